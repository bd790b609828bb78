"""The H-infinity identifier on a whole flight record: one causal pass, as it would have run in the aircraft."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators import hinf
from estimators.estimate import Estimate
from estimators.hinf.measurements import absent, airframe_of_record, measurements
from estimators.hinf.memory import ACCELEROMETER, COUNT, DIAGONAL, FIRST
from estimators.hinf.rows import PARAMETER_NAMES
from estimators.hinf.tuning import CHANNELS, default_tuning
from estimators.regression.equations import EXCITED, LARGEST_RATIO, SURFACES, movement
from estimators.regression.least_squares import Fit, least_squares
from estimators.signals.coefficients import thrust
from estimators.signals.data_checks import check
from estimators.signals.resample import Grid, common_grid
from icing_env.errors import InputError
from icing_env.record import FlightRecord, FloatArray
from icing_env.types import ESTIMATE, unit_of

METHOD = "H-infinity"
AXIS = dict(zip(CHANNELS, ("longitudinal",) * 3 + ("lateral",) * 3, strict=True))
EXTRAPOLATED = 0.2  # lift coefficient: nearest a record must come to zero lift for CD_0 to be its own (assumed)


@dataclass(frozen=True)
class History:
    """What the observer believed at each instant: `time` (N,) s, `estimate` ESTIMATE (N,), `memory` OBSERVER (N,)."""

    time: FloatArray
    estimate: NDArray[np.void]
    memory: NDArray[np.void]
    tuning: NDArray[np.void]

    def parameter(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Estimate of one parameter over time and its standard error (square root of B3's diagonal), each (N,)."""
        if name not in PARAMETER_NAMES:
            raise InputError(f"the H-infinity identifier has no '{name}'; valid are: {', '.join(PARAMETER_NAMES)}")
        index = PARAMETER_NAMES.index(name)
        return self.memory["theta"][:, index], np.sqrt(self.memory["b3"][:, DIAGONAL[index]])


def history(
    record: FlightRecord,
    tuning: NDArray[np.void] | None = None,
    start: float = 1.0,
    airframe: NDArray[np.void] | None = None,
) -> History:
    """Run the observer over `record`.

    Args:
        tuning: `TUNING` array of one row; the default tuning if None.
        start: factor on the clean model at which the estimates start.
        airframe: `AIRFRAME` array of one row; the published one if None. Mass, inertia and geometry that the record
            states take the place of its own.

    Raises:
        InputError: the record is refused by `data_checks.check` or lacks the channels of both axes.
    """
    record = check(record)
    return _run(common_grid(record), record, default_tuning() if tuning is None else tuning, start, airframe)


def _run(
    grid: Grid, record: FlightRecord, tuning: NDArray[np.void], start: float, airframe: NDArray[np.void] | None
) -> History:
    measurement, aircraft = measurements(grid, record), airframe_of_record(record, airframe)
    mass = grid.values.get("mass")
    observer = hinf.init(aircraft, tuning, 1, start)
    now = np.zeros(1, ESTIMATE)
    estimate, memory = np.zeros(len(grid.time), ESTIMATE), np.zeros(len(grid.time), hinf.OBSERVER)
    for k in range(len(grid.time)):
        if mass is not None:
            aircraft["mass"] = mass[k]
        hinf.step(observer, now, measurement[k : k + 1], aircraft, tuning, grid.dt)
        estimate[k], memory[k] = now[0], observer[0]
    return History(grid.time, estimate, memory, tuning)


