"""Whether recorded thrust was measured, as reference flights tell.

Thrust that was computed of torque is the same function of torque, speed of rotation and airspeed on every flight of an
aircraft, whatever its propellers do. Where records have another one than references, it is no computed thrust.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimators.signals.data_checks import repaired
from estimators.signals.resample import common_grid
from icing_env import aircraft
from icing_env.record import FlightRecord, FloatArray
from sim2real.records.powers import SIDES, thrust_per_power, turning

BLOCK = 2.0  # s, of which means are compared
LEAST = 0.2  # of a record's largest power, below which a share of it says little (assumed)
DIFFERS, ERRORS = 0.03, 4.0  # by how much charts have to differ, as a share and in standard errors (assumed)


def as_measured(records: Sequence[FlightRecord]) -> list[FlightRecord]:
    """Records that do not declare where thrust comes from declare it measured."""
    found = {"thrust": {"source": "measured", "found": True}}
    return [replace(r, meta=replace(r.meta, sensors={**found, **r.meta.sensors})) for r in records]


def differs(records: Sequence[FlightRecord], others: Sequence[FlightRecord]) -> bool:
    """Whether one engine at least makes another thrust of the same torque and airspeed in `records`."""
    own, theirs = ([repaired(record) for record in some] for some in (records, others))
    return any(_apart(_charts(own, side), _charts(theirs, side)) for side in SIDES)


def _charts(records: Sequence[FlightRecord], side: str) -> list[FloatArray]:
    """Those of the records that have one."""
    return [chart for record in records if len(chart := _chart(record, side))]


def _chart(record: FlightRecord, side: str) -> FloatArray:
    """Log of thrust over what the published chart makes of the torque, airspeed and log power, in blocks [blocks, 3].

    None where engines were not recorded.
    """
    needed = (f"thrust_{side}", f"torque_{side}", "airspeed", "alpha")
    if any(name not in record.channels or not np.isfinite(record[name]).any() for name in needed):
        return np.zeros((0, 3))
    grid = common_grid(record)
    p = aircraft.load()[0]
    power = grid.values[f"torque_{side}"] * turning(p, grid.values, side, len(grid.time))
    thrust, made = grid.values[f"thrust_{side}"], power * thrust_per_power(p, grid.values["airspeed"],
                                                                          grid.values["alpha"])
    length = max(1, round(BLOCK / grid.dt))
    t, m, v, w = (np.mean(x[: len(x) // length * length].reshape(-1, length), axis=1)
                  for x in (thrust, made, grid.values["airspeed"], power))
    good = (w > LEAST * np.max(power)) & (t > 0.0) & (m > 0.0)
    return np.column_stack([np.log(t[good] / m[good]), v[good], np.log(w[good])])


def _apart(own: Sequence[FloatArray], theirs: Sequence[FloatArray]) -> bool:
    """Whether two lots of records have different charts, each linear in airspeed and log power, alike but for a factor.

    The factor's error is that of records which count as one each (Liang & Zeger's sandwich, Biometrika 73, 1986).
    """
    if not own or not theirs:
        return False
    every = [*own, *theirs]
    y, x = np.concatenate([c[:, 0] for c in every]), np.concatenate([c[:, 1:] for c in every])
    lot = np.repeat([1.0] * len(own) + [0.0] * len(theirs), [len(c) for c in every])
    X = np.column_stack([lot, np.ones(len(y)), (x - x.mean(0)) / np.maximum(x.std(0), 1e-9)])
    bread = np.linalg.pinv(X.T @ X)
    left = y - X @ (factor := bread @ X.T @ y)
    ends = np.cumsum([len(c) for c in every])[:-1]
    each = np.array([a.T @ b for a, b in zip(np.split(X, ends), np.split(left, ends), strict=True)]) @ bread
    error = math.sqrt(float(np.sum(each[:, 0] ** 2)) * len(every) / max(len(every) - 2, 1))
    return bool(abs(factor[0]) > max(DIFFERS, ERRORS * error))
