"""What is tried against a record: the model, its own uncertainty, every effect at several sizes, and the unknown.

The unknown is a set of generic discrepancies that stand for whatever the library lacks.

Every candidate is one row of a batch; rows mean the same in every record, so that evidence of several records adds.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from icing_env import aircraft, effects
from icing_env.effects import Effect, Parameter
from icing_env.parameters import as_bytes, copied
from icing_env.record import FloatArray
from icing_env.types import DERIVATIVE_NAMES
from sim2real.library.terms import BEYOND, GENERIC, Term
from sim2real.records.channels import LATERAL, SURFACES
from sim2real.records.reconstruct import Reconstruction

# The published sets of derivatives differ by about 5 % where they are well identified: the standard deviation of the
# model's own uncertainty. Weak ones differ by more, UIUC's from those of NASA's flights even by factors: by 15 % and
# 30 % (assumed), and the yawing moment of ailerons has either sign. A record's mass is known to about 1 % (assumed).
SPREAD, MASS_SPREAD = 0.05, 0.01
WEAK = (dict.fromkeys(("CZ_q", "CZ_elevator", "CY_p", "CY_r", "CY_rudder", "Cn_p"), 0.15)
        | dict.fromkeys(("Cl_r", "Cl_rudder"), 0.3) | {"Cn_aileron": 3.0})  # fmt: skip
THRUST_SPREAD = 0.3  # of power that was not recorded and is told by the levers (assumed)
FILTER_SPREAD = 0.1  # of the recording's cut-off: channels are in step to a few ms (assumed)
# s, s, rad s2/m: instruments that no paper describes may as well have no lag, and no boom (assumed)
VANE_SPREAD, PITOT_SPREAD, BOOM_SPREAD = 0.008, 0.05, 1e-4
# Numbers of which one source or none tells: heights of thrust line and c.g. (0.15 m of 0.3), what the slipstream does
# to lift and to the elevator (a simulator built on a published set has neither), what part of the pitch damping comes
# from the delay of the downwash (a quasi-steady set has it in Cm_q), how fast engines spool; assumed
TOLD_ONCE = {"engine_arm_z": 0.5, "CZ_CT": 0.5, "Cm_elevator_CT": 0.5, "Cm_alphadot": 0.1, "spool_time": 0.1}
SIGNED = ("engine_arm_z", "CZ_CT", "Cm_elevator_CT", "Cn_aileron")  # so uncertain that they may have the other sign
# Of the readings of flow vanes, upwash included, and of gyros (assumed)
SCALES = {"scale_alpha": 0.015, "scale_beta": 0.015, "scale_p": 0.005, "scale_q": 0.005, "scale_r": 0.005}
# What a calibrated installation is still off by, in the channel's unit (assumed); of gyros, what attitudes say of them
# in NASA's records of the aircraft (0.3 to 1.2 mrad/s of q in 6 to 20 s)
CALIBRATION = {"bias_airspeed": 0.1, "bias_alpha": 8e-4, "bias_beta": 8e-4, "bias_phi": 8e-4, "bias_theta": 8e-4,
               "bias_p": 5e-4, "bias_q": 5e-4, "bias_r": 5e-4, "bias_ax": 0.008, "bias_ay": 0.008, "bias_az": 0.01}
# What rigging leaves of symmetry, about 1 mrad of aileron and rudder (Cn_0 is 5e-4 in NASA's records: Klein & Morelli,
# Aircraft System Identification, 2006, example 5.1), and of agreement between a surface's command and its reading
RIGGING = {"CY_0": 5e-4, "Cl_0": 2e-4, "Cn_0": 2e-4}
PICK_UPS = {f"{surface}_{of}": size for surface in SURFACES for of, size in (("offset", 1e-3), ("gearing", 0.01))}
INSTRUMENTS = SCALES | CALIBRATION | PICK_UPS  # alike in all flights
LEAST = 0.1  # of any other published value: a filter or a thrust with another sign does not fly
NODES, FEW = 4, 2  # sizes of a parameter; and where it only has to be seen whether it is worth more
NUISANCE_STEP = 0.1  # standard deviations at which the derivative with respect to a nuisance is taken


@dataclass(frozen=True)
class Nuisance:
    """One direction in which the model may be wrong without that being a gap; prior N(0, 1) in its own unit.

    `about`: what the model has of a number that is SIGNED. A part of what it was moved to would be no deviation: of a
    number two deviations of a half off there is nothing left to move by.
    """

    name: str
    parameter: str  # of PARAMETERS; several joined by +
    factor: float  # relative standard deviation (or absolute, where `absolute`)
    absolute: bool = False
    only: str = ""  # where the power comes from, if it holds for such records alone
    follows: bool = True  # whether the model that all is flown about follows it
    about: float | None = None

    def apply(self, rows: NDArray, row: int | slice, power_from: str, size: float | FloatArray = NUISANCE_STEP) -> None:
        """Move one row of PARAMETERS (or several, by as many sizes) by `size` standard deviations in this direction."""
        if self.only and self.only != power_from:
            return
        step = size * self.factor
        for name in self.parameter.split("+"):
            now = rows[name][row]
            if self.absolute:
                moved = now + step
            elif self.about is not None:
                moved = now + step * self.about
            else:
                moved = now * np.maximum(1.0 + step, LEAST)
            rows[name][row] = np.maximum(moved, 0.0) if name.endswith("_lag") else moved


def shifted(parameters: NDArray, directions: tuple[Nuisance, ...], sizes: FloatArray, power_from: str) -> NDArray:
    """One PARAMETERS row moved in every nuisance direction by `sizes` standard deviations."""
    out = copied(parameters)
    for nuisance, size in zip(directions, sizes, strict=True):
        nuisance.apply(out, 0, power_from, float(size))
    return out


@dataclass(frozen=True)
class Family:
    """One parameter of one effect between `low` and `high`, the others neutral, flown in `rows` at `nodes`."""

    effect: Effect
    parameter: Parameter
    nodes: tuple[float, ...]
    rows: tuple[int, ...]
    low: float
    high: float


@dataclass(frozen=True)
class Bank:
    """All rows: 0 is the model, then nuisances, effects, generic terms."""

    nuisances: tuple[Nuisance, ...]
    families: tuple[Family, ...]
    terms: tuple[Term, ...]
    size: int
    clean: Mapping[str, float] = field(default_factory=dict)  # component: what terms there explain without a gap

    @property
    def linear(self) -> tuple[int, ...]:
        """Rows whose signatures are taken as linear: nuisances, then generic terms."""
        return (*range(1, 1 + len(self.nuisances)), *(term.row for term in self.terms))


def of_model(directions: Iterable[Nuisance], row: NDArray) -> tuple[Nuisance, ...]:
    """The same for a model with such PARAMETERS."""
    return tuple(replace(n, about=float(row[n.parameter][0])) if n.name in SIGNED and not n.absolute else n
                 for n in directions)  # fmt: skip


def nuisances() -> tuple[Nuisance, ...]:
    """Derivatives by `SPREAD`, mass, what levers or one source tell, instruments and the recorder."""
    derivatives = [Nuisance(name, name, WEAK.get(name, SPREAD)) for name in DERIVATIVE_NAMES]
    guessed = Nuisance("thrust", "thrust_factor_left+thrust_factor_right", THRUST_SPREAD, only="throttle")
    known = {"vane_lag": VANE_SPREAD, "pitot_lag": PITOT_SPREAD, "boom_gain": BOOM_SPREAD}
    timing = (Nuisance("filter_frequency", "filter_frequency", FILTER_SPREAD),
              *(Nuisance(name, name, spread, True) for name, spread in known.items()))
    told_once = [Nuisance(name, name, spread) for name, spread in TOLD_ONCE.items()]
    rigged = [Nuisance(name, name, spread, True, follows=False) for name, spread in RIGGING.items()]
    off = [Nuisance(name, name, spread, True, follows=name in PICK_UPS) for name, spread in INSTRUMENTS.items()]
    every = (*derivatives, *rigged, Nuisance("mass", "mass", MASS_SPREAD), guessed, *told_once, *off, *timing)
    return of_model(every, aircraft.load())


def nodes(parameter: Parameter) -> tuple[float, ...]:
    """Up to NODES sizes at which an effect is flown: its typical size, both signs, the ends of its range, multiples."""
    reach = parameter.typical or 0.5 * max(parameter.high, -parameter.low) * 0.5
    found: list[float] = []
    span = parameter.high - parameter.low
    for value in (reach, -reach, parameter.low, parameter.high, 2.5 * reach, -2.5 * reach):
        inside = parameter.low - 1e-12 <= value <= parameter.high + 1e-12
        if inside and abs(value - parameter.neutral) > 0.02 * span and all(abs(value - v) > 0.06 * span for v in found):
            found.append(value)
    return tuple(sorted(found[:NODES]))


# Sizes of effects whose signatures bend so much that one polynomial does not follow them: piece by piece.
PIECES: dict[tuple[str, str], tuple[tuple[float, ...], ...]] = {
    ("early_stall", "angle"): ((-0.03, 0.03, 0.06), (0.06, 0.07, 0.08), (0.08, 0.09, 0.1), (0.1, 0.115, 0.13),
                               (0.13, 0.14, 0.15)),
    ("elevator_rate_limit", "reduction"): ((0.2, 0.4, 0.6), (0.6, 0.75, 0.85), (0.85, 0.92, 0.98)),
    **{(f"{surface}_lag", "extra"): ((-0.04, 0.06, 0.12), (0.12, 0.2, 0.3), (0.3, 0.4, 0.5)) for surface in SURFACES},
    ("vane_lag", "extra"): ((-0.02, 0.03, 0.08), (0.08, 0.14, 0.22), (0.22, 0.35, 0.5)),
}


# Below these sizes an effect makes what another one does: of drag that grows, lost suction says as much.
FROM = {("ice_drag", "growth"): 1.0}


def _pieces(effect: Effect, parameter: Parameter) -> list[tuple[tuple[float, ...], float, float]]:
    """Nodes and ends of every piece of a parameter's range."""
    parts = PIECES.get((effect.name, parameter.name))
    if parts is None:
        return [(nodes(parameter), FROM.get((effect.name, parameter.name), parameter.low), parameter.high)]
    ends = [parameter.low, *(part[-1] for part in parts[:-1]), parameter.high]
    return [(part, low, high) for part, low, high in zip(parts, ends, ends[1:], strict=False)]


