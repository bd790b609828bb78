"""Closure by the generator's plant: the truth closes what its form can, nothing closes nothing."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from testbed.withheld import draw, generate, refly, windows
from testbed.withheld.conditions import Conditions
from testbed.withheld.effects import BY_NAME
from testbed.withheld.flights import Aircraft, recorded
from testbed.withheld.manoeuvres import DIAGNOSED, PLANS

DESIGN = draw.Design("single", (), 0, 1.0, 0.5, 1.3, 1.0, {"Cl_p": 1.05, "Cm_alpha": 0.95}, 7)
PARTS = {"same": (("elevator_power", "same", -0.2),), "other": (("alpha_bias", "other", 0.02),)}


@pytest.fixture(scope="module", params=sorted(PARTS))
def key(request) -> dict:
    return generate.make_case("a", replace(DESIGN, parts=PARTS[request.param]), None)[1]


def answer(name: str, **values: float) -> dict:
    return commanded(f"--effect {name}:" + ",".join(f"{p}={v}" for p, v in values.items()))


def commanded(effects: str) -> dict:
    return {"verdict": "explained", "resimulate": {"command": f"icing fly clear_air {effects}"}}


def test_the_truth_closes_the_gap_and_another_effect_does_not(key):
    held, (name,) = key["held_out"], key["effects"]
    (parameter, size), = key["parameters"][name].items()
    right = refly.flown_again(answer(name, **{parameter: size}), key)
    assert right["own_after"] < 0.3 * held["own_before"] and right["after"] < held["before"]
    if key["forms"] == ["same"]:  # then the answer is the oracle
        assert right["after"] == pytest.approx(held["oracle"])
        assert right["own_after"] == pytest.approx(held["own_oracle"])
    wrong = refly.flown_again(answer(name, **{parameter: -size}), key)
    assert wrong["own_after"] > held["own_before"]


def test_an_answer_without_effects_leaves_the_gap_as_it_was(key):
    for silent in (commanded(""), {"error": "refused"}):
        found = refly.flown_again(silent, key)
        assert found["after"] == pytest.approx(key["held_out"]["before"])
        assert found["own_after"] == pytest.approx(key["held_out"]["own_before"])
        assert found["flown"] == {} and found["not_flown"] == []


def test_an_answer_that_another_took_the_place_of_is_flown_again_and_no_other(key, tmp_path, monkeypatch):
    answers, keys, out = (tmp_path / name for name in ("answers", "keys", "out"))
    for folder in (answers, keys):
        folder.mkdir()
    (keys / "a.json").write_text(json.dumps(key))
    flown = []
    monkeypatch.setattr(refly, "gap_of", lambda model, flights, own: flown.append(model) or 0.0)
    for size, flights in ((0.1, 3), (0.1, 3), (0.2, 6)):
        (answers / "a.json").write_text(json.dumps(answer("lift_slope", change=size)))
        refly.refly(answers, keys, out)
        assert len(flown) == flights
        assert json.loads((out / "a.json").read_text())["flown"] == {"lift_slope": size}


def test_every_parameter_of_the_library_can_be_flown():
    from icing_env.effects import LIBRARY

    for name, effect in LIBRARY.items():
        model = refly.told(answer(name, **{p.name: p.typical for p in effect.parameters}))
        assert not model.lacking or name == "turbulence", name
        for part, _, size in model.parts:
            assert BY_NAME[part].same(size) is not None
    assert refly.told(answer("made_up", size=1.0)) == refly.Told((), {}, {}, ("made_up.size",))


def test_derivatives_and_lines_are_flown_too(key):
    """With the truth's effect in its true form the true aircraft is left, and that leaves noise."""
    (name,), (form,) = key["effects"], key["forms"]
    (parameter, size), = key["parameters"][name].items()
    whole = commanded(f"--effect derivatives:Cl_p=0.05,Cm_alpha=-0.05 --effect {name}:{parameter}={size}")
    assert refly.told(whole).factors == pytest.approx({"Cl_p": 1.05, "Cm_alpha": 0.95})
    if form == "same":
        found = refly.flown_again(whole, key)
        assert found["after"] == pytest.approx(key["held_out"]["own_oracle"])
        assert found["effects_after"] == pytest.approx(key["held_out"]["oracle"])


