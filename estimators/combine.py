"""One estimate from several records of one aircraft."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimators.estimate import Estimate


def combine(results: Sequence[dict[str, Estimate]]) -> dict[str, Estimate]:
    """Mean of each derivative over the records that could show it, weighted by inverse variance.

    Where the estimates scatter more than their standard errors allow, the error of the mean is widened by Birge's
    ratio sqrt(chi2 / (n - 1)) (R. T. Birge, Phys. Rev. 40, 207, 1932). From one record, its estimate as it is. A
    derivative that no record shows is left out.

    Args:
        results: estimates by name, one mapping per record.
    """
    names = dict.fromkeys(name for result in results for name, e in result.items() if e.identifiable)
    return {name: _mean([r[name] for r in results if name in r and r[name].identifiable]) for name in names}


def _mean(found: list[Estimate]) -> Estimate:
    if len(found) == 1:
        return found[0]
    values, errors = (np.array([getattr(e, key) for e in found]) for key in ("estimate", "std_error"))
    # An error of zero (a record without noise) would divide by zero: it weighs as the rounding of its number would.
    weights = 1.0 / np.maximum(errors, np.finfo(float).eps * np.maximum(np.abs(values), 1e-300)) ** 2
    mean = float(np.average(values, weights=weights))
    birge = np.sqrt(np.sum(weights * (values - mean) ** 2) / (len(found) - 1))
    error = float(max(birge, 1.0) / np.sqrt(np.sum(weights)))
    return Estimate(mean, error, found[0].unit, f"{found[0].method}, mean of {len(found)} records")
