"""Evidence of all records together, flown again about the fitted model where need be, and tempered by what is left."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from icing_env.record import FloatArray
from sim2real.attribution import Posterior, attribute, nuisance_mean, with_prior
from sim2real.candidates import NUISANCE_STEP, Bank, shifted
from sim2real.evidence import Evidence, gather
from sim2real.reconstruct import Reconstruction
from sim2real.references import Baseline

RELINEARISE = 8.0  # whitened distance of the fitted nuisances beyond which all is flown again about them
FARTHEST = 6.0  # standard deviations: what is beyond is no nuisance
Progress = Callable[[str], None]


def fit(flights: Sequence[Reconstruction], candidates: Bank, untestable: dict[str, str], baseline: Baseline,
        progress: Progress) -> tuple[list[Evidence], Posterior]:
    """Evidence and posterior; flown a second time about the fitted model where the first fit lies far from it.

    Signatures are linear in the nuisances only nearby: a 10 % error of CZ_0 seen from afar leaves 4 % of itself, which
    is enough to blame an accelerometer.
    """
    evidences: list[Evidence] = []
    for i, flight in enumerate(flights, start=1):
        progress(f"flying {candidates.size} variants along record {i} of {len(flights)}")
        evidences.append(gather(flight, candidates))
    centre = np.zeros(len(candidates.nuisances))
    posterior = weigh(evidences, candidates, dict(untestable), baseline, centre)
    gram = total(evidences) / posterior.tempering
    mean = nuisance_mean(gram, candidates, posterior, baseline.precision)
    far = mean @ gram[1 : len(mean) + 1, 1 : len(mean) + 1] @ mean / NUISANCE_STEP**2
    if far > RELINEARISE**2:
        centre = np.clip(mean, -FARTHEST, FARTHEST)
        progress("flying the variants again about the fitted model")
        evidences = [gather(replace(f, parameters=shifted(f.parameters, candidates.nuisances, centre, f.power_from)),
                            candidates) for f in flights]  # fmt: skip
    return evidences, weigh(evidences, candidates, untestable, baseline, centre)


def total(evidences: Sequence[Evidence]) -> FloatArray:
    """Inner products of all records together."""
    return np.asarray(np.sum([e.gram for e in evidences], axis=0))


def weigh(evidences: Sequence[Evidence], candidates: Bank, untestable: dict[str, str], baseline: Baseline,
          centre: FloatArray) -> Posterior:
    """Posterior of all records together; effects whose whole range would not show are added to `untestable`.

    Args:
        evidences, candidates: what was flown.
        untestable: effects left out, with the reason; changed in place.
        baseline: the model and its precision.
        centre: nuisances [n] by which the flown model had been moved.
    """
    data, nothing = total(evidences), np.zeros_like(baseline.precision)

    def posterior_of(tempering: float) -> Posterior:
        gram = with_prior(data / tempering, candidates, baseline.precision, centre)
        return replace(attribute(gram, candidates, tuple(untestable), nothing), tempering=tempering)

    posterior = posterior_of(1.0)
    tempering = temper(posterior.least_misfit, evidences)
    if tempering > 1.0:
        posterior = posterior_of(tempering)
    quiet = [name for name, found in posterior.fits.items() if found.smallest is None]
    for name in quiet:
        untestable[name] = "no excitation: these records would not show it anywhere in its range"
    return posterior_of(tempering) if quiet else posterior


def temper(misfit: float, evidences: Sequence[Evidence]) -> float:
    """What to divide the evidence by because even the best explanation leaves more than noise, and that coloured.

    With the mean whitened square c of what is left over and the correlation time tau of the innovations (in samples):
    1 + (c - 1) tau, and 1 where c is below one. Model error that nobody can name is thus counted as noise, instead of
    as thousands of independent proofs of whatever lies nearest.
    """
    excess = misfit / sum(e.samples for e in evidences) - 1.0
    return 1.0 + max(excess, 0.0) * float(np.mean([correlation_time(e.whitened) for e in evidences]))


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
