"""Ice by surface: the evidence is physics, the weights are what was saved, statements that are wrong are caught."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

from estimators.characterise import detection, evidence, online
from estimators.characterise.clean import clean_from, published_clean
from estimators.characterise.detection import exceeds
from estimators.characterise.features import FEATURES, OFFSET, against, departures, features, offset_of
from estimators.characterise.model import PARTS, RIVALS, Judgement, load_models, read_models, save_models
from estimators.characterise.record import characterise
from estimators.characterise.thresholds import Levels, Thresholds
from estimators.characterise.tuning import load_tuning
from icing_env import aircraft, scenario
from icing_env.errors import InputError
from icing_env.record import FlightRecord
from icing_env.types import COMMAND, ESTIMATE, MEASUREMENT, SURFACES
from testbed.characterisation import evaluate_protection
from testbed.characterisation.dataset import SEEDS, five_classes
from testbed.characterisation.flights import Plan, fly
from testbed.cli import icing
from testbed.environments import loop_factory
from testbed.flight import fly as fly_one

TAIL = SURFACES.index("htail")


@pytest.fixture(scope="module")
def flown():
    """Forty aircraft, eight of each class, one window in calm and one fleet in moderate turbulence."""
    eta, label = five_classes(40, np.random.default_rng(3), grid=False)
    return {sigma: (fly(Plan(eta, np.full(40, sigma)), 4000 + k), label) for k, sigma in enumerate((0.0, 3.1))}


@pytest.mark.parametrize("sigma", [0.0, 3.1])
def test_lost_elevator_power_is_what_the_tail_ice_takes(flown, sigma):
    fleet, label = flown[sigma]
    k = float(aircraft.load()["k_Cm_elevator_htail"][0])
    values = against(fleet.features[:, 0, -1], offset_of(fleet.reference))
    tail = (label >= 3) & fleet.good
    found = 0.1*values[tail, FEATURES.index("d_Cm_elevator")]
    truth = k*fleet.eta[tail, TAIL]
    assert np.corrcoef(found, truth)[0, 1] > 0.95
    assert np.abs(found - truth).mean() < 0.06


def departures_in_gusts(tail_effect):
    """Mean departure of Cm_elevator of a clean fleet in moderate turbulence, by a characteriser that knows, or does
    not know, that gusts reach the tail later."""
    world_scenario = scenario.load("clear_air", duration=30.0, ice_protection="off", task={"kind": "hold"},
                                   doublets_at=(2.0,), parameters={"turbulence_sigma_w": 3.1})
    from icing_env.world import World

    world = World(world_scenario, 12, loop_factory(observer=False, management=False, protection=False, boots=False),
                  mode=None)
    world.reset(seeds=list(range(12)))
    clean, memory = clean_from(world.clean), evidence.init(12)
    clean["Cm_alpha_tail"] *= tail_effect
    for _ in range(1500):
        world.step()
        evidence.step(memory, world.fleet.measurement, clean, world.dt, 60.0, 15.0)
    return float(np.mean(departures(memory)[0]["Cm_elevator"]))


def test_gusts_that_reach_the_tail_later_would_pass_for_tail_ice():
    assert abs(departures_in_gusts(1.0)) < 0.1
    assert departures_in_gusts(0.0) < -0.15


def test_the_weights_that_come_along_tell_most_classes(flown):
    fleet, label = flown[0.0]
    judged = load_models("network")["own"].judge(against(fleet.features[:, 0, -1], offset_of(fleet.reference)))
    assert (judged.classes.argmax(axis=1) == label)[fleet.good].mean() >= 0.95
    assert np.allclose(judged.classes.sum(axis=1), 1.0)


def test_a_fleet_is_judged_as_its_aircraft_alone(flown):
    fleet, _ = flown[0.0]
    values = fleet.features[:, 0, -1]
    models = load_models("network")
    offset, referenced = np.zeros((40, OFFSET)), np.arange(40) % 2 == 0
    together = online.judge(values, offset, referenced, models)
    alone = [online.judge(values[i:i + 1], offset[i:i + 1], referenced[i:i + 1], models) for i in range(40)]
    assert np.allclose(together.eta, np.concatenate([one.eta for one in alone]), atol=1e-12)
    assert np.allclose(together.iced, np.concatenate([one.iced for one in alone]), atol=1e-9)


@pytest.mark.parametrize("rival", RIVALS)
def test_saved_weights_judge_as_before(tmp_path, rival, flown):
    models, values = load_models(rival), flown[3.1][0].features[:, 0, -1]
    save_models(tmp_path / f"{rival}.safetensors", models)
    again = read_models(tmp_path / f"{rival}.safetensors")
    for kind, model in models.items():
        assert np.array_equal(model.judge(values).classes, again[kind].judge(values).classes)


def test_a_damaged_file_of_weights_is_refused(tmp_path):
    path = tmp_path / "network.safetensors"
    save_models(path, load_models("network"))
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InputError, match="not a characteriser's weights"):
        read_models(path)
    with pytest.raises(InputError, match="network"):
        load_models("netwerk")


THRESHOLDS = Thresholds.__new__(Thresholds)
THRESHOLDS.sigma = np.array([0.0, 2.0])
THRESHOLDS.levels = {kind: Levels(threshold=(0.0, 2.0), usual=(-8.0, -8.0)) for kind in ("own", "type")}


def believed(scores, gust=0.0, temperature=260.0):
    """Detection and onset after a history of scores, one a second."""
    watch = detection.init(1)
    for t, score in enumerate(scores):
        detection.detect(watch, np.array([score]), np.array([gust]), np.array([temperature]), np.array([float(t)]),
                         np.array([True]), THRESHOLDS, load_tuning())
    return bool(watch["detected"][0]), float(watch["onset"][0])


def test_ice_is_believed_when_its_score_stays_and_began_when_it_rose():
    rise = [-8.0]*30 + [-2.0]*20 + [1.0]*15
    assert believed(rise) == (True, 29.0)
    assert not believed(rise[:55])[0], "not yet confirmed"
    assert not believed(rise, gust=2.0)[0], "in light turbulence the threshold is higher"
    assert not believed(rise, temperature=285.0)[0], "too warm for new ice"
    assert believed(rise + [-1.0]*200)[0], "just below the threshold is no all-clear"
    assert not believed(rise + [-6.0]*61)[0]


def inflated(after, inflations=2):
    """P(failed) of the left wing's boot after inflations that leave `after` of a severity of 0.1."""
    watch, tuning = detection.init(1), load_tuning()

    def judged(eta):
        return Judgement(np.full((1, 5), 0.2), np.zeros(1), np.full((1, 4), eta), np.full((1, 4), 0.01))

    for k in range(inflations):
        now = np.array([100.0 + 300.0*k])
        on = np.array([[True, False, False, False]])
        detection.inflations(watch, on & False, now - 1.0, judged(0.1), tuning)
        assert detection.inflations(watch, on, now, judged(0.1), tuning).tolist() == [[True, False, False, False]]
        detection.outcomes(watch, now + tuning.boot_after, judged(after))
    assert detection.verdicts(watch[0])["htail"] == "not tested"
    return float(detection.failed(watch)[0, 0]), detection.verdicts(watch[0])["left_wing"]


