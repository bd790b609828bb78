"""Ice management: severity, detection with hysteresis, boots, and limits that tighten with the ice."""

from __future__ import annotations

import numpy as np
import pytest
from controlled import airframe, believed, cruise, scattered
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers import ice_management
from icing_env.types import COMMAND, ESTIMATE_FIELDS

DT = 0.1
LIMITS = ("alpha_limit", "airspeed_limit", "bank_limit", "flap_limit")


def managed(estimate, seconds, advisory=None, m=None, frame=None):
    """Run one ice management for a time; returns its advisory."""
    advisory = ice_management.init(1) if advisory is None else advisory
    m, frame = cruise() if m is None else m, airframe() if frame is None else frame
    tuning = ice_management.load_tuning()
    for _ in range(round(seconds/DT)):
        ice_management.step(advisory, estimate, m, frame, tuning, DT)
    return advisory


def test_clean_aircraft_has_no_ice_and_ordinary_limits():
    a = managed(believed(), 120)[0]
    assert a["severity"] == pytest.approx(0, abs=1e-3) and a["ice_detected"] == 0 and a["boots_wing"] == 0
    assert a["alpha_limit"] == pytest.approx(0.2 - 0.009)
    assert a["flap_limit"] == pytest.approx(np.radians(37.5), abs=1e-4)
    assert a["bank_limit"] > np.radians(45)


def test_airspeed_limit_is_the_factor_times_the_stall_speed():
    a = managed(believed(), 1)[0]
    density = 77500.0/(287.05287*268.0)
    stall = np.sqrt(2*4951.0*9.80665/(density*39.25*(0.36 + 5.66*0.2)))
    assert a["airspeed_limit"] == pytest.approx(1.2*stall, rel=1e-6)
    heavy = airframe()
    heavy["mass"] *= 1.21
    assert managed(believed(), 1, frame=heavy)[0]["airspeed_limit"] == pytest.approx(1.1*1.2*stall, rel=1e-6)


@pytest.mark.parametrize("severity", [0.2, 0.5, 0.9])
def test_severity_is_that_of_a_consistent_estimate(severity):
    a = managed(believed(severity=severity), 60)[0]
    assert a["severity"] == pytest.approx(severity, abs=0.01)
    assert a["confidence"] > 0.9


def test_drag_speaks_first_and_derivatives_only_when_excited():
    e = believed(severity=0.5)
    e["excess_drag"] = 0.0
    e["excitation_longitudinal"] = 0.0
    assert managed(e, 60)[0]["severity"] == pytest.approx(0, abs=1e-3)
    e["excitation_longitudinal"] = 0.5
    assert 0.0 < managed(e, 60)[0]["severity"] < 0.15


def test_detection_waits_for_confirmation_and_release_for_clear_air():
    a = managed(believed(severity=0.4), 10)
    assert a[0]["ice_detected"] == 0
    a = managed(believed(severity=0.4), 20, a)
    assert a[0]["ice_detected"] == 1 and a[0]["shot_wing"] > 0 and a[0]["prop_heat"] == 1
    assert 0 < a[0]["since_detection"] < 20
    a = managed(believed(severity=0.07), 300, a)  # between the two thresholds: nothing changes
    assert a[0]["ice_detected"] == 1
    a = managed(believed(), 30, a)
    assert a[0]["ice_detected"] == 1
    a = managed(believed(), 60, a)
    assert a[0]["ice_detected"] == 0 and a[0]["boots_wing"] == 0 and a[0]["since_detection"] == 0


def test_a_level_between_the_thresholds_never_starts_a_detection():
    assert managed(believed(severity=0.08), 600)[0]["ice_detected"] == 0


