"""The contracts of every effect in the library."""

from __future__ import annotations

import inspect
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from plant import fleet_at

from icing_env.aircraft import broadcast, changed, load
from icing_env.discrepancy import CHANGES_OF
from icing_env.effects import LIBRARY, get, parse, with_effects
from icing_env.effects.effect import ENTERS_AT, Component, Effect
from icing_env.errors import InputError
from icing_env.parameters import PARAMETERS
from icing_env.simulate import Fleet
from icing_env.trim import trim
from icing_env.types import MEASUREMENT

EFFECTS = pytest.mark.parametrize("effect", LIBRARY.values(), ids=LIBRARY)
# an aircraft on which nothing is zero or switched off that an effect could scale
AIRCRAFT = changed(load(), turbulence_sigma_w=0.5)


def flown(parameters: NDArray, seconds: float = 6.0) -> Fleet:
    """A flight that works every control: doublets, flap, uneven throttles."""
    t = trim(load(), airspeed=60.0)
    n = len(parameters)
    fleet = fleet_at(t, parameters, n)
    steps = round(seconds / fleet.dt)
    for step in range(steps):
        share = step / steps
        sign = 1.0 if share % 0.5 < 0.25 else -1.0
        fleet.command["elevator"] = t.elevator + 0.15 * sign
        fleet.command["aileron"], fleet.command["rudder"] = -0.1 * sign, 0.1 * sign
        fleet.command["throttle_left"], fleet.command["throttle_right"] = 0.6 + 0.3 * sign, 0.6
        fleet.command["flap"] = 0.2
        fleet.step()
    return fleet


def same(a: Fleet, b: Fleet) -> bool:
    arrays = ("state", "measurement", "current", "outcome")
    return all(getattr(a, name).tobytes() == getattr(b, name).tobytes() for name in arrays)


@pytest.fixture(scope="module")
def reference() -> Fleet:
    return flown(AIRCRAFT)


# ---- the contract


@EFFECTS
def test_neutral_changes_no_bit(effect: Effect) -> None:
    for p in (AIRCRAFT, load("twin_otter_flight"), load(weather="stratiform")):
        assert with_effects(p, {effect.name: effect.neutral()}).tobytes() == p.tobytes()


def test_a_flight_with_every_effect_neutral_is_the_flight_without_any(reference: Fleet) -> None:
    everything = with_effects(AIRCRAFT, {name: effect.neutral() for name, effect in LIBRARY.items()})
    assert same(flown(everything, 10.0), flown(AIRCRAFT, 10.0))
    assert same(flown(with_effects(AIRCRAFT, {})), reference)


@EFFECTS
def test_typical_changes_what_is_measured(effect: Effect, reference: Fleet) -> None:
    fleet = flown(with_effects(AIRCRAFT, {effect.name: effect.typical()}))
    moved = [k for k in MEASUREMENT.names if fleet.measurement[k][0] != reference.measurement[k][0]]
    assert moved, "no instrument saw it"
    for name in MEASUREMENT.names:
        assert np.isfinite(fleet.measurement[name]).all(), name
    if effect.component == "sensor":
        assert fleet.state["u"][0] == reference.state["u"][0]  # an instrument does not move the aircraft
        seen = {name.removeprefix("sensor:") for name in effect.enters_at}
        assert seen <= set(moved)
    else:
        assert fleet.state["u"][0] != reference.state["u"][0]


@EFFECTS
def test_either_end_of_the_range_can_be_flown(effect: Effect) -> None:
    ends = {p.name: np.array([p.low, p.high]) for p in effect.parameters}
    fleet = flown(with_effects(broadcast(AIRCRAFT, 2), {effect.name: ends}))
    for rows in (fleet.state, fleet.measurement):
        for name in rows.dtype.names:
            assert np.isfinite(rows[name]).all(), name


@EFFECTS
def test_one_value_per_row_is_each_row_with_its_value(effect: Effect) -> None:
    shares = np.array([0.0, 0.3, 1.0])
    values = {p.name: p.neutral + shares * (p.typical - p.neutral) for p in effect.parameters}
    together = with_effects(broadcast(AIRCRAFT, 3), {effect.name: values})
    for row in range(3):
        alone = with_effects(AIRCRAFT, {effect.name: {k: float(v[row]) for k, v in values.items()}})
        for name in PARAMETERS.names:
            assert together[name][row] == alone[name][0], name


@EFFECTS
def test_what_an_effect_says_of_itself(effect: Effect) -> None:
    assert effect.component in get_args(Component)
    assert effect.enters_at and set(effect.enters_at) <= set(ENTERS_AT)
    assert effect.description and "\n" not in effect.description and not effect.description.endswith(".")
    assert effect.source
    assert any(p.typical != p.neutral for p in effect.parameters)
    assert len({p.name for p in effect.parameters}) == len(effect.parameters)
    for p in effect.parameters:
        assert p.unit and p.name.isidentifier()
        assert p.low <= p.neutral <= p.high and p.low <= p.typical <= p.high