def identify(
    record: FlightRecord,
    tuning: NDArray[np.void] | None = None,
    start: float = 1.0,
    airframe: NDArray[np.void] | None = None,
) -> dict[str, Estimate]:
    """Derivatives by name at the end of the record; arguments and errors as for `history`.

    The standard error is that of least squares on the rows that the observer learned from (behind its filter; the
    accelerometer's where there is one), corrected for coloured residuals: the scatter to be expected from what the
    record does not explain. It is not B3's, which rests on the tuning alone (`History.parameter`).
    """
    record = check(record)
    grid = common_grid(record)
    run = _run(grid, record, default_tuning() if tuning is None else tuning, start, airframe)
    lacks = absent(grid)
    moved = {
        name: movement(grid.time, grid.values[name], grid.good((name,)))
        for pair in SURFACES.values() for name in pair if name in grid.values
    }  # fmt: skip
    result: dict[str, Estimate] = {}
    for c, channel in enumerate(CHANNELS):
        if not lacks[AXIS[channel]] and (channel != "drag" or "ax" in grid.values):
            fit = _fit(run, c)
            for i in range(COUNT[c]):
                result[PARAMETER_NAMES[FIRST[c] + i]] = _estimate(run, c, i, fit, moved)
    if "CD_0" in result:
        why = _why_not_drag(grid, run)
        drag = result["CD_0"]
        result["CD_0"] = Estimate(drag.estimate, drag.std_error, "1", METHOD, drag.r2, not why, why)
    return result


def _fit(run: History, c: int) -> Fit:
    """Least squares on the rows of one channel, for residuals and their colour."""
    part, memory = slice(FIRST[c], FIRST[c] + COUNT[c]), run.memory
    good = (run.estimate["health"] == 1.0) & (memory["seated"] == 1.0)
    a, rows = ACCELEROMETER[c], memory["filtered"][:, part]
    target = memory["felt_filtered"][:, a] if a >= 0 else memory["y"][:, c] - memory["zeta"][:, c]
    return least_squares(np.where(good[:, None], rows, 0.0), np.where(good, target, 0.0))


def _estimate(run: History, c: int, i: int, fit: Fit, moved: dict[str, float]) -> Estimate:
    """One parameter of a channel, and whether the record shows it."""
    name = PARAMETER_NAMES[FIRST[c] + i]
    values, deviations = run.parameter(name)
    value, error = float(values[-1]), float(fit.std_error[i])
    scale = float(run.memory["scale"][-1, FIRST[c] + i])
    why = _why_not(name, CHANNELS[c], moved)
    if not run.estimate["health"][-1] > 0.0:
        why = "the observer had failed, or could not read the last sample"
    elif not why and deviations[-1] > 0.5 * scale / np.sqrt(run.tuning["q0"][0, c]):
        why = "the record says too little about it: its starting value still weighs"
    elif not why and not name.endswith("_0") and not error <= LARGEST_RATIO * abs(value):
        why = f"its standard error {error:.2g} exceeds a third of the estimate {value:.2g}"
    return Estimate(value, error, unit_of(name), METHOD, fit.r2, not why, why)


def _why_not(name: str, channel: str, moved: dict[str, float]) -> str:
    """Reason from the controls: the axis was not flown, or this surface did not move."""
    if channel == "drag":
        return ""
    surfaces = SURFACES[AXIS[channel]]
    surface = name.split("_")[-1]
    told = [s for s in ((surface,) if surface in surfaces else surfaces) if moved.get(s, 0.0) < EXCITED]
    if len(told) < (1 if surface in surfaces else len(surfaces)):
        return ""
    sizes = ", ".join(f"{s} moved {np.degrees(moved.get(s, 0.0)):.2f} deg rms" for s in told)
    return f"{sizes}; at least {np.degrees(EXCITED):.2f} is needed"


def _why_not_drag(grid: Grid, run: History) -> str:
    """CD_0 needs thrust, and flight near zero lift: further away it is an extrapolation along the clean polar."""
    if thrust(grid.values) is None:
        return "thrust was not recorded and cannot be told from drag"
    lift = run.memory["theta"][-1, 1] + run.memory["theta"][-1, 2] * np.asarray(grid.values["alpha"])
    nearest = float(np.nanmin(np.abs(lift)))
    if nearest > EXTRAPOLATED:
        return f"lift coefficients stay above {nearest:.2f}: zero lift is an extrapolation along the clean polar"
    return ""
