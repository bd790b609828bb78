"""Records flown abreast fly as each of them alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from icing_env import scenario
from sim2real.prediction.abreast import Abreast
from sim2real.prediction.gusts import KINDS
from sim2real.prediction.kalman import Gain, follow
from sim2real.prediction.predictor import Push, innovations
from sim2real.records.reconstruct import Reconstruction, reconstruct
from sim2real.signatures.gust_intensity import SIGMAS, choose_gain
from testbed.flight import fly


@pytest.fixture(scope="module")
def records() -> list[tuple[Reconstruction, Gain]]:
    found = []
    for seed, duration, every in ((3, 20.0, 1), (4, 14.0, 1), (5, 16.0, 2)):  # lengths and rates
        kind = KINDS[seed - 3]
        weather = {"turbulence_sigma_w": 0.5, "turbulence_tail_delay": float(kind.tail_delay),
                   "turbulence_rotation": float(kind.rotation)}
        chosen = scenario.load("clear_air", duration=duration, parameters=weather)
        record = fly(chosen, seed=seed, observer=False, protection=False).record
        slow = replace(record, channels={n: c[::every] for n, c in record.channels.items()})
        flight = reconstruct(slow)
        found.append((flight, follow(flight, choose_gain(flight, SIGMAS, (), kind))))
    return found


@pytest.mark.parametrize("threads", ["1", "3"])
@pytest.mark.parametrize("counts", [(1, 1, 1), (2, 3, 1), (9, 8, 2)])
def test_to_the_bit(records: list[tuple[Reconstruction, Gain]], counts: tuple[int, ...], threads: str,
                    monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    monkeypatch.setenv("OMP_NUM_THREADS", threads)
    flights, own = [f for f, _ in records], [g for _, g in records]
    assert [g.gusts.kind for g in own] == list(KINDS[:3])
    rows, pushes = [], []
    for flight, count in zip(flights, counts, strict=True):
        varied = np.repeat(flight.parameters, count)
        varied["Cm_alpha"] *= np.linspace(0.8, 1.2, count)
        rows.append(varied)
        course = np.sin(flight.time)
        pushes.append((Push(count - 1, "q", 0.01 * course, False), Push(0, "alpha", 0.002 * course, True)))
    together = Abreast(flights, own).innovations(rows, pushes)
    for flight, gain, some, pushed, found in zip(flights, own, rows, pushes, together, strict=True):
        np.testing.assert_array_equal(found, innovations(flight, some, gain.K, pushed, gain.gusts.kind))
