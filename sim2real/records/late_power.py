"""Engine channels that were recorded late, by what the axial acceleration tells of when thrust acts.

Computed thrust and filtered torque may come a tenth of a second or two after the thrust itself, and side files do not
say it. Where levers move, the axial force then leads what is recorded: beside the aircraft's drag it goes with the
thrust and with the rate at which that changes, lateness times as much. Least squares over all records of a recorder;
errors are those of spans that count as one each (Liang & Zeger's sandwich, Biometrika 73, 1986).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import savgol_filter

from icing_env.atmosphere import density
from icing_env.record import FloatArray
from sim2real.records.channels import MEASURED
from sim2real.records.powers import SIDES, thrust_per_power
from sim2real.records.reconstruct import Reconstruction

SMOOTH = 0.6  # s, over which a parabola through the thrust tells how it changes
SPAN, STEPS = 2.0, 6  # s that count as one; in how many steps lateness is found at most
CLEAR, LEAST, LONGEST = 5.0, 0.05, 0.4  # standard errors, s: earlier only where it is plain and a recorder's lag
NEEDED = ("airspeed", "alpha", "ax")


def prompt(flights: Sequence[Reconstruction]) -> list[Reconstruction]:
    """Records with their powers when the thrust acted."""
    late, error = lateness_of_power(flights)
    if not (late > CLEAR * error and LEAST < late < LONGEST):
        return list(flights)
    return [_earlier(flight, late) for flight in flights]


def lateness_of_power(flights: Sequence[Reconstruction]) -> tuple[float, float]:
    """By how much recorded powers are late, and its standard error, s; the error is infinite where nothing tells."""
    return until_none_is_left(flights, _spans, LONGEST)


def until_none_is_left(flights: Sequence[Reconstruction], spans: Callable[[Reconstruction, float], list[FloatArray]],
                       longest: float) -> tuple[float, float]:  # fmt: skip
    """What `of_spans` finds, found again with so much taken out until nothing is left, and its standard error.

    A rate told from samples is too small, so that once is not enough.

    Args:
        spans: of a record from which so much was taken out.
        longest: that it may be, either way.
    """
    found, error = 0.0, np.inf
    for _ in range(STEPS):
        more, error = of_spans([span for flight in flights for span in spans(flight, found)])
        found = float(np.clip(found + more, -longest, longest))
        if abs(more) < 0.1 * error or not np.isfinite(error):
            break
    return found, error


def of_spans(spans: Sequence[FloatArray]) -> tuple[float, float]:
    """What the last column goes with the second by, over the first, and its standard error; infinite where unseen."""
    if not spans:
        return 0.0, np.inf
    k = spans[0].shape[1] - 1
    bread = np.linalg.pinv(sum(s[:, :k].T @ s[:, :k] for s in spans))
    x = bread @ sum(s[:, :k].T @ s[:, k] for s in spans)
    each = np.array([s[:, :k].T @ (s[:, k] - s[:, :k] @ x) for s in spans]) @ bread
    error = np.sqrt(np.sum(each**2, axis=0))
    if not abs(x[0]) > CLEAR * error[0]:
        return 0.0, np.inf
    return float(x[1] / x[0]), float(error[1] / abs(x[0]))


def _spans(flight: Reconstruction, late: float) -> list[FloatArray]:
    """Thrust, its rate, what drag may go with, and the axial force [samples, columns], in coefficients, less means."""
    if flight.power_from not in ("torque", "thrust") or not all(flight.has(name) for name in NEEDED):
        return []
    length = 2 * round(0.5 * SMOOTH / flight.dt) + 1
    if len(flight.time) < 2 * length:
        return []
    V, alpha, ax = (flight.channel(name) for name in NEEDED)
    p = flight.parameters[0]
    qs = 0.5 * density(float(np.median(flight.altitude))) * V**2 * float(p["wing_area"])
    power = np.interp(flight.time + late, flight.time, sum(flight.controls[f"power_{side}"] for side in SIDES))
    thrust = power * thrust_per_power(p, V, alpha)
    rate = savgol_filter(thrust, length, 2, deriv=1, delta=flight.dt)
    elevator = flight.controls["elevator"]
    columns = np.column_stack([thrust / qs, rate / qs, alpha, alpha**2, elevator, elevator**2,
                               float(p["mass"]) * ax / qs])  # fmt: skip
    edge, each = length // 2, round(SPAN / flight.dt)
    inside = columns[edge:-edge] - columns[edge:-edge].mean(axis=0)
    inside = inside[np.isfinite(flight.measured[edge:-edge, MEASURED.index("ax")])]
    return [inside[i : i + each] for i in range(0, len(inside) - each + 1, each)]


def _earlier(flight: Reconstruction, late: float) -> Reconstruction:
    """The record with powers, and what was recorded of thrust, `late` s earlier; its last values go on."""
    now = flight.time + late
    moved = {name: np.interp(now, flight.time, flight.controls[name]) for name in (f"power_{side}" for side in SIDES)}
    measured = flight.measured.copy()
    for column in (MEASURED.index(f"thrust_{side}") for side in SIDES):
        good = np.isfinite(measured[:, column])
        if good.any():
            measured[good, column] = np.interp(now[good], flight.time[good], measured[good, column])
    return replace(flight, controls=flight.controls | moved, measured=measured, notes=(
        *flight.notes, f"engine channels taken {late:.2f} s earlier: the axial acceleration follows them better so"))