def test_an_offset_of_the_aircrafts_own_is_no_share_of_what_is_published():
    """Published as nothing, a rolling moment of 2e-4 was flown as one of 1.0002."""
    found = refly.told(answer("derivatives", Cl_0=2e-4, aileron_offset=-1e-3, bias_q=4e-4, aileron_gearing=0.01))
    assert found.factors == pytest.approx({"Cl_0": 2e-4, "aileron_offset": -1e-3, "bias_q": 4e-4,
                                           "aileron_gearing": 1.01})  # fmt: skip
    row, plain = (Aircraft(factors).row() for factors in (found.factors, {}))
    assert row["Cl_0"][0] == pytest.approx(2e-4) and row["aileron_offset"][0] == pytest.approx(-1e-3)
    assert row["aileron_gearing"][0] == pytest.approx(1.01 * plain["aileron_gearing"][0])


def test_terms_about_a_condition_are_those_of_the_library():
    """What the generator adds to its numbers is what `discrepancy` adds to the simulator's, but for what it lacks."""
    from icing_env.aircraft import load
    from icing_env.effects import with_effects

    values = {"CX_alpha_alpha": 0.4, "CZ_alpha": 0.3, "CZ_0": 0.01, "Cm_elevator": -0.1, "CY_r": 0.2, "Cl_0": 1e-3,
              "Cm_alpha_elevator": 0.5, "Cn_alpha_beta": 0.2, "Cl_airspeed": 1e-4, "Cl_airspeed_airspeed": 1e-6,
              "Cm_elevator_elevator_elevator": -3.0, "Cl_p_p_p": 0.2, "CZ_alpha_alpha_alpha": 5.0,
              "CZ_time": 1e-3, "Cn_alpha_CT": 0.3, "Cm_CT": 0.1, "Cl_q": 0.2, "CX_rudder_rudder": 0.5,
              "Cm_alphadot": -2.0, "CZ_alpha_q": 3.0, "Cn_alpha_aileron": 0.2, "at_CT": 0.02, "at_alpha": 0.05,
              "at_elevator": -0.02, "at_airspeed": 65.0, "at_time": 20.0,
              "bias_alpha": 0.01, "scale_alpha": 0.1, "scale_airspeed": 0.02}  # fmt: skip
    terms, lacking = refly.numbers(values)
    before, after = load(), with_effects(load(), {"discrepancy": values})
    changed = {n for n in before.dtype.names if before[n][0] != after[n][0]}
    assert not lacking and changed == set(terms)
    for name, value in terms.items():
        assert after[name][0] - before[name][0] == pytest.approx(value)
    assert refly.numbers({"delay_alpha": 0.1, "drift_q": 0.1, "Cn_p": 0.0})[1] == [
        "discrepancy.delay_alpha", "discrepancy.drift_q"]


def test_noise_alone_is_no_gap_and_the_start_is_fitted():
    manoeuvre, air = PLANS[0][DIAGNOSED], Conditions(0.5, 1.0, 1.0)
    own, noise = windows.own_noise((manoeuvre,), 1.0, air)
    flight = windows.held(*recorded(Aircraft(), manoeuvre, 1.0, air, np.random.default_rng(99)))
    assert windows.gap_of(Aircraft(), [flight], own) < 3.0 * noise < 0.3
    calm = windows.held(*recorded(Aircraft(), manoeuvre, 1.0, Conditions(0.0, 1.0, 0.0), np.random.default_rng(1)))
    still = np.sqrt(windows.residual_energy(Aircraft(), calm))
    assert np.max(still) < 0.05  # instruments settle at the start of each window; nothing else differs
    calm.states[:, windows.FREE] *= 1.02  # a worse guess of where windows begin
    assert np.max(np.sqrt(windows.residual_energy(Aircraft(), calm))) < 0.1
    assert windows.spread_gap((manoeuvre,), 0.5) > 2.0 * noise
