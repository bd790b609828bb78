"""The effect `discrepancy`: what a diagnosis describes but cannot name, flown by the plant."""

from dataclasses import replace

import numpy as np
import pytest
from described import record
from plant import fleet_at, level, loads

from icing_env.aircraft import changed, load
from icing_env.crosstalk import CROSSTALK
from icing_env.discrepancy import SURFACES, bends
from icing_env.effects import DESCRIPTIONS, LIBRARY, get, parse, with_effects
from icing_env.effects.discrepancy import AT, CHANNELS, TERMS
from icing_env.errors import InputError
from icing_env.frames import direction_cosines
from icing_env.simulate import Fleet
from icing_env.trim import trim
from sim2real.actuators.paths import answered, follow
from sim2real.closing.flyable import SQUARE, choices, condition
from sim2real.library.candidates import bank
from sim2real.library.pushes import pushes
from sim2real.library.terms import GENERIC
from sim2real.prediction.as_predicted import predicted
from sim2real.prediction.kalman import gains
from sim2real.prediction.predictor import innovations
from sim2real.records.reconstruct import reconstruct

AIRCRAFT = changed(load(), Cm_elevator_CT=0.0)  # power would change what a term of the elevator does
EFFECT = DESCRIPTIONS["discrepancy"]
LOAD = {"CX": ("fx", "wing_area"), "CY": ("fy", "wing_area"), "CZ": ("fz", "wing_area"), "Cl": ("roll", "span"),
        "Cm": ("pitch", "chord"), "Cn": ("yaw", "span")}  # fmt: skip
AT_VALUES = {"at_alpha": 0.04, "at_elevator": -0.02, "at_airspeed": 62.0, "at_time": 0.0, "at_theta": 0.03,
             "at_CT": 0.02}  # fmt: skip
STATE = {"q": 0.03, "p": 0.1, "r": -0.05, "elevator": 0.05, "aileron": 0.03, "rudder": -0.04, "power_left": 2.5e5,
         "power_right": 3e5, "alpha_downwash": 0.07, "e0": 0.99, "e1": 0.1, "e2": 0.05, "e3": -0.08}  # fmt: skip


def described(**values: float):
    return with_effects(AIRCRAFT, {"discrepancy": values})


def felt(row) -> dict:
    return loads(level(1, 70.0, 0.09, 0.03, **STATE), row)


def coefficient(name: str, row) -> float:
    """The coefficient of one state, from the loads."""
    found = felt(row)
    qs = 0.5 * found["density"][0] * found["airspeed"][0] ** 2 * row["wing_area"][0]
    field, length = LOAD[name]
    return float(found[field][0] / qs / (1.0 if length == "wing_area" else row[length][0]))


def factor(term: str) -> float:
    """What a term multiplies in the state of `coefficient`, from its definition."""
    p, found = AIRCRAFT[0], felt(AIRCRAFT)
    thrust = (found["thrust_left"] + found["thrust_right"])[0]
    ct = thrust / (0.5 * found["density"][0] * 70.0**2 * p["wing_area"])
    attitude = direction_cosines(*(STATE[e] for e in ("e0", "e1", "e2", "e3")))  # local z in body axes: 2, 5, 8
    turning = (found["fy"][0] / p["mass"] + attitude[5] * p["gravity_sea_level"]) / 70.0 + 0.1 * 0.09 + 0.05
    values = {"0": 1.0, "alpha": 0.09 - 0.04, "beta": 0.03, "elevator": 0.05 + 0.02, "airspeed": 70.0 - 62.0,
              "aileron": 0.03, "rudder": -0.04, "q": 0.03 * p["chord"] / 140.0, "p": 0.1 * p["span"] / 140.0,
              "r": -0.05 * p["span"] / 140.0, "time": 0.0, "CT": ct - p["CT_reference"] - 0.02,
              "alphadot": (0.09 - 0.07) * 70.0 / p["tail_arm"] * p["chord"] / 140.0,
              "betadot": turning * p["span"] / 140.0, "phi": attitude[5], "theta": -attitude[2] - 0.03}  # fmt: skip
    return float(np.prod([values[part] for part in term.split("_")]))


@pytest.mark.parametrize(("name", "term"), [(c, t) for c, terms in TERMS.items() for t in terms])
def test_a_term_adds_its_product_to_its_coefficient(name, term):
    size = 0.02
    changed_by = coefficient(name, described(**{f"{name}_{term}": size}, **AT_VALUES)) - coefficient(name, AIRCRAFT)
    assert changed_by == pytest.approx(size * factor(term), rel=1e-6, abs=1e-9)


