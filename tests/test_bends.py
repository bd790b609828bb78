"""What another form of an effect may have: powers of what it changes, an instrument's zero that wanders, thrust."""

from __future__ import annotations

import numpy as np
import pytest

from icing_env import effects, scenario
from icing_env.effects.derivatives import OFFSETS
from icing_env.types import DERIVATIVE_NAMES
from sim2real.library.bends import DRAG, GROWS, THRUST, bends, changes, natural
from sim2real.library.candidates import bank
from sim2real.library.pushes import pushes
from sim2real.library.terms import BEYOND, GENERIC, WANDERING, Term
from sim2real.library.units import unit_of
from sim2real.records.channels import TOLERANCE
from sim2real.records.reconstruct import Reconstruction, reconstruct
from sim2real.signatures.evidence import gather
from testbed.flight import fly


def test_an_effect_bends_with_the_regressors_of_the_derivatives_that_it_changes():
    assert bends(effects.get("aileron_power")) == {("rolling_moment", "aileron*aileron"),
                                                   ("rolling_moment", "aileron*aileron*aileron")}
    assert ("yawing_moment", "beta*beta*beta") in bends(effects.get("fin_ice"))
    assert ("yawing_moment", "beta") in bends(effects.get("fin_ice"))  # ice changes derivatives in its own proportions
    assert not bends(effects.get("mass_error")) and not bends(effects.get("lateral_cg"))
    for effect in effects.LIBRARY.values():
        assert changes(effect), effect.name
        own = changes(effect) & {*DERIVATIVE_NAMES, "scale_alpha", "scale_airspeed", *OFFSETS, *THRUST, *GROWS, *DRAG}
        assert bool(bends(effect)) <= bool(own), effect.name


def test_an_offset_goes_with_time_and_one_of_a_moment_with_speed():
    assert bends(effects.get("alpha_bias")) == {("sensor:alpha", term) for term in ("time", *WANDERING)}
    assert bends(effects.get("roll_trim")) == {("rolling_moment", "airspeed"), ("rolling_moment", "time")}


def test_a_derivative_that_an_effect_changes_alone_has_a_power_among_the_generic_terms():
    known = {(component, name) for component, _, names in (*GENERIC, *BEYOND) for name in names}
    for effect in effects.LIBRARY.values():
        if len(changes(effect) & set(DERIVATIVE_NAMES)) == 1 and bends(effect):
            assert bends(effect) & known, effect.name
    # nothing is symmetric about the elevator's trim, so that its square bends as well as its cube
    cubed = {("pitching_moment", f"elevator{'*elevator' * times}") for times in (1, 2)}
    assert cubed <= bends(effects.get("elevator_power")) & known


@pytest.fixture(scope="module")
def flight() -> Reconstruction:
    """A short record at changing speed."""
    chosen = scenario.load("clear_air", duration=20.0)
    return reconstruct(fly(chosen, seed=7, observer=False, protection=False).record)


def test_thrust_goes_with_speed_and_one_engine_alone_is_another_form_of_two_that_are_not_alike():
    speed = {("propulsion", f"both*{power}") for power in ("airspeed", "airspeed*airspeed")}
    assert bends(effects.get("thrust_loss")) == speed
    assert natural(effects.get("thrust_loss"), "propulsion", "both*airspeed")
    assert not natural(effects.get("thrust_loss"), "propulsion", "left")
    left = {("propulsion", f"left{power}") for power in ("", "*airspeed", "*airspeed*airspeed")}
    assert bends(effects.get("asymmetric_thrust")) == speed | left | {("propulsion", "both")}


def test_the_zero_of_an_instrument_wanders_as_polynomials_of_time_that_are_orthogonal(flight):
    names = ("1", "time", *WANDERING)
    found = pushes(flight, [Term("sensor:theta", name, "theta", k) for k, name in enumerate(names)])
    courses = [push.series for push in found]
    inner = np.array(courses) @ np.array(courses).T / len(flight.time) / TOLERANCE["theta"] ** 2
    assert inner == pytest.approx(np.diag([1.0, 1/3, 1/5, 1/7]), abs=0.01)  # Legendre's, of a span of two
    assert all(natural(effects.get("pitch_attitude_bias"), "sensor:theta", name) for name in names)
    assert not natural(effects.get("pitch_attitude_bias"), "sensor:theta", "q*time")


def test_terms_of_thrust_act_as_engines_do(flight):
    """Of what weak engines do to a record terms leave hardly anything: slipstream and product of inertia count."""
    candidates = bank()
    gram, row_of = gather(flight, candidates).gram, {t.name: t.row for t in candidates.terms if t.target == "thrust"}
    rows = [row_of["both"], row_of["left"]]
    for name, most in (("thrust_loss", 1e-5), ("asymmetric_thrust", 5e-5)):
        family = next(f for f in candidates.families if f.effect.name == name)
        row = family.rows[int(np.argmin(np.abs(family.nodes)))]
        onto = gram[rows, row]
        taken = onto @ np.linalg.solve(gram[np.ix_(rows, rows)], onto)
        assert gram[row, row] > 1e4
        assert taken == pytest.approx(gram[row, row], rel=most), name


def test_a_thrust_that_goes_with_speed_squared_is_made_of_terms_of_speed(flight):
    """Of thrust that goes with the square of speed nothing is left beside the constant, the linear and the square."""
    names = ("both", "both*airspeed", "both*airspeed*airspeed")
    found = pushes(flight, [Term("propulsion", name, "thrust", k) for k, name in enumerate(names)])
    left = np.array([push.series for push in found if push.target == "thrust_left"])
    speed = flight.channel("airspeed")
    aim = left[0] * (speed / 70.0) ** 2
    fitted, *_ = np.linalg.lstsq(left.T, aim, rcond=None)
    assert left.T @ fitted == pytest.approx(aim, rel=1e-6)
    assert unit_of(names[2], "propulsion") == pytest.approx(unit_of(names[1], "propulsion") / 5.0)
