"""Before a flight: what planned manoeuvres would reveal, and whether they do once they are flown."""

import json
from dataclasses import replace

import numpy as np
import pytest

from icing_env import aircraft
from icing_env.effects import with_effects
from icing_env.errors import InputError
from icing_env.record import COLUMNS, FlightRecord, RecordMeta
from icing_env.simulate import Fleet
from icing_env.trim import trim
from icing_env.types import MEASUREMENT_FIELDS
from sim2real.diagnosis import diagnose
from sim2real.library.candidates import SPREAD, bank
from sim2real.planning.manoeuvre import MANOEUVRES, distances, fly
from sim2real.planning.plan import ALTITUDE, GUSTS, plan
from sim2real.planning.planned import named, planned, template
from sim2real.posterior.singles import DETECTABLE, INDISTINGUISHABLE
from sim2real.signatures.whitening import FARTHEST
from testbed.cli import _run

ELEVATOR, LATERAL = "elevator doublets at 55 m/s", "aileron and rudder doublets at 60 m/s"
SLOW = {"(10 Hz)": 5, "(1 Hz)": 50}  # samples between those of slow channels
COMMANDED = ("elevator", "aileron", "rudder", "throttle_left", "throttle_right")


@pytest.fixture(scope="module")
def elevator():
    return plan(named([ELEVATOR]))


@pytest.fixture(scope="module")
def lateral():
    return plan(named([LATERAL]))


def flown(effects: dict[str, dict[str, float]] | None = None, seed: int = 7) -> FlightRecord:
    """The elevator manoeuvre as the simulator flies it: actuators, gusts, noise, slow channels."""
    (manoeuvre,) = named([ELEVATOR])
    asked = planned(template(ALTITUDE, {}), manoeuvre).commands
    model = aircraft.load()
    true = with_effects(aircraft.changed(model, turbulence_sigma_w=GUSTS), effects or {})
    fleet = Fleet(true, 1, 0.02)
    fleet.state[:] = trim(model, airspeed=manoeuvre.airspeed, altitude=ALTITUDE).state
    fleet.state["seed"] = seed
    fleet.start()
    kept = []
    series = {n: asked.get(f"{n}_command", asked.get(n)) for n in COMMANDED}
    for k in range(len(series["elevator"])):
        kept.append(fleet.measurement[0].copy())
        for name, values in series.items():
            fleet.command[name] = values[k]
        fleet.step()
    rows = np.array(kept)
    channels = {f"{n}_command": series[n] for n in ("elevator", "aileron", "rudder")}
    for name, _, meaning in MEASUREMENT_FIELDS:
        if name in COLUMNS:
            channels[name] = rows[name].astype(float)
            every = next((n for mark, n in SLOW.items() if mark in meaning), 1)
            channels[name][np.arange(len(rows)) % every != 0] = np.nan
    inertia = tuple(float(model[f"inertia_{axis}"][0]) for axis in ("xx", "yy", "zz", "xz"))
    return FlightRecord(channels, RecordMeta(name="flown", mass=float(model["mass"][0]), inertia=inertia,
                                             sensors={"thrust": {"source": "measured"}}))


def missed(found) -> dict[str, str]:
    return {entry["effect"]: entry["why"] for entry in found.not_testable}


def assert_no_harder(more, less):
    """What the lesser plan shows, the better one shows as small (sizes between those flown are read off a line)."""
    for name, limit in less.detection_limits.items():
        other = more.detection_limits[name]
        if other["parameter"] == limit["parameter"]:
            assert abs(other["smallest"]) <= 1.08 * abs(limit["smallest"]), name


def assert_easier(more, less, *names):
    for name in names:
        ratio = more.detection_limits[name]["smallest"] / less.detection_limits[name]["smallest"]
        assert 0.0 < ratio < 0.9, name


def test_what_is_not_moved_is_not_shown(elevator, lateral):
    for name in ("elevator_power", "static_stability", "pitch_damping", "pitch_trim", "elevator_gearing"):
        assert name in elevator.detection_limits
    for name in ("roll_damping", "aileron_power", "dihedral_effect", "directional_stability", "rudder_lag", "fin_ice"):
        assert "not excited" in missed(elevator)[name]
        assert name in lateral.detection_limits
    for name in ("elevator_lag", "elevator_gearing"):
        assert "not excited" in missed(lateral)[name]
    for found in (elevator, lateral):
        assert not set(found.detection_limits) & set(missed(found))


