"""Generic discrepancies: what a force, a moment, a sensor or a path may do that no effect of the library does."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from icing_env.crosstalk import CROSSTALK
from icing_env.discrepancy import FLOW
from sim2real.records.channels import MEASURED, SURFACES


@dataclass(frozen=True)
class Term:
    """A generic discrepancy: `target` (force, moment or sensor component) with a time course made of the record."""

    component: str
    name: str
    target: str
    row: int



def regressor(of: str) -> str:
    """The time course of what a sensor reads of another: "q_dot" of "qdot", "beta*beta" of "beta2"."""
    if of.endswith("dot"):
        return f"{of.removesuffix('dot')}_dot"
    return "*".join([of.removesuffix("2")] * (1 + of.endswith("2")))


# Generic discrepancies: component, what they act on, time courses ("1" constant, products of deviations, "time").
GENERIC: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("x_force", "u", ("1", "alpha", "alpha*alpha", "airspeed", "elevator", "time", "beta*beta", "rudder*rudder")),
    ("z_force", "w", ("1", "alpha", "q", "elevator", "alpha*alpha", "alpha*alpha*alpha", "airspeed", "time",
                      "beta*beta", "alpha*q", "alpha_dot", "CT", "alpha*CT")),
    ("pitching_moment", "q", ("1", "alpha", "q", "elevator", "alpha*alpha", "alpha*elevator",
                              "alpha*alpha*alpha", "elevator*elevator", "elevator*elevator*elevator", "q*q*q",
                              "airspeed", "airspeed*airspeed", "time", "beta*beta", "elevator*airspeed", "aileron", "p",
                              "r", "alpha*q", "CT", "alpha*CT", "alpha_dot", "theta")),
    ("y_force", "v", ("1", "beta", "p", "r", "rudder", "alpha*beta", "beta*beta*beta", "airspeed", "time", "aileron",
                      "alpha*p", "alpha*rudder", "beta*CT", "beta_dot")),
    ("rolling_moment", "p", ("1", "beta", "p", "r", "aileron", "rudder", "alpha*beta", "beta*beta*beta", "p*p*p",
                              "aileron*aileron*aileron", "airspeed", "airspeed*airspeed", "time", "alpha", "q",
                              "alpha*p", "alpha*r", "aileron*airspeed", "CT", "beta*CT", "beta_dot", "phi")),
    ("yawing_moment", "r", ("1", "beta", "p", "r", "aileron", "rudder", "alpha*beta", "beta*beta*beta", "r*r*r",
                            "rudder*rudder*rudder", "airspeed", "airspeed*airspeed", "time", "alpha", "q", "alpha*p",
                            "alpha*r", "alpha*aileron", "alpha*rudder", "rudder*airspeed", "CT", "alpha*CT", "beta*CT",
                            "beta_dot")),
    *((f"sensor:{c}", c, ("1", c, *([f"{c}_dot"] if c in MEASURED[:8] else []), "time",
                          *(regressor(of) for of in CROSSTALK.get(c, ())))) for c in MEASURED[:12]),
    *((f"{s}_path", f"{s}_path", ("1", "position", "position*position*position", "direction", "side", "magnitude",
                                  "airspeed", FLOW[s], *(other for other in SURFACES if other != s)))
      for s in SURFACES),
    ("wind", "wind", ("height",)),
)  # fmt: skip
# Structural modes under an accelerometer: what rings at so many Hz, in phase and a quarter behind. Light transports
# have their first bending modes there (assumed), and each covers its neighbourhood.
MODES = tuple(f"{kind}:{hertz:g}" for hertz in (2.0, 3.0, 4.5) for kind in ("rings", "rings_late"))
# What the zero of an instrument may do beside drifting evenly: Legendre polynomials of time, of degree two and three.
WANDERING = ("time*time", "time*time*time")
# Terms that the effect `discrepancy` cannot fly, and that show where a gap lies nevertheless: of sensors, with thrust
# or with a memory; of the paths of surfaces, with the memory of an actuator of second order (no lags: actuators have
# their own, and channels are in step to a few ms at best); in the engines and of the wind.
BEYOND: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    *((f"sensor:{c}", c, WANDERING) for c in MEASURED[:12]),
    *((f"sensor:{c}", c, ("CT",)) for c in ("airspeed", "alpha", "beta")),
    ("sensor:phi", "phi", ("slow_phi", "slow_ay")), ("sensor:theta", "theta", ("slow_theta", "slow_ax")),
    ("sensor:ay", "ay", MODES), ("sensor:az", "az", MODES),
    *((f"{s}_path", f"{s}_path", ("acceleration", "inertia")) for s in SURFACES),
    ("propulsion", "thrust", ("both", "both*airspeed", "both*airspeed*airspeed", "left", "left*airspeed",
                              "left*airspeed*airspeed")),
    ("wind", "wind", ("along*time", "across*time")),
)  # fmt: skip
# One standard deviation of a generic coefficient with a time course of unit size (assumed: a quarter of the change
# that typical effects of the library make).
GENERIC_SIZE = {"u": 0.008, "w": 0.03, "v": 0.01, "p": 0.002, "q": 0.015, "r": 0.002}
PURE_DELAY = "delay"  # what a path may do beside its terms: not linear, so that it is none
PATH_SIZE = {"1": 0.5 * math.pi / 180.0, "position": 0.1, "acceleration": 0.0025, "inertia": 0.005,
             "position*position*position": 0.1, "direction": 0.25 * math.pi / 180.0,
             "side": 0.25 * math.pi / 180.0, "magnitude": 0.1,
             PURE_DELAY: 1.0}  # rad, 1, s2, s2, 1, rad, rad, 1 (assumed); s
THRUST_SIZE = 0.1  # (assumed)
WIND = "wind"
WIND_SIZE, WIND_CHANGE = 0.1, 1.0  # m/s2: of a wind that gathers all the time, and at a knot (assumed)
AIR_SIZE = 0.02  # of the air's density, per unit of height: an inversion of 6 K (assumed)
DEVIATION = {"alpha": 0.05, "beta": 0.05, "q": 0.1, "p": 0.2, "r": 0.1, "elevator": 0.04, "aileron": 0.08,
             "rudder": 0.05, "airspeed": 5.0, "CT": 0.0106, "phi": 0.2, "theta": 0.1, "ax": 1.0, "ay": 1.0, "az": 2.0,
             "p_dot": 1.0, "q_dot": 0.5, "r_dot": 0.3, "alpha_dot": 0.05, "beta_dot": 0.05,
             "height": 100.0}  # fmt: skip  # what counts as one unit of a regressor (assumed)
FLOW_RATES, WASHED = ("alpha_dot", "beta_dot"), 0.1  # rates of the flow's angles, and s over which they are taken
DAMPING = 0.15  # of a mode (assumed: a real one's is less, but its frequency is not the term's)
FROM_ZERO = ("alpha", "beta", "p", "q", "r")  # channels whose scale counts from zero
EASED = 0.02  # rad, or rad/s, over which a surface changes side, or direction (assumed)
SECOND_ORDER = 0.1  # s, by which an actuator of second order smooths what it lacks in acceleration (assumed)
ERECTION = 30.0  # s in which a vertical gyro follows a false vertical (assumed)
KNOT_AT = "at:"  # how the hat about a knot is named


def in_what_is_left(terms: Sequence[Term]) -> tuple[Term, ...]:
    """The terms with their rows in what a flown set leaves, itself being row 0."""
    return tuple(replace(term, row=1 + j) for j, term in enumerate(terms))
