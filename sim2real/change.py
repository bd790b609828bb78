"""What an explanation changes in the model, and how it is told: effects, terms that nothing else says, own numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from sim2real.answer import judge
from sim2real.baseline.references import Baseline
from sim2real.closing import gap, whole_model
from sim2real.closing.discrepancy import Description, describe_unknown, described, in_other_form
from sim2real.closing.own_numbers import of_component, with_own_numbers
from sim2real.closing.parts import Flown, flown_parts
from sim2real.closing.remedy import Remedy, leading, remedy
from sim2real.closing.servos import servos
from sim2real.closing.whole_model import WholeModel
from sim2real.library.candidates import Bank
from sim2real.posterior.hypotheses import Hypothesis, Posterior
from sim2real.prediction.gusts import Gusts
from sim2real.records.reconstruct import Reconstruction
from sim2real.records.side_by_side import each
from sim2real.signatures.evidence import Evidence
from sim2real.weigh import Progress

SEEDS_APART = 100_000  # from one record's synthetic windows to the next's, which have a seed each


@dataclass(frozen=True)
class Told:
    """The explanation that the verdict rests on, in terms.

    Attributes:
        explained: it; None for no gap.
        unknown: what the library lacks, likely or not; None where that is improbable.
        form: how the effects differ from the library's; None where they do not.
        servos: frequency and damping of actuators that are not of first order.
    """

    explained: Hypothesis | None
    unknown: Description | None
    form: Description | None
    servos: tuple[Description, ...] = ()

    @property
    def forms(self) -> tuple[Description, ...]:
        """In which its effects are not the library's, what says most by fewest numbers first."""
        return self.servos if self.form is None else (*self.servos, self.form)

    @property
    def flown(self) -> Description | None:
        """The terms that are flown with the effects."""
        return self.form or (self.unknown if self.explained is not None and self.explained.unknown else None)


@dataclass(frozen=True)
class Changed:
    """What the records ask to be changed.

    Attributes:
        posterior: with many numbers at once among its explanations, if that is the answer.
        told: the explanation.
        whole: the model with all its numbers fitted, if that is the answer.
        flown: what is changed of it, and what that leaves.
    """

    posterior: Posterior
    told: Told
    whole: WholeModel | None
    flown: Flown


def changed(flights: Sequence[Reconstruction], candidates: Bank, evidences: Sequence[Evidence], baseline: Baseline,
            posterior: Posterior, seed: int, any_aircraft: bool, progress: Progress) -> Changed:  # fmt: skip
    """What the records ask to be changed.

    Args:
        flights, candidates, evidences, baseline: the diagnosed records, and what was flown along them.
        posterior: what they say.
        seed: of the synthetic records behind the gap without a gap.
        any_aircraft: whether all numbers of the model may be another's.
        progress: told what is being done.
    """
    told = _told(flights, candidates, evidences, baseline, posterior, progress)
    alone, gusts = remedy(told.explained, told.flown), [e.gusts for e in evidences]
    progress("flying the records freely, before and after")
    left = flown_freely(flights, gusts, alone, seed)
    if any_aircraft and whole_model.suspected(posterior, baseline.precision):
        judged = _judged(flights, told, alone, left, candidates)
        all_of_it = (told.flown is None or bool(told.flown.values)) and not posterior.best.varies
        if whole_model.incomplete(posterior, baseline.precision, judged, all_of_it):
            whole = _whole(flights, candidates, posterior, told, gusts, judged, seed, progress)
            if whole is not None:
                return whole
    flown = flown_parts(flights, left, told.explained, told.flown, candidates.nuisances)
    return Changed(posterior, told, None, flown)


def _judged(flights: Sequence[Reconstruction], told: Told, alone: Remedy, left: gap.Energy, candidates: Bank
            ) -> gap.Energy:  # fmt: skip
    """The records in free flight with an explanation; beside terms, the numbers of their component were fitted too."""
    change = with_own_numbers(alone, told.explained, told.flown, candidates.nuisances)
    if told.flown is None or change is alone:
        return left
    at_home = of_component(change, told.flown.component)
    return replace(left, after=gap.of_all(flights, at_home, at_home.paths))


def _whole(flights: Sequence[Reconstruction], candidates: Bank, posterior: Posterior, told: Told,
           gusts: Sequence[Gusts], judged: gap.Energy, seed: int, progress: Progress) -> Changed | None:  # fmt: skip
    """All numbers of the model changed; None where that takes no more of the gap than what was found before."""
    progress("fitting all numbers of the model, since what was found is not all")
    whole = whole_model.fit_whole_model(flights, candidates, posterior)
    everything = whole.remedy()
    closer = flown_freely(flights, gusts, everything, seed)
    if not whole_model.takes_most(judged, closer):
        return None
    posterior = whole_model.with_whole_model(posterior, whole)
    told = Told(leading(judge(posterior)[0], posterior), told.unknown, None)
    alone = remedy(told.explained, None)
    left = replace(closer, after=gap.of_all(flights, alone, everything.paths))
    return Changed(posterior, told, whole, Flown(alone, left, everything, closer))


def _told(flights: Sequence[Reconstruction], candidates: Bank, evidences: Sequence[Evidence], baseline: Baseline,
          posterior: Posterior, progress: Progress) -> Told:  # fmt: skip
    explained, lacking = leading(judge(posterior)[0], posterior), described(posterior)
    if explained is not None and explained.unknown is not None:
        lacking = explained
    unknown, form = None, None
    if lacking is not None:
        progress("describing what the library lacks")
        unknown = describe_unknown(flights, candidates, evidences, baseline, posterior.tempering, lacking)
    if explained is not None and (own := in_other_form(explained)) is not None:
        progress("describing the form of what was found")
        form = describe_unknown(flights, candidates, evidences, baseline, posterior.tempering, own)
    return Told(explained, unknown, form, () if explained is None else servos(explained))


def flown_freely(flights: Sequence[Reconstruction], gusts: Sequence[Gusts], change: Remedy, seed: int) -> gap.Energy:
    """Energies of all records under the model and under the model changed."""
    return gap.together(each(lambda i, f, own: gap.energies(f, change, own, seed + SEEDS_APART * i, change.paths),
                             range(len(flights)), flights, gusts))