def piece_at(family: Family, size: float, families: Iterable[Family]) -> Family:
    """The family of the same parameter, of those in a bank, in whose piece of the range a size lies."""
    inside = float(np.clip(size, family.parameter.low, family.parameter.high))
    return next((f for f in families if f.effect is family.effect and f.parameter is family.parameter
                 and f.low <= inside <= f.high), family)  # fmt: skip


def unbroken(families: Iterable[Family]) -> list[Family]:
    """One family for every parameter, over its whole range, without rows; nodes as if nothing bent."""
    whole = {(f.effect.name, f.parameter.name): f for f in families}
    return [replace(f, nodes=nodes(f.parameter), rows=(), low=f.parameter.low, high=f.parameter.high)
            for f in whole.values()]


def at_few_sizes(candidates: Bank, untestable: Iterable[str] = ()) -> Bank:
    """Every parameter at the FEW sizes nearest to its typical one, and no generic terms: to see what is worth more."""
    gone, families, row = set(untestable), [], 1 + len(candidates.nuisances)
    for family in unbroken(f for f in candidates.families if f.effect.name not in gone):
        reach = abs(family.parameter.typical) or 0.25 * max(family.high, -family.low)
        own = tuple(sorted(sorted(family.nodes, key=lambda size: abs(abs(size) - reach))[:FEW]))
        families.append(replace(family, nodes=own, rows=tuple(range(row, row + len(own)))))
        row += len(own)
    return replace(candidates, families=tuple(families), terms=(), size=row)


