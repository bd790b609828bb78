"""What is wrong with a record: each fault is named, then mended and reported, or the record is refused.

Mended: repeated instants (dropped), stamps that jitter where samples do not (evened), constant channels (set aside),
frozen stretches and spikes (left out, interpolated where short), thrust that cannot be in N (set aside). Refused: too
few samples, time running backwards, a wrong unit, a reversed sign. Signs and units are judged by magnitudes, by the
motion and by what lift and drag can be; where a record says nothing of a channel on which its derivatives rest, that is
among its problems too. Thresholds are assumed; they leave clean records with sensor noise and turbulence untouched.
"""

from __future__ import annotations

import numpy as np

from estimators.regression.equations import EXCITED, SURFACES, movement
from estimators.signals.force_checks import check_lift_slope, without_doubtful_thrust
from estimators.signals.instruments import calibrated
from estimators.signals.kinematic_checks import check_kinematics
from estimators.signals.magnitudes import check_magnitudes
from estimators.signals.mending import FEWEST, mended
from estimators.signals.resample import Grid, common_grid
from estimators.signals.stamps import evenly_spaced
from icing_env.errors import InputError
from icing_env.record import DataProblem, FlightRecord

SHORTEST = 1.0  # s
# Channels on which the derivatives of an axis rest, with a sign and a unit that motion can confirm.
TOLD_BY = {"longitudinal": ("airspeed", "alpha", "q", "ax", "elevator"),
           "lateral": ("airspeed", "beta", "p", "r", "ay", "aileron", "rudder")}  # fmt: skip


def check(record: FlightRecord) -> FlightRecord:
    """The record mended where it can be, with everything found in its `problems`.

    Raises:
        InputError: the record cannot be used; the line says why.
    """
    record = _increasing(record)
    duration = float(record.time[-1] - record.time[0]) if len(record) else 0.0
    if len(record) < FEWEST or duration < SHORTEST:
        raise InputError(
            f"record '{record.meta.name}' has {len(record)} samples over {duration:.3g} s; "
            f"at least {FEWEST} over {SHORTEST:g} s are needed"
        )
    where = f"record '{record.meta.name}'"
    check_magnitudes(record)
    record = repaired(record)
    grid = common_grid(calibrated(record))  # signs and units are judged without the lags that are known
    confirmed = check_kinematics(grid, where)
    if check_lift_slope(where, grid, record) or record.has("ground_speed"):
        confirmed.add("airspeed")
    record = without_doubtful_thrust(record, grid)
    known = set(record.problems)
    return record.with_problems(p for p in (*grid.problems, *_unconfirmed(grid, confirmed)) if p not in known)


def repaired(record: FlightRecord) -> FlightRecord:
    """The record with what can be mended without judging it: channels, then stamps; told in its `problems`."""
    return evenly_spaced(mended(record))


def _increasing(record: FlightRecord) -> FlightRecord:
    """Drop instants that repeat; refuse time that runs backwards."""
    step = np.diff(record.time)
    if np.any(step < 0) or not np.isfinite(record.time).all():
        at = float(record.time[int(np.argmin(step)) + 1]) if np.any(step < 0) else float("nan")
        raise InputError(f"record '{record.meta.name}': time must increase; it runs backwards at {at:g} s")
    repeated = np.concatenate(([False], step == 0))
    if not repeated.any():
        return record
    times = record.time[repeated]
    problem = DataProblem("time", f"{len(times)} instants repeated, dropped", float(times[0]), float(times[-1]), True)
    return record.take(~repeated).with_problems([problem])


def _unconfirmed(grid: Grid, confirmed: set[str]) -> list[DataProblem]:
    """Channels of the axes that were flown whose sign and unit nothing in the record tells."""
    start, end, found = float(grid.time[0]), float(grid.time[-1]), list[DataProblem]()
    doubtful = set[str]()
    for axis, names in TOLD_BY.items():
        if any(n in grid.values and movement(grid.time, grid.values[n], grid.good((n,))) >= EXCITED
               for n in SURFACES[axis]):  # fmt: skip
            doubtful |= {n for n in names if n in grid.values} - confirmed
    for name in sorted(doubtful):
        found.append(DataProblem(name, "sign and unit could not be checked from this record", start, end, False))
    return found
