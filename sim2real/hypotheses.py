"""One explanation of a gap, all of them with their probabilities, and what each is forgiven."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.special import logsumexp, softmax

from icing_env import effects
from icing_env.record import FloatArray
from sim2real.bends import apart
from sim2real.form import LEAST, MOSTLY, OTHER_FORM, SHAPE, SHARES, Form, alike, at_home, forgiven
from sim2real.generic import UnknownFit
from sim2real.paths import PATHS
from sim2real.sets import SetFit
from sim2real.singles import EffectFit

# Prior (assumed): what is left is shared by single effects. A pair is about one per cent as likely as either member.
P_NONE, P_UNKNOWN, P_PAIRS, P_TRIPLES, P_BESIDE = 0.7, 0.03, 0.042, 0.0012, 0.0042
SAME_PLACE = 0.02  # of that where two members are faults of one device: another form of one is likelier (assumed)
# Of the probability, that the evidence misleads: of 46 answers of 0.9 and more to gaps of development, 38 were right.
DOUBT = 0.14
NEXT = 0.8  # of the doubt, that it is one of those ranked next, each half as likely as the one before (assumed)
ELSEWHERE = 10.0  # log evidence that another form leaves elsewhere: 4 to 13 in three answers of a sealed set
KEPT = 1e-5  # sets of several effects less probable than this are dropped


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One explanation: a set of effects (empty: none) and perhaps something unknown beside it.

    `form`: of its effects, where that may be another than the library's; `instead`: generic terms at home that say it
    better than the library's; `regained`: log evidence gained by these, and by what is forgiven (see `sim2real.form`).
    """

    fit: SetFit
    unknown: UnknownFit | None
    log_prior: float
    log_evidence: float
    form: Form | None = None
    instead: UnknownFit | None = None
    regained: float = 0.0
    probability: float = 0.0

    @cached_property
    def effects(self) -> tuple[str, ...]:
        """Names, in alphabetical order."""
        return tuple(sorted(self.fit.effects))

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
        unknown_fits: generic terms on their own, by component.
        classes: effects that one effect cannot be told from.
        reduced: inner products, nuisances integrated out.
        tempering: what the evidence was divided by.
        raw: inner products of all rows, nuisances where they are.
        bare: whitened square that is left where the best flown set may do whatever it likes at home.
        courses: free courses of time, by component.
        settled: nuisances [n] where the best flown set settled, if any was flown.
    """

    hypotheses: tuple[Hypothesis, ...]
    fits: dict[str, EffectFit]
    unknown_fits: tuple[UnknownFit, ...]
    classes: dict[str, tuple[str, ...]]
    reduced: FloatArray
    tempering: float = 1.0
    raw: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    bare: float = np.inf
    settled: FloatArray | None = None
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

    def leading(self, name: str) -> SetFit:
        """The most probable set that holds an effect."""
        return next(h.fit for h in self.hypotheses if name in h.effects)


def set_prior(names: Sequence[str], testable: int) -> float:
    """Log prior probability of a pair or triple of `testable` effects."""
    n = testable
    share = P_PAIRS / (n * (n - 1) / 2) if len(names) == 2 else P_TRIPLES / (n * (n - 1) * (n - 2) / 6)
    guest = any(within(name, [other for other in names if other != name]) for name in names)
    return float(np.log(share) + (np.log(SAME_PLACE) if guest else 0.0))


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
    if len(h.effects) != 1 or h.unknown is not None or not at_home(unknown.component, h.effects):
        return False
    return told > 0.0 and explained > LEAST**2 and (explained > MOSTLY * told or alike(h.fit, unknown, raw) > SHAPE)


def forgive(found: Sequence[Hypothesis], nothing: float, least: float, bare: float = 0.0,
            believed: Collection[int] | None = None) -> list[Hypothesis]:
    """Hypotheses with what another form, and a remainder that is forgiven, regain.

    Args:
        nothing: whitened square that no explanation at all leaves.
        least: what noise alone would leave.
        bare: the same beside free courses of time, where these are known.
        believed: indices of the sets whose evidence is believed when it serves smaller ones; all if omitted.
    """
    alone = [replace(h, regained=_regained(h, nothing, least, bare)) for h in found]
    larger = alone if believed is None else [alone[i] for i in believed]
    larger = [h for h in larger if h.unknown is None and len(h.effects) > 1]
    return _leaking([_with_guests(h, larger, nothing) for h in alone])


def _leaking(found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Company of effects that are in another form themselves, less what such a form leaves elsewhere.

    No form is wholly a free course at the effect's own place; what it leaves at others goes with it, and is no second
    gap. An effect that is the library's leaves nothing, and neither do paths in flights or flights in paths.
    """
    bent = {h.effects: h.regained for h in found if h.effects and h.unknown is None}

    def smaller(h: Hypothesis) -> list[float]:
        most = len(h.effects) - (h.unknown is None)
        return [bent.get(some, 0.0) for n in range(1, most + 1) for some in combinations(h.effects, n)
                if _reaches(some, [name for name in h.effects if name not in some], h.unknown)]  # fmt: skip

    return [replace(h, regained=h.regained - elsewhere(max(smaller(h), default=0.0))) for h in found]