def test_an_uncertain_or_unhealthy_estimate_detects_nothing_new():
    e = believed(severity=0.8)
    e["excitation_longitudinal"] = 0
    e["CD_0_std"] = 0.05
    a = managed(e, 120)[0]
    assert a["ice_detected"] == 0 and a["confidence"] < 0.5
    for broken in ("health", "excess_drag"):
        e = believed(severity=0.8)
        e[broken] = 0 if broken == "health" else np.nan
        a = managed(e, 120)[0]
        assert a["severity"] == 0 and a["confidence"] == 0 and a["ice_detected"] == 0
    seen = managed(believed(severity=0.8), 60)
    severity = seen["severity"][0]
    e["health"] = 0
    assert managed(e, 60, seen)[0]["severity"] == severity  # remembered while the observer is out


@pytest.mark.parametrize(("celsius", "boots", "heat"), [(-5, 1, 1), (1, 1, 1), (3, 0, 1), (7, 0, 0)])
def test_temperature_decides_boots_and_heat(celsius, boots, heat):
    m = cruise()
    m["temperature"] = 273.15 + celsius
    a = managed(believed(severity=0.5), 60, m=m)
    assert [a[0][f"shot_{group}"] > 0 for group in ("wing", "tail", "struts")] == [bool(boots)]*3  # have inflated
    assert a[0]["prop_heat"] == heat
    c = np.zeros(1, COMMAND)
    a["boots_tail"] = boots
    ice_management.operate(c, a)
    assert c[0]["boots_tail"] == boots and c[0]["prop_heat"] == heat
    ice_management.operate(c, ice_management.init(1))
    assert not c[0]["boots_wing"] and not c[0]["boots_tail"] and not c[0]["prop_heat"]  # off with the all-clear


def test_limits_tighten_with_severity():
    m = cruise()
    m["airspeed"] = 60.0
    rows = [managed(believed(severity=s), 60, m=m)[0] for s in (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)]
    for name, direction in (("alpha_limit", -1), ("airspeed_limit", 1), ("bank_limit", -1), ("flap_limit", -1)):
        values = np.array([row[name] for row in rows])
        assert (direction*np.diff(values) >= 0).all() and values[0] != values[-1], name


def test_flap_waits_until_tail_ice_is_gone():
    e = believed(severity=0.2)
    assert managed(e, 60)[0]["flap_limit"] > 0.6
    e["Cm_elevator"] = -1.74*0.85
    a = managed(e, 60)
    assert a[0]["flap_limit"] == pytest.approx(np.radians(20), abs=1e-3)
    e["excitation_longitudinal"] = 0.0  # no longer seen, still remembered
    assert managed(e, 60, a)[0]["flap_limit"] < 0.4
    assert managed(believed(), 120, a)[0]["flap_limit"] > 0.6


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_finite_and_bounded_whatever_instruments_and_estimate_say(seed):
    n, rng = 16, np.random.default_rng(seed)
    a, e = ice_management.init(n), believed(n)
    for name, _, _ in ESTIMATE_FIELDS[:-1]:
        e[name] = rng.normal(0, 10, n)
    e["excess_drag"][::5] = np.nan
    for k in range(3):
        ice_management.step(a, e, scattered(n, seed + k), airframe(), ice_management.load_tuning(), 30.0)
    assert all(np.isfinite(a[name]).all() for name in a.dtype.names)
    assert ((a["severity"] >= 0) & (a["severity"] <= 1) & (a["confidence"] >= 0) & (a["confidence"] <= 1)).all()
    assert (a["bank_limit"] >= 0.2).all() and (a["airspeed_limit"] > 0).all()


def test_single_equals_batch_bit_for_bit():
    n, tuning = 7, ice_management.load_tuning()
    batch, alone = ice_management.init(n), ice_management.init(n)
    e = believed(n)
    e["excess_drag"] = np.linspace(-0.01, 0.07, n)
    for k in range(20):
        m = scattered(n, k)
        ice_management.step(batch, e, m, np.repeat(airframe(), n), tuning, DT)
        for i in range(n):
            j = slice(i, i + 1)
            ice_management.step(alone[j], e[j], m[j], airframe(), tuning, DT)
    assert batch.tobytes() == alone.tobytes()
