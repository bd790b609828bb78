"""The model's numbers brought to their best along some flights, in the gusts that these met.

By Gauss-Newton, all flights flown anew at every step, each number with a value and a change with the flight condition:
an aircraft whose derivatives bend with angle of attack is met by lines through its test points. Their prior is that of
the published model; where the flights contradict it a number's prior widens until they do not (automatic relevance:
MacKay, Neural Computation 4(3), 1992), so that an aircraft far from the model is followed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from icing_env.record import FloatArray
from sim2real.baseline.inadequacy import WALKS, walk
from sim2real.library.candidates import INSTRUMENTS, NUISANCE_STEP, Bank, Nuisance
from sim2real.prediction.gusts import LATER, Kind
from sim2real.prediction.kalman import Gain, follow
from sim2real.records.reconstruct import Inadequacy, Reconstruction
from sim2real.signatures.evidence import Evidence, gather
from sim2real.signatures.gust_intensity import (
    AT_ONCE,
    CALM,
    SIGMAS,
    STRAIGHT,
    TURNING_KINDS,
    asked,
    choose_gain,
    in_turning_air,
    likelihoods,
)
from sim2real.signatures.tempering import temper

ROUNDS, SETTLED = 10, 4.0  # flown steps, and the whitened length of one that ends them
AGAIN = 2  # the round after which gust intensities are chosen anew at every step: what does not fit passes for gusts
LONGEST = 40.0  # standard deviations that a step may move a number
CHANGES = 1.0  # prior standard deviation of that change at twice the dynamic pressure, in that of the value (assumed)
ALIKE = (*INSTRUMENTS, "spool_time")  # in all flights
STEADY = 1e-3  # the change with the flight condition of what an instrument or a path has


def in_any_gusts(flights: Sequence[Reconstruction], moves: Sequence[Nuisance], at: FloatArray) -> Fit:
    """The fit in the likeliest kind of gusts, in each of which the numbers go to their best by themselves.

    Numbers that settled in gusts of another kind make those look like the right ones: a downwash whose lag is two and
    a half times as published stood for gusts that meet the tail when they meet the wing. So of gusts that meet all of
    the aircraft at once no more is asked than the least: what an aircraft's own numbers cannot make good of the wrong
    kind is hundreds of units of log likelihood in a flight. Air that turns is tried where it is likelier with the
    numbers of the straight kinds, and half of what is asked of it then has to be gained with its own.
    """
    best = _run(flights, moves, at, LATER)
    if max(gain.gusts.sigma for gain in best.gains()) < CALM:
        return best
    other = _run(flights, moves, at, STRAIGHT[1])
    if other.likelihood() > best.likelihood() + AT_ONCE[0] * len(flights):
        best = other
    if in_turning_air(best.flown(), best.gains()):
        turned = max((_run(flights, moves, at, kind) for kind in TURNING_KINDS), key=Fit.likelihood)
        if turned.likelihood() > best.likelihood() + 0.5 * sum(asked(gain) for gain in turned.gains()):
            best = turned
    return best


def _run(flights: Sequence[Reconstruction], moves: Sequence[Nuisance], at: FloatArray, kind: Kind) -> Fit:
    fit = Fit(flights, moves, at, kind)
    fit.run()
    return fit


class Fit:
    """Values and changes of the numbers `moves`, fitted to `flights`.

    x: the numbers' values, then their changes [2 n], in `moves`' units; precision: of x; walk: of `Inadequacy`.
    """

    def __init__(self, flights: Sequence[Reconstruction], moves: Sequence[Nuisance], at: FloatArray,
                 kind: Kind = LATER) -> None:
        """Begin with the model as it is.

        Args:
            at: condition that changes go with [flights], zeros for none.
            kind: of the gusts.
        """
        n = len(moves)
        self.flights, self.moves, self.at, self.kind = flights, moves, at, kind
        self.bank = Bank(tuple(moves), (), (), 1 + n)
        changing = [STEADY if move.name in ALIKE else CHANGES for move in moves]
        self.widest = np.tile([1.0 if move.name in ALIKE else np.inf for move in moves], 2)
        self.x, self.spread = np.zeros(2 * n), np.concatenate([np.ones(n), changing])
        self.walk = WALKS[-1]  # while the model may still be far off
        self.precision = np.zeros((0, 0))
        self.evidences: list[Evidence] = []

    def run(self) -> None:
        """Step until it settles, the process noise judged on the way."""
        for k in range(ROUNDS):
            settled = self.step(again=k > AGAIN) < SETTLED
            if k == AGAIN or (k > AGAIN and settled):
                last, self.walk = self.walk, walk(self.flown(), self.kind)
                if k > AGAIN and self.walk == last:
                    break

    def flown(self) -> list[Reconstruction]:
        """The flights over the model as fitted so far."""
        n, out = len(self.moves), []
        for flight, condition in zip(self.flights, self.at, strict=True):
            row = flight.parameters.copy()
            for nuisance, size in zip(self.moves, self.x[:n] + condition * self.x[n:], strict=True):
                nuisance.apply(row, 0, flight.power_from, float(size))
            out.append(replace(flight, parameters=possible(row), inadequacy=Inadequacy(self.walk)))
        return out

    def step(self, again: bool) -> float:
        """One step of x; its whitened length.

        Args:
            again: whether gust intensities are chosen anew.
        """
        flown = self.flown()
        known = ([follow(f, choose_gain(f, SIGMAS, (), self.kind)) for f in flown] if again or not self.evidences
                 else [e.gain for e in self.evidences])  # fmt: skip
        self.evidences = [gather(f, self.bank, gain) for f, gain in zip(flown, known, strict=True)]
        information, slope, tempering = _normal(self.evidences, self.at)
        prior = np.diag(1.0 / np.maximum(self.spread, np.minimum(np.abs(self.x), self.widest)) ** 2)
        self.precision = information / tempering + prior
        step = -np.linalg.solve(self.precision, slope / tempering + prior @ self.x)
        self.x = self.x + step * LONGEST / max(float(np.max(np.abs(step))), LONGEST)
        return float(np.sqrt(step @ self.precision @ step))

    def gains(self) -> list[Gain]:
        """Of the predictor of each flight, in gusts as strong as they were at the last step."""
        return [evidence.gain for evidence in self.evidences]

    def likelihood(self) -> float:
        """Log likelihood of a sample, summed over the flights."""
        likely = [(flight, choose_gain(flight, SIGMAS, (), self.kind)) for flight in self.flown()]
        return sum(likelihoods(flight, [gain])[0] for flight, gain in likely)


def possible(row: NDArray) -> NDArray:
    """No negative lags."""
    for name in ("elevator_lag", "aileron_lag", "rudder_lag", "vane_lag"):
        row[name] = np.maximum(row[name], 1e-3)
    return row


def _normal(evidences: Sequence[Evidence], at: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Information and slope of values and changes together [2 n], and what to divide them by (see tempering.temper)."""
    n = len(evidences[0].gram) - 1
    information, slope, misfit = np.zeros((2 * n, 2 * n)), np.zeros(2 * n), 0.0
    for evidence, condition in zip(evidences, at, strict=True):
        both = np.vstack([np.eye(n), condition * np.eye(n)]) / NUISANCE_STEP
        information += both @ evidence.gram[1:, 1:] @ both.T
        slope += both @ evidence.gram[1:, 0]
        misfit += evidence.gram[0, 0]
    gain = float(slope @ np.linalg.lstsq(information, slope, rcond=1e-9)[0])
    return information, slope, temper(max(misfit - gain, 0.0), evidences)
