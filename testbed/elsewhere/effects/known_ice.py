"""Library effects of ice on wing, tail and fin (numbers 1, 2, 3, 6, 8, 19 of the list in docs/elsewhere.md)."""

from __future__ import annotations

import numpy as np

from testbed.elsewhere.effects.registry import known
from testbed.elsewhere.hooks import Flow, Hooks

ALL_ICE = {"CX0": 6.52696, "CZa": -1.48148, "CZde": -1.40741, "Cma": -1.46667, "Cmde": -1.48148, "CYb": -2.96296,
           "Clp": -1.48148, "Clda": -1.48148, "Cnb": -2.96296, "Cndr": -1.18519}  # UIUC's TwinOtterAllIce


@known("Wing ice: CLα loss", 1, ("z_force",), "aerodynamics", (0.15, 0.35), "1", other_form=True)
def wing_lift(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Lift lost grows with the square of alpha: `size` of CLα alpha is lost at the reference angle of 5 deg."""
    reference = np.radians(5.0)

    def coefficients(f: Flow) -> None:
        a = np.maximum(f.alpha, 0.0)
        f.C[2] -= f.on * size * f.d["CZa"] * a * np.minimum(a / reference, 2.0)

    return Hooks({"fraction_at_5_deg": size}, coefficients=coefficients)


@known("Ice drag", 2, ("x_force",), "aerodynamics", (0.008, 0.030), "1")
def drag(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """CD rises by `size` + K CL^2, along the relative wind."""
    k = size * rng.uniform(0.2, 0.6)

    def coefficients(f: Flow) -> None:
        cd = f.on * (size + k * f.C[2] ** 2)
        f.C[0] -= cd * np.cos(f.alpha)
        f.C[2] -= cd * np.sin(f.alpha)

    return Hooks({"dCD0": size, "dK": k}, coefficients=coefficients)


@known("Tail ice: Cmδe loss", 3, ("pitching_moment",), "aerodynamics", (0.12, 0.30), "1")
def elevator_power(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Elevator loses the fraction `size` of Cmδe and of CZδe."""

    def coefficients(f: Flow) -> None:
        f.C[4] -= f.on * size * f.d["Cmde"] * f.surfaces[0]
        f.C[2] -= f.on * size * f.d["CZde"] * f.surfaces[0]

    return Hooks({"fraction": size}, coefficients=coefficients)


@known("Asymmetric wing ice", 6, ("rolling_moment",), "aerodynamics", (0.0005, 0.0018), "1", either_sign=True)
def one_wing(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """One wing iced: Cl = `size` (1 + alpha / 4 deg), Cn a third of it the same way (drag on the wing that drops)."""
    share = rng.uniform(0.2, 0.4)

    def coefficients(f: Flow) -> None:
        roll = f.on * size * (1.0 + f.alpha / np.radians(4.0))
        f.C[3] += roll
        f.C[5] += share * roll

    return Hooks({"dCl0": size, "dCn_over_dCl": share}, coefficients=coefficients)


@known("Cnβ loss (fin ice)", 8, ("yawing_moment",), "aerodynamics", (0.25, 0.55), "1", other_form=True)
def fin(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """Cnβ lost about zero sideslip only, recovering beyond `width`; Cnδr loses half the fraction."""
    width = np.radians(rng.uniform(4.0, 7.0))

    def coefficients(f: Flow) -> None:
        f.C[5] -= f.on * size * f.d["Cnb"] * f.beta * np.exp(-((f.beta / width) ** 2))
        f.C[5] -= f.on * 0.5 * size * f.d["Cndr"] * f.surfaces[2]

    return Hooks({"fraction_at_zero": size, "width": width}, coefficients=coefficients)


@known("Time-varying accretion/boot cycles", 19, ("x_force", "z_force", "pitching_moment"), "aerodynamics",
       (0.05, 0.13), "eta", other_form=True)
def accretion(size: float, rng: np.random.Generator, n: int) -> Hooks:
    """All derivatives scaled by 1 + k eta(t), k of the published all-ice set, eta a logistic curve up to `size`."""
    middle, span = rng.uniform(12.0, 24.0), rng.uniform(2.0, 4.0)

    def coefficients(f: Flow) -> None:
        eta = f.on * size / (1.0 + np.exp(-(f.t - middle) / span))
        d, (de, da, dr) = {k: v * f.d[k] * eta for k, v in ALL_ICE.items()}, f.surfaces
        f.C[0] += d["CX0"]
        f.C[1] += d["CYb"] * f.beta
        f.C[2] += d["CZa"] * f.alpha + d["CZde"] * de
        f.C[3] += d["Clda"] * da + d["Clp"] * f.relative[0] * 9.906 / f.speed
        f.C[4] += d["Cma"] * f.alpha + d["Cmde"] * de
        f.C[5] += d["Cnb"] * f.beta + d["Cndr"] * dr

    return Hooks({"eta_final": size, "middle_s": middle, "span_s": span}, coefficients=coefficients)
