"""How strong the gusts along a record were: the intensity that makes the model's innovations likeliest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from icing_env.record import FloatArray
from sim2real.prediction.gusts import KINDS, LATER, Kind
from sim2real.prediction.kalman import Gain, follow, gains
from sim2real.prediction.predictor import LOST, Push, innovations
from sim2real.prediction.readings import slow
from sim2real.records.channels import FED_BACK
from sim2real.records.reconstruct import Reconstruction
from sim2real.records.side_by_side import each
from sim2real.signatures.whitening import SETTLE, factors, whiten

# m/s
SIGMAS = (0.003, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.27, 0.35, 0.45, 0.55, 0.67, 0.82, 1.0, 1.2, 1.45, 1.75, 2.1, 2.6,
          3.2)  # fmt: skip
CALM = 0.1  # m/s, below which no kind of gusts is told
# Of log likelihood a sample: the least that speaks for air that turns, or that meets all of the aircraft at once, and
# half of what it is per (m/s)^2 (our simulator at 0.25 to 1.5 m/s: 15 to 25, and 2 to 3); m/s beyond which no more
TURNING, AT_ONCE, MOST = (0.3, 8.0), (0.05, 1.0), 1.5
STRAIGHT = [kind for kind in KINDS if not kind.rotation]  # LATER first
TURNING_KINDS = [kind for kind in KINDS if kind.rotation]
TOGETHER = 100  # samples that the channels have to share for their covariance to be judged


def choose_gain(flight: Reconstruction, sigmas: Sequence[float], pushed: Sequence[Push] = (), kind: Kind = LATER
                ) -> Gain:  # fmt: skip
    """The gust intensity that makes the model's innovations likeliest, between those given by a parabola.

    Their size is taken from medians: a gap that shows as an offset or in the moments of a manoeuvre is no gust. It has
    to be known to a few per cent: where instruments have little noise, a fifth too much of it puts the derivatives by
    sideslip five standard deviations off.

    Args:
        sigmas: intensities, ascending.
        pushed: generic discrepancies that the model is flown with, whatever their rows.
        kind: of the gusts.
    """
    options = gains(flight, sigmas, kind)
    scores = likelihoods(flight, options, pushed)
    k = int(np.argmax(scores))
    if k in (0, len(options) - 1):
        return options[k]
    return gains(flight, (_peak(sigmas[k - 1 : k + 2], scores[k - 1 : k + 2]),), kind)[0]


def kind_at_first(flights: Sequence[Reconstruction], usual: Kind = LATER) -> Kind:
    """The same before anything is known, with the model as it was published.

    Gusts of another kind leave more than derivatives that are off by their spread; and taken for strong gusts of this
    kind, the model settles where no other kind makes sense any more. Whether the air turns is not asked yet: a gap in
    roll makes more of it than any spread. `usual`: where nothing is said of it.
    """
    told = [flight for flight in flights if flight.inadequacy.followed]
    return STRAIGHT[int(np.argmax(np.sum(each(_at_first, told), axis=0)))] if told else usual


def _at_first(flight: Reconstruction) -> list[float]:
    """Log likelihood of a sample by kind of gusts beyond that of LATER, less what is asked.

    Also where only the strongest gusts make sense: what is not understood passes for gusts of either kind, and a gap
    beside gusts that meet all of the aircraft at once is what makes them look strong.
    """
    out = list[float]()
    for kind in STRAIGHT:
        likely, score = _of_any_strength(flight, kind)
        if kind == LATER and likely.sigma < CALM:
            return [0.0] * len(STRAIGHT)
        out.append(score - asked(likely))
    return [score - out[0] for score in out]


def _of_any_strength(flight: Reconstruction, kind: Kind) -> tuple[Gain, float]:
    """The likeliest gusts of a kind with the model alone, to a step or two of SIGMAS, and their log likelihood."""
    options = gains(flight, SIGMAS[1::2], kind)
    scores = likelihoods(flight, options)
    best = int(np.argmax(scores))
    return options[best], scores[best]


def turns(flights: Sequence[Reconstruction], found: Sequence[Gain]) -> bool:
    """Whether air that turns makes a settled model likelier than the gusts `found` that do not turn it, as is asked.

    Of other kinds gusts often look several times as strong as they are, up to the strongest: any is tried. Nothing
    is said where the model is known to follow poorly, or in calm.
    """
    told = [of for of in zip(flights, found, strict=True) if of[0].inadequacy.followed]
    return bool(told) and in_turning_air(*zip(*told, strict=True))


def in_turning_air(flights: Sequence[Reconstruction], found: Sequence[Gain]) -> bool:
    """The same of flights however they are followed: reference flights, whose numbers are at their best."""
    told = [of for of in zip(flights, found, strict=True) if of[1].sigma >= CALM]
    return bool(told) and bool(np.max(np.sum(each(_turning, *zip(*told, strict=True)), axis=0)) > 0.0)


def _turning(flight: Reconstruction, found: Gain) -> list[float]:
    """Log likelihood of a sample by kind that turns the air: beyond that with the gusts found, and what is asked."""
    (here,) = likelihoods(flight, [found])
    likely = [_of_any_strength(flight, kind) for kind in TURNING_KINDS]
    return [score - asked(gain) - here for gain, score in likely]


def kind_of_gusts(flights: Sequence[Reconstruction], found: Sequence[Gain], pushed: Sequence[Sequence[Push]]) -> Kind:
    """The likeliest kind of gusts along some records, which were flown on one day and met gusts of one kind.

    What a gap makes of roll and yaw passes for air that turns, and what it makes of pitch for a tail that meets gusts
    later or not, so that this is for a model with an explanation in it, and the log likelihood has to gain half of what
    gusts of another kind than LATER, as strong as they are found, make of it.
    Of an aircraft that the model is known to follow poorly nothing is said: what the model lacks passes for a kind of
    gusts, too.

    Args:
        found: gains of each record, of gusts of one kind.
        pushed: generic discrepancies that the model is flown with, of each record.
    """
    told = [of for of in zip(flights, found, pushed, strict=True) if of[0].inadequacy.followed]
    if not told:
        return found[0].gusts.kind
    return KINDS[int(np.argmax(np.sum(each(_in_favour, *zip(*told, strict=True)), axis=0)))]


def _in_favour(flight: Reconstruction, found: Gain, pushed: Sequence[Push]) -> list[float]:
    """Log likelihood of a sample by kind of gusts: beyond that with the gusts found, and less what is asked.

    Where only the strongest gusts make sense, what is not understood passes for gusts: nothing is in their favour.
    """
    if found.sigma < CALM:
        return [0.0] * len(KINDS)
    here = likelihoods(flight, [found], pushed)[0]

    def gained(gain: Gain) -> float:
        return float(np.nan_to_num(likelihoods(flight, [gain], pushed)[0] - here, nan=-np.inf))

    out = []
    for kind in KINDS:
        if kind == found.gusts.kind:
            out.append(-0.5 * asked(found))
            continue
        gain = gains(flight, (found.sigma,), kind)[0]
        if (gain_of := gained(gain)) > 0.0:
            gain = choose_gain(flight, SIGMAS, pushed, kind)
            gain_of = gained(gain)
        # that it turns was paid for, and of one strength the kinds look stronger or weaker than they are
        paid = 0.5 * asked(found) if kind.rotation and found.gusts.kind.rotation else asked(gain)
        out.append(min(gain_of, 0.0) if strongest([gain]) and kind != LATER else gain_of - paid)
    return out


def strongest(found: Sequence[Gain]) -> bool:
    """Whether only the strongest gusts make sense, along every record: what is not understood passes for gusts."""
    return all(gain.sigma == SIGMAS[-1] for gain in found)


def asked(gain: Gain) -> float:
    """What the log likelihood of a sample has to gain by gusts of such a kind, half of it to stay with them."""
    if gain.gusts.kind == LATER:
        return 0.0
    least, by = TURNING if gain.gusts.kind.rotation else AT_ONCE
    return max(least, by * min(gain.sigma, MOST) ** 2)


def likelihoods(flight: Reconstruction, options: Sequence[Gain], pushed: Sequence[Push] = ()) -> list[float]:
    """Log likelihood of a sample's innovations with each of some gains, their size taken from medians.

    That of a filter which loses the record is minus infinity: what is lost is constant, and medians would call it calm.
    Where a channel is slow, gains at every step are too far from those that it needs: gusts are judged by these.
    All of them are of gusts of one kind.
    """
    kind = options[0].gusts.kind
    options = [follow(flight, gain) for gain in options] if slow(flight) else options
    everywhere = tuple(replace(push, row=i) for push in pushed for i in range(len(options)))
    left = innovations(flight, np.repeat(flight.parameters, len(options)), np.stack([g.K for g in options]), everywhere,
                       kind)
    left = left[round(SETTLE / flight.dt) :]
    seen = np.isfinite(left[:, 0, : FED_BACK - 1])
    use = np.flatnonzero(seen.sum(axis=0) > 0.5 * seen.sum(axis=0).max())
    together = seen[:, use].all(axis=1)
    scores = []
    for i, gain in enumerate(options):
        if gain.along:
            scores.append(_along(left[:, i], gain, round(SETTLE / flight.dt)))
            continue
        S = gain.S[np.ix_(use, use)]
        if together.sum() < TOGETHER:  # channels that take turns: each by itself
            factor, white = np.diag(np.sqrt(np.diag(S))), left[:, i, use] / np.sqrt(np.diag(S))
        else:
            factor = np.linalg.cholesky(S)
            white = np.linalg.solve(factor, left[together, i][:, use].astype(float).T).T
        if np.nanmax(np.abs(left[:, i, use]), initial=0.0) >= LOST:
            scores.append(-np.inf)
            continue
        median = np.nanmedian if np.isnan(white).any() else np.median
        away = median(np.abs(white - median(white, axis=0)), axis=0)
        scores.append(-0.5 * float(np.sum((1.4826 * away) ** 2)) - float(np.sum(np.log(np.diag(factor)))))
    return scores


def _along(left: FloatArray, gain: Gain, first: int) -> float:
    """The same of innovations [steps, channels] from step `first` on whose covariance is another at every step."""
    use = np.flatnonzero(np.isfinite(left[:, : FED_BACK - 1]).any(axis=0))
    if np.nanmax(np.abs(left[:, use]), initial=0.0) >= LOST:
        return -np.inf
    factor, seen = factors(left, replace(gain, S=gain.S[first:]), use), np.isfinite(left[:, use])
    white = np.where(seen, whiten(left[:, None], factor)[:, 0, use], np.nan)
    away = np.nanmedian(np.abs(white - np.nanmedian(white, axis=0)), axis=0)
    log = np.log(np.where(seen, factor[:, use, use], 1.0))
    return float(np.sum(log) / len(left) - 0.5 * np.mean(seen, axis=0) @ (1.4826 * away) ** 2)


def _peak(sigmas: Sequence[float], scores: Sequence[float]) -> float:
    """Where a parabola in the logarithm through three scores, the middle one the best, is highest."""
    if not np.all(np.isfinite(scores)):
        return sigmas[1]
    at = np.log(sigmas)
    square, slope, _ = np.polyfit(at, scores, 2)
    return float(np.exp(np.clip(-0.5 * slope / square, at[0], at[2]))) if square < 0.0 else sigmas[1]
