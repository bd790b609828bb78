"""Generic discrepancies: what a force, a moment, a sensor or a path may do that no effect of the library does."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.signal import bilinear, lfilter
from scipy.special import eval_legendre

from icing_env.atmosphere import density
from icing_env.crosstalk import CROSSTALK
from icing_env.discrepancy import FLOW
from icing_env.record import FloatArray
from sim2real.library.knots import hat, knots
from sim2real.prediction.predictor import Push
from sim2real.records.channels import MEASURED, SURFACES, TOLERANCE
from sim2real.records.powers import thrust_per_power
from sim2real.records.reconstruct import Reconstruction


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
DEVIATION = {"alpha": 0.05, "beta": 0.05, "q": 0.1, "p": 0.2, "r": 0.1, "elevator": 0.04, "aileron": 0.08,
             "rudder": 0.05, "airspeed": 5.0, "CT": 0.0106, "phi": 0.2, "theta": 0.1, "ax": 1.0, "ay": 1.0, "az": 2.0,
             "p_dot": 1.0, "q_dot": 0.5, "r_dot": 0.3, "alpha_dot": 0.05, "beta_dot": 0.05,
             }  # fmt: skip  # what counts as one unit of a regressor (assumed)
FLOW_RATES, WASHED = ("alpha_dot", "beta_dot"), 0.1  # rates of the flow's angles, and s over which they are taken
DAMPING = 0.15  # of a mode (assumed: a real one's is less, but its frequency is not the term's)
FROM_ZERO = ("alpha", "beta", "p", "q", "r")  # channels whose scale counts from zero
EASED = 0.02  # rad, or rad/s, over which a surface changes side, or direction (assumed)
SECOND_ORDER = 0.1  # s, by which an actuator of second order smooths what it lacks in acceleration (assumed)
ERECTION = 30.0  # s in which a vertical gyro follows a false vertical (assumed)
KNOT_AT = "at:"  # how the hat about a knot is named


@np.errstate(over="ignore", invalid="ignore")  # of a record as a model predicts it that departs from it
def pushes(flight: Reconstruction, terms: Sequence[Term]) -> tuple[Push, ...]:
    """The time courses of the generic terms along one record."""
    scale = _scales(flight)
    out: list[Push] = []
    for term in terms:
        if term.target == "thrust":
            out += _thrust_pushes(flight, term)
        elif term.component == WIND:
            out += _wind_pushes(flight, term)
        elif term.component.startswith("sensor:"):
            out.append(Push(term.row, term.target, _sensor_course(flight, term.name, term.target), True))
        elif not term.target.endswith("_path"):
            series = GENERIC_SIZE[term.target] * _course(flight, term.name, True)
            out += [Push(term.row, state, per_unit * series, False) for state, per_unit in scale[term.target].items()]
    return tuple(out)


def at_any_time(flight: Reconstruction, component: str, first: int) -> list[Term]:
    """Terms that together are a free course of time at a force, a moment, a sensor, the engines or the wind.

    Args:
        flight: one record.
        component: where.
        first: row of the first.
    """
    target = next(target for where, target, _ in (*GENERIC, *BEYOND) if where == component)
    kinds = {"propulsion": ("both*", "left*"), WIND: ("along*", "across*")}.get(component, ("",))
    return [Term(component, f"{kind}{KNOT_AT}{t:.9g}", target, first + i)
            for i, (kind, t) in enumerate(product(kinds, knots(flight)))]


def _thrust_pushes(flight: Reconstruction, term: Term) -> list[Push]:
    """A share of both engines' thrust or of the left one's: felt, slipstream included, and read where recorded."""
    side, _, course = term.name.partition("*")
    p, sides = flight.parameters[0], ("left", "right") if side == "both" else ("left",)
    per_power = thrust_per_power(p, flight.channel("airspeed"), flight.channel("alpha"))
    xx, zz, xz = p["inertia_xx"], p["inertia_zz"], p["inertia_xz"]
    pitch = p["Cm_CT"] + p["Cm_elevator"] * p["Cm_elevator_CT"] * flight.controls["elevator"]  # per CT, as CZ_CT is
    out = []
    for side in sides:
        thrust = flight.controls[f"power_{side}"] * per_power
        series = THRUST_SIZE * thrust * _course(flight, course or "1")
        turn = p["engine_arm_y"] / (xx * zz - xz**2) * (1.0 if side == "left" else -1.0) * series
        out += [Push(term.row, "u", series / p["mass"], False), Push(term.row, "r", xx * turn, False),
                Push(term.row, "p", xz * turn, False),
                Push(term.row, "w", p["CZ_CT"] / p["mass"] * series, False),
                Push(term.row, "q", (p["engine_arm_z"] + p["chord"] * pitch) / p["inertia_yy"] * series, False),
                Push(term.row, f"thrust_{side}", series, True)]
    return out


def _wind_pushes(flight: Reconstruction, term: Term) -> list[Push]:
    """A wind along or across the aircraft that gathers: to what flies in it, an acceleration that nothing feels."""
    side, _, course = term.name.partition("*")
    axis, felt = {"along": ("u", "ax"), "across": ("v", "ay")}[side]
    gathers = np.full(len(flight.time), WIND_SIZE) if course == "time" else WIND_CHANGE * _course(flight, course)
    return [Push(term.row, axis, -gathers, False), Push(term.row, felt, gathers, True)]


def path_courses(flight: Reconstruction, position: FloatArray, names: Sequence[str]) -> list[FloatArray]:
    """What generic terms add to a surface's predicted position [rad]; loads push it by what the air does."""
    if not names:
        return []
    rate = np.gradient(position, flight.dt)
    reach = max(float(np.max(np.abs(position))), 1e-3)
    acceleration, share = np.gradient(rate, flight.dt), min(flight.dt / SECOND_ORDER, 1.0)
    course = {"1": np.ones(len(position)), "position": position, "acceleration": acceleration,
              "inertia": lfilter([share], [1.0, share - 1.0], acceleration),
              "position*position*position": position**3 / reach**2, "direction": np.tanh(rate / EASED),
              "side": np.tanh(position / EASED), "magnitude": np.abs(position)}  # fmt: skip
    return [PATH_SIZE[name] * course[name] if name in course else PATH_SIZE["1"] * _course(flight, name)
            for name in names]


