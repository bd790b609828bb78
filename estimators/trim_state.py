"""Trim-state analysis: what a steadily flying aircraft needs, against what the clean aircraft would.

In a steady stretch the means of angle of attack, elevator, lift and drag coefficient and thrust coefficient are one
point each of the trim curves. At the same CL the clean aircraft has (linear lift and moment, Klein and Morelli,
chapter 3) alpha and elevator from
    CL = CL_0 + CL_alpha alpha + CL_elevator elevator,    0 = Cm_0 + Cm_alpha alpha + Cm_elevator elevator,
and its drag from CX(alpha). The differences are the paper's Figs. 21 and 22: more alpha, other elevator, more drag and
thrust for the same lift. They need no manoeuvre, and one stretch is enough.

delta_CD_0 comes from the accelerometers: CD less the clean CD at this CL. delta_CT comes without them, from thrust and
what the aircraft does: CT cos(alpha) - (Vdot + g sin(theta - alpha)) m/(qbar S) - CD_clean. That both agree is a check.

The airframe's own curve knows neither the moment of the thrust nor the biases of vane and elevator pick-off (0.3 deg of
elevator on the simulated Twin Otter). Reference records take them out; standard errors are those of scatter only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.combine import combine
from estimators.estimate import Estimate
from estimators.observer.layout import clean_values
from estimators.observer.measurements import airframe_of_record
from estimators.observer.rows import GRAVITY
from estimators.regression.least_squares import least_squares
from estimators.signals.coefficients import Airframe, body_forces, dynamic_pressure, lift_drag, thrust
from estimators.signals.data_checks import check
from estimators.signals.resample import Grid, common_grid
from icing_env.errors import InputError
from icing_env.record import FlightRecord, FloatArray

METHOD = "trim state"
NEEDED = ("airspeed", "alpha", "q", "theta", "ax", "az", "elevator")
SECONDS = 4.0  # length of a stretch: longer than a short period, shorter than a phugoid (assumed)
QUIET_RATE = 0.03  # rad/s, largest r.m.s. of each body rate
QUIET_FORCE = 0.6  # m/s2, largest standard deviation of the normal acceleration, 0.06 g
QUIET_SPEED = 0.3  # m/s2, largest slope of the airspeed
QUIET_SURFACE = 0.006  # rad, largest standard deviation of the elevator
LEVEL = 0.15  # rad, largest bank (all assumed: calm and light turbulence pass, a doublet does not)
SLOPE_RANGE = 0.15  # lift coefficient: spread of reference points from which the slope of a curve is fitted (assumed)
CURVES = ("alpha", "elevator", "CD")
DELTAS = (
    ("delta_alpha", "alpha", "alpha"),
    ("delta_elevator", "elevator", "elevator"),
    ("delta_CD_0", "CD", "CD"),
    ("delta_CT", "CT_level", "CD"),
)  # what is told, the mean it is of, the clean curve it is held against
WITHOUT_THRUST = "thrust was not recorded and cannot be told from drag"


@dataclass(frozen=True)
class TrimPoint:
    """Means over one steady stretch [start, end] s, and their differences to the clean aircraft at the same CL.

    `values`: alpha, elevator (rad), CL, CD, CT; `deltas`: delta_alpha, delta_elevator (rad), delta_CD_0, delta_CT.
    """

    start: float
    end: float
    airspeed: float
    values: Mapping[str, Estimate]
    deltas: Mapping[str, Estimate]


@dataclass(frozen=True)
class CleanCurve:
    """alpha, elevator and CD of the clean aircraft as functions of CL, with standard errors.

    The airframe's curve, plus for each of CURVES a correction c0 + c1 (CL - centre) fitted on reference records.
    """

    airframe: NDArray[np.void]
    centre: float = 0.0
    correction: Mapping[str, tuple[float, float]] | None = None
    covariance: Mapping[str, FloatArray] | None = None  # of (c0, c1), (2, 2)

    def at(self, lift: float, flap: float) -> dict[str, tuple[float, float]]:
        """Value and standard error of each of CURVES at a lift coefficient and flap angle (rad)."""
        clean = clean_trim(self.airframe, lift, flap)
        if self.correction is None or self.covariance is None:
            return {name: (clean[name], 0.0) for name in CURVES}
        at = np.array([1.0, lift - self.centre])
        told = {name: (clean[name], 0.0) for name in CURVES}
        for name, moved in self.correction.items():
            told[name] = clean[name] + float(at @ moved), float(np.sqrt(at @ self.covariance[name] @ at))
        return told


def clean_trim(airframe: NDArray[np.void], lift: float, flap: float = 0.0) -> dict[str, float]:
    """alpha, elevator (rad) and CD at which the clean aircraft of one AIRFRAME row flies steadily at `lift`."""
    af = {name: float(airframe[name][0]) for name in airframe.dtype.names or ()}
    _, cl_0, cl_alpha, _, cl_elevator = (float(x) for x in clean_values(airframe)[0, :5])
    added = af["CL_flap"] * flap
    alpha, elevator = np.linalg.solve(
        [[cl_alpha, cl_elevator], [af["Cm_alpha"], af["Cm_elevator"]]],
        [lift - cl_0 - added, -af["Cm_0"] - af["Cm_flap"] * flap],
    )
    cx = af["CX_0"] + alpha * (af["CX_alpha"] + alpha * af["CX_alpha2"])
    plain = lift - added
    drag = -cx * np.cos(alpha) + (plain - cx * np.sin(alpha)) * np.tan(alpha)
    drag += af["CD_flap"] * flap + af["induced_drag"] * added * (added + 2.0 * plain)
    return {"alpha": float(alpha), "elevator": float(elevator), "CD": float(drag)}


def steady_stretches(grid: Grid, seconds: float = SECONDS) -> list[slice]:
    """Rows of each stretch of `seconds` in which nothing happens: rates, normal force, airspeed, elevator, bank."""
    values, n = grid.values, round(seconds / grid.dt)
    good = grid.good((*NEEDED, "p", "r", "phi", "thrust_left", "thrust_right"))
    found, first = [], 0
    while first + n <= len(grid.time):
        rows = slice(first, first + n)
        if good[rows].all() and _is_quiet({name: x[rows] for name, x in values.items()}, grid.time[rows]):
            found.append(rows)
            first += n
        else:
            first += max(1, n // 4)
    return found


def _is_quiet(part: Mapping[str, FloatArray], time: FloatArray) -> bool:
    rates = [float(np.sqrt(np.mean(part[name] ** 2))) for name in ("p", "q", "r") if name in part]
    acceleration = abs(float(np.polyfit(time - time[0], part["airspeed"], 1)[0]))
    level = "phi" not in part or float(np.max(np.abs(part["phi"]))) <= LEVEL
    return (
        max(rates) <= QUIET_RATE
        and float(np.std(part["az"])) <= QUIET_FORCE
        and acceleration <= QUIET_SPEED
        and float(np.std(part["elevator"])) <= QUIET_SURFACE
        and level
    )


def analyse(
    record: FlightRecord,
    airframe: NDArray[np.void] | None = None,
    reference: Sequence[FlightRecord] = (),
    seconds: float = SECONDS,
) -> list[TrimPoint]:
    """Trim points of a record, one for each steady stretch (none if it has none).

    Args:
        airframe: `AIRFRAME` array of one row; the published one if None. Mass, inertia and geometry that the record
            states take the place of its own.
        reference: records of the same aircraft without what is looked for; the clean curves are moved onto them.
        seconds: length of a stretch.

    Raises:
        InputError: a channel of NEEDED is absent; the record is refused by `data_checks.check`; no reference record
            has a steady stretch.
    """
    curve = CleanCurve(airframe_of_record(record, airframe))
    if reference:
        curves = [(other, CleanCurve(airframe_of_record(other, airframe))) for other in reference]
        points = [point for other, its_own in curves for point in _points(other, its_own, seconds)]
        if not points:
            raise InputError(f"trim state: no reference record has a steady stretch of {seconds:g} s")
        curve = _fitted(curve, points)
    return _points(record, curve, seconds)


def combined(points: Sequence[TrimPoint]) -> dict[str, Estimate]:
    """The deltas of several points of one state of the aircraft as one (`estimators.combine`)."""
    return combine([dict(point.deltas) for point in points])


def _points(record: FlightRecord, curve: CleanCurve, seconds: float) -> list[TrimPoint]:
    lacks = [name for name in NEEDED if name not in record.channels]
    if lacks:
        raise InputError(f"record '{record.meta.name}': trim state needs {', '.join(lacks)}")
    grid = common_grid(check(record))
    return [_point(grid, rows, curve) for rows in steady_stretches(grid, seconds)]


def _point(grid: Grid, rows: slice, curve: CleanCurve) -> TrimPoint:
    part = {name: x[rows] for name, x in grid.values.items()}
    mean = _means(part, grid.time[rows], curve.airframe)
    flap = float(np.mean(part["flap"])) if "flap" in part else 0.0
    shown: dict[str, Estimate] = {
        name: Estimate(*mean[name], "rad" if name in ("alpha", "elevator") else "1", METHOD)
        for name in ("alpha", "elevator", "CL", "CD", "CT")
        if name in mean
    }
    start, end = float(grid.time[rows][0]), float(grid.time[rows][-1])
    return TrimPoint(start, end, float(np.mean(part["airspeed"])), shown, _deltas(mean, curve, flap))


def _means(
    part: Mapping[str, FloatArray], time: FloatArray, airframe: NDArray[np.void]
) -> dict[str, tuple[float, float]]:
    """Mean and standard error of alpha, elevator, CL, and with thrust of CD, CT and CT_level.

    CT_level: thrust along the flight path less what climbs and accelerates the aircraft, without accelerometers.
    """
    qbar, alpha = dynamic_pressure(part), part["alpha"]
    forces = body_forces(part, qbar, Airframe.from_parameters(airframe))
    lift, drag = lift_drag(forces["CX"], forces["CZ"], alpha)
    mean = {"alpha": _mean(alpha), "elevator": _mean(part["elevator"]), "CL": _mean(lift)}
    push = thrust(part)
    if push is not None:
        force = qbar * airframe["wing_area"][0]
        mass = part.get("mass", np.full(len(alpha), airframe["mass"][0]))
        rate, rate_error = _slope(time, part["airspeed"])
        climb = (rate + GRAVITY * np.sin(part["theta"] - alpha)) * mass / force
        mean["CD"], mean["CT"] = _mean(drag), _mean(push / force)
        level, error = _mean(push / force * np.cos(alpha) - climb)
        mean["CT_level"] = level, float(np.hypot(error, rate_error * np.mean(mass / force)))
    return mean


def _deltas(mean: Mapping[str, tuple[float, float]], curve: CleanCurve, flap: float) -> dict[str, Estimate]:
    """Differences to the clean curve at the CL of this point; its error moves along the curve into theirs."""
    lift, lift_error = mean["CL"]
    clean, above, below = (curve.at(lift + step, flap) for step in (0.0, 0.01, -0.01))
    deltas = {}
    for name, source, against in DELTAS:
        if source not in mean:
            deltas[name] = Estimate(0.0, np.inf, "1", METHOD, None, False, WITHOUT_THRUST)
            continue
        slope = (above[against][0] - below[against][0]) / 0.02
        error = float(np.sqrt(mean[source][1] ** 2 + (slope * lift_error) ** 2 + clean[against][1] ** 2))
        unit = "rad" if source in ("alpha", "elevator") else "1"
        deltas[name] = Estimate(mean[source][0] - clean[against][0], error, unit, METHOD)
    return deltas


def _mean(signal: FloatArray) -> tuple[float, float]:
    """Mean of a stretch and its standard error, corrected for coloured departures from it.

    Lags up to a fifth of the stretch (Klein and Morelli, section 5.2): over all lags the residuals of a mean sum to 0.
    """
    return _first(np.ones((len(signal), 1)), signal)


def _slope(time: FloatArray, signal: FloatArray) -> tuple[float, float]:
    """Slope of a stretch and its standard error, as `_mean`."""
    return _first(np.column_stack([time - np.mean(time), np.ones(len(time))]), signal)


def _first(matrix: FloatArray, signal: FloatArray) -> tuple[float, float]:
    """First coefficient of a fit and its standard error: the larger of the coloured one and the white one."""
    fit = least_squares(matrix, signal, lags=len(signal) // 5)
    return float(fit.theta[0]), float(np.sqrt(max(fit.covariance[0, 0], fit.covariance_white[0, 0])))


def _fitted(curve: CleanCurve, points: Sequence[TrimPoint]) -> CleanCurve:
    """The airframe's curve moved onto reference points: an offset, and a slope where their CL spread far enough."""
    lift = np.array([p.values["CL"].estimate for p in points])
    centre, known = float(np.mean(lift)), all(p.deltas["delta_CD_0"].identifiable for p in points)
    tilted = len(points) >= 3 and np.ptp(lift) >= SLOPE_RANGE
    matrix = np.column_stack([np.ones(len(lift)), lift - centre if tilted else np.zeros(len(lift))])
    correction, covariance = {}, {}
    for name in CURVES if known else CURVES[:2]:
        found = [p.deltas["delta_CD_0" if name == "CD" else f"delta_{name}"] for p in points]
        z, own = np.array([e.estimate for e in found]), np.array([e.std_error for e in found])
        used = matrix if tilted else matrix[:, :1]
        weighed = used / own[:, None]
        inverse = np.linalg.inv(weighed.T @ weighed)
        theta = inverse @ weighed.T @ (z / own)
        spread = float(np.sum(((z - used @ theta) / own) ** 2)) / max(len(z) - used.shape[1], 1)
        full = np.zeros((2, 2))
        full[: len(theta), : len(theta)] = inverse * max(1.0, spread)
        correction[name] = (float(theta[0]), float(theta[1]) if tilted else 0.0)
        covariance[name] = full
    return CleanCurve(curve.airframe, centre, correction, covariance)
