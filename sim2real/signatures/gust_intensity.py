"""How strong the gusts along a record were: the intensity that makes the model's innovations likeliest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from icing_env.record import FloatArray
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
PLAIN, STILL = 1.0, 0.3  # of log likelihood a sample, the least that speaks for air that turns, and to leave it at that
TURNING, MOST = 8.0, 1.5  # of the same per (m/s)^2, half of what it is; m/s
TOGETHER = 100  # samples that the channels have to share for their covariance to be judged


def choose_gain(flight: Reconstruction, sigmas: Sequence[float], pushed: Sequence[Push] = (), rotation: bool = False
                ) -> Gain:  # fmt: skip
    """The gust intensity that makes the model's innovations likeliest, between those given by a parabola.

    Their size is taken from medians: a gap that shows as an offset or in the moments of a manoeuvre is no gust. It has
    to be known to a few per cent: where instruments have little noise, a fifth too much of it puts the derivatives by
    sideslip five standard deviations off.

    Args:
        sigmas: intensities, ascending.
        pushed: generic discrepancies that the model is flown with, whatever their rows.
        rotation: whether the air turns.
    """
    options = gains(flight, sigmas, rotation)
    scores = likelihoods(flight, options, pushed)
    k = int(np.argmax(scores))
    if k in (0, len(options) - 1):
        return options[k]
    return gains(flight, (_peak(sigmas[k - 1 : k + 2], scores[k - 1 : k + 2]),), rotation)[0]


def air_turns(flights: Sequence[Reconstruction], found: Sequence[Gain], pushed: Sequence[Sequence[Push]]) -> bool:
    """Whether the air of some records turns, by how likely they are with the gusts found and with the other kind.

    The air of a day is of one kind. What a gap makes of roll and yaw passes for air that turns, so that this is for a
    model with an explanation in it, and the log likelihood of a sample has to gain half of what air that turns so much
    makes of it (15 to 25 per (m/s)^2); no more than of MOST, since what is not understood passes for stronger gusts
    than there are.
    Of an aircraft that the model is known to follow poorly, or of which only the strongest gusts make sense, nothing is
    said: what the model lacks passes for air that turns, too.

    Args:
        found: gains of each record, of gusts of one kind.
        pushed: generic discrepancies that the model is flown with, of each record.
    """
    turned = found[0].gusts.rotation
    told = [of for of in zip(flights, found, pushed, strict=True)
            if of[0].inadequacy.walk <= 1.0 and not (turned and of[1].sigma == SIGMAS[-1])]
    if not told:
        return False
    gained = each(_gained, *zip(*told, strict=True))
    if turned:
        return -sum(gained) > sum(max(STILL, 0.5 * _asked(gain)) for _, gain, _ in told)
    if max(gained) <= PLAIN:
        return False
    turning = each(lambda flight, _, push: choose_gain(flight, SIGMAS, push, True), *zip(*told, strict=True))
    likely = [(*of, gain) for of, gain in zip(told, turning, strict=True) if gain.sigma != SIGMAS[-1]]
    return sum(_gained_by(*of) for of in likely) > sum(_asked(of[-1]) for of in likely)


def _asked(turning: Gain) -> float:
    """What the log likelihood of a sample gains at least where the air turns as a gain expects it to."""
    return TURNING * min(turning.sigma, MOST) ** 2


def _gained(flight: Reconstruction, found: Gain, pushed: Sequence[Push]) -> float:
    """What the log likelihood of a sample gains by gusts as strong and of the other kind."""
    return _gained_by(flight, found, pushed, gains(flight, (found.sigma,), not found.gusts.rotation)[0])


def _gained_by(flight: Reconstruction, found: Gain, pushed: Sequence[Push], other: Gain) -> float:
    """The same by another gain."""
    here, there = (likelihoods(flight, [gain], pushed)[0] for gain in (found, other))
    return there - here


def likelihoods(flight: Reconstruction, options: Sequence[Gain], pushed: Sequence[Push] = ()) -> list[float]:
    """Log likelihood of a sample's innovations with each of some gains, their size taken from medians.

    That of a filter which loses the record is minus infinity: what is lost is constant, and medians would call it calm.
    Where a channel is slow, gains at every step are too far from those that it needs: gusts are judged by these.
    All of them are of gusts of one kind.
    """
    rotation = options[0].gusts.rotation
    options = [follow(flight, gain) for gain in options] if slow(flight) else options
    everywhere = tuple(replace(push, row=i) for push in pushed for i in range(len(options)))
    left = innovations(flight, np.repeat(flight.parameters, len(options)), np.stack([g.K for g in options]), everywhere,
                       rotation)
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