def in_common(flights: Sequence[Reconstruction]) -> list[Reconstruction]:
    """Records whose terms count deviations from one condition: the median of all of them.

    A moment that is a function of the angle of attack is one function, whatever angle a record was trimmed at. A cube
    that is far from the median in some record would be flown much larger there than anything is: no course is larger
    than one by its root mean square.
    """
    if not flights:
        return []
    about = {factor: float(np.median(np.concatenate([values_of(f, factor) for f in flights]))) for factor in DEVIATION}
    found = [replace(f, about=about, reach={}) for f in flights]
    names = {name for _, _, names in (*GENERIC, *BEYOND) for name in names if set(name.split("*")) <= set(DEVIATION)}
    square = {name: np.mean(np.concatenate([_course(f, name, True) for f in found]) ** 2) for name in names}
    return [replace(f, reach={name: max(float(np.sqrt(s)), 1.0) for name, s in square.items()}) for f in found]


def _course(flight: Reconstruction, name: str, aerodynamic: bool = False) -> FloatArray:
    """Product of the deviations named, in units of DEVIATION; of time a polynomial from -1 or 1 to 1, or a knot's hat.

    Args:
        aerodynamic: what the air does with a rate of turn goes with the rate over the airspeed.
    """
    n = len(flight.time)
    if name == "1":
        return np.ones(n)
    if set(name.split("*")) == {"time"}:
        return np.asarray(eval_legendre(name.count("time"), np.linspace(-1.0, 1.0, n)))
    if name.startswith(KNOT_AT):
        return hat(flight, float(name.removeprefix(KNOT_AT)))
    out = np.ones(n)
    for factor in name.split("*"):
        values = values_of(flight, factor)
        middle = flight.about[factor] if factor in flight.about else float(np.median(values))
        away = (values - middle) / DEVIATION[factor]
        if aerodynamic and factor in ("p", "q", "r", *FLOW_RATES):
            speed = flight.channel("airspeed")
            away = away * flight.about.get("airspeed", float(np.median(speed))) / speed
        out = out * away
    return out / flight.reach.get(name, 1.0)