def test_neutral_changes_no_bit_and_it_is_no_explanation():
    assert with_effects(AIRCRAFT, {"discrepancy": EFFECT.neutral()}).tobytes() == AIRCRAFT.tobytes()
    assert "discrepancy" not in LIBRARY
    assert get("discrepancy") is EFFECT
    assert parse("discrepancy:Cm_alpha_alpha=0.3,at_alpha=0.05")[1] == {"Cm_alpha_alpha": 0.3, "at_alpha": 0.05}
    with pytest.raises(InputError, match="discrepancy"):
        get("discrepency")
    with pytest.raises(InputError, match="Cm_alpha_alpha"):
        described(Cm_alpha_alfa=0.3)


@pytest.mark.parametrize("name", TERMS)
def test_growth_counts_from_the_start_and_acts_like_a_constant_of_the_moment(name):
    """After t seconds the moment is that of an aircraft with the constant that has grown by then."""
    t = trim(AIRCRAFT, airspeed=65.0)
    for step in (0, 500):
        grown, constant = (fleet_at(t, row) for row in (described(**{f"{name}_time": 1e-4}),
                                                        described(**{f"{name}_0": 1e-4 * step * 0.02})))  # fmt: skip
        for fleet in (grown, constant):
            fleet.state["step"] = step
            fleet.step()
        for field in ("u", "v", "w", "p", "q", "r"):
            assert grown.state[field][0] == pytest.approx(constant.state[field][0], rel=1e-9, abs=1e-12)


def flown(row, seconds: float = 8.0) -> tuple[Fleet, list]:
    """A noiseless flight with doublets: the fleet and every sample of its instruments."""
    quiet = changed(row, **{n: 0.0 for n in row.dtype.names if n.startswith("noise_")})
    t = trim(AIRCRAFT, airspeed=65.0)
    fleet, samples = fleet_at(t, quiet), []
    for step in range(round(seconds / fleet.dt)):
        sign = 1.0 if step * fleet.dt % 4.0 < 2.0 else -1.0
        fleet.command["elevator"], fleet.command["rudder"] = t.elevator + 0.03 * sign, 0.03 * sign
        fleet.step()
        samples.append(fleet.measurement[0].copy())
    return fleet, samples


@pytest.fixture(scope="module")
def plain() -> list:
    return flown(AIRCRAFT)[1]


@pytest.mark.parametrize("channel", CHANNELS)
def test_errors_of_a_channel_are_what_they_say(channel, plain):
    """Scale about the condition, bias and growth; nothing else is touched."""
    at = {f"at_{channel}": 0.5} if channel in AT else {}
    row = described(**{f"bias_{channel}": 0.01, f"scale_{channel}": 0.1, f"drift_{channel}": 0.002}, **at)
    for before, after in zip(plain, flown(row)[1], strict=True):
        if channel == "altitude" and round(after["time"] / 0.02) % 5 != 0:
            continue  # sampled ten times a second
        wanted = before[channel] + 0.01 + 0.1 * (before[channel] - at.get(f"at_{channel}", 0.0)) + 0.002 * after["time"]
        assert after[channel] == pytest.approx(wanted, abs=1e-9)
        assert after["az"] == before["az"] or channel == "az"


OTHERS = [(channel, of) for channel, others in CROSSTALK.items() for of in others]


@pytest.mark.parametrize(("channel", "of"), OTHERS)
def test_what_a_channel_reads_of_others_is_what_it_says(channel, of, plain):
    """It follows the other channel's reading from the condition, its square or its rate; nothing else is touched."""
    other = of.removesuffix("2").removesuffix("dot")
    at = {f"at_{other}": 0.7} if other in AT and not of.endswith("dot") else {}
    size = {"airspeed": 1e-3, "az": 1e-3}.get(other, 0.01)
    with_it = flown(described(**{f"{channel}_of_{of}": size}, **at))[1]
    before, after = (np.array([[s[c] for c in CROSSTALK] for s in samples]) for samples in (plain, with_it))
    names = list(CROSSTALK)
    own, source = names.index(channel), before[:, names.index(other)]
    course = np.gradient(source, 0.02) if of.endswith("dot") else source - at.get(f"at_{other}", 0.0)
    course = course**2 if of.endswith("2") else course
    error = (after - before)[:, own] - size * course
    inside = slice(20, -1) if of.endswith("dot") else slice(None)
    assert np.sqrt(np.mean(error[inside] ** 2)) < (0.2 if of.endswith("dot") else 0.03) * size * np.sqrt(
        np.mean(course[inside] ** 2))  # fmt: skip
    assert np.array_equal(np.delete(before, own, axis=1), np.delete(after, own, axis=1))


