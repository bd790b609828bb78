"""A recursive identifier on a whole flight record: one causal pass, as it would have run in the aircraft."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from estimators.estimate import Estimate
from estimators.observer.layout import CHANNELS, COUNT, FIRST, PARAMETER_NAMES, SEEN_NAMES
from estimators.observer.learned import History, learned, noise_of
from estimators.observer.measurements import absent, airframe_of_record, measurements
from estimators.regression.equations import EXCITED, LARGEST_RATIO, LEFT_OUT, SURFACES, movement
from estimators.signals.coefficients import thrust
from estimators.signals.data_checks import check
from estimators.signals.gust_level import turbulence_warnings
from estimators.signals.resample import Grid, common_grid
from icing_env.record import FlightRecord
from icing_env.types import ESTIMATE, unit_of

__all__ = ["FAR", "STARTS", "History", "Method", "histories", "identify"]
AXIS = dict(zip(CHANNELS, ("longitudinal",) * 3 + ("lateral",) * 3, strict=True))
EXTRAPOLATED = 0.2  # lift coefficient: nearest a record must come to zero lift for CD_0 to be its own (assumed)
STARTS = (0.4, 0.6, 0.8, 1.0, 1.2, 1.4, 1.6)  # of the clean aircraft: seven, as in the paper's Figs. 23-26 (assumed)
FAR = (STARTS[0], STARTS[-1])
# As LEFT_OUT, of recursions with errors by least squares; more of what moves with alpha, whose lag they see as slower.
SLOWLY = LEFT_OUT | {"CL_elevator": 0.1, "CY_beta": 0.011, "CY_r": 0.025, "CY_rudder": 0.025, "Cl_rudder": 0.02}
CONVERGED = 0.1  # largest share of the spread of the starts that may be left at the end (assumed; "a small fraction")


@dataclass(frozen=True)
class Method:
    """A recursive identifier, by its two functions.

    `init(airframe, tuning, n, start) -> memory` and `step(memory, estimate, measurement, airframe, tuning, dt)`, in
    place, n aircraft at once. `kept`: fields of its memory that a `History` keeps. `own_errors`: take standard errors
    from the method's own `deviation`; else they are those of least squares on the rows it learned from. `left_out`:
    error beside that, as a share of a derivative.
    """

    name: str
    init: Callable[..., NDArray[np.void]]
    step: Callable[..., None]
    default_tuning: Callable[[], NDArray[np.void]]
    kept: tuple[str, ...] = SEEN_NAMES
    own_errors: bool = False
    left_out: Mapping[str, float] = field(default_factory=lambda: SLOWLY)


def histories(
    method: Method,
    record: FlightRecord,
    starts: Sequence[float] = STARTS,
    tuning: NDArray[np.void] | None = None,
    airframe: NDArray[np.void] | None = None,
) -> list[History]:
    """Run one observer for each start over `record`.

    Args:
        method: which identifier.
        starts: factors on the clean model at which the estimates start.
        tuning: of one row; the method's default if None.
        airframe: `AIRFRAME` array of one row; the published one if None. Mass, inertia and geometry that the record
            states take the place of its own.

    Raises:
        InputError: the record is refused by `data_checks.check` or lacks the channels of both axes.
    """
    record = check(record)
    return _run(method, common_grid(record), record, starts, tuning, airframe)


def _run(
    method: Method, grid: Grid, record: FlightRecord, starts: Sequence[float], tuning: NDArray[np.void] | None,
    airframe: NDArray[np.void] | None,
) -> list[History]:  # fmt: skip
    measurement, aircraft = measurements(grid, record), airframe_of_record(record, airframe)
    tuning = method.default_tuning() if tuning is None else tuning
    mass, n, steps = grid.values.get("mass"), len(starts), len(grid.time)
    observer = np.concatenate([method.init(aircraft, tuning, 1, start) for start in starts])
    seen, now = observer[list(method.kept)], np.zeros(n, ESTIMATE)
    estimate, memory = np.zeros((steps, n), ESTIMATE), np.zeros((steps, n), _packed(seen.dtype))
    for k in range(steps):
        if mass is not None:
            aircraft["mass"] = mass[k]
        method.step(observer, now, np.repeat(measurement[k : k + 1], n), aircraft, tuning, grid.dt)
        estimate[k], memory[k] = now, seen
    return [History(grid.time, estimate[:, i], memory[:, i], tuning) for i in range(n)]


def _packed(dtype: np.dtype) -> np.dtype:
    """The same fields without the holes of those left out."""
    return np.dtype([(name, *_shape(dtype[name])) for name in dtype.names or ()])


def _shape(field: np.dtype) -> tuple[np.dtype, tuple[int, ...]]:
    return field.base, field.shape


def identify(
    method: Method,
    record: FlightRecord,
    tuning: NDArray[np.void] | None = None,
    start: float = 1.0,
    airframe: NDArray[np.void] | None = None,
) -> dict[str, Estimate]:
    """Derivatives by name at the end of the record; arguments and errors as for `histories`.

    The standard error is that of least squares on the rows that the observer learned from (behind its filter; the
    accelerometer's where there is one), corrected for coloured residuals: the scatter to be expected from what the
    record does not explain. It is not what the recursion holds for it, which rests on the tuning alone
    (`History.parameter`). Of methods without errors of their own what noise in the regressors took is put back
    (`learned`). A record with gusts carries a warning. A parameter has converged if starts far apart end
    close together, and is refused if not.
    """
    record = check(record)
    grid = common_grid(record)
    run, *far = (_to_the_last_good(h) for h in _run(method, grid, record, (start, *FAR), tuning, airframe))
    aircraft, noise = airframe_of_record(record, airframe), noise_of(grid)
    lacks, warnings = absent(grid), turbulence_warnings(grid, method.name)
    moved = {
        name: movement(grid.time, grid.values[name], grid.good((name,)))
        for pair in SURFACES.values() for name in pair if name in grid.values
    }  # fmt: skip
    result: dict[str, Estimate] = {}
    for c, channel in enumerate(CHANNELS):
        if not lacks[AXIS[channel]] and (channel != "drag" or "ax" in grid.values):
            fit, put_back = learned(run, c, aircraft, noise)
            for i in range(FIRST[c], FIRST[c] + COUNT[c]):
                error = float(run.memory["deviation"][-1, i] if method.own_errors else fit.std_error[i - FIRST[c]])
                value, name = float(run.memory["theta"][-1, i]), PARAMETER_NAMES[i]
                if not method.own_errors:
                    value += put_back[i - FIRST[c]]
                error = float(np.hypot(error, method.left_out.get(name, 0.0) * value))
                why = _why_not(name, channel, moved) or _why_not_converged(run, far, i, len(grid.time))
                if not why and not name.endswith("_0") and not error <= LARGEST_RATIO * abs(value):
                    why = f"its standard error {error:.2g} exceeds a third of the estimate {value:.2g}"
                warning = warnings.get(AXIS[channel], "")
                result[name] = Estimate(value, error, unit_of(name), method.name, fit.r2, not why, why, warning)
    if "CD_0" in result:
        why = _why_not_drag(grid, run)
        result["CD_0"] = replace(result["CD_0"], identifiable=not why, why=why)
    return result


def _to_the_last_good(run: History) -> History:
    """Without what follows the last sample at which the observer was well: a failed one may hold anything."""
    end = int(np.flatnonzero(run.estimate["health"])[-1]) + 1 if run.estimate["health"].any() else 1
    return History(run.time[:end], run.estimate[:end], run.memory[:end], run.tuning)


def _why_not_converged(run: History, far: Sequence[History], i: int, steps: int) -> str:
    """Reason from the observer: it failed, or the starting value still weighs."""
    if min(len(h.time) for h in (run, *far)) < steps:
        return "the observer had failed, or could not read the last sample"
    low, high = (float(h.memory["theta"][-1, i]) for h in far)
    first, last = (float(h.memory["theta"][0, i]) for h in far)
    if abs(high - low) > CONVERGED * abs(last - first) and not np.isclose(first, last):
        return (f"no convergence: from {FAR[0]:g} and {FAR[1]:g} of the clean value it ends at {low:.3g} and "
                f"{high:.3g}; what the record says of it is too weak to outweigh the start")  # fmt: skip
    deviation, prior = run.memory["deviation"][-1, i], run.memory["deviation"][0, i]
    return "the record says too little about it: its starting value still weighs" if deviation > 0.5 * prior else ""


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
    lift = run.memory["theta"][-1, 1] + run.memory["theta"][-1, 2] * grid.values["alpha"]
    nearest = float(np.nanmin(np.abs(lift)))
    if nearest > EXTRAPOLATED:
        return f"lift coefficients stay above {nearest:.2f}: zero lift is an extrapolation along the clean polar"
    return ""
