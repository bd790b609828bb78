"""What to fly next: the manoeuvre of a small list whose simulated signatures part the remaining explanations best."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from icing_env import effects
from icing_env.errors import InputError
from icing_env.record import FloatArray
from icing_env.trim import trim
from sim2real.library.candidates import Bank
from sim2real.posterior.attribution import reduce
from sim2real.posterior.singles import INDISTINGUISHABLE
from sim2real.prediction.kalman import gains
from sim2real.prediction.predictor import Predictor, innovations, put
from sim2real.records.channels import FED_BACK, MEASURED, NOISE_FLOOR
from sim2real.records.reconstruct import Reconstruction
from sim2real.signatures.whitening import FARTHEST, SETTLE, whiten

DURATION = 30.0  # s
TARGET = 5.0  # distance beyond which more is worth nothing (bounded Hunter-Reiner criterion)
DEG = np.pi / 180.0


@dataclass(frozen=True)
class Manoeuvre:
    """A test flown from level flight.

    Attributes:
        airspeed: m/s.
        doublets: (control, start s, amplitude rad or share of power, half period s).
        power_ramp: change of power [1/s] for a deceleration.
    """

    name: str
    airspeed: float
    doublets: tuple[tuple[str, float, float, float], ...] = ()
    power_ramp: float = 0.0


MANOEUVRES = (
    Manoeuvre("elevator doublets at 55 m/s", 55.0, (("elevator", 6.0, 2 * DEG, 0.8), ("elevator", 16.0, 2 * DEG, 1.6))),
    Manoeuvre("elevator doublets at 85 m/s", 85.0,
              (("elevator", 6.0, 1.5 * DEG, 0.8), ("elevator", 16.0, 1.5 * DEG, 1.6))),
    Manoeuvre("throttle step at 70 m/s", 70.0, (("power", 6.0, 0.2, 8.0),)),
    Manoeuvre("aileron and rudder doublets at 60 m/s", 60.0,
              (("aileron", 6.0, 6 * DEG, 0.8), ("rudder", 14.0, 4 * DEG, 1.2))),
    Manoeuvre("aileron and rudder doublets at 85 m/s", 85.0,
              (("aileron", 6.0, 4 * DEG, 0.8), ("rudder", 14.0, 3 * DEG, 1.2))),
    Manoeuvre("slow deceleration from 65 m/s", 65.0, (("elevator", 8.0, 1 * DEG, 0.8),), -0.008),
)  # fmt: skip


def next_manoeuvre(flight: Reconstruction, bank: Bank, rivals: Mapping[str, Mapping[str, float]],
                   weights: Mapping[str, float], sigma: float, precision: FloatArray) -> dict[str, object] | None:
    """The manoeuvre that best separates `rivals` (effects with their values), and the pairs it separates.

    None where there is nothing to separate or no manoeuvre of the list separates any pair.

    Args:
        weights: probability of each.
        sigma: gust intensity, m/s.
        precision: prior precision of the nuisances [n, n].
    """
    names = list(rivals)[:6]
    pairs = list(combinations(names, 2))
    best: tuple[float, Manoeuvre, list[list[str]]] | None = None
    for manoeuvre in MANOEUVRES if pairs else ():
        try:
            apart = distances(fly(flight, manoeuvre), bank, [(n, rivals[n]) for n in names], sigma, precision)
        except InputError:  # this aircraft cannot be trimmed or stay there
            continue
        score = sum(weights[a] * weights[b] * min(apart[a, b], TARGET) ** 2 for a, b in pairs)
        parted = [[a, b] for a, b in pairs if apart[a, b] >= INDISTINGUISHABLE]
        if parted and (best is None or score > best[0]):
            best = (score, manoeuvre, parted)
    return None if best is None else {"name": best[1].name, "separates": best[2]}


def fly(flight: Reconstruction, manoeuvre: Manoeuvre) -> Reconstruction:
    """The manoeuvre flown by the model, as a record without noise in the channels that `flight` has.

    Raises:
        InputError: the aircraft cannot fly steadily at that speed, or departs from flight.
    """
    made = flown(*asked(flight, manoeuvre))
    if not np.isfinite(made.measured[-1, :FED_BACK][[made.has(name) for name in MEASURED[:FED_BACK]]]).all():
        raise InputError(f"{manoeuvre.name}: the model departs from flight")
    return made


def asked(flight: Reconstruction, manoeuvre: Manoeuvre) -> tuple[Reconstruction, dict[str, float]]:
    """A record that holds nothing but the controls of a manoeuvre, and the trimmed state that it starts from.

    Raises:
        InputError: the aircraft cannot fly steadily at that speed.
    """
    height = float(np.median(flight.altitude))
    state = trim(flight.parameters, airspeed=manoeuvre.airspeed, altitude=height)
    time = np.arange(0.0, DURATION, flight.dt)
    controls = {n: np.full(len(time), float(state.state[n][0]))
                for n in ("elevator", "aileron", "rudder", "flap", "power_left", "power_right")}  # fmt: skip
    for control, start, size, half in manoeuvre.doublets:
        shape = np.where((time >= start) & (time < start + half), 1.0, 0.0)
        shape -= np.where((time >= start + half) & (time < start + 2 * half), 1.0, 0.0)
        for name in ("power_left", "power_right") if control == "power" else (control,):
            step = size * controls[name][0] if control == "power" else size
            controls[name] = controls[name] + step * shape
    for name in ("power_left", "power_right"):
        controls[name] = np.maximum(controls[name] * (1.0 + manoeuvre.power_ramp * time), 0.0)
    absent: NDArray[np.bool_] = np.array([not flight.has(name) for name in MEASURED])
    made = replace(flight, known=None, time=time, measured=np.where(absent, np.nan, np.zeros((len(time), 1))),
                   controls=controls, altitude=np.full(len(time), height))
    return made, {"airspeed": manoeuvre.airspeed, "alpha": state.alpha, "beta": state.beta, "p": 0.0, "q": 0.0,
                  "r": 0.0, "phi": state.phi, "theta": state.theta, "altitude": height}


def flown(made: Reconstruction, start: Mapping[str, float]) -> Reconstruction:
    """The record filled with what the model does under its controls from a state, in the channels that it has."""
    plant = Predictor(made, made.parameters)
    put(plant.fleet, dict(start) | {n: float(v[0]) for n, v in made.controls.items()})
    measured = np.empty_like(made.measured)
    measured[0] = plant.read()
    measured[1:] = plant.fly(len(made.time) - 1)[:, 0]
    measured[:, [not made.has(name) for name in MEASURED]] = np.nan
    has_altitude = made.has("altitude")
    return replace(made, measured=measured, altitude=measured[:, MEASURED.index("altitude")].copy()
                   if has_altitude else made.altitude)


def distances(made: Reconstruction, bank: Bank, rivals: list[tuple[str, Mapping[str, float]]],
              sigma: float, precision: FloatArray | None = None) -> dict[tuple[str, str], float]:
    """Whitened distance of every pair of effects along a manoeuvre, size of the second and nuisances free."""
    rows = np.repeat(made.parameters, 1 + len(bank.nuisances) + len(rivals))
    for j, nuisance in enumerate(bank.nuisances, start=1):
        nuisance.apply(rows, j, made.power_from)
    for j, (name, values) in enumerate(rivals, start=1 + len(bank.nuisances)):
        rows[j : j + 1] = effects.with_effects(rows[j : j + 1], {name: values})
    gain = gains(made, (sigma,))[0].with_start()
    left = whiten(innovations(made, rows, gain.K)[round(SETTLE / made.dt) :], _factor(made, gain.S))
    flat = np.clip(left.transpose(0, 2, 1).reshape(-1, len(rows)), -FARTHEST, FARTHEST)
    flat = flat - np.where(np.arange(len(rows)) > 0, flat[:, :1], 0.0)
    reduced = reduce(flat.T @ flat, bank, precision)[1 + len(bank.nuisances) :, 1 + len(bank.nuisances) :]
    out = {}
    for i, j in combinations(range(len(rivals)), 2):
        along = reduced[i, j] ** 2 / reduced[j, j] if reduced[j, j] > 0.0 else 0.0
        out[rivals[i][0], rivals[j][0]] = float(np.sqrt(max(reduced[i, i] - along, 0.0)))
    return out


def _factor(made: Reconstruction, S: NDArray) -> FloatArray:
    use = [c for c in range(FED_BACK) if made.has(MEASURED[c])]
    out = np.zeros((len(MEASURED), len(MEASURED)))
    out[np.ix_(use, use)] = np.linalg.inv(np.linalg.cholesky(S[np.ix_(use, use)]))
    for c in range(FED_BACK, len(MEASURED)):
        if made.has(MEASURED[c]):
            out[c, c] = 0.4 / NOISE_FLOOR[MEASURED[c]]  # sampled at 10 Hz
    return out
