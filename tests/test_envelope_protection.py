"""Envelope protection: nothing far inside, finite, alike on both sides, the same single and batched."""

from __future__ import annotations

import numpy as np
import pytest
from controlled import airframe, believed, cruise, requested, scattered
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers import ice_management
from controllers.choice import PROTECTIONS, protection
from controllers.protection import surfaces

DT = 0.02
EVERY = pytest.mark.parametrize("name", list(PROTECTIONS))


def advised(n=1, severity=0.0, m=None):
    """Advisories with the limits of this severity."""
    m = cruise(n) if m is None else m
    a = ice_management.init(n)
    a["severity"] = severity
    e = believed(n)
    e["health"] = 0  # keeps the severity
    ice_management.step(a, e, m, airframe(), ice_management.load_tuning(), DT)
    return a


def protected(c, a, m, e=None, module=surfaces):
    """What the protection makes of a command (a copy)."""
    c, e = c.copy(), believed(len(c)) if e is None else e
    module.protect(module.init(len(c)), c, a, m, e, airframe(), module.load_tuning(), DT)
    return c


@EVERY
def test_far_inside_every_bit_passes(name):
    module, n = protection(name), 200
    rng = np.random.default_rng(3)
    m = cruise(n)
    m["phi"], m["p"] = rng.uniform(-0.6, 0.6, n), rng.uniform(-0.1, 0.1, n)
    m["alpha"], m["airspeed"] = rng.uniform(-0.05, 0.08, n), rng.uniform(65, 80, n)
    m["theta"] = m["alpha"]
    m["az"] = -9.80665/np.cos(m["phi"])
    m["q"] = 9.80665/m["airspeed"]*np.sin(m["phi"])*np.tan(m["phi"])
    c = requested(n, 3)
    for surface in ("elevator", "aileron"):
        c[surface] = rng.uniform(-0.1, 0.1, n)
    c["elevator"] = m["elevator"] = rng.uniform(-0.03, 0.05, n)
    a = advised(n, m=m)
    assert protected(c, a, m, module=module).tobytes() == c.tobytes()
    assert (a["intervention"] == 0).all() and (a["intervention_aileron"] == 0).all()


@EVERY
@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), severity=st.floats(0, 1))
def test_finite_within_travel_and_no_more_flap_or_less_power(name, seed, severity):
    n = 16
    m, c, e = scattered(n, seed), requested(n, seed), believed(n)
    out = protected(c, advised(n, severity, m), m, e, protection(name))
    assert all(np.isfinite(out[field]).all() for field in out.dtype.names)
    assert (out["flap"] <= c["flap"]).all() and np.array_equal(out["rudder"], c["rudder"])
    assert (out["throttle_left"] >= c["throttle_left"]).all() and (out["throttle_left"] <= 1).all()
    assert (np.abs(out["aileron"]) <= 0.3).all() and (out["elevator"] >= -0.454 - 1e-9).all()


@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1), st.floats(0, 1))
def test_never_nose_up_never_less_power_and_finite(seed, severity):
    n = 32
    m, c, e = scattered(n, seed), requested(n, seed), believed(n)
    e["Cm_elevator"] = np.random.default_rng(seed).normal(-1, 1, n)
    a = advised(n, severity, m)
    out = protected(c, a, m, e)
    assert (out["elevator"] >= c["elevator"]).all()
    assert np.array_equal(out["elevator"] - c["elevator"], a["intervention"])
    assert (out["throttle_left"] >= c["throttle_left"]).all() and (out["throttle_left"] <= 1).all()
    assert (out["flap"] <= c["flap"]).all() and np.array_equal(out["rudder"], c["rudder"])
    assert all(np.isfinite(out[name]).all() for name in out.dtype.names)
    assert (np.abs(out["aileron"]) <= 0.3).all()


