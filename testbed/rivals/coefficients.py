"""What the model lacks in each force and moment coefficient along a record, and what each effect would make of it.

Equation error through the simulator: at instants along the record it is restarted at the measured state, flown for a
tenth of a second, and its accelerations are taken from those measured (Klein & Morelli, Aircraft System Identification,
AIAA 2006, chapter 5). An effect's own lack is what the model with it does beside the model without, from the states
that its instruments would have shown.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from icing_env import effects
from icing_env.effects import Parameter
from icing_env.record import FloatArray
from sim2real.actuators.paths import path_residuals
from sim2real.prediction.predictor import Predictor, put
from sim2real.prediction.windows import COMPARED, FREE, fly
from sim2real.records.channels import MEASURED, SURFACES
from sim2real.records.reconstruct import Reconstruction
from sim2real.rollout import as_coefficients

HORIZON, APART, AVERAGED = 0.1, 0.2, 0.1  # s flown, between restarts, and over which the starts are averaged (assumed)
NAMES = ("CX", "CY", "CZ", "Cl", "Cm", "Cn")
CHANNELS = (*MEASURED[:8], *SURFACES)
_FELT = tuple(COMPARED.index(name) for name in ("ax", "ay", "az"))
_RATES = tuple(COMPARED.index(name) for name in "pqr")


@dataclass(frozen=True)
class Variant:
    """An effect of the library at one size of one of its parameters."""

    effect: str
    parameter: Parameter
    size: float


@dataclass(frozen=True)
class Lack:
    """Of all records together.

    Attributes:
        residual: measured less model by coefficient [M].
        signatures: the same for every variant instead of the aircraft that flew [variants, M], by coefficient.
        channels: state and surfaces at the instants, by name [M].
        paths: by surface or engine, residual and signatures [1 + variants, samples], in units of their noise.
    """

    residual: Mapping[str, FloatArray]
    signatures: Mapping[str, FloatArray]
    channels: Mapping[str, FloatArray]
    paths: Mapping[str, FloatArray]


def variants() -> list[Variant]:
    """Every effect at its typical size, or a quarter of its range where that is none."""
    return [Variant(name, p, p.typical or 0.25 * max(p.high, -p.low))
            for name, effect in effects.LIBRARY.items() if name != "turbulence" for p in effect.parameters]


def lack(flights: Sequence[Reconstruction], tried: Sequence[Variant]) -> Lack:
    """What the model lacks along the records, and what it would lack were one of `tried` the truth."""
    residual, channels, paths = zip(*(_of_one(flight, tried) for flight in flights), strict=True)
    together = {name: np.concatenate([r[name] for r in residual], axis=1) for name in NAMES}
    return Lack({name: table[0] for name, table in together.items()},
                {name: table[1:] for name, table in together.items()},
                {name: np.concatenate([c[name] for c in channels]) for name in CHANNELS},
                {name: np.concatenate([p[name] for p in paths if name in p], axis=1)
                 for name in dict.fromkeys(n for p in paths for n in p)})  # fmt: skip


def _of_one(flight: Reconstruction, tried: Sequence[Variant]) -> tuple[dict[str, FloatArray], dict[str, FloatArray],
                                                                       dict[str, FloatArray]]:  # fmt: skip
    steps, half = max(1, round(HORIZON / flight.dt)), max(1, round(0.5 * AVERAGED / flight.dt))
    at = np.arange(half, len(flight.time) - steps - half, max(1, round(APART / flight.dt)))
    measured = np.column_stack([flight.channel(name) for name in COMPARED])
    begin = [COMPARED.index(name) for name in FREE]
    start = _averaged(measured, at, half)[:, begin]
    rows = parameter_rows(flight, tried)
    told = accelerations(flight, rows, at, start, steps)
    own = _averaged(measured, at + steps // 2 + 1, half)[:, _FELT]
    turning = (_averaged(measured, at + steps, half) - _averaged(measured, at, half))[:, _RATES] / (steps * flight.dt)
    lacking = np.concatenate([(np.hstack([own, turning]) - told[0])[None], told[1:] - told[0]])
    speed = start[:, FREE.index("airspeed")]
    by_row = [as_coefficients(one, flight, speed) for one in lacking]
    middle = {name: (flight.controls[name] if name in SURFACES else flight.channel(name))[at] for name in CHANNELS}
    return {name: np.stack([c[name] for c in by_row]) for name in NAMES}, middle, _paths(flight, rows)


def parameter_rows(flight: Reconstruction, tried: Sequence[Variant]) -> NDArray:
    """PARAMETERS of the model and of every variant for one record."""
    rows = np.repeat(flight.parameters, 1 + len(tried))
    for i, v in enumerate(tried, start=1):
        rows[i : i + 1] = effects.with_effects(rows[i : i + 1], {v.effect: {v.parameter.name: v.size}})
    return rows


def accelerations(flight: Reconstruction, rows: NDArray, at: NDArray[np.intp], start: FloatArray, steps: int
                  ) -> FloatArray:  # fmt: skip
    """Mean specific forces [m/s2] and angular accelerations [rad/s2] after a restart at each instant, every row's.

    Args:
        rows: PARAMETERS.
        at: samples of the restarts [M].
        start: what was measured there [M, FREE]; each row's true state is what its instruments would show so.
        steps: flown after each.

    Returns:
        [rows, M, 6].
    """
    n, m = len(rows), len(at)
    parameters, first, shown = np.repeat(rows, m), np.tile(at, n), np.tile(start, (n, 1))
    true = shown - _errors(flight, parameters, first, shown, m)
    read = fly(flight, parameters, first, true, steps).reshape(n, m, steps, -1)
    shown = shown.reshape(n, m, -1)
    begun = np.stack([shown[..., FREE.index(name)] for name in "pqr"], axis=-1)
    turning = (read[:, :, -1][..., _RATES] - begun) / (steps * flight.dt)
    return np.concatenate([read[..., _FELT].mean(axis=2), turning], axis=-1)


def _errors(flight: Reconstruction, parameters: NDArray, first: NDArray[np.intp], start: FloatArray, m: int
            ) -> FloatArray:  # fmt: skip
    """By how much instruments of each row read more than those of the first `m` in the same state [rows m, FREE]."""
    flown = Predictor(flight, parameters)
    values = {name: start[:, j] for j, name in enumerate(FREE)}
    values |= {name: series[first] for name, series in flight.controls.items()}
    put(flown.fleet, values | {"altitude": flight.altitude[first]})
    read = flown.read()[:, [MEASURED.index(name) for name in FREE]].reshape(-1, m, len(FREE))
    return np.asarray((read - read[:1]).reshape(-1, len(FREE)))


def _averaged(values: FloatArray, at: NDArray[np.intp], half: int) -> FloatArray:
    """Means over `half` samples either side of each instant."""
    return np.asarray(np.mean([values[at + k] for k in range(-half, half + 1)], axis=0))


def _paths(flight: Reconstruction, rows: NDArray) -> dict[str, FloatArray]:
    found = {}
    for k, (_, left, own) in enumerate(path_residuals(flight, rows)):
        table = np.zeros((len(rows), len(left)))
        table[0] = left[:, 0]
        for i, row in enumerate(own[1:], start=1):
            table[row] = left[:, 0] - left[:, i]
        found[f"path {k}"] = table
    return found