def test_a_boot_that_leaves_the_ice_has_failed():
    assert inflated(0.1)[0] > 0.8
    assert inflated(0.1)[1] == "failed"
    assert inflated(0.035)[0] < 0.02
    assert inflated(0.035)[1] == "works"
    assert 0.05 < inflated(0.072, 1)[0] < 0.5, "halfway says little"


def test_failed_boots_are_recognised_in_flight():
    broken, severity = evaluate_protection.fly(12, "calm", online.load("network"), 5000)
    p = np.stack([severity[f"p_failed_{part}"] for part in PARTS[:3]], axis=1)
    assert (p[broken] > 0.5).mean() >= 0.7
    assert (p[~broken] < 0.5).mean() >= 0.9


def test_a_shot_between_two_judgements_is_seen():
    memory, severity = online.init(1)
    measurement, estimate, switches = np.zeros(1, MEASUREMENT), np.zeros(1, ESTIMATE), np.zeros(1, COMMAND)
    for name, value in {"airspeed": 72.0, "pressure": 8e4, "temperature": 265.0, "az": -9.8}.items():
        measurement[name] = value
    character = online.load("logistic")
    for k in range(150):
        measurement["time"] = 0.02*k
        switches["boots_tail"] = float(60 <= k < 70)
        online.step(memory, severity, estimate, measurement, switches, published_clean(), character, 0.02)
    assert np.isfinite(memory.watch["due"][0]).tolist() == [False, False, True, False]


