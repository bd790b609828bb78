"""How probable explanations are before any record: no gap, effects alone or together, something unknown."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim2real.posterior.devices import within

# Assumed: what is left is shared by single effects. A pair is about one per cent as likely as either member.
P_NONE, P_UNKNOWN, P_PAIRS, P_TRIPLES, P_BESIDE = 0.8, 0.02, 0.028, 0.0008, 0.0028
SAME_PLACE = 0.02  # of that where two members are faults of one device: another form of one is likelier (assumed)


def single_prior(testable: int) -> float:
    """Log prior probability of one of `testable` effects by itself."""
    return float(np.log((1.0 - P_NONE - P_UNKNOWN - P_PAIRS - P_TRIPLES - P_BESIDE) / max(testable, 1)))


def set_prior(names: Sequence[str], testable: int) -> float:
    """Log prior probability of a pair or triple of `testable` effects."""
    n = testable
    share = P_PAIRS / (n * (n - 1) / 2) if len(names) == 2 else P_TRIPLES / (n * (n - 1) * (n - 2) / 6)
    guest = any(within(name, [other for other in names if other != name]) for name in names)
    return float(np.log(share) + (np.log(SAME_PLACE) if guest else 0.0))


def unknown_prior(beside: float | None = None) -> float:
    """Log prior probability of something unknown, by itself or beside effects of that log prior probability."""
    return float(np.log(P_UNKNOWN) if beside is None else np.log(P_BESIDE / (1.0 - P_NONE)) + beside)
