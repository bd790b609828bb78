"""What is tried against a record: the model, its own uncertainty, every effect at several sizes, and the unknown.

The unknown is a set of generic discrepancies that stand for whatever the library lacks.

Every candidate is one row of a batch; rows mean the same in every record, so that evidence of several records adds.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from icing_env import effects
from icing_env.atmosphere import density
from icing_env.effects import Effect, Parameter
from icing_env.record import FloatArray
from icing_env.types import DERIVATIVE_NAMES
from sim2real.channels import LATERAL, MEASURED, SURFACES, TOLERANCE
from sim2real.predictor import Push
from sim2real.reconstruct import Reconstruction

# The published sets of derivatives differ by about 5 % where they are well identified: the standard deviation of the
# model's own uncertainty. A record's mass is known to about 1 % (assumed).
SPREAD, MASS_SPREAD = 0.05, 0.01
LAG_SPREAD = 0.02  # s, of an actuator's lag that nobody has measured (assumed)
THRUST_SPREAD = 0.3  # of thrust that was not recorded and is balanced against the model's own drag (assumed)
FILTER_SPREAD, VANE_SPREAD = 0.1, 0.005  # of the recording's cut-off, and s: channels are in step to a few ms (assumed)
VANE_SCALE = 0.015  # of a flow vane's reading, upwash included (assumed)
NUISANCE_STEP = 1.0  # standard deviations at which the derivative with respect to a nuisance is taken


@dataclass(frozen=True)
class Nuisance:
    """One direction in which the model may be wrong without that being a gap; prior N(0, 1) in its own unit."""

    name: str
    parameter: str  # of PARAMETERS; several joined by +
    factor: float  # relative standard deviation (or absolute, where `absolute`)
    absolute: bool = False
    only: str = ""  # where the power comes from, if it holds for such records alone
    follows: bool = True  # whether the model that all is flown about follows it

    def apply(self, rows: NDArray, row: int | slice, power_from: str, size: float | FloatArray = NUISANCE_STEP) -> None:
        """Move one row of PARAMETERS (or several, by as many sizes) by `size` standard deviations in this direction."""
        if self.only and self.only != power_from:
            return
        step = size * self.factor
        for name in self.parameter.split("+"):
            rows[name][row] = rows[name][row] + step if self.absolute else rows[name][row] * (1.0 + step)


def shifted(parameters: NDArray, directions: tuple[Nuisance, ...], sizes: FloatArray, power_from: str) -> NDArray:
    """One PARAMETERS row moved in every nuisance direction by `sizes` standard deviations."""
    out = parameters.copy()
    for nuisance, size in zip(directions, sizes, strict=True):
        nuisance.apply(out, 0, power_from, float(size))
    return out


@dataclass(frozen=True)
class Family:
    """One parameter of one effect, the others neutral: rows `first + i` at `nodes[i]`."""

    effect: Effect
    parameter: Parameter
    nodes: tuple[float, ...]
    rows: tuple[int, ...]


@dataclass(frozen=True)
class Term:
    """A generic discrepancy: `target` (force, moment or sensor component) with a time course made of the record."""

    component: str
    name: str
    target: str
    row: int


@dataclass(frozen=True)
class Bank:
    """All rows: 0 is the model, then nuisances, effects, generic terms."""

    nuisances: tuple[Nuisance, ...]
    families: tuple[Family, ...]
    terms: tuple[Term, ...]
    size: int
    excluded: Mapping[str, str] = field(default_factory=dict)  # effect: why it is not tried


def nuisances() -> tuple[Nuisance, ...]:
    """Derivatives by `SPREAD`, mass, the actuators' lags, the vanes' scales, the timing of channels, guessed thrust."""
    derivatives = [Nuisance(name, name, SPREAD) for name in DERIVATIVE_NAMES]
    # flown about a lag that has taken an effect's place, the two no longer look alike, and neither gives way
    lags = [Nuisance(f"{s}_lag", f"{s}_lag", LAG_SPREAD, True, follows=False) for s in SURFACES]
    guessed = Nuisance("thrust", "thrust_factor_left+thrust_factor_right", THRUST_SPREAD, only="balance")
    timing = (Nuisance("filter_frequency", "filter_frequency", FILTER_SPREAD),
              Nuisance("vane_lag", "vane_lag", VANE_SPREAD, True))
    vanes = [Nuisance(f"scale_{c}", f"scale_{c}", VANE_SCALE, True, follows=False) for c in ("alpha", "beta")]
    return (*derivatives, Nuisance("mass", "mass", MASS_SPREAD), *lags, guessed, *vanes, *timing)


def nodes(parameter: Parameter) -> tuple[float, ...]:
    """Sizes at which an effect is flown: its typical size, multiples of it, and the ends of its range."""
    reach = parameter.typical or 0.5 * max(parameter.high, -parameter.low) * 0.5
    wanted = [parameter.low, parameter.high, reach, -reach, 2.5 * reach, -2.5 * reach]
    found: list[float] = []
    span = parameter.high - parameter.low
    for value in sorted(wanted, key=lambda v: abs(abs(v) - abs(reach))):
        inside = parameter.low - 1e-12 <= value <= parameter.high + 1e-12
        if inside and abs(value - parameter.neutral) > 0.02 * span and all(abs(value - v) > 0.06 * span for v in found):
            found.append(value)
    return tuple(sorted(found))


def bank(without: Iterable[str] = ()) -> Bank:
    """The candidates of the whole library less `without`."""
    noise, families, terms = nuisances(), [], []
    row = 1 + len(noise)
    for effect in effects.LIBRARY.values():
        if effect.name in without or effect.name == "turbulence":
            continue
        for parameter in effect.parameters:
            sizes = nodes(parameter)
            families.append(Family(effect, parameter, sizes, tuple(range(row, row + len(sizes)))))
            row += len(sizes)
    for component, target, names in (*GENERIC, *BEYOND):
        for name in names:
            terms.append(Term(component, name, target, row))
            row += 1
    return Bank(noise, tuple(families), tuple(terms), row)


def parameter_rows(flight: Reconstruction, candidates: Bank) -> NDArray:
    """PARAMETERS of every row for one record."""
    base = flight.parameters
    rows = np.repeat(base, candidates.size)
    for j, nuisance in enumerate(candidates.nuisances, start=1):
        nuisance.apply(rows, j, flight.power_from)
    for family in candidates.families:
        chosen = list(family.rows)
        rows[chosen] = effects.with_effects(
            rows[chosen], {family.effect.name: {family.parameter.name: np.array(family.nodes)}})
    return rows


# Generic discrepancies: component, what they act on, time courses ("1" constant, products of deviations, "time").
GENERIC: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("x_force", "u", ("1", "alpha", "alpha*alpha", "airspeed", "elevator", "time")),
    ("z_force", "w", ("1", "alpha", "q", "elevator", "alpha*alpha", "airspeed", "time")),
    ("pitching_moment", "q", ("1", "alpha", "q", "elevator", "alpha*alpha", "alpha*elevator", "airspeed", "time")),
    ("y_force", "v", ("1", "beta", "p", "r", "rudder", "alpha*beta", "time")),
    ("rolling_moment", "p", ("1", "beta", "p", "r", "aileron", "rudder", "alpha*beta", "time")),
    ("yawing_moment", "r", ("1", "beta", "p", "r", "aileron", "rudder", "alpha*beta", "time")),
    *((f"sensor:{c}", c, ("1", c, f"{c}_dot", "time")) for c in MEASURED[:8]),
    *((f"sensor:{c}", c, ("1", c, "time")) for c in MEASURED[8:12]),
)
# Terms that the effect `discrepancy` cannot fly, and that show where a gap lies nevertheless: across axes, of higher
# order, in the paths of surfaces (no lags: actuators have their own, and channels are in step to a few ms at best) and
# in the engines.
BEYOND: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("x_force", "u", ("beta*beta", "rudder*rudder")),
    ("z_force", "w", ("beta*beta", "alpha*alpha*alpha")),
    ("pitching_moment", "q", ("beta*beta", "alpha*alpha*alpha", "aileron", "p", "r", "power")),
    ("y_force", "v", ("aileron", "alpha*p", "alpha*rudder")),
    ("rolling_moment", "p", ("alpha", "q", "alpha*p", "aileron*aileron*aileron", "power")),
    ("yawing_moment", "r", ("alpha", "q", "alpha*p", "alpha*aileron", "alpha*rudder", "power")),
    ("sensor:airspeed", "airspeed", ("alpha", "beta")),
    ("sensor:alpha", "alpha", ("airspeed", "q")), ("sensor:beta", "beta", ("alpha", "p", "r")),
    ("sensor:p", "p", ("q", "r", "az")), ("sensor:q", "q", ("p", "r", "az")), ("sensor:r", "r", ("p", "q", "az")),
    ("sensor:phi", "phi", ("slow_phi", "slow_ay")), ("sensor:theta", "theta", ("slow_theta", "slow_ax")),
    ("sensor:ax", "ax", ("q_dot", "alpha")), ("sensor:ay", "ay", ("p_dot", "r_dot")),
    ("sensor:az", "az", ("q", "q_dot")),
    *((f"{s}_path", f"{s}_path", ("1", "position", "acceleration", "position*position*position", "direction",
                                  "airspeed", flow)) for s, flow in zip(SURFACES, ("alpha", "p", "beta"), strict=True)),
    ("propulsion", "thrust", ("both", "both*airspeed", "left", "left*airspeed")),
)  # fmt: skip
# One standard deviation of a generic coefficient with a time course of unit size (assumed: a quarter of the change
# that typical effects of the library make).
GENERIC_SIZE = {"u": 0.008, "w": 0.03, "v": 0.01, "p": 0.002, "q": 0.015, "r": 0.002}
PATH_SIZE = {"1": 0.5 * math.pi / 180.0, "position": 0.1, "acceleration": 0.0025,
             "position*position*position": 0.1, "direction": 0.25 * math.pi / 180.0}  # rad, 1, s2, 1, rad (assumed)
THRUST_SIZE = {"both": 0.1, "both*airspeed": 0.1, "left": 0.1, "left*airspeed": 0.1}  # (assumed)
DEVIATION = {"alpha": 0.05, "beta": 0.05, "q": 0.1, "p": 0.2, "r": 0.1, "elevator": 0.04, "aileron": 0.08,
             "rudder": 0.05, "airspeed": 5.0, "power": 0.2, "phi": 0.2, "theta": 0.1, "ax": 1.0, "ay": 1.0, "az": 2.0,
             "p_dot": 1.0, "q_dot": 0.5, "r_dot": 0.3}  # fmt: skip  # what counts as one unit of a regressor (assumed)
ERECTION = 30.0  # s in which a vertical gyro follows a false vertical (assumed)


def pushes(flight: Reconstruction, candidates: Bank) -> tuple[Push, ...]:
    """The time courses of the generic terms along one record."""
    scale = _scales(flight)
    out: list[Push] = []
    for term in candidates.terms:
        if term.target == "thrust":
            out += _thrust_pushes(flight, term)
        elif term.component.startswith("sensor:"):
            out.append(Push(term.row, term.target, _sensor_course(flight, term.name, term.target), True))
        elif not term.target.endswith("_path"):
            series = GENERIC_SIZE[term.target] * scale[term.target] * _course(flight, term.name)
            out.append(Push(term.row, term.target, series, False))
    return tuple(out)


def _thrust_pushes(flight: Reconstruction, term: Term) -> list[Push]:
    """A share of both engines' thrust or of the left one's: felt, and read where recorded."""
    p, sides = flight.parameters[0], ("left", "right") if term.name.startswith("both") else ("left",)
    speed = flight.channel("airspeed")
    per_power = p["propeller_efficiency"] / np.sqrt(speed**2 + p["propeller_static_speed"] ** 2)
    out = []
    for side in sides:
        thrust = flight.controls[f"power_{side}"] * per_power
        series = THRUST_SIZE[term.name] * thrust
        if term.name.endswith("*airspeed"):
            series = series * (speed - np.median(speed)) / DEVIATION["airspeed"]
        yaw = p["engine_arm_y"] / p["inertia_zz"] * (1.0 if side == "left" else -1.0)
        out += [Push(term.row, "u", series / p["mass"], False), Push(term.row, "r", yaw * series, False),
                Push(term.row, "q", p["engine_arm_z"] / p["inertia_yy"] * series, False),
                Push(term.row, f"thrust_{side}", series, True)]
    return out


def path_course(flight: Reconstruction, position: FloatArray, name: str) -> FloatArray:
    """What a generic term adds to a surface's predicted position [rad]; loads push it by what the air does."""
    rate = np.gradient(position, flight.dt)
    reach = max(float(np.max(np.abs(position))), 1e-3)
    course = {"1": np.ones(len(position)), "position": position, "acceleration": np.gradient(rate, flight.dt),
              "position*position*position": position**3 / reach**2, "direction": np.tanh(rate / 0.02)}  # fmt: skip
    return PATH_SIZE[name] * course[name] if name in course else PATH_SIZE["1"] * _course(flight, name)