@EFFECTS
def test_applying_leaves_the_given_aircraft_alone(effect: Effect) -> None:
    before = AIRCRAFT.tobytes()
    with_effects(AIRCRAFT, {effect.name: effect.typical()})
    assert AIRCRAFT.tobytes() == before


# ---- the library


def test_library_is_broad_enough() -> None:
    assert len(LIBRARY) >= 15
    assert {effect.component for effect in LIBRARY.values()} == set(get_args(Component))
    assert all(name == effect.name for name, effect in LIBRARY.items())


def test_the_plant_knows_nothing_of_effects() -> None:
    """A step costs the same with none and with sixty: effects change numbers before the flight, never code in it."""
    assert set(inspect.signature(Fleet.__init__).parameters) == {"self", "parameters", "n", "dt", "substeps", "threads"}
    combined = with_effects(AIRCRAFT, {name: effect.typical() for name, effect in LIBRARY.items()})
    assert combined.dtype == PARAMETERS and len(combined) == 1
    assert np.isfinite(flown(combined).state["u"]).all()


@settings(max_examples=30)
@given(st.dictionaries(st.sampled_from(sorted(LIBRARY)), st.floats(0.0, 1.0), max_size=8))
def test_any_company_of_effects_gives_finite_numbers(shares: dict[str, float]) -> None:
    values = {
        name: {p.name: p.neutral + share * (p.typical - p.neutral) for p in LIBRARY[name].parameters}
        for name, share in shares.items()
    }
    row = with_effects(AIRCRAFT, values)
    assert all(np.isfinite(row[name]).all() for name in PARAMETERS.names)


@pytest.mark.parametrize("name", ["lift_slope", "static_stability", "pitch_damping", "elevator_power", "roll_damping",
                                  "dihedral_effect", "aileron_power", "directional_stability", "rudder_power",
                                  "side_force"])  # fmt: skip
def test_a_derivative_that_is_weaker_is_so_in_every_condition(name: str) -> None:
    """A corrected model's derivatives change with angles, rates and thrust: a factor is one of the whole."""
    bent = AIRCRAFT.copy()
    for derivative, more in CHANGES_OF.items():
        for number in more:
            assert bent[number] == 0.0  # of the published aircraft
            bent[number] = 0.3 * bent[derivative]
    weaker = with_effects(bent, {name: {"change": -0.25}})
    touched = {n for n in PARAMETERS.names if weaker[n] != bent[n]}
    assert touched == touched_by(name) | {n for d in touched_by(name) for n in CHANGES_OF.get(d, ())}
    assert touched > touched_by(name)
    assert all(weaker[n] == pytest.approx(0.75 * bent[n]) for n in touched)


def touched_by(name: str) -> set[str]:
    """Numbers of the published aircraft that an effect changes."""
    weaker = with_effects(AIRCRAFT, {name: {"change": -0.25}})
    return {n for n in PARAMETERS.names if weaker[n] != AIRCRAFT[n]}


# ---- the command line's form


@EFFECTS
def test_a_bare_name_means_typical(effect: Effect) -> None:
    assert parse(effect.name) == (effect.name, effect.typical())


def test_values_can_be_given() -> None:
    assert parse("wing_ice:eta=0.1") == ("wing_ice", {"eta": 0.1})
    effect = next(e for e in LIBRARY.values() if len(e.parameters) > 1)
    text = ",".join(f"{p.name}={p.high}" for p in effect.parameters)
    assert parse(f"{effect.name}:{text}") == (effect.name, {p.name: p.high for p in effect.parameters})


@pytest.mark.parametrize(("text", "message"), [
    ("wing_ise", "did you mean 'wing_ice'"), ("", "no effect ''"), ("wing_ice:eta=lots", "PARAM=NUMBER"),
    ("wing_ice:eta", "PARAM=NUMBER"), ("wing_ice:etta=0.1", "did you mean 'eta'"), ("wing_ice:eta=nan", "finite"),
    ("wing_ice:eta=inf", "finite"),
])  # fmt: skip
def test_what_cannot_be_read_is_told_in_one_line(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        name, values = parse(text)
        with_effects(AIRCRAFT, {name: values})
    assert "\n" not in str(caught.value)


def test_unknown_names_in_a_configuration_are_told() -> None:
    with pytest.raises(InputError, match="did you mean 'mass_error'"):
        get("mass_eror")
    with pytest.raises(InputError, match="has no parameter 'eeta'"):
        with_effects(AIRCRAFT, {"wing_ice": {"eeta": 0.1}})
    with pytest.raises(InputError, match="finite"):
        with_effects(broadcast(AIRCRAFT, 2), {"wing_ice": {"eta": np.array([0.1, np.nan])}})
    with pytest.raises(InputError, match="3 values of eta for 2 aircraft"):
        with_effects(broadcast(AIRCRAFT, 2), {"wing_ice": {"eta": np.zeros(3)}})
