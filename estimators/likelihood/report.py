"""From fitted parameters to named derivatives: those that follow from others, and what the record cannot show."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from estimators.estimate import Estimate
from estimators.likelihood.model import OUTPUT_OF
from estimators.regression.equations import EXCITED, LARGEST_RATIO, SURFACES, movement
from estimators.signals.coefficients import thrust
from estimators.signals.resample import Grid
from icing_env.record import FloatArray

ALIKE = 0.99  # correlation of two estimates beyond which only a combination of them is known (assumed)
UNITS = {
    "CX_alpha2": "1/rad2", "alpha_scale": "1", "beta_scale": "1", "tail_lift": "1", "gust_lag": "s",
    "alpha_lag": "s", "beta_lag": "s", "theta_lag": "s", "phi_lag": "s", "bias_q": "rad/s", "bias_p": "rad/s",
    "bias_az": "m/s2", "bias_ay": "m/s2", "bias_phi": "rad", "sigma_gust_w": "m/s", "sigma_gust_v": "m/s",
}  # fmt: skip
ZERO = 1e-5  # relative step of the slopes of derived quantities


@dataclass(frozen=True)
class Found:
    """Fitted parameters of one axis: names, values (p,), covariance (p, p); r2 by output; how the fit ended."""

    axis: str
    names: tuple[str, ...]
    theta: FloatArray
    covariance: FloatArray
    r2: Mapping[str, float]
    failure: str = ""
    warning: str = ""


def estimates(found: Found, grid: Grid, method: str) -> dict[str, Estimate]:
    """Estimates by name: the parameters and, longitudinally, lift and drag; each judged against the record."""
    fitted, covariance = dict(zip(found.names, found.theta, strict=True)), found.covariance
    moved = {n: movement(grid.time, grid.values[n], grid.good((n,))) for n in SURFACES[found.axis] if n in grid.values}
    twin = _twins(found)
    result = {}
    for i, name in enumerate(found.names):
        if not name.startswith("start_"):
            error = float(np.sqrt(max(covariance[i, i], 0.0)))
            result[name] = _judged(name, fitted[name], error, found, moved, twin.get(name, ""), method)
    if found.axis == "longitudinal":
        alpha = float(np.mean(grid.values["alpha"]))
        for name, value, error in _lift_and_drag(found, alpha):
            result[name] = _judged(name, value, error, found, moved, twin.get(name.replace("CL", "CZ"), ""), method)
    if thrust(grid.values) is None:
        why = "thrust was not recorded and cannot be told from drag"
        for name in set(result) & {"CD_0", "CX_0", "CX_alpha", "CX_alpha2"}:
            result[name] = replace(result[name], identifiable=False, why=why)
    return result


def _judged(
    name: str, value: float, error: float, found: Found, moved: dict[str, float], twin: str, method: str
) -> Estimate:
    coefficient, _, by = name.partition("_")
    derivative = coefficient in OUTPUT_OF or coefficient in ("CL", "CD")
    why = _why_controls(found.axis, by, moved) or found.failure
    if not why and derivative and by != "0":
        why = twin
        if not why and not error <= LARGEST_RATIO * abs(value):
            why = f"its standard error {error:.2g} exceeds a third of the estimate {value:.2g}"
    if not why and name == "CD_0" and not error <= LARGEST_RATIO * abs(value):
        why = f"zero lift is too far from what was flown: standard error {error:.2g}"
    output = {"CL": "az", "CD": "ax"}.get(coefficient, OUTPUT_OF.get(coefficient, ""))
    unit = UNITS.get(name, "1" if by == "0" else "1/rad")
    return Estimate(value, error, unit, method, found.r2.get(output), not why, why, found.warning)


def _why_controls(axis: str, by: str, moved: dict[str, float]) -> str:
    surfaces = SURFACES[axis]
    told = ", ".join(f"{s} moved {np.degrees(moved.get(s, 0.0)):.2f} deg rms" for s in surfaces)
    if max(moved.get(s, 0.0) for s in surfaces) < EXCITED:
        return f"no {axis} manoeuvre: {told}, at least {np.degrees(EXCITED):.2f} is needed"
    if by in surfaces and moved.get(by, 0.0) < EXCITED:
        return f"{by} moved {np.degrees(moved.get(by, 0.0)):.2f} deg rms, at least {np.degrees(EXCITED):.2f} is needed"
    return ""


def _twins(found: Found) -> dict[str, str]:
    """Derivatives whose estimate goes with that of another, and the sentence that says so."""
    scale = np.sqrt(np.maximum(np.diag(found.covariance), 1e-300))
    matrix = np.abs(found.covariance / np.outer(scale, scale)) - np.eye(len(scale))
    twins = {}
    for i, name in enumerate(found.names):
        j = int(np.argmax(matrix[i]))
        both = all(n.split("_")[0] in OUTPUT_OF and not n.endswith("_0") for n in (name, found.names[j]))
        same = name.split("_")[0] == found.names[j].split("_")[0]
        if both and same and matrix[i, j] > ALIKE and "CX" not in name:
            twins[name] = (f"{name} and {found.names[j]} are known together only "
                           f"(correlation of the estimates {matrix[i, j]:.3f})")  # fmt: skip
    return twins


def _lift_and_drag(found: Found, alpha: float) -> list[tuple[str, float, float]]:
    """CL_* at the mean alpha and CD_0, with errors carried over from body axes."""
    names, result = found.names, []
    functions: dict[str, Callable[[dict[str, float]], float]] = {
        "CL_alpha": lambda t: _lift_slope(t, alpha), "CL_q": lambda t: -t["CZ_q"] * np.cos(alpha),
        "CL_elevator": lambda t: -t["CZ_elevator"] * np.cos(alpha), "CD_0": _zero_lift_drag,
    }  # fmt: skip
    needs = {"CL_alpha": ("CZ_alpha",), "CL_q": ("CZ_q",), "CL_elevator": ("CZ_elevator",), "CD_0": ("CX_0",)}
    for name, function in functions.items():
        if not all(n in names for n in needs[name]):
            continue
        slopes, value = np.zeros(len(names)), function(dict(zip(names, found.theta, strict=True)))
        for i in range(len(names)):
            width = ZERO * max(abs(found.theta[i]), 1.0)
            sides = [function(dict(zip(names, found.theta + s * width * np.eye(len(names))[i], strict=True)))
                     for s in (1.0, -1.0)]  # fmt: skip
            slopes[i] = (sides[0] - sides[1]) / (2.0 * width)
        result.append((name, float(value), max(float(slopes @ found.covariance @ slopes), 0.0) ** 0.5))
    return result


def _lift_slope(t: dict[str, float], alpha: float) -> float:
    """d(CX sin alpha - CZ cos alpha)/d alpha; without an axial force, of CZ alone."""
    axial = t.get("CX_0", 0.0) + alpha * (t.get("CX_alpha", 0.0) + alpha * t.get("CX_alpha2", 0.0))
    axial_slope = t.get("CX_alpha", 0.0) + 2.0 * alpha * t.get("CX_alpha2", 0.0)
    normal = t["CZ_0"] + t["CZ_alpha"] * alpha
    sine, cosine = np.sin(alpha), np.cos(alpha)
    return float(axial_slope * sine + axial * cosine - t["CZ_alpha"] * cosine + normal * sine)


def _zero_lift_drag(t: dict[str, float]) -> float:
    """Drag at the small alpha at which CX alpha = CZ, lift being zero there."""
    alpha = t["CZ_0"] / (t["CX_0"] - t["CZ_alpha"])
    return float(-(t["CX_0"] + alpha * (t["CX_alpha"] + alpha * t["CX_alpha2"])) / np.cos(alpha))
