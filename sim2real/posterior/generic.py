"""What the library lacks: generic discrepancies of one component, alone or beside a set of effects.

Linear-Gaussian terms (constant, linear, quadratic, drifting) whose coefficients are integrated out in closed form.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import gammaln

from icing_env.jit import entry
from icing_env.record import FloatArray
from sim2real.library.candidates import Bank
from sim2real.library.terms import Term, in_what_is_left
from sim2real.posterior.sets import SetFit

SCALES = (0.5, 1.0, 2.0)  # sizes of generic terms, in their own unit (assumed)
IN_STEP = 0.03  # of the unit of a channel's lag: 3 ms, by which channels are out of step for no reason (assumed)
FEW = 6  # terms at most that are chosen from a component's one by one
COURSE = "course"  # name of a free course of time among terms


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

    @property
    def surest(self) -> str:
        """Name of the term that is farthest from nothing by its standard error; empty if there is none."""
        return max(self.terms, key=lambda term: abs(term[1]) / term[2], default=("", 0.0, 1.0))[0]


def beside(reduced: FloatArray, fit: SetFit, slopes: list[dict[int, float]]) -> FloatArray:
    """Inner products with row 0 the residual that a set of effects leaves, its sizes free to give way.

    Args:
        slopes: weights of the flown rows in each member's slope per standard deviation of its estimate: a member may
            move by its own uncertainty, no farther.
    """
    rows, weights = list(fit.weights or {}), np.array(list((fit.weights or {}).values()))
    out = moved(reduced, rows, weights)
    if not slopes:
        return out
    onto = np.array([np.array(list(slope.values())) @ reduced[list(slope)] for slope in slopes])
    inner = np.array([onto[:, list(slope)] @ np.array(list(slope.values())) for slope in slopes]).T
    onto[:, 0] += onto[:, rows] @ weights
    return np.asarray(out - onto.T @ np.linalg.solve(inner + 1e-2 * np.eye(len(slopes)), onto))


def moved(inner: FloatArray, rows: Sequence[int], weights: FloatArray) -> FloatArray:
    """Inner products with so much of some rows added to row 0."""
    out = inner.copy()
    out[0] += weights @ inner[rows]
    out[:, 0] += out[:, rows] @ weights
    return out


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

    One term alone, a few, and all of a component's together are equally likely beforehand: most gaps are simple, and
    every term that is not needed costs evidence. A few are chosen one by one, each where it adds most; the evidence of
    all other choices of as many is not counted.
    """
    out = []
    for component in dict.fromkeys(term.component for term in bank.terms):
        terms = [term for term in bank.terms if term.component == component]
        rows = [term.row for term in terms]
        T, t = reduced[np.ix_(rows, rows)], -reduced[rows, 0]
        if np.max(np.diag(T)) <= 0.0:
            continue
        ways = [way(T, t) for way in (_one, _few, _all)]
        _, scale, kept = max(ways, key=lambda way: way[0])
        variance = np.linalg.inv(T[np.ix_(kept, kept)] + scale**-2 * np.eye(len(kept)))
        mean, error = variance @ t[kept], np.sqrt(np.diag(variance))
        found = tuple((terms[i].name, float(m), float(e)) for i, m, e in zip(kept, mean, error, strict=True))
        together = float(np.logaddexp.reduce([log for log, _, _ in ways])) - np.log(len(ways))
        needless = _by_timing(terms, T, t) + bank.clean.get(component, 0.0)
        out.append(UnknownFit(component, together - needless, found,
                              float(reduced[0, 0] - mean @ t[kept]),
                              {rows[i]: float(m) for i, m in zip(kept, mean, strict=True)}))
    return out


Way = tuple[float, float, list[int]]  # log evidence, the likeliest scale, and terms of a way to describe a component


def fit_unknown_left(left: FloatArray, bank: Bank) -> list[UnknownFit]:
    """The same of what a flown set leaves (row 0, then generic terms); weights by row of the bank."""
    return [replace(u, weights={bank.terms[row - 1].row: w for row, w in u.weights.items()})
            for u in fit_unknown(left, replace(bank, terms=in_what_is_left(bank.terms)))]


def fit_some_left(left: FloatArray, bank: Bank, chosen: Collection[tuple[str, str]]) -> UnknownFit | None:
    """The same of some terms of one component, by (component, name); none where these make nothing of the records."""
    few = tuple(term for term in bank.terms if (term.component, term.name) in chosen)
    rows = [0, *(row for row, term in enumerate(bank.terms, 1) if term in few)]
    found = fit_unknown_left(left[np.ix_(rows, rows)], replace(bank, terms=few))
    return found[0] if found else None


def _one(T: FloatArray, t: FloatArray) -> Way:
    """One term, whichever."""
    alone = np.array([_each_alone(T, t, scale) for scale in SCALES])
    k, chosen = divmod(int(np.argmax(alone)), len(t))
    return float(np.logaddexp.reduce(alone, axis=None)) - float(np.log(alone.size)), SCALES[k], [chosen]


def _few(T: FloatArray, t: FloatArray) -> Way:
    """Two to FEW terms, each number and each choice of as many as likely."""
    n, most = len(t), min(FEW, len(t))
    if most < 2:
        return -np.inf, SCALES[0], [0]
    logs, order = np.empty((len(SCALES), most)), np.empty((len(SCALES), most), np.intp)
    _forward(np.ascontiguousarray(T), t, np.array(SCALES), logs, order)
    count = np.arange(1, most + 1)
    choices = gammaln(n + 1) - gammaln(count + 1) - gammaln(n - count + 1)
    several = (logs - choices)[:, 1:]
    k, last = np.unravel_index(int(np.argmax(several)), several.shape)
    return (float(np.logaddexp.reduce(several, axis=None)) - float(np.log(several.size)), SCALES[k],
            [int(i) for i in order[k, : last + 2]])


def _all(T: FloatArray, t: FloatArray) -> Way:
    """All terms of a component together."""
    logs = [_joint(T, t, scale) for scale in SCALES]
    return (float(np.logaddexp.reduce(logs)) - float(np.log(len(SCALES))), SCALES[int(np.argmax(logs))],
            list(range(len(t))))


def _joint(T: FloatArray, t: FloatArray, scale: float) -> float:
    """Log evidence of some terms together."""
    inner = np.eye(len(t)) + scale**2 * T
    solved = np.linalg.solve(inner, scale * t)
    return 0.5 * float(scale * t @ solved) - 0.5 * float(np.linalg.slogdet(inner)[1])


@entry
def _forward(T: Any, t: Any, scales: Any, logs: Any, order: Any) -> None:
    """Choose terms one by one, each where the evidence gains most: its log [scales, chosen] and which [the same]."""
    n = len(t)
    for s in range(len(scales)):
        inner, onto, total = scales[s]**2*T + np.eye(n), scales[s]*t, 0.0
        left = np.ones(n)
        for k in range(logs.shape[1]):
            best, most = -1, -np.inf
            for j in range(n):
                gain = 0.5*onto[j]**2/inner[j, j] - 0.5*np.log(inner[j, j])
                if left[j] > 0.0 and gain > most:
                    best, most = j, gain
            total += most
            logs[s, k], order[s, k], left[best] = total, best, 0.0
            across, pivot = inner[:, best].copy(), inner[best, best]
            onto = onto - across*(onto[best]/pivot)
            for i in range(n):
                for j in range(n):
                    inner[i, j] -= across[i]*across[j]/pivot
            for i in range(n):
                inner[i, i] = max(inner[i, i], 1e-12)
