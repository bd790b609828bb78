"""What the library lacks: generic discrepancies of one component, alone or beside a set of effects.

Linear-Gaussian terms (constant, linear, quadratic, drifting) whose coefficients are integrated out in closed form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from icing_env.record import FloatArray
from sim2real.candidates import Bank
from sim2real.sets import SetFit
from sim2real.terms import Term

SCALES = (0.5, 1.0, 2.0)  # sizes of generic terms, in their own unit (assumed)
IN_STEP = 0.03  # of the unit of a channel's lag: 3 ms, by which channels are out of step for no reason (assumed)
STEP = 1e-3  # of an effect's range, for the slope of its signature


@dataclass(frozen=True)
class UnknownFit:
    """A generic discrepancy of one component: its evidence, terms (name, coefficient, standard error) and misfit."""

    component: str
    log_evidence: float
    terms: tuple[tuple[str, float, float], ...]
    misfit: float
    weights: dict[int, float]

    @property
    def left(self) -> float:
        """Whitened square that it leaves, less the luck of so many terms."""
        return self.misfit + len(self.terms)


def beside(reduced: FloatArray, bank: Bank, fit: SetFit, slopes: list[dict[int, float]]) -> FloatArray:
    """Inner products with row 0 the residual that a set of effects leaves, its sizes free to give way.

    Args:
        slopes: weights of the flown rows in each member's slope per standard deviation of its estimate: a member may
            move by its own uncertainty, no farther.
    """
    rows, weights = list(fit.weights or {}), np.array(list((fit.weights or {}).values()))

    def moved(inner: FloatArray) -> FloatArray:
        inner[:, 0] += inner[:, rows] @ weights
        return inner

    out = reduced.copy()
    out[0] += weights @ reduced[rows]
    out = moved(out)
    if not slopes:
        return out
    onto = np.array([np.array(list(slope.values())) @ reduced[list(slope)] for slope in slopes])
    inner = np.array([onto[:, list(slope)] @ np.array(list(slope.values())) for slope in slopes]).T
    onto = moved(onto)
    return np.asarray(out - onto.T @ np.linalg.solve(inner + 1e-2 * np.eye(len(slopes)), onto))


def _by_timing(terms: Sequence[Term], T: FloatArray, t: FloatArray) -> float:
    """Log evidence that a channel slightly out of step would have: it needs nothing unknown."""
    lags = [i for i, term in enumerate(terms) if term.name == f"{term.target}_dot"]
    return float(max([0.0, *_each_alone(T, t, IN_STEP)[lags]]))


def _each_alone(T: FloatArray, t: FloatArray, scale: float) -> FloatArray:
    """Log evidence of every term by itself [terms]."""
    known = scale**2 * np.diag(T)
    return np.asarray(0.5 * (scale * t) ** 2 / (1.0 + known) - 0.5 * np.log1p(known))


def fit_unknown(reduced: FloatArray, bank: Bank) -> list[UnknownFit]:
    """Evidence of generic terms, component by component; log_evidence is over row 0's own likelihood.

    One term alone is as likely beforehand as all of a component's together: most gaps are simple, and every term that
    is not needed costs evidence.
    """
    out = []
    for component in dict.fromkeys(term.component for term in bank.terms):
        terms = [term for term in bank.terms if term.component == component]
        rows = [term.row for term in terms]
        T, t = reduced[np.ix_(rows, rows)], -reduced[rows, 0]
        if np.max(np.diag(T)) <= 0.0:
            continue
        joint = [_joint(T, t, scale) for scale in SCALES]
        alone = np.array([_each_alone(T, t, scale) for scale in SCALES])
        together = float(np.logaddexp.reduce([log for log, _, _ in joint])) - np.log(2 * len(SCALES))
        single = float(np.logaddexp.reduce(alone, axis=None)) - np.log(2 * alone.size)
        if single > together:
            k, chosen = divmod(int(np.argmax(alone)), len(rows))
            variance = 1.0 / (SCALES[k] ** -2 + T[chosen, chosen])
            mean, error, kept = np.array([variance * t[chosen]]), np.array([np.sqrt(variance)]), [chosen]
        else:
            _, mean, error = max(joint, key=lambda one: one[0])
            kept = list(range(len(rows)))
        found = tuple((terms[i].name, float(m), float(e)) for i, m, e in zip(kept, mean, error, strict=True))
        log = float(np.logaddexp(together, single)) - _by_timing(terms, T, t)
        out.append(UnknownFit(component, log, found,
                              float(reduced[0, 0] - mean @ t[kept]),
                              {rows[i]: float(m) for i, m in zip(kept, mean, strict=True)}))
    return out


def _joint(T: FloatArray, t: FloatArray, scale: float) -> tuple[float, FloatArray, FloatArray]:
    """All terms of a component together: log evidence, means and standard errors."""
    inner = np.eye(len(t)) + scale**2 * T
    solved = np.linalg.solve(inner, scale * t)
    log = 0.5 * float(scale * t @ solved) - 0.5 * float(np.linalg.slogdet(inner)[1])
    return log, np.asarray(scale * solved, np.float64), scale * np.sqrt(np.diag(np.linalg.inv(inner)))
