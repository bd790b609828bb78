"""One explanation of a gap, all of them with their probabilities, and what each is forgiven."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.special import logsumexp, softmax

from icing_env.record import FloatArray
from sim2real.posterior.any_delay import is_delay
from sim2real.posterior.form import LEAST, Form, at_home
from sim2real.posterior.generic import UnknownFit
from sim2real.posterior.likeness import FORMED, MOSTLY, POWERED, SHAPE, bent_gear, calibration, foreign, like, powered
from sim2real.posterior.sets import SetFit
from sim2real.posterior.singles import EffectFit

# Of the probability, that the evidence misleads: where the library's own form of one effect explains a gap; again for
# each ten times that another form regains in log evidence, and at most, half of it for something unknown; where that is
# what explains it; more where two effects are told; and in all where more are, or something unknown beside them. And
# that something unknown is there where no gap is likeliest. Chosen on 1,630 opened answers (docs/diagnosis_method.md).
DOUBT, PER_DECADE, MOST_DOUBT = 0.03, 0.08, 0.11
OF_UNKNOWN, OF_TWO, OF_MORE, UNSEEN = 0.14, 0.1, 0.5, 0.02
FEWER = 0.5  # of the doubt about several things, that one of them is not there; the rest is as of any (assumed)
NEXT = 0.8  # of the rest, that it is one of those ranked next, each a third as likely as the one before (assumed)
RANKED = 1.0 / 3.0
KEPT = 1e-5  # sets of several effects less probable than this are dropped


@dataclass(frozen=True, eq=False)
class Settled:
    """Where an explanation settled in flight: nuisances [n] and their covariance [n, n], in prior deviations."""

    nuisances: FloatArray
    covariance: FloatArray

    @property
    def error(self) -> FloatArray:
        """Standard errors [n]."""
        return np.asarray(np.sqrt(np.diag(self.covariance)), np.float64)


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One explanation: a set of effects (empty: none) and perhaps something unknown beside it.

    `form`: of its effects, where that may be another than the library's; `instead`: what says it better than that,
    generic terms at home or its actuators in their usual forms; `regained`: log evidence gained by these, and by what
    is forgiven (see `posterior.form`); `settled`: where it was flown; `varies`: whether its effect's size differs along
    the records (`fit` has the mean).
    """

    fit: SetFit
    unknown: UnknownFit | None
    log_prior: float
    log_evidence: float
    form: Form | None = None
    instead: UnknownFit | None = None
    regained: float = 0.0
    probability: float = 0.0
    settled: Settled | None = None
    varies: bool = False

    @cached_property
    def effects(self) -> tuple[str, ...]:
        """Names, in alphabetical order."""
        return tuple(sorted(self.fit.effects))

    @property
    def things(self) -> int:
        """How many causes it names, something unknown among them."""
        return len(self.effects) + (self.unknown is not None)

    def is_part_of(self, other: Hypothesis) -> bool:
        """Whether it says the same as another but for one thing that it lacks."""
        fewer = set(self.effects) <= set(other.effects) and (other.unknown is not None or self.unknown is None)
        return fewer and self.things == other.things - 1

    @property
    def log_posterior(self) -> float:
        """But for a constant."""
        return self.log_prior + self.log_evidence + self.regained

    @property
    def left(self) -> float:
        """Whitened square that it leaves over at best, other forms included."""
        own = self.unknown.left if self.unknown else self.fit.misfit
        forms = [] if self.form is None else [self.form.least]
        return min([own, *forms, *([] if self.instead is None else [self.instead.left])])

    @property
    def pushed(self) -> dict[int, float]:
        """Weights of the generic terms that it is flown with: of something unknown, or of its other form."""
        return self.unknown.weights if self.unknown else self.form.weights if self.form else {}

    @property
    def weights(self) -> dict[int, float]:
        """Of the flown rows, beside the model's."""
        return (self.fit.weights or {}) | (self.unknown.weights if self.unknown else {})


