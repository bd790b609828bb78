"""Whatever the library lacks, written as terms of coefficients and errors of channels: how an unknown is flown.

A diagnosis that finds nothing in the library describes the gap by a regression on residual coefficients (constant,
linear and nonlinear terms, growth with time; Klein & Morelli, Aircraft System Identification, AIAA 2006, section 5.4),
or on what an instrument reads of others. This effect flies such a description. It belongs to no library: it explains
nothing.

A term is a product of deviations from the condition `at_*`; multiplied out it changes the parameters of its factors.
"""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from icing_env.crosstalk import CROSSTALK, CROSSTALK_PARAMETERS
from icing_env.discrepancy import PATH_PARAMETERS, SURFACES, bends
from icing_env.effects.effect import Effect, Parameter, Values
from icing_env.sensors import BIASED, DELAYED, DRIFTING, SCALED
from icing_env.types import unit_of

SIDEWAYS = ("0", "beta", "p", "r", "aileron", "rudder", "alpha_beta", "beta_beta_beta", "airspeed", "airspeed_airspeed",
            "time", "alpha", "q", "alpha_p", "alpha_r", "CT", "beta_CT", "betadot")  # fmt: skip
TERMS: dict[str, tuple[str, ...]] = {
    "CX": ("0", "alpha", "alpha_alpha", "elevator", "airspeed", "time", "beta_beta", "rudder_rudder"),
    "CY": ("0", "beta", "p", "r", "rudder", "alpha_beta", "beta_beta_beta", "airspeed", "time", "aileron", "alpha_p",
           "alpha_rudder", "beta_CT", "betadot"),
    "CZ": ("0", "alpha", "q", "elevator", "alpha_alpha", "alpha_alpha_alpha", "airspeed", "time", "beta_beta",
           "alpha_q", "alphadot", "CT", "alpha_CT"),
    "Cl": (*SIDEWAYS, "p_p_p", "aileron_aileron_aileron", "aileron_airspeed", "phi"),
    "Cm": ("0", "alpha", "q", "elevator", "alpha_alpha", "alpha_elevator", "alpha_alpha_alpha", "elevator_elevator",
           "elevator_elevator_elevator", "q_q_q", "airspeed", "airspeed_airspeed", "time", "beta_beta",
           "elevator_airspeed", "aileron", "p", "r", "alpha_q", "CT", "alpha_CT", "alphadot", "theta"),
    "Cn": (*SIDEWAYS, "r_r_r", "rudder_rudder_rudder", "alpha_aileron", "alpha_rudder", "rudder_airspeed", "alpha_CT"),
}
AT = {"alpha": "rad", "elevator": "rad", "airspeed": "m/s", "time": "s", "phi": "rad", "theta": "rad", "ax": "m/s2",
      "ay": "m/s2", "az": "m/s2", "altitude": "m", "CT": "1", "height": "m"}  # fmt: skip
CHANNELS = DRIFTING  # those of which an error can be described: airspeed to altitude
# Numbers of each surface's path: gearing and offset by which it differs, a lag more, and how it bends.
PATHS = {s: (f"{s}_gearing", f"{s}_offset", f"{s}_lag", *bends(s)) for s in SURFACES}
PATH_UNITS = {"gearing": "1", "offset": "rad", "lag": "s"}
LARGEST = 1e3  # either way, of everything (no range is searched)


def apply(p: NDArray, values: Values) -> None:
    for coefficient, terms in TERMS.items():
        for term in terms:
            _add(p, coefficient, () if term == "0" else tuple(term.split("_")), values)
    for channel in CHANNELS:
        scale, drift = values[f"scale_{channel}"], values[f"drift_{channel}"]
        p[f"bias_{channel}"] += values[f"bias_{channel}"] - scale*values.get(f"at_{channel}", 0.0)
        p[f"bias_{channel}"] -= drift*values["at_time"]
        p[f"scale_{channel}"] += scale
        p[f"drift_{channel}"] += drift
    for channel, others in CROSSTALK.items():
        for of in others:
            _read(p, channel, of, values)
    for surface in SURFACES:
        _bend(p, surface, values)
    p["density_factor"] -= values["density_height"]*values["at_height"]
    p["density_lapse"] += values["density_height"]
    for channel in DELAYED:
        p[f"delay_{channel}"] += values[f"delay_{channel}"]
    p["pitot_lag"] = np.maximum(p["pitot_lag"] + values["delay_airspeed"], 0.0)


