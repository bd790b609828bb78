"""The H-infinity identifier on a whole flight record: one causal pass, as it would have run in the aircraft."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimators import hinf
from estimators.estimate import Estimate
from estimators.hinf.tuning import default_tuning
from estimators.observer import record as runs
from estimators.observer.layout import SEEN_NAMES
from estimators.observer.learned import History
from estimators.observer.record import STARTS, Method
from icing_env.record import FlightRecord

__all__ = ["METHOD", "STARTS", "History", "histories", "history", "identify"]
METHOD = Method("H-infinity", hinf.init, hinf.step, default_tuning, (*SEEN_NAMES, "b3"))


def history(
    record: FlightRecord,
    tuning: NDArray[np.void] | None = None,
    start: float = 1.0,
    airframe: NDArray[np.void] | None = None,
) -> History:
    """Run the observer over `record` from one start; arguments and errors as for `histories`."""
    return histories(record, (start,), tuning, airframe)[0]


def histories(
    record: FlightRecord,
    starts: Sequence[float] = STARTS,
    tuning: NDArray[np.void] | None = None,
    airframe: NDArray[np.void] | None = None,
) -> list[History]:
    """Run the observer over `record` from each start (seven by default); see `estimators.observer.record.histories`."""
    return runs.histories(METHOD, record, starts, tuning, airframe)


def identify(
    record: FlightRecord,
    tuning: NDArray[np.void] | None = None,
    start: float = 1.0,
    airframe: NDArray[np.void] | None = None,
    accelerations: bool = True,
) -> dict[str, Estimate]:
    """Derivatives by name at the end of the record; see `estimators.observer.record.identify`.

    accelerations: learn from the accelerometers too. Without them lift and side force come from the flow angles' rates
    alone, which a gust enters as if it were a force: the paper found lift derivatives useless without them.
    """
    tuning = default_tuning() if tuning is None else tuning.copy()
    if not accelerations:
        tuning["accelerometer"] = np.inf
    return runs.identify(METHOD, record, tuning, start, airframe)
