"""What a diagnosis changes in the model, and how to fly it: known effects at their sizes, the unknown as its terms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from icing_env import effects
from icing_env.effects.discrepancy import PATHS
from icing_env.record import FloatArray
from sim2real.baseline.quasi_steady import NUMBER, lacks_the_lag
from sim2real.closing import gap
from sim2real.closing.discrepancy import Description
from sim2real.posterior.hypotheses import Hypothesis, Posterior
from sim2real.posterior.sets import SetFit
from sim2real.posterior.widened import SIZES
from sim2real.prediction.windows import FREE, cut
from sim2real.records.channels import SURFACES
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.evidence import Evidence

OWN = "derivatives"  # the effect that flies the model's own numbers
Values = dict[str, dict[str, float]]


@dataclass(frozen=True)
class Remedy:
    """Values by effect that are put into the model; none where there is no gap.

    Attributes:
        values: as `icing_env.effects.with_effects` takes them.
        covariance: of the fitted numbers, those of the set first, then the unknown's terms; None where none is known.
        own: the model's own numbers that are flown with them: relative change and its standard error, by name.
        through: surfaces that follow their commands though nothing of it enters there.
    """

    values: Values = field(default_factory=dict)
    covariance: FloatArray | None = None
    own: dict[str, tuple[float, float]] = field(default_factory=dict)
    through: tuple[str, ...] = ()

    def __call__(self, parameters: NDArray) -> NDArray:
        """PARAMETERS with the values in them."""
        return effects.with_effects(parameters, self.values) if self.values else parameters

    @property
    def paths(self) -> tuple[str, ...]:
        """Surfaces that follow their commands: those whose actuator is part of it."""
        entered = {component for name in self.values if name != "discrepancy"
                   for component in effects.get(name).enters_at}  # fmt: skip
        bent = self.values.get("discrepancy", {})
        return tuple(surface for surface in SURFACES if surface in self.through or f"{surface}_path" in entered
                     or any(bent.get(number) for number in PATHS[surface]))  # fmt: skip

    @property
    def command(self) -> str:
        """A flight of the aircraft as diagnosed."""
        said = "icing fly clear_air"
        for name, values in self.values.items():
            told = {k: v for k, v in values.items() if v != 0.0} if name == "discrepancy" else values
            said += f" --effect {name}:" + ",".join(f"{k}={v:.6g}" for k, v in told.items())
        return said


def values_of(fit: SetFit) -> Values:
    """Fitted parameters of every effect of a set."""
    return {family.effect.name: {**family.effect.neutral(), family.parameter.name: size}
            for family, size in zip(fit.families, fit.estimate, strict=True)}


def leading(verdict: str, posterior: Posterior) -> Hypothesis | None:
    """The explanation that the verdict rests on; None for no gap."""
    if verdict == "no_gap":
        return None
    wanted: Callable[[Hypothesis], bool] = (
        (lambda h: h.unknown is not None) if verdict == "unknown" else (lambda h: bool(h.effects)))
    return next((h for h in posterior.hypotheses if wanted(h)), None)


def remedy(explained: Hypothesis | None, description: Description | None) -> Remedy:
    """The change of the model that an explanation asks for.

    Args:
        explained: of `leading`.
        description: of its unknown, if it holds one, or of its other form.
    """
    if explained is None:
        return Remedy()
    values, fitted = values_of(explained.fit), explained.fit.covariance
    parts = [None if fitted is None else SIZES**2 * fitted]
    if description is not None and description.values:
        values["discrepancy"] = description.values
        parts.append(description.covariance)
    known = [p for p in parts if p is not None]
    return Remedy(values, block_diag(*known) if known else None)


def resimulation(change: Remedy, training: gap.Energy, flights: Sequence[Reconstruction],
                 evidences: Sequence[Evidence]) -> dict[str, Any]:
    """What to fly to see the diagnosis for oneself."""
    starts, at = [], 0
    for flight in flights:
        starts.append(training.starts[at])
        at += len(cut(flight).first)
    records = [{"initial_state": dict(zip(FREE, (float(v) for v in start), strict=True)),
                "wind": {"sigma_w": evidence.gusts.sigma, **evidence.gusts.kind._asdict()}, "biases": {}}
               for start, evidence in zip(starts, evidences, strict=True)]
    if any(lacks_the_lag(flight) for flight in flights):  # which the aircraft that a command flies has
        own = {**change.values.get(OWN, {}), NUMBER: -1.0}
        change = replace(change, values={OWN: own} | {n: v for n, v in change.values.items() if n != OWN})
    return {"command": change.command, "records": records,
            "parameter_covariance": None if change.covariance is None else np.asarray(change.covariance).tolist(),
            "model": {name: {"change": size, "std_error": error} for name, (size, error) in change.own.items()}}