def test_limits_shrink_with_larger_inputs(elevator):
    larger = plan(named([ELEVATOR], amplitude=1.5))
    assert_no_harder(larger, elevator)
    assert_easier(larger, elevator, "elevator_rate_limit", "downwash_lag", "power_pitching")


def test_limits_shrink_in_calmer_air(elevator):
    rough = plan(named([ELEVATOR]), 1.5)
    assert_no_harder(elevator, rough)
    assert_easier(elevator, rough, "updraft", "pitch_attitude_bias")


def test_limits_shrink_with_better_instruments(elevator):
    worse = plan(named([ELEVATOR]), noise={"q": 0.01, "alpha": 0.01, "az": 0.5})
    assert_no_harder(elevator, worse)
    assert_easier(elevator, worse, "pitch_gyro_bias", "normal_accelerometer_bias")
    assert worse.noise["q"] == 0.01


def test_limits_shrink_with_more_manoeuvres(elevator, lateral):
    more = plan(named([ELEVATOR, LATERAL, ELEVATOR]))
    for part in (elevator, lateral):
        assert_no_harder(more, part)
    assert_easier(more, elevator, "elevator_lag", "elevator_rate_limit")  # a vane's offset shows beyond its calibration


def test_limits_agree_with_those_after_the_flight(elevator):
    after = {n: limit for n, limit in diagnose([flown()]).detection_limits.items() if limit["smallest"] is not None}
    ratio = {n: limit["smallest"] / after[n]["smallest"] for n, limit in elevator.detection_limits.items()
             if n in after and limit["parameter"] == after[n]["parameter"]}  # fmt: skip
    # not of a trim: the height of the thrust line hides more of it where power rests, as it does in a plan
    for name in ("elevator_power", "static_stability", "pitch_damping", "lift_slope", "tail_ice", "wing_ice",
                 "ice_drag", "mass_error", "cg_shift", "elevator_lag", "elevator_gearing", "alpha_bias",
                 "airspeed_scale", "thrust_loss", "pitch_gyro_bias"):  # fmt: skip
        assert 0.75 < ratio[name] < 1.3, (name, ratio[name])
    near = [n for n, r in ratio.items() if 0.7 < r < 1.3]  # gusts excite some others, diagnose interpolates two
    assert len(near) >= 0.8 * len(ratio) > 25


def test_a_derivative_shows_only_beyond_its_own_spread(elevator, lateral):
    """The model's uncertainty, 5 % of each, can take an effect's place at the price of its own size."""
    for found, name in ((elevator, "static_stability"), (elevator, "pitch_damping"), (lateral, "roll_damping")):
        limit = found.detection_limits[name]["smallest"]
        assert abs(1.0 / (1.0 + limit) - 1.0) / SPREAD >= DETECTABLE


@pytest.mark.slow
def test_a_gap_twice_the_limit_is_found_and_one_of_a_quarter_is_not(elevator):
    limit = elevator.detection_limits["pitch_trim"]["smallest"]
    assert diagnose([flown({"pitch_trim": {"delta_Cm_0": 2.0 * limit}})]).verdict != "no_gap"
    assert diagnose([flown({"pitch_trim": {"delta_Cm_0": 0.25 * limit}})]).verdict == "no_gap"


def test_a_rate_limit_shows_only_once_it_is_reached(elevator):
    row = aircraft.load()[0]
    (manoeuvre,) = named([ELEVATOR])
    reversal = 2.0 * manoeuvre.doublets[0][2]  # the largest step asked of the actuator, rad
    fastest = reversal * (1.0 - np.exp(-0.02 / row["elevator_lag"])) / 0.02
    assert elevator.detection_limits["elevator_rate_limit"]["smallest"] > 1.0 - fastest / row["elevator_rate"] > -1.0
    assert elevator.detection_limits["elevator_rate_limit"]["smallest"] > 0.1


