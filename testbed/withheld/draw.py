"""What is drawn: the tier of each case, its effects, forms and sizes, aircraft, air and instruments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from testbed.withheld.conditions import KINDS, Conditions
from testbed.withheld.effects import EFFECTS, Effect
from testbed.withheld.manoeuvres import PLANS
from testbed.withheld.published import DERIVATIVES
from testbed.withheld.strangers import STRANGERS
from testbed.withheld.unknown import UNKNOWN

DEVELOPMENT_SEED = 20_260_214  # sets that one may look at while writing a solver; sets for reports take the system's
SIGMAS = (0.0, 0.5, 1.5)  # m/s
GAINS = (0.85, 1.0, 1.15)  # of the inputs
SCALES = (0.75, 1.3)  # of the length of turbulence
LEVELS = (0.5, 1.0, 1.5)  # of the published noise
SHARES = {"null": 0.375, "single": 0.375, "pair": 0.125, "unknown": 0.125}
SPREAD, MASS_RANGE = 0.05, 0.02
# Numbers of which one source or none tells (assumed): height of the thrust line, +-0.15 m; what the slipstream does to
# lift and to the elevator; the delay of the downwash
TOLD_ONCE = {"engine_arm_z": 0.5, "CZ_CT": 0.5, "Cm_elevator_CT": 0.5, "Cm_alphadot": 0.1}
# What a calibrated installation is off by, in the channel's unit (assumed)
CALIBRATION = {"bias_airspeed": 0.1, "bias_alpha": 8e-4, "bias_beta": 8e-4, "bias_phi": 8e-4, "bias_theta": 8e-4,
               "bias_ax": 0.008, "bias_ay": 0.008, "bias_az": 0.01}  # fmt: skip
# What gyros are off by, what rigging leaves of symmetry, and what surfaces and their readings are off by (assumed)
RIGGING = {"bias_p": 5e-4, "bias_q": 5e-4, "bias_r": 5e-4, "CY_0": 5e-4, "Cl_0": 2e-4, "Cn_0": 2e-4,
           "elevator_offset": 1e-3, "aileron_offset": 1e-3, "rudder_offset": 1e-3}  # fmt: skip
GEARING = {"elevator_gearing": 0.01, "aileron_gearing": 0.01, "rudder_gearing": 0.01}
SMALLEST, LARGEST = 0.7, 2.2  # of the typical size
# Effects that must be larger for an ideal observer to name eight of them in 2,400 cases (`shares.py`): the spread of
# derivatives or a near rival hides smaller ones.
LARGER = {"static_stability": (2.5, 2.9), "rudder_power": (2.6, 3.1), "mass_error": (1.7, 2.5),
          "air_density": (2.1, 2.7), "early_stall": (1.3, 2.5), "drag_due_to_lift": (1.7, 2.5),
          "pitch_damping": (2.1, 2.7), "lift_slope": (2.3, 2.9), "elevator_power": (2.0, 2.7),
          "roll_damping": (2.0, 2.6), "aileron_power": (1.25, 2.2), "dihedral_effect": (1.3, 2.2),
          "tail_ice": (1.7, 2.5), "wing_ice": (1.4, 2.5)}  # fmt: skip
# Among calibrated aircraft, times as large as drawn: the height of the thrust line hides smaller ones.
LARGER_STILL = {"power_pitching": 1.8}
MOST = {"elevator_rate_limit": 0.95}


@dataclass(frozen=True)
class Fault:
    """What is wrong with a case's records (`faults.py`); `seed` draws where it begins and how long it lasts."""

    kind: str
    channel: str
    seed: int


@dataclass(frozen=True)
class Design:
    """One case: everything but the random numbers of gust and noise, which come from `seed`."""

    tier: str
    parts: tuple[tuple[str, str, float], ...]  # effect, form, size
    plan: int
    gain: float
    sigma: float
    scale: float
    level: float
    baseline: dict[str, float]
    seed: int
    target: float = 0.0  # distance to the nearest pair of library effects that an unknown effect by itself is scaled to
    fault: Fault | None = None
    gusts: str = "later"

    @property
    def conditions(self) -> Conditions:
        """Its gusts and noise."""
        return Conditions(self.sigma, self.scale, self.level, self.gusts)

    def random(self, flight: int) -> np.random.Generator:
        """What draws gust and noise of one of its flights."""
        return np.random.default_rng(np.random.SeedSequence([self.seed, flight]))


