"""Flights of the same aircraft without the gap: they correct the model, and say how well it is known then.

The model's numbers are fitted by Gauss-Newton, all flown anew at every step, each with a value and a change with the
flight condition: an aircraft whose derivatives bend with angle of attack is met by lines through its test points. Their
prior is that of the published model; where the flights contradict it a number's prior widens until they do not
(automatic relevance: MacKay, Neural Computation 4(3), 1992), so that an aircraft far from the model is followed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env import aircraft
from icing_env.record import FlightRecord, FloatArray
from sim2real.baseline.inadequacy import WALKS, clean, colour, walk
from sim2real.library.candidates import INSTRUMENTS, NUISANCE_STEP, Bank, Nuisance
from sim2real.prediction.gusts import KINDS, LATER, Kind
from sim2real.prediction.kalman import follow
from sim2real.records.reconstruct import Inadequacy, Reconstruction
from sim2real.signatures.evidence import Evidence, gather
from sim2real.signatures.gust_intensity import SIGMAS, choose_gain
from sim2real.signatures.tempering import temper

ROUNDS, SETTLED = 10, 4.0  # flown steps, and the whitened length of one that ends them
AGAIN = 2  # the round after which gust intensities are chosen anew at every step: what does not fit passes for gusts
LONGEST = 40.0  # standard deviations that a step may move a number
REFERENCE_SPEED = 65.0  # m/s, where a number has its value; it changes with (65/V)^2, as alpha does in level flight
CHANGES = 1.0  # prior standard deviation of that change at twice the dynamic pressure, in that of the value (assumed)
# What the published spread leaves alone and another aircraft may have: standard deviations (assumed). No cubes: where
# the references did not fly, they run away.
BEYOND: dict[str, float] = {
    "Cl_alpha": 2e-3, "Cn_alpha": 3e-3, "CX_elevator": 5e-3,
    "CY_aileron": 3e-3, "Cl_q": 0.02, "Cn_q": 0.02, "Cm_p": 0.05, "Cm_r": 0.05,
    "thrust_factor_left+thrust_factor_right": 0.02,
    # with thrust
    "Cm_CT": 0.02, "Cl_CT": 1e-3, "Cn_CT": 1e-3, "CZ_alpha_CT": 0.3, "Cm_alpha_CT": 0.1, "Cn_alpha_CT": 0.02,
    "CY_beta_CT": 0.1, "Cl_beta_CT": 0.02, "Cn_beta_CT": 0.02,
    # of second order
    "CZ_alpha2": 0.3, "Cm_alpha2": 0.1, "Cm_elevator2": 0.1, "CX_beta2": 0.1, "CZ_beta2": 0.3, "Cm_beta2": 0.1,
    "Cm_alpha_elevator": 0.1, "CZ_alpha_q": 5.0, "Cm_alpha_q": 5.0, "CY_alpha_beta": 0.1, "Cl_alpha_beta": 0.02,
    "Cn_alpha_beta": 0.02, "CY_alpha_p": 0.2, "Cl_alpha_p": 0.5, "Cn_alpha_p": 0.2, "Cl_alpha_r": 0.2,
    "Cn_alpha_r": 0.2, "CY_alpha_rudder": 0.1, "Cn_alpha_aileron": 0.02, "Cn_alpha_rudder": 0.05}
ALIKE = (*INSTRUMENTS, "spool_time")  # in all flights
STEADY = 1e-3  # the change with the flight condition of what an instrument or a path has
# a matter of each record and its recorder
FIXED = ("mass", "thrust", "filter_frequency", "vane_lag", "pitot_lag", "boom_gain")
REPEATABLE = 0.2  # standard deviations: no number is known better for another flight (assumed: 1 % of a derivative)
LEAST = 1e-3  # of a published step: a number near zero has a nuisance that hardly moves it


@dataclass(frozen=True)
class Baseline:
    """The model a gap is looked for against: its PARAMETERS row and the precision of its nuisances [n, n].

    `changes`: what is added to PARAMETERS per unit of (65 m/s / V)^2 - 1, by name; `inadequacy`: what is
    left then; `clean`: what generic terms explain of the references all the same, log evidence by component;
    `spread`: how many times the published spread its derivatives are uncertain by (`baseline.spread`); None where
    reference flights say how well they are known. `kind`: of the gusts along reference flights.
    """

    parameters: NDArray
    precision: FloatArray
    changes: dict[str, float] = field(default_factory=dict)
    inadequacy: Inadequacy = field(default_factory=Inadequacy)
    clean: dict[str, float] = field(default_factory=dict)
    spread: float | None = 1.0
    kind: Kind = LATER

    def near(self, record: FlightRecord) -> NDArray:
        """PARAMETERS row at the record's median airspeed."""
        out = self.parameters.copy()
        if self.changes:
            condition = _condition(record)
            for name, slope in self.changes.items():
                out[name] += condition * slope
        return out

    def answer(self) -> dict[str, Any]:
        """What references say of the model with its numbers at their best, for machines."""
        return {**asdict(self.inadequacy), "explained_without_a_gap": {c: v for c, v in self.clean.items() if v > 0.0}}


def conditions(records: Sequence[FlightRecord]) -> FloatArray:
    """What numbers go with, beside their values at 65 m/s, at the median airspeed of each record [records]."""
    return np.array([_condition(record) for record in records])


def _condition(record: FlightRecord) -> float:
    return (REFERENCE_SPEED / float(np.nanmedian(record["airspeed"]))) ** 2 - 1.0


def _first(nuisance: Nuisance) -> str:
    return nuisance.parameter.split("+")[0]