@pytest.mark.parametrize("surface", SURFACES)
def test_bends_of_a_path_in_flight_are_those_that_a_record_is_judged_by(surface):
    """The position that the flight recorded is what the actuator makes of command, airspeed, load and surfaces."""
    asked = {"cube": 20.0, "side": 5e-3, "magnitude": 0.1, "direction": -4e-3, "of_airspeed": 1e-4, "of_alpha": 0.05,
             "of_beta": 0.05, "of_p": 0.01, "of_elevator": 0.1, "of_aileron": 0.1, "of_rudder": 0.1}  # fmt: skip
    quiet = {f"noise_{s}": 0.0 for s in SURFACES} | {"turbulence_sigma_w": 0.0}
    plain = reconstruct(record({}, 5, **quiet))
    nothing = follow(plain.commands[f"{surface}_command"], plain.positions[surface][0], plain.parameters, surface, 0.02)
    for name in bends(surface):
        values = {name: asked[name.removeprefix(f"{surface}_")], "at_airspeed": 65.0, "at_alpha": 0.05}
        flight = reconstruct(record(values, 5, **quiet))
        row = with_effects(flight.parameters, {"discrepancy": values})
        told = answered(flight, surface, row)[:, 0]
        moved = np.sqrt(np.mean((told - nothing[: len(told), 0]) ** 2))
        left = np.sqrt(np.nanmean((flight.positions[surface] - told)[5:] ** 2))
        assert left < max(0.2 * moved, 2e-5) < 0.5 * moved, (name, left, moved)  # the vanes are noisy


@pytest.mark.parametrize("channel", ["alpha", "beta", "p", "q", "r", "phi", "theta"])
@pytest.mark.parametrize("delay", [0.04, -0.04])
def test_a_delay_shows_what_was_there_before(channel, delay, plain):
    """The delayed reading is the plain one of two samples ago (or to come), to second order in the delay."""
    late = np.array([s[channel] for s in flown(described(**{f"delay_{channel}": delay}))[1]])
    there = np.array([s[channel] for s in plain])
    steps = round(delay / 0.02)
    inside = slice(10, -10)
    moved = np.roll(there, steps)[inside]
    left, without = late[inside] - moved, there[inside] - moved
    assert np.sqrt(np.mean(left**2)) < 0.35 * np.sqrt(np.mean(without**2))


# ---- the terms of the search


# Delays are left out: what the search differences are one-step predictions, whose steps are those of the filter too.
FLOWN = {(component, name) for component, _, names in GENERIC for name in names}
PUSHED = [t for t in bank().terms if (t.component, t.name) in FLOWN and t.component != "sensor:altitude"
          and not t.component.endswith("_path")  # judged from command to position
          and t.name.split("*")[0] not in ("airspeed", "time") and not t.name.endswith("_dot")
          # of the search it counts from the median, flown from zero as the scale does
          and (t.component, t.name) != ("sensor:alpha", "alpha*alpha")]  # fmt: skip


def test_the_generic_terms_of_the_search_are_those_that_are_flown():
    """A push of the predictor and its number of the effect make the same innovations, to the predictor's step."""
    flight = reconstruct(record({}, 5).slice(0.0, 24.0))
    gain, base = gains(flight, (0.5,))[0].with_start(), flight.parameters
    told = predicted(flight, innovations(flight, base, gain.K)[:, 0].astype(float))
    pushed = pushes(replace(flight, measured=told), bank().terms)
    for term in PUSHED:
        options = {c.term: c for c in choices(term.component, [flight])}
        chosen, at = options[term.name], condition(term.component, [flight])
        row = with_effects(base, {"discrepancy": {chosen.number: 0.5 * chosen.size} | at})
        square = SQUARE if term.component == f"sensor:{term.name.partition('*')[0]}" and "*" in term.name else 1.0
        own = tuple(replace(q, row=1, series=0.5 * square * q.series) for q in pushed if q.row == term.row)
        left = innovations(flight, np.concatenate([base, base, row]), gain.K, own)[200:].astype(float)
        search, flown_so = (np.nan_to_num(left[:, j] - left[:, 0]) / np.maximum(flight.noise, 1e-6) for j in (1, 2))
        cosine = np.sum(search * flown_so) / np.sqrt(np.sum(search**2) * np.sum(flown_so**2))
        assert cosine > 0.97, (term.component, term.name, cosine)