def _add(p: NDArray, coefficient: str, factors: tuple[str, ...], values: Values) -> None:
    """One term, multiplied out: of every factor either the quantity itself or less its value of reference."""
    size = values["_".join((coefficient, *(factors or ("0",))))]
    for kept in product(*((True, False) if f"at_{f}" in values else (True,) for f in factors)):
        left = [f for f, keep in zip(factors, kept, strict=True) if keep]
        change = size
        for factor, keep in zip(factors, kept, strict=True):
            if not keep:
                change = -change*values[f"at_{factor}"]
        p[number(coefficient, left)] += change
        if (coefficient, left) == ("Cm", ["alphadot"]):  # which the plant has as a part of Cm_q
            p["Cm_q"] += change


def _read(p: NDArray, channel: str, of: str, values: Values) -> None:
    """What a channel reads of another, or of its square, counted from the value of reference."""
    size, other = values[f"{channel}_of_{of}"], of.removesuffix("2")
    at = values.get(f"at_{other}", 0.0)
    p[f"{channel}_of_{of}"] += size
    if other == of:
        p[f"bias_{channel}"] -= size*at
    elif other == channel:
        p[f"scale_{channel}"] -= 2.0*size*at
        p[f"bias_{channel}"] += size*at*at
    else:
        p[f"{channel}_of_{other}"] -= 2.0*size*at
        p[f"bias_{channel}"] += size*at*at


def _bend(p: NDArray, surface: str, values: Values) -> None:
    """Where a surface is taken; by airspeed and load counted from the values of reference."""
    for name in PATHS[surface]:
        p[name] += values[name]
        if "_of_" in name:
            p[f"{surface}_offset"] -= values[name]*values.get(f"at_{name.rpartition('_')[2]}", 0.0)
    p[f"{surface}_lag"] = np.maximum(p[f"{surface}_lag"], 0.0)


def number(coefficient: str, factors: list[str]) -> str:
    """The parameter that multiplies a product of quantities: `Cm_0`, `Cm_alpha_elevator`, `Cm_alpha3`."""
    if len(factors) > 1 and len(set(factors)) == 1:
        return f"{coefficient}_{factors[0]}{len(factors)}"
    return f"{coefficient}_{'_'.join(factors) or '0'}"


def unit(coefficient: str, term: str) -> str:
    """Unit of one term's size: per rad of every angle and normalised rate, per m/s, per s."""
    if term in (units := {"airspeed": "s/m", "airspeed_airspeed": "s2/m2", "time": "1/s", "CT": "1", "phi": "1",
                          "theta": "1"}):  # fmt: skip
        return units[term]
    if term.endswith("_airspeed"):
        return "s/(m rad)"
    angles = term.count("_") + 1 - ("CT" in term)
    return (f"1/rad{angles}" if angles > 1 else "1/rad") if "_" in term else unit_of(f"{coefficient}_{term}")


def _number(name: str, unit: str) -> Parameter:
    return Parameter(name, unit, neutral=0.0, typical=0.0, low=-LARGEST, high=LARGEST)


EFFECT = Effect(
    name="discrepancy",
    component="aerodynamics",
    enters_at=("x_force", "y_force", "z_force", "rolling_moment", "pitching_moment", "yawing_moment",
               *(f"sensor:{channel}" for channel in CHANNELS), *(f"{surface}_path" for surface in SURFACES), "wind"),
    description="Terms of force and moment coefficients and errors of channels, as a diagnosis describes an unknown",
    source="docs/model.md, section 20",
    parameters=(
        *(_number(f"{c}_{term}", unit(c, term)) for c, terms in TERMS.items() for term in terms),
        *(_number(f"bias_{c}", "of the channel") for c in CHANNELS if c in BIASED),
        *(_number(f"scale_{c}", "1") for c in CHANNELS if c in SCALED),
        *(_number(f"delay_{c}", "s") for c in ("airspeed", *DELAYED)),
        *(_number(f"drift_{c}", "of the channel per s") for c in CHANNELS),
        *(_number(name, unit) for name, unit, _ in CROSSTALK_PARAMETERS),
        *(_number(f"{s}_{name}", unit) for s in SURFACES for name, unit in PATH_UNITS.items()),
        *(_number(name, unit) for name, unit, _ in PATH_PARAMETERS),
        _number("density_height", "1/m"),
        *(Parameter(f"at_{name}", u, neutral=0.0, typical=0.0, low=-1e5, high=1e5) for name, u in AT.items()),
    ),
    apply=apply,
)