class Population(NamedTuple):
    """What a set is drawn from.

    Attributes:
        strangers: effects of the second list alone (`strangers.py`).
        spread: of derivatives, one standard deviation.
        gusts: one of `conditions.KINDS`, or "mixed": each in turn.
        calibrated: numbers of which one source or none tells are off as well, and instruments by what a calibration
            leaves: as in every set that is drawn today.
        rigged: gyros, the airframe's symmetry and surfaces are off as well: as in every set that is drawn today.
        beside: effects of the library with one of no list beside alone.
    """

    strangers: bool = False
    spread: float = SPREAD
    gusts: str = "later"
    calibrated: bool = False
    rigged: bool = False
    beside: bool = False

    @property
    def whole(self) -> bool:
        """Whether every tier is drawn, and records with faults beside them."""
        return not (self.strangers or self.beside)

    def told(self) -> dict[str, Any]:
        """What a manifest says of it: what is not as usual."""
        return {name: value for name, value in self._asdict().items() if value != getattr(USUAL, name)}

    @classmethod
    def of(cls, manifest: Mapping[str, Any]) -> Population:
        """That of a set with this manifest."""
        return cls(**{name: manifest[name] for name in cls._fields if name in manifest})

    def placed(self, drawn: Sequence[Design], seed: int) -> list[Design]:
        """Cases as they were drawn, among such aircraft and in such gusts; a given seed does the same again."""
        rng = np.random.default_rng(np.random.SeedSequence([seed, len(drawn), 5]))
        order = rng.permutation(len(drawn)) % len(KINDS)
        beside = [_about(1.0, TOLD_ONCE, rng) | _about(0.0, CALIBRATION, rng) if self.calibrated else {} for _ in drawn]
        rng = np.random.default_rng(np.random.SeedSequence([seed, len(drawn), 6]))  # older sets are drawn as they were
        if self.rigged:
            beside = [more | _about(0.0, RIGGING, rng) | _about(1.0, GEARING, rng) for more in beside]
        larger = LARGER_STILL if self.calibrated else {}
        return [replace(design, gusts=KINDS[k] if self.gusts == "mixed" else self.gusts,
                        baseline=wider(design.baseline, self.spread) | more,
                        parts=tuple((name, form, size * larger.get(name, 1.0)) for name, form, size in design.parts))
                for design, k, more in zip(drawn, order, beside, strict=True)]


USUAL = Population()