def test_monotone_and_continuous_in_alpha():
    n = 2001
    m, c = cruise(n), requested(n, 0)
    m["alpha"] = np.linspace(-0.2, 0.5, n)
    c["elevator"] = -0.25
    out = protected(c, advised(n, m=m), m)["elevator"]
    assert (np.diff(out) >= 0).all() and out[0] == -0.25 and out[-1] > 0.2
    assert np.diff(out).max() < 3*2.0*(0.7/n)  # no step: at most a few times the gain per sample
    slope = np.diff(out[out < 0.24])
    assert np.abs(np.diff(slope)).max() < 0.2*slope.max()  # and no corner before full travel


def test_a_rising_angle_of_attack_is_caught_before_the_limit():
    m, c = cruise(), requested(1, 0)
    c["elevator"] = -0.2
    m["alpha"] = 0.15
    a = advised(m=m)
    still = protected(c, a, m)[0]["elevator"]
    m["q"] = 0.2
    assert protected(c, a, m)[0]["elevator"] > still


def test_trim_at_the_limit_follows_a_healthy_excited_estimate():
    m, c, e = cruise(), requested(1, 0), believed()
    m["alpha"], c["elevator"] = 0.18, -0.3
    a = advised(m=m)
    assert protected(c, a, m, e)[0]["elevator"] == pytest.approx(protected(c, a, m)[0]["elevator"])
    e["Cm_0"] = 0.10  # a nose-up moment that the clean aircraft lacks: more nose-down elevator needed
    assert protected(c, a, m, e)[0]["elevator"] > protected(c, a, m)[0]["elevator"] + 0.02
    e["health"] = 0
    assert protected(c, a, m, e)[0]["elevator"] == pytest.approx(protected(c, a, m)[0]["elevator"], abs=2e-3)


def test_low_airspeed_brings_power_and_lowers_the_nose():
    m, c = cruise(), requested(1, 0)
    c["elevator"], c["throttle_left"], c["throttle_right"] = 0.0, 0.2, 0.3
    a = advised(m=m)
    m["airspeed"] = a["airspeed_limit"] - 3.0
    out = protected(c, a, m)[0]
    assert out["elevator"] > 0.01 and out["throttle_left"] > 0.3 and out["throttle_right"] > 0.4
    m["airspeed"] = a["airspeed_limit"] + 8.0
    m["ax"] = -6.0  # slowing down fast: acts before the limit
    assert protected(c, a, m)[0]["throttle_left"] > 0.2


@EVERY
def test_bank_is_left_alike_on_both_sides_and_rolled_back(name):
    m, c = cruise(2), requested(2, 0)
    c["elevator"] = m["elevator"]
    a = advised(2, severity=0.6, m=m)
    m["phi"] = 1.2*a["bank_limit"][0], -1.2*a["bank_limit"][0]
    c["aileron"] = -0.2, 0.2  # rolling further out
    out = protected(c, a, m, module=protection(name))["aileron"]
    assert out[0] == pytest.approx(-out[1], abs=1e-9) and out[0] > 0.02


def test_bank_is_held_inside_on_both_sides_alike():
    m, c = cruise(2), requested(2, 0)
    a = advised(2, severity=0.6, m=m)
    limit = a["bank_limit"][0]
    m["phi"] = limit, -limit
    c["aileron"] = -0.2, 0.2  # rolling further out
    out = protected(c, a, m)["aileron"]
    assert out[0] == pytest.approx(-out[1]) and abs(out[0]) < 0.02
    m["phi"] *= 1.1
    out = protected(c, a, m)["aileron"]
    assert out[0] > 0.05 and out[1] < -0.05  # rolls back
    c["aileron"] = 0.25, -0.25  # already rolling back harder
    assert np.array_equal(protected(c, a, m)["aileron"], c["aileron"])


@EVERY
def test_single_equals_batch_bit_for_bit(name):
    module, n = protection(name), 50
    m, c = scattered(n, 8), requested(n, 8)
    a = advised(n, 0.5, m)
    batch = protected(c, a, m, module=module)
    single = np.concatenate([protected(c[i:i + 1], a[i:i + 1].copy(), m[i:i + 1], module=module) for i in range(n)])
    assert batch.tobytes() == single.tobytes()