def directions(candidates: Bank) -> tuple[Nuisance, ...]:
    """What is fitted: the candidates' nuisances in steps of the published numbers' size, then those of BEYOND."""
    row = aircraft.load()[0]
    out = []
    for nuisance in candidates.nuisances:
        size = nuisance.factor * (1.0 if nuisance.absolute else abs(float(row[_first(nuisance)])))
        out.append(replace(nuisance, factor=size, absolute=True, only="nowhere" if nuisance.name in FIXED else ""))
    known = {nuisance.name for nuisance in out}
    return (*out, *(_beyond(name) for name in BEYOND if name not in known))


def _beyond(name: str) -> Nuisance:
    return Nuisance(name, name, BEYOND[name], True)


def uncertain() -> tuple[Nuisance, ...]:
    """Nuisances beside the usual ones where reference flights tell the model's numbers.

    What these tell badly would else be told as something unknown, or as an effect that changes the same number.
    """
    return tuple(_beyond(name) for name in BEYOND)


def fit_baseline(flights: Sequence[Reconstruction], candidates: Bank, records: Sequence[FlightRecord] = ()
                 ) -> Baseline:  # fmt: skip
    """The model corrected by reference flights, and the precision with which they leave it.

    Args:
        flights: the reference flights.
        candidates: whose nuisances are corrected.
        records: flown later, at whose airspeeds the precision is told; the reference flights' if none are given.
    """
    at = conditions([flight.record for flight in flights])
    fit = Fit(flights, directions(candidates), at)
    fit.run()
    return fit.baseline(candidates, conditions(records) if records else at)


class Fit:
    """Values and changes of the numbers `moves`, fitted to `flights`.

    x: the numbers' values, then their changes [2 n], in `moves`' units; precision: of x; walk: of `Inadequacy`.
    """

    def __init__(self, flights: Sequence[Reconstruction], moves: Sequence[Nuisance], at: FloatArray,
                 kinds: Sequence[Kind] = KINDS) -> None:
        """Begin with the model as it is.

        Args:
            at: condition that changes go with [flights], zeros for none.
            kinds: of gusts, of which the likeliest is taken.
        """
        self.kinds = kinds
        n = len(moves)
        self.flights, self.moves, self.at = flights, moves, at
        self.bank = Bank(tuple(moves), (), (), 1 + n)
        changing = [STEADY if move.name in ALIKE else CHANGES for move in moves]
        self.widest = np.tile([1.0 if move.name in ALIKE else np.inf for move in moves], 2)
        self.x, self.spread = np.zeros(2 * n), np.concatenate([np.ones(n), changing])
        self.walk, self.kind = WALKS[-1], LATER  # while the model may still be far off
        self.precision = np.zeros((0, 0))
        self.evidences: list[Evidence] = []

    def run(self) -> None:
        """Step until it settles, the process noise judged on the way."""
        for k in range(ROUNDS):
            settled = self.step(again=k > AGAIN) < SETTLED
            if k == AGAIN or (k > AGAIN and settled):
                last, (self.walk, self.kind) = self.walk, walk(self.flown(), self.kinds)
                if k > AGAIN and self.walk == last:
                    break

    def flown(self) -> list[Reconstruction]:
        """The flights over the model as fitted so far."""
        n, out = len(self.moves), []
        for flight, condition in zip(self.flights, self.at, strict=True):
            row = flight.parameters.copy()
            for nuisance, size in zip(self.moves, self.x[:n] + condition * self.x[n:], strict=True):
                nuisance.apply(row, 0, flight.power_from, float(size))
            out.append(replace(flight, parameters=_possible(row), inadequacy=Inadequacy(self.walk)))
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

    def baseline(self, candidates: Bank, at: FloatArray) -> Baseline:
        """What was fitted, and how well it flies; its precision on average over the conditions `at`."""
        found = _baseline(candidates, self.moves, self.x, self.precision, at)
        left = Inadequacy(self.walk, *colour(self.evidences))
        flown = [replace(flight, inadequacy=left) for flight in self.flown()]
        told = clean(flown, [e.gain for e in self.evidences], candidates, found.precision)
        return replace(found, inadequacy=left, clean=told, kind=self.kind)


def _possible(row: NDArray) -> NDArray:
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


def _baseline(candidates: Bank, moves: Sequence[Nuisance], x: FloatArray, precision: FloatArray,
              at: FloatArray) -> Baseline:
    """The fitted model; its nuisances' precision in their own units, the rest integrated out.

    Where references did not fly, the change with speed is told by the prior, and numbers are as uncertain as that.
    """
    n, count = len(moves), len(candidates.nuisances)
    row, changes = aircraft.load(), dict[str, float]()
    for nuisance, size, change in zip(moves, x[:n], x[n:], strict=True):
        if not nuisance.only:
            nuisance.apply(row, 0, "", float(size))
            changes |= {name: float(change) * nuisance.factor for name in nuisance.parameter.split("+")}
    whole = np.linalg.inv(precision)
    value, change, across = whole[:n, :n], whole[n:, n:], whole[:n, n:]
    covariance = (value + np.mean(at) * (across + across.T) + np.mean(at**2) * change)[:count, :count]
    unit = np.ones(count)
    for j, (nuisance, move) in enumerate(zip(candidates.nuisances, moves, strict=False)):
        if not nuisance.absolute:
            now = abs(float(row[_first(nuisance)][0])) * nuisance.factor
            unit[j] = max(now / move.factor, LEAST)
    out = np.linalg.inv(covariance / unit[:, None] / unit + REPEATABLE**2 * np.eye(count))
    for j, nuisance in enumerate(candidates.nuisances):
        if nuisance.name in FIXED:
            out[j], out[:, j] = 0.0, 0.0
            out[j, j] = 1.0
    return Baseline(_possible(row), 0.5 * (out + out.T), changes, spread=None)