def designs(count: int, seed: int) -> list[Design]:
    """`count` cases in a random order; the same seed draws the same cases.

    Every tier goes through gust levels, effects and forms in turn, so that each is met about equally often.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, count]))
    sizes = {tier: round(share * count) for tier, share in SHARES.items()}
    sizes["null"] += count - sum(sizes.values())
    found: list[Design] = []
    for tier, size in sizes.items():
        forms = 1 if tier == "unknown" else 2
        order = [divmod(int(n), forms) for n in rng.permutation(forms * len(_pool(tier)))]
        for k in range(size):
            parts = _parts(tier, k, order, rng)
            found.append(Design(tier, parts, *conditions(SIGMAS[k % 3], rng), published_spread(rng),
                                int(rng.integers(2**62)), _target(rng) if tier == "unknown" else 0.0))
    return [found[i] for i in rng.permutation(len(found))]


def stranger_designs(count: int, seed: int) -> list[Design]:
    """`count` cases of the second list of unknown effects (`strangers.py`), each in turn, at every gust level."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, count, 4]))
    order = rng.permutation(len(STRANGERS))
    found = []
    for k in range(count):
        chosen = STRANGERS[int(order[k % len(order)])]
        sigma = SIGMAS[(k % len(order) + k // len(order)) % 3]
        found.append(Design("unknown", ((chosen.name, "same", size_of(chosen, rng)),), *conditions(sigma, rng),
                            published_spread(rng), int(rng.integers(2**62)), _target(rng)))
    return [found[i] for i in rng.permutation(count)]


def beside_designs(count: int, seed: int) -> list[Design]:
    """`count` cases of a library's effect, each in turn, with an unknown one beside it that enters nowhere it does."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, count, 7]))
    order = [divmod(int(n), 2) for n in rng.permutation(2 * len(EFFECTS))]
    found = []
    for k in range(count):
        index, form = order[k % len(order)]
        known = EFFECTS[index]
        apart = [effect for effect in UNKNOWN if not set(effect.where) & set(known.where)]
        strange = apart[int(rng.integers(len(apart)))]
        parts = tuple((effect.name, of, size_of(effect, rng))
                      for effect, of in ((known, ("same", "other")[form]), (strange, "same")))  # fmt: skip
        found.append(Design("beside", parts, *conditions(SIGMAS[k % 3], rng), published_spread(rng),
                            int(rng.integers(2**62)), _target(rng)))
    return [found[i] for i in rng.permutation(count)]


def conditions(sigma: float, rng: np.random.Generator) -> tuple[int, float, float, float, float]:
    """Plan, gain of its inputs, gust intensity and scale, noise level."""
    return (int(rng.integers(len(PLANS))), float(rng.choice(GAINS)), sigma,
            float(rng.choice(SCALES)) if sigma else 1.0, float(rng.choice(LEVELS)))


def _pool(tier: str) -> tuple[Effect, ...]:
    return UNKNOWN if tier == "unknown" else EFFECTS


def _parts(tier: str, k: int, order: list[tuple[int, int]], rng: np.random.Generator) -> tuple:
    if tier == "null":
        return ()
    pool = _pool(tier)
    index, form = order[k % len(order)]
    first = pool[index]
    chosen = [(first, ("same", "other")[form])]
    if tier == "pair":
        others = [e for e in EFFECTS if e.name != first.name and set(e.where) != set(first.where)]
        chosen.append((others[int(rng.integers(len(others)))], ("same", "other")[int(rng.integers(2))]))
    return tuple((e.name, f if tier != "unknown" else "same", size_of(e, rng)) for e, f in chosen)


def size_of(effect: Effect, rng: np.random.Generator) -> float:
    """A size of an effect, about its typical one."""
    size = effect.typical * float(rng.uniform(*LARGER.get(effect.name, (SMALLEST, LARGEST))))
    if effect.signed and rng.random() < 0.3:
        size = -size
    return min(size, MOST.get(effect.name, size))


def _target(rng: np.random.Generator) -> float:
    """A third within 5 to 8, the rest beyond, evenly in the logarithm."""
    low, high = (5.0, 8.0) if rng.random() < 1.0 / 3.0 else (8.0, 80.0)
    return float(low * (high / low) ** rng.random())


def wider(baseline: Mapping[str, float], spread: float) -> dict[str, float]:
    """The same aircraft with derivatives that are off by as many deviations of another spread."""
    if spread == SPREAD:
        return dict(baseline)
    return {name: 1.0 + (factor - 1.0) * spread / SPREAD if name in DERIVATIVES else factor
            for name, factor in baseline.items()}  # fmt: skip


def published_spread(rng: np.random.Generator) -> dict[str, float]:
    """Factors on derivatives (5 %, one standard deviation, not beyond three) and on the mass (uniform)."""
    spread = _about(1.0, dict.fromkeys(DERIVATIVES, SPREAD), rng)
    return {**spread, "mass": 1.0 + float(rng.uniform(-MASS_RANGE, MASS_RANGE))}


def _about(mean: float, spreads: Mapping[str, float], rng: np.random.Generator) -> dict[str, float]:
    """Numbers about a mean by name, of such standard deviations, not beyond three."""
    return {name: mean + size * float(np.clip(rng.standard_normal(), -3.0, 3.0)) for name, size in spreads.items()}
