"""One flight as many recorders would have it: what each does to the record, and what is said of their answers."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from estimators.signals.data_checks import check
from icing_env import scenario
from icing_env.errors import InputError
from icing_env.record import FlightRecord
from testbed.benchmarks import recordings
from testbed.flight import fly
from testbed.withheld import files
from testbed.withheld.draw import DEVELOPMENT_SEED
from testbed.withheld.recorders import DEG, RECORDERS, SURFACES, WANDER, WANDER_TIME


@cache
def flown() -> FlightRecord:
    chosen = scenario.load("clear_air", duration=40.0, parameters={"turbulence_sigma_w": 0.5})
    return replace(fly(chosen, seed=3, observer=False, protection=False).record, owner={})


def recorded(name: str) -> FlightRecord:
    return replace(flown(), channels=RECORDERS[name](dict(flown().channels), np.random.default_rng(1)))


@pytest.mark.parametrize("name", RECORDERS)
def test_every_recorder_makes_a_record_of_the_same_flight_that_nothing_refuses(name):
    record = recorded(name)
    assert "," not in name  # which parts what --only is told
    assert np.all(np.diff(record.time) > 0.0) and abs(record.time[-1] - flown().time[-1]) < 0.1
    assert set(record.channels) <= set(flown().channels)
    assert len(check(record)) > 0.15 * len(flown())


@pytest.mark.parametrize("name", sorted(set(RECORDERS) - {"as drawn (50 a second)"}))
def test_every_recorder_but_the_first_changes_something_and_the_flight_stays_as_it_was(name):
    before = {n: x.copy() for n, x in flown().channels.items()}
    record = recorded(name)
    assert set(record.channels) != set(before) or len(record) != len(flown()) or any(
        not np.array_equal(record[n], x, equal_nan=True) for n, x in before.items())
    assert all(np.array_equal(flown()[n], x, equal_nan=True) for n, x in before.items())


def test_levels_are_whole_steps_no_farther_than_half_of_one():
    for name in SURFACES:
        steps = recorded("surfaces in 0.5 deg")[name] / (0.5 * DEG)
        np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
        assert np.max(np.abs(steps - flown()[name] / (0.5 * DEG))) <= 0.5 + 1e-9


def test_held_readings_are_those_of_the_last_sample_and_slow_ones_are_blank_between():
    held, slow = (recorded(name)["alpha"] for name in ("vanes held for 0.1 s", "vanes 10 a second"))
    true = flown()["alpha"]
    np.testing.assert_array_equal(held, np.repeat(true[::5], 5)[: len(true)])
    np.testing.assert_array_equal(slow[::5], true[::5])
    assert np.isnan(slow[np.arange(len(slow)) % 5 > 0]).all()


def test_a_vane_that_wanders_does_so_by_as_much_and_for_as_long_as_said():
    rng = np.random.default_rng(2)
    time = 0.02 * np.arange(100_000)
    off = RECORDERS["vane wanders by 1.5 mrad over 0.3 s"]({"time": time, "alpha": np.zeros_like(time)}, rng)["alpha"]
    assert np.std(off) == pytest.approx(WANDER, rel=0.05)
    lag = round(WANDER_TIME / 0.02)
    assert np.corrcoef(off[:-lag], off[lag:])[0, 1] == pytest.approx(np.exp(-1.0), abs=0.05)


def said(*effects: str) -> str:
    return json.dumps({"verdict": "explained" if effects else "no_gap", "seconds": 2.0, "credible_set_95": [0],
                       "hypotheses": [{"effects": list(effects), "unknown": False, "probability": 0.9}]})  # fmt: skip


def test_rows_tell_what_is_blamed_what_is_missed_and_what_is_refused(tmp_path):
    """Of a set that stands there with its answers: two clean aircraft, an effect that can be told, one that cannot."""
    far, near = {"wing_ice": 0.0, "ice_drag": 40.0}, {"wing_ice": 0.0, "ice_drag": 1.0}
    cases = {"a0": ("null", [], {}), "a1": ("null", [], {}), "a2": ("single", ["wing_ice"], far),
             "a3": ("single", ["wing_ice"], near), "a4": ("pair", ["wing_ice", "ice_drag"], far)}  # fmt: skip
    (tmp_path / "keys").mkdir()
    for name, (tier, effects, distances) in cases.items():
        files.write_case(tmp_path / "records" / name, {"1.csv": "time\n0\n"})
        files.write_text(tmp_path / "keys" / f"{name}.json", json.dumps(
            {"tier": tier, "sigma_w": 0.5, "effects": effects, "forms": ["same"] * len(effects), "D": distances,
             "D_none": 40.0, "D_pair": 9.0, "where": [],
             "parameters": {n: {"size": 1.0} for n in effects}, "salt": name}))
    sealed = files.manifest(tmp_path / "records", tmp_path / "keys", list(cases))
    sealed |= {"count": len(cases), "development_seed": DEVELOPMENT_SEED}
    files.write_text(tmp_path / "manifest.json", json.dumps(sealed))
    answers = {"as_drawn_50_a_second_": (said(), said(), said("wing_ice")),
               "no_ax": (said("ice_drag"), '{"error": "no record"}', said())}  # fmt: skip
    for folder, texts in answers.items():
        (tmp_path / f"answers_{folder}").mkdir()
        for name, text in zip(list(cases)[:3], texts, strict=True):
            files.write_text(tmp_path / f"answers_{folder}" / f"{name}.json", text)
    whole, part = recordings.measure(tmp_path, 5, 0, 1, ("as drawn (50 a second)", "no ax"), lambda what: None)
    assert (whole["null"], whole["single"], whole["null_wrong"], whole["single_wrong"]) == (2, 1, 0, 0)
    assert (part["null_wrong"], part["single_wrong"], part["refused"], part["seconds"]) == (2, 1, 1, 2.0)
    rows, wrong = (rows for _, _, rows in recordings.tables([whole, part]))
    assert rows[1] == ["no ax", "2 of 2", "1 of 1", "1", "2.0"] and len(wrong) == 3
    with pytest.raises(InputError, match=r"no recorder 'no axe'.*no ax"):
        recordings.measure(tmp_path, 5, 0, 1, ("no axe",), lambda what: None)