def test_what_one_manoeuvre_confuses_another_tells_apart(elevator, lateral):
    assert "pitch_trim" in lateral.indistinguishable_from["cg_shift"]  # nothing pitches: both are a constant moment
    assert "cg_shift" not in elevator.indistinguishable_from["pitch_trim"]
    for name in lateral.indistinguishable_from:  # only what shows at its typical size is compared
        limit = lateral.detection_limits[name]
        assert abs(limit["smallest"]) <= 1.001 * abs(limit["typical"])


def test_a_manoeuvre_is_flown_at_the_speed_of_its_name():
    faster, slower = named(["elevator doublets at 80 m/s", "slow deceleration from 60.5 m/s"])
    assert faster == replace(named(["elevator doublets at 85 m/s"])[0], name="elevator doublets at 80 m/s",
                             airspeed=80.0)  # fmt: skip
    assert slower.airspeed == 60.5
    assert slower.power_ramp < 0.0
    assert len(named(["all"])) == 6


def test_a_plan_that_cannot_be_is_told():
    with pytest.raises(InputError, match="elevator doublets"):
        named(["elevator doublet at 55 m/s"])
    with pytest.raises(InputError, match="20 to 110 m/s"):
        named(["elevator doublets at 200 m/s"])
    with pytest.raises(InputError, match="no manoeuvre"):
        plan(())
    with pytest.raises(InputError, match="alpha"):
        plan(named([ELEVATOR]), noise={"alfa": 0.01})
    with pytest.raises(InputError, match="positive"):
        plan(named([ELEVATOR]), noise={"alpha": 0.0})
    with pytest.raises(InputError, match="lift_slope"):
        plan(named([ELEVATOR]), without=["lift_slop"])


@pytest.mark.parametrize(("arguments", "said"), [
    (["--plan", "elevator doublet"], "no manoeuvre 'elevator doublet'"),
    (["--plan", "elevator doublets at 100 m/s"], "cannot be flown"),
    (["--plan", ELEVATOR, "--amplitude", "12"], "alpha reaches"),
    (["--plan", LATERAL, "--amplitude", "12"], "make its amplitude smaller"),
    (["--plan", ELEVATOR, "--noise", "q"], "CHANNEL=VALUE"),
    (["--plan", ELEVATOR, "--without", "gremlins"], "no effect 'gremlins'"),
    (["--plan", ELEVATOR, "--gusts", "-1"], "--gusts"),
    (["--plan", ELEVATOR, "flown.csv"], "takes no RECORD"),
    (["--plan", ELEVATOR, "--ladder"], "takes no --ladder"),
    (["flown.csv", "--gusts", "1.5"], "--gusts belongs to a plan"),
    ([], "--plan"),
])  # fmt: skip
def test_bad_input_is_one_line(arguments, said, capsys):
    assert _run(["diagnose", *arguments]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.count("\n") == 1
    assert said in printed.err


def test_the_command_says_what_would_show(capsys, elevator):
    assert _run(["diagnose", "--plan", ELEVATOR, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["manoeuvres"] == [{"name": ELEVATOR, "airspeed": 55.0, "duration": 30.0}]
    assert (found["sigma_w"], found["altitude"], found["refused"]) == (0.5, 2200.0, {})
    assert found["detection_limits"] == elevator.detection_limits
    assert found["not_testable"] == elevator.not_testable
    assert _run(["diagnose", "--plan", ELEVATOR, "--gusts", "1.5", "--without", "pitch_trim"]) == 0
    printed = capsys.readouterr().out
    assert f"in gusts of 1.5 m/s, '{ELEVATOR}' would show" in printed
    assert "elevator_gearing" in printed
    assert "pitch_trim" not in printed
    assert "not excited" in printed


def test_a_rival_that_departs_from_flight_is_no_farther_than_its_samples_allow():
    slow = fly(template(ALTITUDE, {}), MANOEUVRES[-1])
    apart = distances(slow, bank(), [("pitch_trim", {"delta_Cm_0": 0.05}), ("thrust_loss", {"change": -0.18})], 3.2)
    assert INDISTINGUISHABLE < apart["pitch_trim", "thrust_loss"] < FARTHEST * slow.measured.size**0.5