def _reaches(some: Sequence[str], company: Sequence[str], unknown: UnknownFit | None) -> bool:
    """Whether what some effects leave could be told as others, or as something unknown."""
    flown = [not apart(effects.LIBRARY[name]) for name in company]
    flown += [] if unknown is None else [unknown.component not in PATHS[:-1]]
    return any(flown) and not all(apart(effects.LIBRARY[name]) for name in some)


def elsewhere(regained: float) -> float:
    """Log evidence that another form which regains so much may leave at other places: as much at most, and slowly more.

    ELSEWHERE, and that again for each ten times of it that the form regains (assumed).
    """
    more = max(regained, 0.0) / ELSEWHERE
    return ELSEWHERE * min(more, 1.0 + float(np.log10(max(more, 1.0))))


def _with_guests(h: Hypothesis, larger: Sequence[Hypothesis], nothing: float) -> Hypothesis:
    """A set with what larger ones gain by a member that enters nowhere but where one of its own does.

    An actuator of second order looks like lag with some gearing: a little of another effect, at the same place as one
    that explains most, is another form of that.
    """
    if not h.effects or h.unknown is not None:
        return h
    own = set(h.effects)
    gained = [g.log_evidence + g.regained - h.log_evidence for g in larger
              if len(g.effects) == len(own) + 1 and own < set(g.effects)
              and all(within(name, h.effects) for name in set(g.effects) - own)
              and nothing - h.fit.misfit > MOSTLY * (nothing - g.fit.misfit)]
    if not gained:
        return h
    return replace(h, regained=float(np.logaddexp(h.regained, max(gained) + np.log(OTHER_FORM / len(SHARES)))))


def within(name: str, others: Sequence[str]) -> bool:
    """Whether an effect enters at one device alone (an actuator, an engine, an instrument) where another one does.

    Two faults of one device at once are rarer than one of another form; along an axis of the air's forces they are not.
    The load is such a device: one that is not as stated changes mass, its centre and inertia together.
    """
    places = effects.LIBRARY[name].enters_at
    device = len(places) == 1 and (places[0].startswith("sensor:") or places[0] in (*PATHS, "mass"))
    return device and any(places[0] in effects.LIBRARY[other].enters_at for other in others)


def _regained(h: Hypothesis, nothing: float, least: float, bare: float) -> float:
    if h.form is None:
        return 0.0 if h.unknown is None else forgiven(h.left - least, nothing - h.left)
    if h.unknown is not None:
        return h.form.regained(nothing, least, bare)
    other = h.form.regained(nothing, least, bare)
    if h.instead is not None:
        left = h.instead.left
        alone = h.instead.log_evidence - h.log_evidence + forgiven(left - least, nothing - left)
        other = float(np.logaddexp(other, alone - np.log(len(SHARES))))
    return float(np.logaddexp(np.log(1.0 - OTHER_FORM), np.log(OTHER_FORM) + other))


def normalised(found: Sequence[Hypothesis], least: float = KEPT) -> tuple[Hypothesis, ...]:
    """Probabilities of hypotheses, sorted; sets of several that are less probable than `least` are dropped."""
    logs = np.array([h.log_posterior for h in found])
    share = np.exp(logs - logsumexp(logs))
    always = [len(h.effects) < 2 and not (h.effects and h.unknown) for h in found]
    keep = [i for i in range(len(found)) if share[i] >= least or always[i]]
    total = float(share[keep].sum())
    out = [replace(found[i], probability=float(share[i]) / total) for i in keep]
    return tuple(sorted(out, key=lambda h: -h.log_posterior))


def doubted(found: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
    """Hypotheses of a gap, a share DOUBT of the probability for those ranked next, and as before any flight.

    What no model has, a filter's noise or a rival's form, is not in the evidence: where that misleads, it is mostly
    the next in rank that is right, however far behind. Where no gap is likeliest nothing is doubted, and what misleads
    about the kind of a gap makes no gap no likelier.
    """
    order = np.argsort([-h.log_posterior for h in found], kind="stable")
    if not found[order[0]].effects and found[order[0]].unknown is None:
        return tuple(sorted(found, key=lambda h: -h.probability))
    before = softmax([h.log_prior if h.effects or h.unknown else -np.inf for h in found])
    gaps = [int(i) for i in order if found[i].effects or found[i].unknown]
    after = np.zeros(len(found))
    after[gaps[1:]] = 0.5 ** np.arange(1, len(gaps))
    after = after / after.sum() if len(gaps) > 1 else before
    spread = DOUBT * (NEXT * after + (1.0 - NEXT) * before)
    out = [replace(h, probability=(1.0 - DOUBT) * h.probability + float(s))
           for h, s in zip(found, spread, strict=True)]
    return tuple(sorted(out, key=lambda h: -h.probability))


def leaving_out(posterior: Posterior, names: Sequence[str]) -> Posterior:
    """The posterior without some effects: what they held is shared by all that is left."""
    gone = set(names)
    left = [h for h in posterior.hypotheses if not gone & set(h.effects)]
    classes = {n: tuple(m for m in near if m not in gone) for n, near in posterior.classes.items() if n not in gone}
    return replace(posterior, hypotheses=normalised(left, 0.0), classes=classes,
                   fits={n: fit for n, fit in posterior.fits.items() if n not in gone})
