"""Closure by the generator's own plant: a held-out record flown again in 10 s windows by a model of the aircraft.

Still air (nobody knows the gusts), the recorded commands, nobody correcting. Each window starts from the true state
with eight states (velocities, rates, bank, pitch) fitted to its first 2 s, whoever flies it; heading, altitude,
surfaces, shaft powers and downwash start true. f_c, of noise and gust alone, comes from the same windows of the
published aircraft's own draws. Gap and tolerances: 14 CFR Part 60, Appendix A, Table A2A; alpha, ax, ay assumed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.withheld import instruments
from testbed.withheld import plant as pl
from testbed.withheld.compiled import compiled
from testbed.withheld.conditions import Conditions
from testbed.withheld.distance import MOTION
from testbed.withheld.draw import published_spread
from testbed.withheld.flights import Aircraft, Flown, recorded
from testbed.withheld.manoeuvres import Manoeuvre
from testbed.withheld.trim import ALTITUDE

LENGTH, START = 500, 100  # samples: 10 s and 2 s
DEG, G0 = math.pi / 180.0, 9.80665
TOLERANCE = np.array([1.54, DEG, DEG, 2 * DEG, 2 * DEG, 2 * DEG, 2 * DEG, 1.5 * DEG, 0.02 * G0, 0.05 * G0, 0.10 * G0,
                      30.5])  # of MOTION
FREE = (pl.U, pl.V, pl.W, pl.P, pl.Q, pl.R, pl.PHI, pl.THETA)
FREE_STEP = np.array([0.5, 0.3, 0.3, 0.005, 0.005, 0.005, 0.005, 0.005])
FITTED = 8  # of MOTION: those that the start is fitted to
CORRECTIONS = 2
SUB = 2  # integration steps in a sample: no gusts change within it here
Manoeuvres = tuple[Manoeuvre, ...]
DRAWS, NULL_DRAWS = 16, 40  # behind f_c; behind the gap that aircraft with nothing but the spread reach


@dataclass(frozen=True)
class Held:
    """One held-out flight: readings of MOTION [samples, 12], true states [samples, 27], commands [samples, 5]."""

    readings: NDArray
    states: NDArray
    commands: NDArray


def held(flown: Flown, read: Mapping[str, NDArray]) -> Held:
    """What flying a record again needs of it."""
    return Held(np.column_stack([read[name] for name in MOTION]), flown.states, flown.commands)


@compiled
def _glide(row: Any, starts: Any, commands: Any, first: Any, steps: int) -> tuple[Any, Any]:
    """States [rows, steps + 1, 27] and outputs [rows, steps + 1, 9] from sample `first` of each row on, still air."""
    p = row[0]
    h, delay, still = pl.DT / SUB, round(row[0].elevator_delay / pl.DT), np.zeros(pl.GUSTS)
    Y, out = np.zeros((len(first), steps + 1, pl.STATES)), np.zeros((len(first), steps + 1, pl.OUTPUTS))
    d1, d2, d3, o, u = np.zeros(pl.STATES), np.zeros(pl.STATES), np.zeros(pl.STATES), np.zeros(pl.OUTPUTS), np.zeros(5)
    for i in range(len(first)):
        y = starts[i].copy()
        for k in range(steps + 1):
            at = first[i] + k
            if k > 0:
                u[:] = commands[at]
                u[0] = commands[max(at - delay, 0), 0]
                for s in range(SUB):
                    t = ((at - 1) * SUB + s) * h
                    pl.glide(y, p, u, t, h, d1, d2, d3, o)
            pl.rates(y, p, commands[at], still, at * pl.DT, d1, o)
            Y[i, k], out[i, k] = y, o
    return Y, out


def residual_energy(model: Aircraft, flight: Held) -> NDArray:
    """Mean square of measured less freely flown, in tolerances [windows, 12 of MOTION].

    A model that departs in a window is worth ten tolerances there in every channel.
    """
    row, wrong = model.row(), model.instruments()
    row["altitude_start"] = ALTITUDE
    first = np.arange(0, len(flight.readings) - LENGTH, LENGTH)
    measured = np.stack([flight.readings[k : k + LENGTH + 1] for k in first])
    starts = _started(row, wrong, flight, first, measured)
    found = _read(_glide(row, starts, flight.commands, first, LENGTH), first, wrong)
    left = np.clip(np.nan_to_num((measured - found)[:, 1:] / TOLERANCE, nan=10.0), -10.0, 10.0)
    return np.asarray(np.mean(left**2, axis=1))


def _started(row: NDArray, wrong: dict[str, float], flight: Held, first: NDArray, measured: NDArray) -> NDArray:
    """True states with FREE corrected by Gauss-Newton; how readings follow a start leaves the instruments' lags out."""
    starts, free = flight.states[first].copy(), list(FREE)
    tried = np.repeat(starts, len(free) + 1, axis=0)
    for j, state in enumerate(free):
        tried[j + 1 :: len(free) + 1, state] += FREE_STEP[j]
    Y, out = _glide(row, tried, flight.commands, np.repeat(first, len(free) + 1), START)
    seen = np.concatenate([out[..., [pl.VT, pl.ALPHA, pl.BETA]], Y[..., [pl.P, pl.Q, pl.R, pl.PHI, pl.THETA]]], axis=2)
    seen = (seen / TOLERANCE[:FITTED]).reshape(len(first), len(free) + 1, -1)
    J = (seen[:, 1:] - seen[:, :1]) / FREE_STEP[:, None]
    normal = J @ J.transpose(0, 2, 1) + np.diag(1e-2 / (10.0 * FREE_STEP) ** 2)
    for _ in range(CORRECTIONS):
        now = _read(_glide(row, starts, flight.commands, first, START), first, wrong)
        left = ((measured[:, : START + 1] - now) / TOLERANCE)[..., :FITTED].reshape(len(first), -1)
        starts[:, free] += np.linalg.solve(normal, np.einsum("wfn,wn->wf", J, left)[..., None])[..., 0]
    return starts