def _course(flight: Reconstruction, name: str) -> FloatArray:
    """Product of the deviations named, in units of DEVIATION; a ramp from -1 to 1 for time."""
    n = len(flight.time)
    if name == "1":
        return np.ones(n)
    if name == "time":
        return np.linspace(-1.0, 1.0, n)
    out = np.ones(n)
    for factor in name.split("*"):
        values = _values(flight, factor)
        out = out * (values - np.median(values)) / DEVIATION[factor]
    return out


def _values(flight: Reconstruction, factor: str) -> FloatArray:
    """A regressor: a control, both engines' power over its mean, a channel, or its derivative from the past."""
    if factor == "power":
        both = flight.controls["power_left"] + flight.controls["power_right"]
        return np.asarray(both / max(float(np.mean(both)), 1.0))
    if factor in flight.controls:
        return flight.controls[factor]
    if factor.endswith("_dot"):
        values = flight.channel(factor.removesuffix("_dot"))
        return np.diff(values, prepend=values[:1]) / flight.dt
    return flight.channel(factor)


def _sensor_course(flight: Reconstruction, name: str, channel: str) -> FloatArray:
    """Bias of one tolerance, scale error of 10 %, a lag of 0.1 s, or a drift over the record."""
    tolerance = TOLERANCE[channel]
    if name in ("1", "time"):
        return tolerance * _course(flight, name)
    if name.startswith("slow_"):
        course, share = _course(flight, name.removeprefix("slow_")), flight.dt / ERECTION
        return np.asarray(tolerance * lfilter([share], [1.0, share - 1.0], course))
    if name.removesuffix("_dot") != channel:
        return tolerance * _course(flight, name)
    values = flight.channel(channel)
    if name.endswith("_dot"):
        return -0.1 * np.diff(values, prepend=values[:1]) / flight.dt  # backward: nothing of the sample to come
    return 0.1 * (values - (0.0 if channel in ("alpha", "beta", "p", "q", "r") else np.median(values)))


