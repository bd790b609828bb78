"""What the library lacks: generic discrepancies of one component, alone or beside a set of effects.

Linear-Gaussian terms (constant, linear, quadratic, drifting) whose coefficients are integrated out in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from icing_env.record import FloatArray
from sim2real.candidates import Bank
from sim2real.sets import SetFit

SCALES = (0.5, 1.0, 2.0)  # sizes of generic terms, in their own unit (assumed)
STEP = 1e-3  # of an effect's range, for the slope of its signature


@dataclass(frozen=True)
class UnknownFit:
    """A generic discrepancy of one component: its evidence, terms (name, coefficient, standard error) and misfit."""

    component: str
    log_evidence: float
    terms: tuple[tuple[str, float, float], ...]
    misfit: float
    weights: dict[int, float]


def beside(reduced: FloatArray, bank: Bank, fit: SetFit, slopes: list[dict[int, float]]) -> FloatArray:
    """Inner products with row 0 the residual that a set of effects leaves, its sizes free to give way.

    Args:
        slopes: weights of the flown rows in each member's slope per standard deviation of its estimate: a member may
            move by its own uncertainty, no farther.
    """
    moved = np.eye(len(reduced))
    for row, weight in (fit.weights or {}).items():
        moved[0, row] += weight
    out = moved @ reduced @ moved.T
    if not slopes:
        return np.asarray(out)
    change = np.zeros((len(slopes), len(reduced)))
    for m, slope in enumerate(slopes):
        change[m, list(slope)] = list(slope.values())
    onto = change @ reduced @ moved.T
    inner = change @ reduced @ change.T + 1e-2 * np.eye(len(slopes))
    return np.asarray(out - onto.T @ np.linalg.solve(inner, onto))


def fit_unknown(reduced: FloatArray, bank: Bank) -> list[UnknownFit]:
    """Evidence of generic terms, component by component; log_evidence is over row 0's own likelihood."""
    out = []
    for component in dict.fromkeys(term.component for term in bank.terms):
        terms = [term for term in bank.terms if term.component == component]
        rows = [term.row for term in terms]
        T, t = reduced[np.ix_(rows, rows)], -reduced[rows, 0]
        if np.max(np.diag(T)) <= 0.0:
            continue
        logs, means, errors = [], [], []
        for scale in SCALES:
            inner = np.eye(len(rows)) + scale**2 * T
            solved = np.linalg.solve(inner, scale * t)
            logs.append(0.5 * float(scale * t @ solved) - 0.5 * float(np.linalg.slogdet(inner)[1]))
            means.append(scale * solved)
            errors.append(scale * np.sqrt(np.diag(np.linalg.inv(inner))))
        k = int(np.argmax(logs))
        found = tuple((term.name, float(m), float(e)) for term, m, e in zip(terms, means[k], errors[k], strict=True))
        left = float(reduced[0, 0] - means[k] @ t)
        out.append(UnknownFit(component, float(logsumexp(logs) - np.log(len(SCALES))), found, left,
                              dict(zip(rows, (float(m) for m in means[k]), strict=True))))
    return out