@dataclass(frozen=True)
class Posterior:
    """Probabilities that sum to one, with the fits behind them.

    Attributes:
        hypotheses: the most probable first.
        fits: every effect on its own.
        classes: effects that one effect cannot be told from.
        reduced: inner products, nuisances integrated out.
        tempering: what the evidence was divided by.
        raw: inner products of all rows, nuisances where they are.
        bare: whitened square that is left where the best flown set may do whatever it likes at home, or beside what is
            unknown, where that is likeliest.
        courses: free courses of time, by component.
    """

    hypotheses: tuple[Hypothesis, ...]
    fits: dict[str, EffectFit]
    classes: dict[str, tuple[str, ...]]
    reduced: FloatArray
    tempering: float = 1.0
    raw: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    bare: float = np.inf
    courses: tuple[UnknownFit, ...] = ()

    @property
    def none(self) -> float:
        """Probability of no gap."""
        return sum(h.probability for h in self.hypotheses if not h.effects and h.unknown is None)

    @property
    def unknown(self) -> float:
        """Probability that something is there which the library lacks, with or without known effects."""
        return sum(h.probability for h in self.hypotheses if h.unknown is not None)

    @property
    def effects(self) -> dict[str, float]:
        """Probability that each effect is there, alone or with others."""
        found = dict.fromkeys(self.fits, 0.0)
        for hypothesis in self.hypotheses:
            for name in hypothesis.effects:
                found[name] += hypothesis.probability
        return found

    @property
    def best(self) -> Hypothesis:
        """The most probable explanation."""
        return self.hypotheses[0]

    @property
    def settled(self) -> FloatArray | None:
        """Nuisances [n] where the most probable of what was flown settled, if any was."""
        return next((h.settled.nuisances for h in self.hypotheses if h.settled is not None), None)

    def leading(self, name: str) -> SetFit:
        """The most probable set that holds an effect."""
        return next(h.fit for h in self.hypotheses if name in h.effects)


def homes(found: Sequence[Hypothesis], alone: Sequence[UnknownFit], nothing: float,
          raw: FloatArray) -> tuple[list[Hypothesis], tuple[UnknownFit, ...]]:
    """Generic terms where a single effect of the library says most of the same are that effect in another form.

    Returns:
        The hypotheses, the single ones with such terms; and the terms that are nobody's.
    """
    out, left = list(found), []
    for u in alone:
        near = [i for i, h in enumerate(out) if is_home(h, u, nothing - u.misfit, nothing - h.fit.misfit, raw)]
        if not near:
            left.append(u)
            continue
        i = min(near, key=lambda i: out[i].fit.misfit)
        now = out[i].instead
        out[i] = replace(out[i], instead=u if now is None or u.log_evidence > now.log_evidence else now)
    return out, tuple(left)


def is_home(h: Hypothesis, unknown: UnknownFit, told: float, explained: float, raw: FloatArray) -> bool:
    """Whether a single effect that enters where generic terms do says most of what they say, or the like of it.

    Args:
        told, explained: whitened square that the terms and the effect explain.
        raw: inner products of all rows of the bank.
    """
    if len(h.effects) != 1 or h.unknown is not None or not at_home(unknown.component, h.effects) or is_delay(unknown):
        return False
    if bent_gear(h.fit, unknown):
        return True
    formed = h.form is not None and told + unknown.misfit - h.form.least > FORMED * told
    if foreign(h.effects[0], unknown, raw) and explained < (MOSTLY if formed else SHAPE) * told:
        return False
    if powered(h.effects[0], unknown) and explained < POWERED * told:
        return False
    return told > 0.0 and (calibration(h.effects[0], unknown, raw) or (explained > LEAST**2 and (
        explained > MOSTLY * told or like(h.fit, unknown, raw, explained / told))))


def normalised(found: Sequence[Hypothesis], least: float = KEPT) -> tuple[Hypothesis, ...]:
    """Probabilities of hypotheses, sorted; sets of several below `least` are dropped, but for parts of the best."""
    logs = np.array([h.log_posterior for h in found])
    share = np.exp(logs - logsumexp(logs))
    best = found[int(np.argmax(logs))]
    always = [h.things < 2 or h.is_part_of(best) for h in found]
    keep = [i for i in range(len(found)) if share[i] >= least or always[i]]
    total = float(share[keep].sum())
    out = [replace(found[i], probability=float(share[i]) / total) for i in keep]
    return tuple(sorted(out, key=lambda h: -h.log_posterior))