def unit_of(term: str, component: str) -> float:
    """What a generic coefficient of one stands for: of a force's or moment's coefficient, or a reading, per regressor.

    Deviations are in the units of their channels, power in shares of its mean.
    """
    if component.endswith("_path"):
        return PATH_SIZE[term] if term in PATH_SIZE else PATH_SIZE["1"] / DEVIATION[term]
    if component == "propulsion":
        return THRUST_SIZE[term] / (DEVIATION["airspeed"] if term.endswith("*airspeed") else 1.0)
    target = next(target for where, target, _ in GENERIC if where == component)
    if component.startswith("sensor:"):
        if term not in ("1", "time") and term.removesuffix("_dot") == target:
            return 0.1
        return TOLERANCE[target] / DEVIATION.get(term.removeprefix("slow_"), 1.0)
    size = GENERIC_SIZE[target]
    for factor in term.split("*"):
        size /= DEVIATION.get(factor, 1.0)
    return size


def _scales(flight: Reconstruction) -> dict[str, float]:
    """Acceleration per unit coefficient [m/s2, rad/s2] at the record's median condition."""
    p = flight.parameters[0]
    rho = density(float(np.median(flight.altitude)))
    qs = 0.5 * rho * float(np.median(flight.channel("airspeed"))) ** 2 * p["wing_area"]
    return {"u": qs / p["mass"], "v": qs / p["mass"], "w": qs / p["mass"], "p": qs * p["span"] / p["inertia_xx"],
            "q": qs * p["chord"] / p["inertia_yy"], "r": qs * p["span"] / p["inertia_zz"]}  # fmt: skip


def not_testable(flight_list: list[Reconstruction], candidates: Bank) -> dict[str, str]:
    """Effects that none of the records can show, for want of channels, with the reason."""
    out = {"turbulence": "gust intensity is estimated with the noise, as part of what no model is expected to know"}
    commands = {name for flight in flight_list for name in flight.commands}
    has_beta = any(flight.has("beta") and flight.has("p") and flight.has("r") for flight in flight_list)
    torque = any(flight.power_from == "torque" for flight in flight_list)
    for family in candidates.families:
        effect = family.effect
        for surface in SURFACES:
            if f"{surface}_path" in effect.enters_at and f"{surface}_command" not in commands:
                out[effect.name] = f"needs {surface}_command: positions alone do not show how it follows"
        if effect.name == "spool_lag" and not (torque and "throttle_left" in commands):
            out[effect.name] = "needs torque and throttle"
        lateral = {"y_force", "rolling_moment", "yawing_moment", *(f"sensor:{c}" for c in LATERAL)}
        enters = set(effect.enters_at)
        if not has_beta and enters <= lateral | {"mass", "propulsion"} and enters & lateral:
            out[effect.name] = "needs beta, p and r"
    return out
