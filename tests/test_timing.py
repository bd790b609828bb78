"""When recorded commands act: a recorder between samples is no lag of actuators, and a lag is no recorder's doing."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from icing_env import effects, scenario
from icing_env.record import FlightRecord
from sim2real.actuators.paths import path_gram
from sim2real.actuators.timing import in_step
from sim2real.records.channels import SURFACES
from sim2real.records.reconstruct import TIMING, Reconstruction, reconstruct
from testbed.flight import fly

CLEAR = 12.0  # whitened square that a lag has to explain before it is anything


@cache
def flown(effect: str = "", value: float = 0.0, seed: int = 4) -> FlightRecord:
    """Doublets of all three surfaces."""
    name, _, parameter = effect.partition(":")
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": 0.5},
                           effects={name: {parameter: value}} if name else {})  # fmt: skip
    return fly(chosen, seed=seed, observer=False, protection=False).record


def late(record: FlightRecord, samples: float) -> FlightRecord:
    """The commands as a recorder has them that is `samples` late, in straight lines between its own."""
    at = np.arange(len(record), dtype=float)
    channels = {n: np.interp(at - samples, at, v) if n.endswith("_command") else v for n, v in record.channels.items()}
    return replace(record, channels=channels)


def explained(flight: Reconstruction, surface: str, extra: float) -> float:
    """Whitened square that a lag of the surface takes away from what the paths leave, at its best size."""
    rows = np.repeat(flight.parameters, 2)
    rows[1:] = effects.with_effects(rows[1:], {f"{surface}_lag": {"extra": extra}})
    gram = path_gram(flight, rows)
    return float(gram[0, 1] ** 2 / max(gram[1, 1], 1e-12))


def test_an_exact_recorder_is_left_as_it_is():
    flight = reconstruct(flown())
    (found,) = in_step([flight])
    assert found.timing == TIMING
    assert found.commands == flight.commands
    assert found.notes == flight.notes


@pytest.mark.parametrize("samples", [-1.5, -0.75, 0.75, 1.5])
def test_a_recorder_between_samples_makes_no_actuator_lag(samples: float):
    flights = [reconstruct(late(flown(seed=seed), samples)) for seed in (4, 5, 6)]
    found = in_step(flights)
    assert any("samples later" in note for note in found[0].notes)
    before, after = ([sum(explained(f, s, 0.02) for f in those) for s in SURFACES] for those in (flights, found))
    assert max(before) > 2.0 * CLEAR
    assert max(after) < CLEAR


def test_every_second_sample_alone_makes_no_actuator_lag():
    record = flown()
    flight = reconstruct(record.take(np.arange(len(record)) % 2 == 0))
    (found,) = in_step([flight])
    assert found.timing > TIMING
    assert max(explained(found, s, 0.02) for s in SURFACES) < CLEAR


@pytest.mark.parametrize("samples", [0.0, 0.5])
@pytest.mark.parametrize("surface", SURFACES)
def test_one_surface_that_lags_is_still_seen(surface: str, samples: float):
    (found,) = in_step([reconstruct(late(flown(f"{surface}_lag:extra", 0.08), samples))])
    gains = {s: explained(found, s, 0.08) for s in SURFACES}
    assert gains[surface] > 6.0 * CLEAR
    assert all(gain < CLEAR for s, gain in gains.items() if s != surface)


def test_records_without_commands_are_left_as_they_are():
    record = flown()
    bare = replace(record, channels={n: v for n, v in record.channels.items() if not n.endswith("_command")})
    flight = reconstruct(bare)
    assert in_step([flight]) == [flight]
