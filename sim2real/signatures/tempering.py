"""What evidence is divided by: model error that nobody can name counts as noise, not as thousands of proofs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from icing_env.record import FloatArray
from sim2real.signatures.evidence import Evidence

LUCK = 2.0  # standard deviations by which noise alone exceeds what it leaves on average (95 in 100 nulls: 1 to 2.3)
FIRST_ORDER = 3.0  # least tempering where another simulator's accelerations stand in for its flight (assumed)


def total(evidences: Sequence[Evidence]) -> FloatArray:
    """Inner products of all records together."""
    return np.asarray(np.sum([e.gram for e in evidences], axis=0))


def noise(evidences: Sequence[Evidence], tempering: float) -> float:
    """Tempered whitened square that noise alone would leave, if it is known to be less than what is left."""
    return _lucky(evidences) / tempering if tempering > 1.0 else np.inf


def _lucky(evidences: Sequence[Evidence]) -> float:
    """Whitened square that noise alone stays below: a chi-square of as many degrees of freedom as samples."""
    samples = sum(e.samples for e in evidences)
    return samples + LUCK * float(np.sqrt(2.0 * samples))


def temper(misfit: float, evidences: Sequence[Evidence]) -> float:
    """What to divide the evidence by because even the best explanation leaves more than noise, and that coloured.

    With the mean whitened square c of what is left over and the time tau that it stays correlated (in samples):
    1 + (c - 1) tau, and 1 where c is below one, what may be luck left out (FIRST_ORDER in the place of 1 with a user's
    simulator). Model error that nobody can name is thus counted as noise, instead of as thousands of independent proofs
    of whatever lies nearest. tau is that of the model's own innovations; an explanation that takes most of what they
    have above noise takes as much of their colour.

    Args:
        misfit: whitened square that the best explanation leaves, nuisances at their best.
        evidences: of the records.
    """
    samples = sum(e.samples for e in evidences)
    excess = max((misfit - _lucky(evidences)) / samples, 0.0)
    whole = max(float(np.sum([np.sum(e.whitened**2) for e in evidences])) / samples - 1.0, excess, 1e-9)
    coloured = float(np.mean([correlation_time(e.whitened) for e in evidences])) - 1.0
    least = FIRST_ORDER if any(e.flight.known is not None for e in evidences) else 1.0
    return least + excess * (1.0 + coloured * excess / whole)


def correlation_time(series: FloatArray) -> float:
    """Samples in which innovations stay correlated [N, channels], the channels weighted by their energy."""
    n = len(series)
    spectrum = np.abs(np.fft.rfft(series, 2 * n, axis=0)) ** 2
    together = np.fft.irfft(spectrum.sum(axis=1), 2 * n)[:n]
    if together[0] <= 0.0:
        return 1.0
    rho = together / together[0]
    below = np.flatnonzero(rho < 0.05)
    return float(1.0 + 2.0 * np.sum(rho[1 : below[0] if len(below) else n]))