def test_a_nan_in_a_measurement_changes_nothing_for_good():
    measurement, estimate = np.zeros(2, MEASUREMENT), np.zeros(2, ESTIMATE)
    for name, value in {"airspeed": 72.0, "pressure": 8e4, "temperature": 265.0, "alpha": 0.04, "az": -9.8,
                        "thrust_left": 1500.0, "thrust_right": 1500.0}.items():
        measurement[name] = value
    clean, memory = published_clean(), evidence.init(2)
    for k in range(50):
        measurement["q"][1] = np.nan if k == 25 else 0.0
        evidence.step(memory, measurement, clean, 0.02, 60.0, 15.0)
    assert np.isfinite(features(memory, estimate, clean)).all()
    assert memory["age"][1] == pytest.approx(memory["age"][0] - 0.02)


@pytest.fixture(scope="module")
def records():
    """A clean flight of the type and one with ice on its wings, doublets in both."""
    ice = {"left_wing": 0.15, "right_wing": 0.15}
    return {name: fly_one(scenario.load("clear_air", duration=45.0, doublets_at=(3.0,), task={"kind": "hold"},
                                        initial={"eta": eta}, ice_protection="off"), seed=1).record
            for name, eta in (("clean", {}), ("iced", ice))}


def test_a_record_tells_its_ice(records):
    clean, iced = characterise(records["clean"]), characterise(records["iced"], records["clean"])
    assert max(s["eta"] for s in clean["surfaces"].values()) < 0.06
    assert iced["surfaces"]["left_wing"]["eta"] == pytest.approx(0.15, abs=0.05)
    assert iced["surfaces"]["htail"]["eta"] < 0.06
    assert iced["probability"] > 0.9 > 0.5 > clean["probability"]
    assert any("reference" in note for note in clean["notes"])
    assert iced["surfaces"]["left_wing"]["protection"] == "not tested"


def test_a_record_without_thrust_is_refused(records):
    channels = {k: v for k, v in records["clean"].channels.items() if k != "thrust_left"}
    with pytest.raises(InputError, match="thrust_left"):
        characterise(FlightRecord(channels=channels, meta=records["clean"].meta))


def test_the_command_prints_what_the_record_shows(records, tmp_path):
    from icing_env.record import write

    path = tmp_path / "iced.csv"
    write(records["iced"], path)
    done = CliRunner().invoke(icing, ["characterise", str(path), "--json"], catch_exceptions=False)
    found = json.loads(done.output)["records"][str(path)]
    assert set(found["surfaces"]) == set(PARTS)
    assert sum(found["classes"].values()) == pytest.approx(1.0)


def test_seeds_of_fit_and_test_are_apart():
    firsts = sorted(SEEDS.values())
    assert all(b - a >= 40 for a, b in zip(firsts, firsts[1:], strict=False))


def test_probability_of_a_level():
    assert exceeds(0.1, 0.02, 0.1) == pytest.approx(0.5)
    assert exceeds(0.1, 0.02, 0.06) == pytest.approx(0.97725, abs=1e-4)


def test_switches_are_fields_of_the_command():
    assert set(detection.SWITCHES) <= set(COMMAND.names or ())


@pytest.mark.slow
def test_a_training_goes_on_where_it_was_killed(tmp_path):
    from safetensors.numpy import load_file

    from testbed.characterisation.train import Options, train

    options, said = Options(aircraft=20, parts=1, hours=0.7, iterations=20), []
    train(tmp_path, options, said.append)
    first = load_file(tmp_path / "network.safetensors")
    assert sum("flying" in line for line in said) == 2
    (tmp_path / "network.safetensors").unlink()
    said.clear()
    train(tmp_path, options, said.append)
    assert not any("flying" in line for line in said)
    again = load_file(tmp_path / "network.safetensors")  # bytes may differ: the header's order is not kept
    assert again.keys() == first.keys() and all(again[k].tobytes() == first[k].tobytes() for k in first)
    assert characterise.__name__ and online.load("network", tmp_path)


def test_the_card_tells_what_the_weights_and_seeds_are():
    from icing_env.configuration import read_toml

    card = read_toml("estimators", "characterise/card")
    assert tuple(card["features"]) == FEATURES
    assert {name: card["seeds"][name] for name in SEEDS} == SEEDS
    assert card["command"] == read_toml("estimators", "characterise/thresholds")["command"]