def _read(flown: tuple[NDArray, NDArray], first: NDArray, wrong: dict[str, float]) -> NDArray:
    """Readings of MOTION [windows, samples, 12], instruments settled at the start of each window."""
    Y, out = flown
    found = np.empty((*Y.shape[:2], len(MOTION)))
    for i, k in enumerate(first):
        channels = instruments.exact(Y[i], out[i], wrong, float(k) * pl.DT)
        found[i] = np.column_stack([channels[name] for name in MOTION])
    return found


@lru_cache(maxsize=256)
def alone(manoeuvre: Manoeuvre, gain: float, given: Conditions) -> NDArray:
    """Mean squares per draw [DRAWS, 12]: the published aircraft's own records, with gust and noise, flown by itself."""
    rng = np.random.default_rng(0)
    flights = [held(*recorded(Aircraft(), manoeuvre, gain, given, rng)) for _ in range(DRAWS)]
    return np.array([np.mean(residual_energy(Aircraft(), flight), axis=0) for flight in flights])


@lru_cache(maxsize=64)
def _spread_alone(manoeuvre: Manoeuvre, given: Conditions) -> NDArray:
    """The same [NULL_DRAWS, 12] for aircraft with the published spread, flown again without it."""
    rng, spread = np.random.default_rng(1), np.random.default_rng(2)
    flights = [held(*recorded(Aircraft(published_spread(spread)), manoeuvre, 1.0, given, rng))
               for _ in range(NULL_DRAWS)]
    return np.array([np.mean(residual_energy(Aircraft(), flight), axis=0) for flight in flights])


def own_noise(manoeuvres: Manoeuvres, gain: float, given: Conditions) -> tuple[NDArray, float]:
    """f_c squared [12] over some manoeuvres, and the gap that 95 % of draws of noise and gust alone stay below."""
    drawn = np.mean([alone(m, gain, given) for m in manoeuvres], axis=0)
    own = np.mean(drawn, axis=0)
    return own, float(np.quantile([gap(energy, own) for energy in drawn], 0.95))


def spread_gap(manoeuvres: Manoeuvres, sigma: float, gusts: str = "later") -> float:
    """Gap that 95 % of aircraft with nothing but the published spread stay below (usual gust scale and noise)."""
    given = Conditions(sigma, 1.0, 1.0, gusts)
    drawn = np.mean([_spread_alone(m, given) for m in manoeuvres], axis=0)
    own, _ = own_noise(manoeuvres, 1.0, given)
    return float(np.quantile([gap(energy, own) for energy in drawn], 0.95))


def gap(energy: NDArray, own: NDArray) -> float:
    """g of mean squares by channel, in tolerances, above those of noise and gust alone."""
    return float(np.sqrt(np.mean(np.maximum(energy - own, 0.0))))


def gap_of(model: Aircraft, flights: Sequence[Held], own: NDArray) -> float:
    """g of a model over held-out flights."""
    return gap(np.mean([residual_energy(model, flight) for flight in flights], axis=(0, 1)), own)


def closures(baseline: Mapping[str, float], parts: Sequence[tuple[str, str, float]], manoeuvres: Manoeuvres,
             flights: Sequence[Held], gain: float, given: Conditions) -> dict[str, Any]:
    """What a key tells of held-out records: f_c, and gaps without and with the true effects.

    Args:
        baseline: factors of this aircraft's spread.
        parts: its true effects.
        manoeuvres, flights: held out.
        gain: of the inputs.
        given: gusts and noise.

    Returns:
        `f` by channel; `before`, `oracle`: gaps of the published aircraft without and with the effects, `spread`: what
        95 % of aircraft without an effect stay below; `own_*`: the same for the aircraft with its own spread, `noise`
        what it reaches without any gap.
    """
    own, noise = own_noise(manoeuvres, gain, given)
    models = {"before": Aircraft(), "oracle": Aircraft(parts=parts), "own_before": Aircraft(baseline),
              "own_oracle": Aircraft(baseline, parts)}
    return {"f": dict(zip(MOTION, np.sqrt(own).tolist(), strict=True)),
            "spread": spread_gap(manoeuvres, given.sigma, given.gusts), "noise": noise,
            **{name: gap_of(model, flights, own) for name, model in models.items()}}