def bank(without: Iterable[str] = (), beside: Iterable[Nuisance] = ()) -> Bank:
    """The candidates of the whole library less `without`; `beside`: nuisances beside the usual ones."""
    noise, families, terms = (*nuisances(), *beside), [], []
    row = 1 + len(noise)
    for effect in effects.LIBRARY.values():
        if effect.name in without or effect.name == "turbulence":
            continue
        for parameter in effect.parameters:
            for sizes, low, high in _pieces(effect, parameter):
                families.append(Family(effect, parameter, sizes, tuple(range(row, row + len(sizes))), low, high))
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
        own = slice(family.rows[0], family.rows[-1] + 1)
        as_bytes(rows)[own] = as_bytes(effects.with_effects(
            rows[own], {family.effect.name: {family.parameter.name: np.array(family.nodes)}}))
    return rows


def not_testable(flight_list: list[Reconstruction], candidates: Bank) -> dict[str, str]:
    """Effects that none of the records can show, for want of channels, with the reason."""
    out = {"turbulence": "gust intensity is estimated with the noise, as part of what no model is expected to know"}
    commands = {name for flight in flight_list for name in flight.commands}
    has_beta = any(flight.has("beta") and flight.has("p") and flight.has("r") for flight in flight_list)
    torque = any(flight.shaft_powers for flight in flight_list)
    balanced = all(flight.power_from == "balance" for flight in flight_list)
    for family in candidates.families:
        effect = family.effect
        for surface in SURFACES:
            if f"{surface}_path" in effect.enters_at and f"{surface}_command" not in commands:
                out[effect.name] = f"needs {surface}_command: positions alone do not show how it follows"
        if effect.name == "spool_lag" and not (torque and "throttle_left" in commands):
            out[effect.name] = "needs torque and throttle"
        if balanced and set(effect.enters_at) in ({"x_force"}, {"propulsion"}, {"sensor:ax"}):
            out[effect.name] = "needs thrust, torque or levers: the axial acceleration stands for them"
        lateral = {"y_force", "rolling_moment", "yawing_moment", *(f"sensor:{c}" for c in LATERAL)}
        enters = set(effect.enters_at)
        if not has_beta and enters <= lateral | {"mass", "propulsion"} and enters & lateral:
            out[effect.name] = "needs beta, p and r"
    return out
