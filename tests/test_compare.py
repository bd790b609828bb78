"""Comparison: metrics on traces made by hand, the same cases for everybody, the form of the answer."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from icing_env import scenario
from icing_env.errors import InputError
from testbed.comparison import metrics, suite
from testbed.comparison.compare import compare
from testbed.comparison.trace import INTERVAL, SAMPLES, Trace, trace
from testbed.flight import CONTROLLERS, make_world

N = 1201  # two minutes
TIME = np.arange(N)*INTERVAL
TINY = """name = "tiny"
episodes = 2
duration = 20.0
turbulence = { light = 1.0 }
[[entries]]
scenario = "stratiform"
pre_iced = true
"""


def made(alive: int = N, reason: str = "", **channels: np.ndarray) -> Trace:
    """One episode in which nothing happens but what is given."""
    names = {name for kind, names in SAMPLES.items() if kind != "command" for name in names}
    names |= {f"command_{name}" for name in SAMPLES["command"]}
    names |= {"excess_drag", "slope_lost", "elevator_lost", "thrust_lost", "alpha_margin", "ice_mass", "bank",
              "stall_speed"}
    values = {name: np.zeros((N, 1)) for name in names}
    values["alpha_margin"][:], values["airspeed"][:], values["load_factor"][:] = 0.1, 70.0, 1.0
    values |= {name: np.asarray(array, float).reshape(N, 1) for name, array in channels.items()}
    return Trace(TIME, values, (np.arange(N) < alive).reshape(N, 1), (reason,))


def found(name: str, t: Trace) -> float:
    return metrics.METRICS[name].of(t, 0)


def test_detection_delay_counts_from_the_crossing():
    t = made(excess_drag=np.where(TIME >= 20.0, 0.011, 0.009), ice_detected=TIME >= 47.0)
    assert found("detection_delay", t) == pytest.approx(27.0)
    assert found("missed_alarms", t) == 0.0 and found("false_alarms", t) == 0.0


def test_a_late_alarm_is_a_missed_one_and_none_has_no_delay():
    late = made(slope_lost=np.full(N, 0.2), ice_detected=TIME >= 70.0)
    assert found("missed_alarms", late) == 1.0
    never = made(elevator_lost=np.full(N, 0.2))
    assert found("missed_alarms", never) == 1.0 and np.isnan(found("detection_delay", never))
    assert np.isnan(found("missed_alarms", made()))
    assert np.isnan(found("missed_alarms", made(excess_drag=np.where(TIME > 90.0, 0.02, 0.0))))


def test_false_alarms_are_raised_without_ice_and_counted_per_hour():
    blinking = (TIME % 40.0 > 20.0) & (TIME < 100.0)
    assert found("false_alarms", made(ice_detected=blinking)) == pytest.approx(2*3600.0/120.1)
    some_ice = made(ice_detected=blinking, thrust_lost=np.full(N, 0.06))
    assert found("false_alarms", some_ice) == 0.0


def test_stall_time_margin_and_losses():
    beyond = ((TIME >= 10.0) & (TIME < 10.8)) | ((TIME >= 30.0) & (TIME < 31.5))
    t = made(alpha_margin=np.where(beyond, -0.02, 0.05), reason="upset")
    assert found("stall_time", t) == pytest.approx(2.3)
    assert found("stalled", t) == 1.0 and found("losses", t) == found("upsets", t) == 1.0
    assert found("worst_alpha_margin", t) == -0.02
    assert found("stalled", made(alpha_margin=np.where(TIME < 0.85, -0.02, 0.05))) == 0.0


def test_nothing_counts_after_the_end():
    t = made(alive=100, alpha_margin=np.where(TIME > 20.0, -1.0, 0.05), altitude_error=np.where(TIME > 20.0, 1e6, 3.0),
             ice_detected=TIME > 20.0, reason="ground")
    assert found("stall_time", t) == 0.0 and found("altitude_rms", t) == pytest.approx(3.0)
    assert found("false_alarms", t) == 0.0 and found("upsets", t) == 0.0 and found("losses", t) == 1.0


def test_activity_is_the_rate_of_the_command():
    assert found("elevator_activity", made(command_elevator=0.03*TIME)) == pytest.approx(0.03, rel=1e-3)
    assert found("intervention_time", made(intervention=np.where(TIME < 12.0, -0.01, 0.0))) == pytest.approx(0.1, 1e-2)


def test_exceedances_are_of_any_kind_and_counted_once():
    slow, steep = TIME < 12.0, (TIME > 6.0) & (TIME < 18.0)
    t = made(stall_speed=np.where(slow, 80.0, 40.0), bank=np.where(steep, -1.2, 0.1))
    assert found("exceedances", t) == pytest.approx(18.0/120.1, abs=1e-3)
    assert found("exceedances", made(load_factor=np.where(TIME < 6.0, 4.0, 1.0))) == pytest.approx(0.05, abs=1e-3)
    assert found("exceedances", made()) == 0.0


def test_nuisance_is_counted_where_there_is_no_ice():
    moved = np.where((TIME > 30.0) & (TIME < 90.0), 0.01, 0.0)
    t = made(intervention=moved, excess_drag=np.where(TIME > 60.0, 0.03, 0.0))
    assert found("nuisance_time", t) == pytest.approx(0.5, abs=0.01)
    assert np.isnan(found("nuisance_time", made(intervention=moved, excess_drag=np.full(N, 0.03))))
    assert found("intervention_time", made(intervention_aileron=moved)) == pytest.approx(0.5, abs=0.01)


def test_overshoot_and_settling_of_a_step():
    since = np.maximum(TIME - 10.0, 0.0)
    error = 30.0*np.exp(-since/5.0)*np.cos(since/4.0)*(TIME > 10.0)  # m
    t = made(altitude_error=error)
    assert np.isnan(found("altitude_overshoot", t))
    t = Trace(t.time, t.values, t.alive, t.reason, stepped=True)
    after = np.linspace(0.0, 40.0, 40001)
    answer = np.exp(-after/5.0)*np.cos(after/4.0)
    assert found("altitude_overshoot", t) == pytest.approx(-answer.min(), abs=1e-3)
    assert found("altitude_settling", t) == pytest.approx(after[np.abs(answer) > 0.1].max(), abs=0.11)
    assert found("heading_overshoot", t) == 0.0


def test_a_learned_controller_is_judged_over_its_training_seeds():
    runs = [{name: np.array([float(k), float(k), np.nan]) for name in metrics.METRICS} for k in (1, 2, 3)]
    told = metrics.summary(runs, learned=True)["altitude_rms"]
    assert told["mean"] == 2.0 and told["training_seeds"] == 3 and told["episodes"] == 6
    assert told["high95"] - told["mean"] == pytest.approx(4.302653/np.sqrt(3.0), rel=1e-5)
    assert told["iqm"] == pytest.approx(2.0)
    assert "iqm" not in metrics.summary(runs[:1], learned=False)["altitude_rms"]


def test_intervals():
    mean, low, high = metrics.interval(np.array([1.0, 2.0, 3.0, 4.0]), share=False)
    assert mean == 2.5 and high - mean == pytest.approx(3.182446*1.290994/2.0, rel=1e-5) and mean - low == high - mean
    mean, low, high = metrics.interval(np.zeros(16), share=True)
    assert mean == 0.0 and low == 0.0 and high == pytest.approx(0.1936, abs=1e-4)  # Wilson: z^2/(n + z^2)
    assert metrics.interval(np.array([]), share=False) == (None, None, None)
    assert metrics.interval(np.array([7.0]), share=False) == (7.0, 7.0, 7.0)


def test_everybody_meets_the_same_case_and_the_truth_about_ice_starts_alike(tmp_path: Path):
    path = tmp_path / "tiny.toml"
    path.write_text(TINY)
    ((_, long),) = suite.load(path).cases()
    case = long.model_copy(update={"duration": 1.0})
    flown = [trace(make_world(case, 2, who, protection), [5, 6])
             for who in CONTROLLERS for protection in (True, False)]
    for t in flown:
        for name in ("excess_drag", "ice_mass", "airspeed"):
            assert np.array_equal(t[name][0], flown[0][name][0]), name
        assert t["excess_drag"][0, 0] != t["excess_drag"][0, 1] and (t["excess_drag"][0] > 0.0).all()


def test_a_clean_flight_has_no_excess():
    t = trace(make_world(scenario.load("clear_air", duration=2.0), 1), [0])
    assert abs(t["excess_drag"]).max() < 1e-12 and abs(t["slope_lost"]).max() < 1e-12
    assert len(t.time) == 21 and t.alive.all() and t.reason == ("",)


def test_the_answer_has_its_form_and_is_repeatable(tmp_path: Path):
    path = tmp_path / "tiny.toml"
    path.write_text(TINY)
    said: list[str] = []
    first = compare(suite.load(path), ["autopilot"], seed=3, progress=said.append)
    assert first["suite"] == "tiny" and first["episodes"] == 2 and len(first["rows"]) == 2 == len(said)
    for row in first["rows"]:
        assert set(row) >= {"controller", "kind", "protection", "scenario", "metrics"}
        assert row["kind"] == "classical" and row["scenario"] == "stratiform"
        for name, m in row["metrics"].items():
            assert set(m) >= {"mean", "low95", "high95", "unit", "ims_function"} and m["ims_function"] in (1, 2, 3, 4)
            assert m["mean"] is None or m["low95"] <= m["mean"] <= m["high95"], name
    protected, bare = first["rows"]
    assert protected["protection"] and not bare["protection"]
    assert bare["metrics"]["false_alarms"]["mean"] is None and bare["metrics"]["boot_cycles"]["mean"] == 0.0
    assert json.dumps(first, allow_nan=False) == json.dumps(compare(suite.load(path), ["autopilot"], seed=3,
                                                                     workers=2))


@pytest.mark.parametrize("name", suite.names())
def test_a_suite_loads_with_every_case(name: str):
    cases = list(suite.load(name).cases())
    assert len({(label, case.name) for label, case in cases}) == len(cases) >= 5
    assert any(case.name == "clear_air" for _, case in cases)
    for label, case in cases:
        assert case.parameters["turbulence_sigma_w"] == suite.load(name).turbulence[label]


def test_mistakes_name_the_nearest(tmp_path: Path):
    with pytest.raises(InputError, match="quick"):
        suite.load("quik")
    with pytest.raises(InputError, match="autopilot"):
        compare(suite.load("quick"), ["autopilott"], 1)
    path = tmp_path / "x.toml"
    path.write_text(TINY.replace("pre_iced", "preiced"))
    with pytest.raises(InputError, match="pre_iced"):
        suite.load(path)
    path.write_text(TINY + 'turbulence = ["lightt"]\n')
    with pytest.raises(InputError, match="light"):
        list(suite.load(path).cases())