def doubt(told: Hypothesis) -> float:
    """Probability that the best explanation misleads.

    The larger where its own form fails and another is needed, and where it names several causes: of these, one is often
    the form of another. What seems to be nothing that is known is sometimes the form of something that is.
    """
    if told.things > 2 or (told.effects and told.unknown):
        return OF_MORE
    return OF_UNKNOWN if told.unknown else DOUBT + _bent(told) + (OF_TWO if told.things > 1 else 0.0)


def _bent(told: Hypothesis) -> float:
    """What another form of known effects adds to doubt."""
    return min(PER_DECADE * float(np.log10(1.0 + max(told.regained, 0.0))), MOST_DOUBT - DOUBT)


def doubted(found: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
    """Hypotheses of a gap, a share `doubt` of the probability for what the best has too much, or for those ranked next.

    What no model has, a filter's noise or a rival's form, is not in the evidence: where that misleads, it is mostly
    the next in rank that is right, however far behind, or a part of what is told; of one effect in another form as
    often something unknown, and never something unknown beside what is told. Where no gap is likeliest it is not
    doubted, but of the rest something unknown may be most; and what misleads about the kind of a gap makes no gap no
    likelier.
    """
    order = [int(i) for i in np.argsort([-h.log_posterior for h in found], kind="stable")]
    best = found[order[0]]
    if not best.things:
        return tuple(sorted(_unseen(found), key=lambda h: -h.probability))
    before = softmax([h.log_prior if h.things else -np.inf for h in found])
    gaps = [i for i in order[1:] if found[i].things and not (found[i].unknown and best.is_part_of(found[i]))]
    after = _by_rank(gaps, len(found)) if gaps else before
    parts = [i for i in gaps if found[i].is_part_of(best)]
    fewer = FEWER if parts else 0.0
    share = doubt(best)
    strange = [i for i in gaps if _is_unknown(found[i])][:1] if len(best.effects) == best.things == 1 else []
    lacking = 0.5 * _bent(best) if strange else 0.0
    rest = NEXT * after + (1.0 - NEXT) * before
    spread = (share - lacking) * (fewer * _by_rank(parts, len(found)) + (1.0 - fewer) * rest)
    spread += lacking * _by_rank(strange, len(found))
    out = [replace(h, probability=(1.0 - share) * h.probability + float(s))
           for h, s in zip(found, spread, strict=True)]
    return tuple(sorted(out, key=lambda h: -h.probability))


def _unseen(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Hypotheses where no gap is likeliest: something unknown has UNSEEN, or two thirds of all gaps if that is less."""
    gap, now = (sum(h.probability for h in found if of(h)) for of in (lambda h: h.things, _is_unknown))
    then = max(now, min(UNSEEN, gap / 1.5))
    if now <= 0.0 or gap <= now:
        return list(found)
    known = (gap - then) / (gap - now)
    return [replace(h, probability=h.probability * (then / now if _is_unknown(h) else known)) if h.things else h
            for h in found]


def _is_unknown(h: Hypothesis) -> bool:
    return h.unknown is not None and not h.effects


def _by_rank(ranked: Sequence[int], count: int) -> FloatArray:
    """Shares [count] of those of these indices, each RANKED of the one before; zero of the others."""
    out = np.zeros(count)
    out[list(ranked)] = RANKED ** np.arange(len(ranked))
    return out / max(out.sum(), 1e-300)


def leaving_out(posterior: Posterior, names: Sequence[str]) -> Posterior:
    """The posterior without some effects: what they held is shared by all that is left."""
    gone = set(names)
    left = [h for h in posterior.hypotheses if not gone & set(h.effects)]
    classes = {n: tuple(m for m in near if m not in gone) for n, near in posterior.classes.items() if n not in gone}
    return replace(posterior, hypotheses=normalised(left, 0.0), classes=classes,
                   fits={n: fit for n, fit in posterior.fits.items() if n not in gone})
