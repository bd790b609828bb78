"""A surface is where its command puts it if nothing but noise is between; else where it was recorded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from icing_env import scenario
from icing_env.record import FloatArray
from sim2real.actuators.paths import UNFILTERED, follow, path_residuals
from sim2real.actuators.surfaces import EXACT, PLACED, placed
from sim2real.records.channels import SURFACE_NOISE
from sim2real.records.reconstruct import Reconstruction, reconstruct
from testbed.flight import fly

NOISE = 5.2e-4  # rad


@pytest.fixture(scope="module")
def flight() -> Reconstruction:
    chosen = scenario.load("clear_air", duration=40.0, parameters={"turbulence_sigma_w": 0.0})
    return reconstruct(fly(chosen, seed=2, observer=False, protection=False).record)


def driven(flight: Reconstruction, lag: float, error: FloatArray | float = 0.0, seed: int = 0, size: float = 0.05,
           **actuator: float) -> tuple[Reconstruction, FloatArray]:  # fmt: skip
    """A record whose elevator follows doublets of some size with a lag, and errs; and where the elevator was.

    `actuator`: how many times as published its gearing or rate limit is.
    """
    t = flight.time
    command = size * np.sign(np.sin(0.9 * t)) * (np.abs(np.sin(0.35 * t)) > 0.4)
    row = flight.parameters.copy()
    row["elevator_lag"] = lag
    for name, times in actuator.items():
        row[f"elevator_{name}"] *= times
    seen = follow(command, 0.0, row, "elevator", flight.dt)[:, 0] + error
    row["filter_frequency"] = UNFILTERED
    true = follow(command, 0.0, row, "elevator", flight.dt)[:, 0] + error
    noisy = seen + NOISE * np.random.default_rng(seed).standard_normal(len(t))
    return replace(flight, commands={"elevator_command": command}, positions=flight.positions | {"elevator": noisy},
                   controls=flight.controls | {"elevator": noisy}), true


@pytest.mark.parametrize("lag", [0.05, 0.09, 0.23])
@pytest.mark.parametrize("drift", [0.0, 0.004])
def test_a_surface_that_follows_its_command_is_placed_far_better_than_it_was_recorded(flight, lag, drift):
    made, true = driven(flight, lag, drift * np.sin(np.linspace(0.0, 2.0, len(flight.time))))
    found = placed([made])[0]
    assert list(found.surface_noise) == [PLACED if drift else EXACT, SURFACE_NOISE, SURFACE_NOISE]
    away = (found.controls["elevator"] - true)[50:]
    assert np.sqrt(np.mean(away**2)) < 0.4 * NOISE
    if not drift:  # nothing is shifted by the noise of what was recorded
        assert abs(np.mean(away)) < 5e-6
    assert np.array_equal(found.positions["elevator"], made.positions["elevator"])


def test_a_surface_that_does_something_else_stays_where_it_was_recorded(flight):
    t = flight.time
    for error in (0.004 * (np.sin(1.7 * t) > 0.6), 0.002 * np.sin(9.0 * t)):
        found = placed([driven(flight, 0.05, error)[0]])[0]
        assert found.surface_noise[0] == SURFACE_NOISE


def test_a_surface_without_a_command_stays_where_it_was_recorded_and_one_that_is_held_is_placed(flight):
    made, _ = driven(flight, 0.05)
    found = placed([replace(made, commands={})])[0]
    assert np.array_equal(found.controls["elevator"], made.controls["elevator"])
    assert list(found.surface_noise) == [SURFACE_NOISE] * 3
    still = 0.01 + NOISE * np.random.default_rng(1).standard_normal(len(flight.time))
    held = replace(made, commands={"elevator_command": np.full(len(flight.time), 0.01)},
                   positions=made.positions | {"elevator": still})
    assert placed([held])[0].surface_noise[0] == EXACT
    assert placed([held])[0].controls["elevator"][100:] == pytest.approx(0.01, abs=0.3 * NOISE)


def test_stretches_that_were_not_recorded_are_bridged_by_the_command(flight):
    made, true = driven(flight, 0.09)
    blank = made.positions["elevator"].copy()
    blank[400:900] = np.nan
    blank[np.arange(len(blank)) % 5 != 0] = np.nan
    found = placed([replace(made, positions=made.positions | {"elevator": blank})])[0]
    assert found.surface_noise[0] == EXACT
    assert np.sqrt(np.mean((found.controls["elevator"] - true)[50:] ** 2)) < 0.6 * NOISE


def test_a_short_record_and_a_blank_position_are_no_trouble(flight):
    made, _ = driven(flight, 0.05)
    n = 60
    short = replace(made, time=made.time[:n], commands={k: v[:n] for k, v in made.commands.items()},
                    positions={k: v[:n] for k, v in made.positions.items()})
    assert len(placed([short])[0].controls["elevator"]) in (n, len(made.time))
    blank = replace(made, positions=made.positions | {"elevator": np.full(len(made.time), np.nan)})
    assert placed([blank])[0].surface_noise[0] == SURFACE_NOISE
    assert all(np.isfinite(left).all() for _, left, _ in path_residuals(blank, blank.parameters))


def test_a_surface_that_was_not_recorded_is_where_its_command_puts_it(flight):
    """It was taken as zero, and a gearing of minus a half was blamed: nothing judges how well it follows."""
    record = flight.record
    bare = reconstruct(replace(record, channels={n: v for n, v in record.channels.items() if n != "rudder"}))
    found = placed([bare])[0]
    assert not np.isfinite(found.positions["rudder"]).any()
    assert "rudder_path" not in {name for name, _, _ in path_residuals(found, found.parameters)}
    away = found.controls["rudder"] - placed([flight])[0].controls["rudder"]
    assert np.std(flight.controls["rudder"]) > 5.0 * np.std(away[50:])
    assert any("rudder not recorded: where its command puts it" in note for note in found.notes)


def test_gear_and_lag_are_the_aircrafts_in_all_of_its_records(flight):
    """One in which the elevator hardly moves cannot tell them, and by itself is some per cent off."""
    large, small = driven(flight, 0.07, gearing=1.02), driven(flight, 0.07, seed=1, size=0.002, gearing=1.02)
    together, alone = placed([large[0], small[0]])[1], placed([small[0]])[0]

    def gear(found: Reconstruction) -> float:
        true = small[1] - small[1].mean()
        return float(found.controls["elevator"] @ true / (true @ true))

    assert gear(together) == pytest.approx(1.0, abs=1e-3) and abs(gear(alone) - 1.0) > 5e-3


@pytest.mark.parametrize("rate", [0.6, 1.5])
def test_a_rate_limit_is_told_by_the_records(flight, rate):
    """No source has one. By the published limit doublets are off by more, and pass for a bent gearing."""
    made, true = driven(flight, 0.05, size=0.15, rate=rate)
    found = placed([made])[0]
    assert found.surface_noise[0] < SURFACE_NOISE
    row = flight.parameters.copy()
    row["filter_frequency"] = UNFILTERED
    usual = follow(made.commands["elevator_command"], 0.0, row, "elevator", flight.dt)[:, 0]
    off = [np.sqrt(np.mean((where - true)[50:] ** 2)) for where in (found.controls["elevator"], usual)]
    assert off[0] < 0.1 * off[1]


@pytest.mark.parametrize("gearing", [0.985, 1.012])
def test_a_gear_in_front_of_the_actuator_makes_no_other_rate_limit(flight, gearing):
    """Behind it, it is a limit of as much less: ailerons were 7e-5 rad off in steps, a rolling moment over time."""
    made = [driven(flight, 0.05, seed=seed, size=0.15, gearing=gearing) for seed in range(3)]
    for found, (_, true) in zip(placed([record for record, _ in made]), made, strict=True):
        away = (found.controls["elevator"] - true)[50:]
        shape = np.column_stack([np.ones(len(away)), true[50:]])  # what an offset and a derivative take
        away = away - shape @ np.linalg.lstsq(shape, away, rcond=None)[0]
        assert np.sqrt(np.mean(away**2)) < 1e-5
