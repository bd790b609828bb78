"""Limits by what is known now, tailplane stall and roll upset: told when there, and answered."""

from __future__ import annotations

import numpy as np
import pytest
from controlled import airframe, believed, cruise, requested
from test_envelope_protection import protected

from controllers import ice_management
from icing_env import aircraft
from icing_env.atmosphere import G0

DT = 0.02


def managed(m, seconds=1.0, advisory=None, estimate=None):
    """Run the ice management on one measurement; the severity stays that of the advisory unless an estimate speaks."""
    advisory = ice_management.init(len(m)) if advisory is None else advisory
    e = believed(len(m))
    if estimate is None:
        e["health"] = 0.0
    else:
        e = estimate
    for _ in range(round(seconds/DT)):
        ice_management.step(advisory, e, m, airframe(), ice_management.load_tuning(), DT)
    return advisory


def iced(**severities):
    """An advisory that knows of ice."""
    a = ice_management.init(1)
    a["ice_detected"] = a["memory"] = a["confidence"] = 1.0
    for name, value in severities.items():
        a[name] = value
    return a


def hinge(m, frame, surface, share):
    """Hinge moment of a surface with a separated share ahead of it [N m]; docs/model.md."""
    p = frame[0]
    pressure = 0.5*m["pressure"]/(287.05287*m["temperature"])*m["airspeed"]**2
    angle = m["alpha"]*(1 - p["downwash_slope"]) - p["downwash_flap"]*m["flap"] + p["tail_incidence"]
    angle = angle if surface == "elevator" else 0.0
    attached = p[f"hinge_{surface}_delta"]*m[surface] + p[f"hinge_{surface}_alpha"]*angle
    return pressure*p[f"hinge_{surface}_volume"]*(attached + p[f"hinge_{surface}_stall"]*share)


def test_attached_hinge_moments_tell_nothing_and_separated_ones_tell_their_tail():
    m = cruise(2)
    m["flap"], m["airspeed"], m["alpha"], m["elevator"] = 0.5, 50.0, -0.03, -0.05
    m["hinge_moment_elevator"] = hinge(m, airframe(), "elevator", np.array([0.0, 0.4]))
    m["hinge_moment_aileron"] = hinge(m, airframe(), "aileron", 0.0)
    a = managed(m)
    assert list(a["tail_stall"]) == [0, 1] and list(a["roll_upset"]) == [0, 0]
    assert a["flap_limit"][0] > 0.6 and a["flap_limit"][1] == pytest.approx(0.4, abs=1e-6)  # less than it is
    m["hinge_moment_elevator"] = hinge(m, airframe(), "elevator", 0.0)
    assert not managed(m, 2.0, a)["tail_stall"].any()


def test_tailplane_stall_is_answered_with_the_stick_back_and_no_push():
    m, c = cruise(), requested(1, 0)
    c["elevator"], m["airspeed"] = 0.1, 50.0
    a = ice_management.init(1)
    a["airspeed_limit"] = 60.0  # lacking: alone, it would push
    pushed = protected(c, a, m)[0]["elevator"]
    a["tail_stall"], a["tail_share"] = 1.0, 0.4
    assert pushed > 0.12 and protected(c, a, m)[0]["elevator"] < 0.0
    m["alpha"] = a["alpha_limit"] = 0.2  # but never into the wing's own stall
    assert protected(c, a, m)[0]["elevator"] > -0.2


def test_a_separated_half_wing_is_told_unloaded_and_rolled_level_with_power():
    m = cruise(2)
    m["alpha"], m["phi"] = 0.1, 0.5
    m["hinge_moment_elevator"] = hinge(m, airframe(), "elevator", 0.0)
    m["hinge_moment_aileron"] = hinge(m, airframe(), "aileron", np.array([0.0, -0.4]))
    a = managed(m)
    assert list(a["roll_upset"]) == [0, 1]
    assert a["alpha_limit"][1] < a["alpha_limit"][0] - 0.03 and a["bank_limit"][1] < a["bank_limit"][0]
    c = requested(2, 0)
    c["aileron"], c["throttle_left"], c["throttle_right"] = 0.0, 0.3, 0.3
    out = protected(c, a, m)
    assert out["aileron"][1] > 0.2 > abs(out["aileron"][0]) and out["throttle_left"][1] == pytest.approx(0.9)


