"""Equation error: aerodynamic derivatives from a flight record by least squares.

Two modes. `matched` differentiates the raw rates and passes every regressor through the smoother that belongs to the
slope filter. `textbook` takes the angular accelerations, coefficients and hat rates that the record's owner stored,
which is where the printed values of Klein & Morelli's examples come from. Equations: estimators.regression.equations.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimators.estimate import Estimate
from estimators.regression.equations import EQUATIONS, NEEDED, SURFACES, Equation, fit_equation, movement
from estimators.signals.coefficients import (
    Airframe,
    airframe_of,
    body_forces,
    dynamic_pressure,
    hat_rates,
    lift_drag,
    moment_coefficients,
    products,
    thrust,
)
from estimators.signals.data_checks import check
from estimators.signals.differentiate import half_width, slope, smooth
from estimators.signals.resample import Grid, common_grid
from icing_env.errors import InputError
from icing_env.record import FlightRecord, FloatArray

MODES = ("matched", "textbook")


def identify(record: FlightRecord, mode: str = "matched", default: Airframe | None = None) -> dict[str, Estimate]:
    """Derivatives by name (CZ_alpha, CL_alpha, CD_0, Cm_q, CY_beta, Cl_p, Cn_rudder ..., per rad; biases as *_0).

    An axis whose channels are absent is left out; a derivative that the record does not excite is carried with
    `identifiable` false and the reason. Forces and moments are in the owner's or the record's own signs and units.

    Args:
        mode: "matched" or "textbook".
        default: the airframe for what the record does not state.

    Raises:
        InputError: the record is refused by `data_checks.check`, or lacks the channels of both axes or of the mode.
    """
    if mode not in MODES:
        raise InputError(f"identify: mode '{mode}' is unknown; valid are: {', '.join(MODES)}")
    record = check(record)
    grid = common_grid(record)
    axes = {axis: [n for n in needed if n not in grid.values] for axis, needed in NEEDED.items()}
    if all(axes.values()):
        lacks = "; ".join(f"{axis} needs {', '.join(names)}" for axis, names in axes.items())
        raise InputError(f"record '{record.meta.name}' lacks columns: {lacks}")
    airframe = airframe_of(record, default)
    data, half = _data(grid, airframe) if mode == "matched" else _stored(grid, record, airframe)
    surfaces = [name for pair in SURFACES.values() for name in pair if name in grid.values]
    moved = {name: movement(grid.time, grid.values[name], grid.good((name,))) for name in surfaces}
    result: dict[str, Estimate] = {}
    for equation in EQUATIONS:
        if not axes[equation.axis] and equation.target in data:
            good = _usable(grid, equation, half) & np.isfinite(data[equation.target])
            found = fit_equation(equation, data, good, moved, f"equation error, {mode}")
            result.update(_without_thrust(found, equation, thrust(grid.values) is not None))
    return result


def _usable(grid: Grid, equation: Equation, half: int) -> NDArray[np.bool_]:
    """Rows with every channel of the equation known, and none unknown within the reach of the filter."""
    bad = ~grid.good((*NEEDED[equation.axis], "ax", "thrust_left", "thrust_right"))
    if half and bad.any():
        bad = np.convolve(bad, np.ones(2 * half + 1), mode="same") > 0.5
    return ~bad


def _without_thrust(found: dict[str, Estimate], equation: Equation, known: bool) -> dict[str, Estimate]:
    """Refuse drag and axial force where thrust was not recorded: they then contain it."""
    if known or equation.target not in ("CD", "CX"):
        return found
    why = "thrust was not recorded and cannot be told from drag"
    return {n: Estimate(e.estimate, e.std_error, e.unit, e.method, e.r2, False, why) for n, e in found.items()}


def _present(values: dict[str, FloatArray], names: tuple[str, ...]) -> dict[str, FloatArray]:
    """Those of the named channels that are there."""
    return {name: values[name] for name in names if name in values}


def _zeros_for(values: dict[str, FloatArray], names: tuple[str, ...], n: int) -> tuple[FloatArray, ...]:
    """Channels by name; zero where absent, for small corrections only (inertial coupling, the turn of lift)."""
    return tuple(values.get(name, np.zeros(n)) for name in names)


def _data(grid: Grid, airframe: Airframe) -> tuple[dict[str, FloatArray], int]:
    """Coefficients and regressors from raw channels, all through matched filters; and the filter's half width."""
    values, n, half = dict(grid.values), len(grid.time), half_width(grid.dt)
    p, q, r = _zeros_for(values, ("p", "q", "r"), n)
    qbar = dynamic_pressure(values)
    raw = _with_lift(body_forces(values, qbar, airframe), values, n)
    raw.update(_regressors(values, hat_rates(values, airframe), raw))
    data = {name: smooth(x, half) for name, x in raw.items()}
    product = {name: smooth(x, half) for name, x in products(p, q, r).items()}
    rates_dot = (slope(p, grid.dt, half), slope(q, grid.dt, half), slope(r, grid.dt, half))
    return {**data, **moment_coefficients(rates_dot, product, smooth(qbar, half), airframe)}, half


def _stored(grid: Grid, record: FlightRecord, airframe: Airframe) -> tuple[dict[str, FloatArray], int]:
    """Coefficients and regressors as the record's owner stored them, unfiltered."""
    values, n = dict(grid.values), len(grid.time)
    qbar = dynamic_pressure(values)
    forces = body_forces(values, qbar, airframe)
    if not record.meta.corrected:
        forces.update(_present(values, ("CX", "CY", "CZ")))
    data = _with_lift(forces, values, n)
    hats = {**hat_rates(values, airframe), **_present(values, ("p_hat", "q_hat", "r_hat"))}
    data.update(_regressors(values, hats, data))
    stored = _present(values, ("Cl", "Cm", "Cn"))
    if len(stored) < 3:
        if not all(name in values for name in ("p_dot", "q_dot", "r_dot")):
            raise InputError(f"record '{record.meta.name}' stores no p_dot, q_dot, r_dot: use the mode 'matched'")
        rates = _zeros_for(values, ("p", "q", "r"), n)
        dots = (values["p_dot"], values["q_dot"], values["r_dot"])
        stored = {**moment_coefficients(dots, products(*rates), qbar, airframe), **stored}
    return {**data, **stored}, 0


def _with_lift(forces: dict[str, FloatArray], values: dict[str, FloatArray], n: int) -> dict[str, FloatArray]:
    """Add CL and CD where alpha and az are there; without ax, CX is taken as zero in CL and there is no CD."""
    if "CZ" not in forces or "alpha" not in values:
        return dict(forces)
    lift, drag = lift_drag(forces.get("CX", np.zeros(n)), forces["CZ"], values["alpha"])
    return {**forces, "CL": lift, **({"CD": drag} if "CX" in forces else {})}


def _regressors(
    values: dict[str, FloatArray], hats: dict[str, FloatArray], forces: dict[str, FloatArray]
) -> dict[str, FloatArray]:
    """What may stand on the right of an equation."""
    found = {**_present(values, ("alpha", "beta", "elevator", "aileron", "rudder")), **hats}
    if "alpha" in values:
        found["alpha2"] = values["alpha"] ** 2
    if "CL" in forces:
        found["CL2"] = forces["CL"] ** 2
    return found
