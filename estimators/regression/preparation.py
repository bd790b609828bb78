"""What stands in the equations, made ready from a record: coefficients and regressors through one filter or another.

`matched`: local slopes, and every other signal through the smoother that belongs to them. `fourier`: optimal Fourier
smoothing with one cut-off for all, which matches as well. `textbook`: the columns that the record's owner stored. For
comparison, as analyses have been made and not as they should be: `unmatched`, local slopes against raw regressors, and
`unmatched_smoothed`, local slopes against regressors smoothed by themselves (Savitzky & Golay, quadratic, of the same
width). Both shrink Cm_q and Cm_elevator (see estimators.signals.differentiate).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.signal import savgol_filter

from estimators.regression.noisy_regressors import white_noise
from estimators.signals.coefficients import (
    Airframe,
    body_forces,
    dynamic_pressure,
    hat_rates,
    lift_drag,
    moment_coefficients,
    products,
)
from estimators.signals.differentiate import half_width, slope, smooth
from estimators.signals.fourier_smoothing import fourier_smooth, smooth_together
from estimators.signals.resample import Grid
from icing_env.errors import InputError
from icing_env.record import FlightRecord, FloatArray

MODES = ("matched", "fourier", "textbook", "unmatched", "unmatched_smoothed")
Filter = Callable[[FloatArray], FloatArray]


def prepare(
    grid: Grid, record: FlightRecord, airframe: Airframe, mode: str, half: int | None = None
) -> tuple[dict[str, FloatArray], int]:
    """Coefficients and regressors by name, each (N,), and the half width (samples) of the filter they came through.

    Args:
        mode: one of `MODES`.
        half: samples either side in the slope filter; 0.1 s if None.

    Raises:
        InputError: an unknown mode, or one that needs what the owner did not store.
    """
    if mode not in MODES:
        raise InputError(f"identify: mode '{mode}' is unknown; valid are: {', '.join(MODES)}")
    if mode == "textbook":
        return stored(grid, record, airframe), 0
    reach = half_width(grid.dt) if half is None else half
    value, rate = _filters(grid, mode, reach)
    return _filtered(grid, airframe, value, rate), reach


def noise_of(grid: Grid, airframe: Airframe, mode: str, half: int) -> dict[str, float]:
    """Variance of the noise left in each regressor by name, behind the filter of a mode that matches; else nothing.

    half: samples either side in the slope filter.
    """
    if mode not in ("matched", "fourier"):
        return {}
    value, _ = _filters(grid, mode, half)
    impulse = np.zeros(len(grid.time))
    impulse[len(impulse) // 2] = 1.0
    left = float(np.nansum(value(impulse) ** 2))
    airspeed, size = float(np.mean(grid.values["airspeed"])), airframe.geometry
    hat = {"p": size.span, "q": size.chord, "r": size.span}
    found = {}
    for name in ("alpha", "beta", "elevator", "aileron", "rudder", *hat):
        if name in grid.values:
            scale = hat[name] / (2.0 * airspeed) if name in hat else 1.0
            regressor = f"{name}_hat" if name in hat else name
            found[regressor] = white_noise(grid.values[name][grid.good((name,))]) * left * scale**2
    return found


def _filters(grid: Grid, mode: str, half: int) -> tuple[Filter, Filter]:
    """What the values, and what the angular rates to be differentiated, pass through."""
    if mode == "fourier":
        cut = _common_cutoff(grid)
        return (lambda x: fourier_smooth(x, grid.dt, cut).value), (lambda x: fourier_smooth(x, grid.dt, cut).rate)
    values: dict[str, Filter] = {
        "matched": lambda x: smooth(x, half),
        "unmatched": lambda x: x,
        "unmatched_smoothed": lambda x: np.asarray(savgol_filter(x, 2 * half + 1, 2), np.float64),
    }
    return values[mode], lambda x: slope(x, grid.dt, half)


def _common_cutoff(grid: Grid) -> float:
    """Hz that passes the fastest of the rates and flow angles; a surface's sharp edge is smoothed with the rest."""
    rates = {name: grid.values[name] for name in ("alpha", "beta", "p", "q", "r") if name in grid.values}
    return next(iter(smooth_together(rates, grid.dt).values())).cutoff


def _filtered(grid: Grid, airframe: Airframe, value: Filter, rate: Filter) -> dict[str, FloatArray]:
    """Coefficients and regressors from raw channels."""
    values, n = dict(grid.values), len(grid.time)
    p, q, r = zeros_for(values, ("p", "q", "r"), n)
    qbar = dynamic_pressure(values)
    raw = _with_lift(body_forces(values, qbar, airframe), values, n)
    raw.update(_regressors(values, hat_rates(values, airframe), raw))
    data = {name: value(x) for name, x in raw.items()}
    product = {name: value(x) for name, x in products(p, q, r).items()}
    return {**data, **moment_coefficients((rate(p), rate(q), rate(r)), product, value(qbar), airframe)}


def stored(grid: Grid, record: FlightRecord, airframe: Airframe) -> dict[str, FloatArray]:
    """Coefficients and regressors as the record's owner stored them, unfiltered.

    Raises:
        InputError: neither moment coefficients nor angular accelerations were stored.
    """
    values, n = dict(grid.values), len(grid.time)
    qbar = dynamic_pressure(values)
    forces = body_forces(values, qbar, airframe)
    if not record.meta.corrected:
        forces.update(_present(values, ("CX", "CY", "CZ")))
    data = _with_lift(forces, values, n)
    hats = {**hat_rates(values, airframe), **_present(values, ("p_hat", "q_hat", "r_hat"))}
    data.update(_regressors(values, hats, data))
    moments = _present(values, ("Cl", "Cm", "Cn"))
    if len(moments) < 3:
        if not all(name in values for name in ("p_dot", "q_dot", "r_dot")):
            raise InputError(f"record '{record.meta.name}' stores no p_dot, q_dot, r_dot: use the mode 'matched'")
        rates = zeros_for(values, ("p", "q", "r"), n)
        dots = (values["p_dot"], values["q_dot"], values["r_dot"])
        moments = {**moment_coefficients(dots, products(*rates), qbar, airframe), **moments}
    return {**data, **moments}


def zeros_for(values: dict[str, FloatArray], names: tuple[str, ...], n: int) -> tuple[FloatArray, ...]:
    """Channels by name; zero where absent, for small corrections only (inertial coupling, the turn of lift)."""
    return tuple(values.get(name, np.zeros(n)) for name in names)


def _present(values: dict[str, FloatArray], names: tuple[str, ...]) -> dict[str, FloatArray]:
    """Those of the named channels that are there."""
    return {name: values[name] for name in names if name in values}


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