def test_strange_roll_counts_only_with_unlike_half_wings():
    for unlike, told in ((0.0, 0.0), (0.08, 1.0)):
        a, m = iced(severity_right_wing=unlike), cruise()
        m["hinge_moment_elevator"] = hinge(m, airframe(), "elevator", 0.0)
        for k in range(20):
            m["p"] = 2.0*k*DT  # rolls at 2 rad/s2 with the aileron neutral
            managed(m, DT, a)
        assert a["roll_upset"] == told


def test_flap_limit_leaves_an_iced_tailplane_its_margin():
    limits = [managed(cruise(), 0.1, iced(severity_htail=eta))["flap_limit"][0] for eta in (0.0, 0.08, 0.12, 0.16, 0.2)]
    assert limits[0] > 0.6 and (np.diff(limits) < 0).all() and 0.05 < limits[-1] < 0.2
    p = airframe()[0]
    angle = -0.08*(1 - p["downwash_slope"]) - p["downwash_flap"]*limits[2] + p["tail_incidence"]
    held = 0.3 - 0.3297*np.exp(-5*0.12)  # SIS saturation
    assert -angle == pytest.approx(p["alpha_tail_stall"]*(1 - 2.5*held) - 0.035)


@pytest.mark.parametrize(("severity", "eta"), [(0.26, 0.05), (0.53, 0.1), (0.95, 0.18)])
def test_limits_lie_within_what_the_iced_aircraft_can_do(severity, eta):
    from icing_env.severity import iced_aircraft
    from icing_env.types import CURRENT, STATE

    p, s, c = aircraft.load("twin_otter"), np.zeros(1, STATE), np.zeros(1, CURRENT)
    for surface in ("left_wing", "right_wing", "htail"):
        s[f"eta_{surface}"] = eta
    iced_aircraft(s[0], p[0], c[0])
    m, a = cruise(), iced(severity=severity)
    a = managed(m, 5.0, a, believed(severity=severity))
    true_stall = c["alpha_stall_left"][0]
    assert 0.005 < true_stall - a["alpha_limit"][0] < 0.06
    lift = -(c["CZ_0"] + c["CZ_alpha"]*true_stall)[0]
    density = m["pressure"][0]/(287.05287*m["temperature"][0])
    stall_speed = np.sqrt(2*p["mass"][0]*G0/(density*p["wing_area"][0]*lift))
    assert 1.15 < a["airspeed_limit"][0]/stall_speed < 1.4
    assert a["load_factor_limit"][0] == pytest.approx((m["airspeed"][0]/stall_speed)**2, rel=0.25)


@pytest.mark.slow
def test_doubt_and_gusts_narrow_the_limits_of_an_iced_aircraft_only():
    sure, unsure = iced(severity=0.4), iced(severity=0.4)
    e = believed(2, severity=0.4)
    e["CD_0_std"] = 1e-4, 0.05
    e["excitation_longitudinal"] = 0.0
    a = managed(cruise(2), 1.0, np.concatenate([sure, unsure]), e)
    assert a["confidence"][1] < a["confidence"][0]
    assert a["alpha_limit"][1] < a["alpha_limit"][0] and a["airspeed_limit"][1] > a["airspeed_limit"][0]
    for start, margin in ((ice_management.init(1), 0.0), (iced(severity=0.4), 0.02)):
        still, gusty, m = start.copy(), start.copy(), cruise()
        for k in range(1500):
            managed(m, DT, still)
            m["alpha"] = 0.02 + 0.06*np.sin(0.1*k)
            managed(m, DT, gusty)
            m["alpha"] = 0.02
        assert still["alpha_limit"][0] - gusty["alpha_limit"][0] == pytest.approx(margin, abs=0.012)


def test_pitch_limit_rises_with_the_power_in_reserve():
    m = cruise(2)
    m["thrust_left"] = m["thrust_right"] = 3500.0
    m["throttle_left"] = m["throttle_right"] = 0.5, 1.0
    a = managed(m, 30.0)
    assert a["pitch_limit"][0] - a["pitch_limit"][1] == pytest.approx(7000.0/(4951.0*G0), rel=0.01)


def test_at_high_speed_the_limit_load_lowers_the_limit_of_alpha():
    m, p = cruise(2), airframe()[0]
    m["airspeed"] = 72.0, 100.0
    a = managed(m)
    assert a["alpha_limit"][0] == pytest.approx(0.191) and a["load_factor_limit"][1] == pytest.approx(3.8)
    pressure = 0.5*77500.0/(287.05287*268.0)*100.0**2
    lift = pressure*p["wing_area"]*-(p["CZ_0"] + p["CZ_alpha"]*a["alpha_limit"][1])
    assert lift/(p["mass"]*G0) == pytest.approx(3.8, rel=1e-6)