def values_of(flight: Reconstruction, factor: str) -> FloatArray:
    """A regressor: a control, both engines' thrust as a coefficient, a channel, or its derivative."""
    if factor == "CT" and flight.power_from == "balance":
        return np.zeros(len(flight.time))  # of the alpha and ax of which that power is made, it says nothing new
    if factor == "CT":
        per_power = thrust_per_power(flight.parameters[0], flight.channel("airspeed"), flight.channel("alpha"))
        both = flight.controls["power_left"] + flight.controls["power_right"]
        return np.asarray(both * per_power / _pressed_area(flight))
    if factor in flight.controls:
        return flight.controls[factor]
    if factor in FLOW_RATES:
        values, share = flight.channel(factor.removesuffix("_dot")), 1.0 - math.exp(-flight.dt / WASHED)
        late, _ = lfilter([share], [1.0, share - 1.0], values, zi=[(1.0 - share) * values[0]])
        return np.asarray((values - late) * share / ((1.0 - share) * flight.dt))  # over how late a ramp is
    if factor.endswith("_dot"):
        values = flight.channel(factor.removesuffix("_dot"))
        return np.diff(values, prepend=values[:1]) / flight.dt
    return flight.channel(factor)


def _sensor_course(flight: Reconstruction, name: str, channel: str) -> FloatArray:
    """Bias of one tolerance, scale error of 10 %, a lag of 0.1 s, or a drift over the record."""
    tolerance = TOLERANCE[channel]
    if name in ("1", "time") or name.startswith(KNOT_AT):
        return tolerance * _course(flight, name)
    if name.startswith("slow_"):
        course, share = _course(flight, name.removeprefix("slow_")), flight.dt / ERECTION
        return np.asarray(tolerance * lfilter([share], [1.0, share - 1.0], course))
    if name.startswith("rings"):
        return _ringing(flight, name, channel)
    if name.removesuffix("_dot") != channel:
        return tolerance * _course(flight, name)
    values = flight.channel(channel)
    if name.endswith("_dot"):
        return -0.1 * np.diff(values, prepend=values[:1]) / flight.dt  # backward: nothing of the sample to come
    return 0.1 * (values - (0.0 if channel in FROM_ZERO else flight.about.get(channel, float(np.median(values)))))


def _ringing(flight: Reconstruction, name: str, channel: str) -> FloatArray:
    """A tenth of what a mode makes of a reading: of the samples before, whose noise says nothing of the next."""
    kind, hertz = name.split(":")
    w, values = 2.0 * math.pi * float(hertz), flight.channel(channel)
    above = [2.0 * DAMPING * w, 0.0] if kind == "rings" else [2.0 * DAMPING * w * w]
    b, a = bilinear(above, [1.0, 2.0 * DAMPING * w, w * w], 1.0 / flight.dt)
    return np.asarray(0.1 * lfilter([0.0, *b], [*a, 0.0], values - values[0]))


def _pressed_area(flight: Reconstruction) -> FloatArray:
    """Dynamic pressure times wing area along a record [N], N."""
    rho = density(float(np.median(flight.altitude)))
    return np.asarray(0.5 * rho * flight.channel("airspeed") ** 2 * flight.parameters[0]["wing_area"])


def _scales(flight: Reconstruction) -> dict[str, dict[str, FloatArray]]:
    """Accelerations of states per unit coefficient along a record [m/s2, rad/s2], each [N].

    A moment about one axis also turns the aircraft about the other that its product of inertia ties to it.
    """
    p, qs = flight.parameters[0], _pressed_area(flight)
    xx, zz, xz = p["inertia_xx"], p["inertia_zz"], p["inertia_xz"]
    lateral = qs * p["span"] / (xx * zz - xz**2)
    return {**{force: {force: qs / p["mass"]} for force in ("u", "v", "w")},
            "q": {"q": qs * p["chord"] / p["inertia_yy"]},
            "p": {"p": zz * lateral, "r": xz * lateral}, "r": {"r": xx * lateral, "p": xz * lateral}}


def in_what_is_left(terms: Sequence[Term]) -> tuple[Term, ...]:
    """The terms with their rows in what a flown set leaves, itself being row 0."""
    return tuple(replace(term, row=1 + j) for j, term in enumerate(terms))
