"""Flights of the same aircraft without the gap: they correct the model, and say how well it is known then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env import aircraft
from icing_env.record import FlightRecord, FloatArray
from sim2real.baseline.fit import in_any_gusts, possible
from sim2real.baseline.inadequacy import clean, colour
from sim2real.library.candidates import Bank, Nuisance
from sim2real.prediction.gusts import LATER, Kind
from sim2real.records.reconstruct import Inadequacy, Reconstruction

REFERENCE_SPEED = 65.0  # m/s, where a number has its value; it changes with (65/V)^2, as alpha does in level flight
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
    fit = in_any_gusts(flights, directions(candidates), at)
    found = _baseline(candidates, fit.moves, fit.x, fit.precision, conditions(records) if records else at)
    left = Inadequacy(fit.walk, *colour(fit.evidences))
    flown = [replace(flight, inadequacy=left) for flight in fit.flown()]
    told = clean(flown, fit.gains(), candidates, found.precision)
    return replace(found, inadequacy=left, clean=told, kind=fit.kind)


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
    return Baseline(possible(row), 0.5 * (out + out.T), changes, spread=None)
