"""The time courses of generic discrepancies along a record: what they push, and what instruments and surfaces read."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from scipy.signal import bilinear, lfilter
from scipy.special import eval_legendre

from icing_env.atmosphere import density
from icing_env.record import FloatArray
from sim2real.library.knots import hat, knots
from sim2real.library.terms import (
    AIR_SIZE,
    BEYOND,
    DAMPING,
    DEVIATION,
    EASED,
    ERECTION,
    FLOW_RATES,
    FROM_ZERO,
    GENERIC,
    GENERIC_SIZE,
    KNOT_AT,
    PATH_SIZE,
    SECOND_ORDER,
    THRUST_SIZE,
    WASHED,
    WIND,
    WIND_CHANGE,
    WIND_SIZE,
    Term,
)
from sim2real.prediction.predictor import Push
from sim2real.records.channels import TOLERANCE
from sim2real.records.powers import thrust_per_power
from sim2real.records.reconstruct import Reconstruction


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
    out = []
    for side in sides:
        thrust = flight.controls[f"power_{side}"] * per_power
        series = THRUST_SIZE * thrust * _course(flight, course or "1")
        turn = p["engine_arm_y"] / (xx * zz - xz**2) * (1.0 if side == "left" else -1.0) * series
        out += [Push(term.row, state, made, False) for state, made in _by_thrust(flight, series).items()]
        out += [Push(term.row, "r", xx * turn, False), Push(term.row, "p", xz * turn, False),
                Push(term.row, f"thrust_{side}", series, True)]
    return out


def _by_air(flight: Reconstruction) -> dict[str, FloatArray]:
    """Accelerations of states that the air makes: what is felt, less what thrust does; in pitch it balances that."""
    thrust = _by_thrust(flight, _thrust(flight))
    return {"u": flight.channel("ax") - thrust["u"], "v": flight.channel("ay"),
            "w": flight.channel("az") - thrust["w"], "q": -thrust["q"]}  # fmt: skip


def _by_thrust(flight: Reconstruction, thrust: FloatArray) -> dict[str, FloatArray]:
    """Accelerations of states in the plane of symmetry that a thrust makes [N], slipstream included."""
    p = flight.parameters[0]
    pitch = p["Cm_CT"] + p["Cm_elevator"] * p["Cm_elevator_CT"] * flight.controls["elevator"]  # per CT, as CZ_CT is
    return {"u": thrust / p["mass"], "w": p["CZ_CT"] / p["mass"] * thrust,
            "q": (p["engine_arm_z"] + p["chord"] * pitch) / p["inertia_yy"] * thrust}


def _wind_pushes(flight: Reconstruction, term: Term) -> list[Push]:
    """A wind along or across the aircraft that gathers: to what flies in it, an acceleration that nothing feels.

    Or air that is denser with height.
    """
    if term.name == "height":
        denser = AIR_SIZE * _course(flight, term.name)
        return [Push(term.row, state, denser * made, False) for state, made in _by_air(flight).items()]
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
        return _thrust(flight) / _pressed_area(flight)
    if factor == "height":
        return flight.channel("altitude") if flight.has("altitude") else flight.altitude
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


def _thrust(flight: Reconstruction) -> FloatArray:
    """Of both engines along a record [N], N."""
    per_power = thrust_per_power(flight.parameters[0], flight.channel("airspeed"), flight.channel("alpha"))
    return np.asarray((flight.controls["power_left"] + flight.controls["power_right"]) * per_power)


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
