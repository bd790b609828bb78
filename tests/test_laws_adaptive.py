"""The laws that adapt: L1, scheduled by identification, incremental inversion. What each is for, and its bounds."""

from __future__ import annotations

import numpy as np
import pytest
from answers import answer, apart
from controlled import airframe, cruise, free, requested, scattered, targets

from controllers.ice_management.clean_answer import quasi_inertia, quasi_pitch
from controllers.kernels import air_density
from controllers.laws import autopilot, indi, l1, scheduled
from icing_env.types import ESTIMATE, ESTIMATED_NAMES, TARGET

DT = 0.02
CLEAN = airframe()
SHARES = {"Cm_elevator": 0.75, "Cl_aileron": 0.75, "Cl_p": 0.85}


def identified(n: int = 1, error: float = 0.05, density: float = 1.0, **shares) -> np.ndarray:
    """A healthy, excited estimate of the clean aircraft, or of one that keeps only shares of its derivatives."""
    e = np.zeros(n, ESTIMATE)
    cm_alpha, cm_q = quasi_pitch(CLEAN[0], density)
    cm_elevator = float(CLEAN["Cm_elevator"][0])/quasi_inertia(CLEAN[0], density)
    cl_alpha = float(CLEAN["CX_0"][0] - CLEAN["CZ_alpha"][0])
    clean = {"Cm_alpha": cm_alpha, "Cm_q": cm_q, "Cm_elevator": cm_elevator, "CL_alpha": cl_alpha}
    for name in ESTIMATED_NAMES:
        value = clean.get(name, float(CLEAN[name][0]) if name in CLEAN.dtype.names else 0.0)
        e[name], e[f"{name}_std"] = value*shares.get(name, 1.0), error*abs(value)
    e["health"] = e["excitation_longitudinal"] = e["excitation_lateral"] = 1.0
    return e


def level() -> np.ndarray:
    t = np.zeros(1, TARGET)
    t["pitch_mode"] = t["speed_mode"] = t["roll_mode"] = 1
    t["altitude"], t["airspeed"] = 2200.0, 72.0
    return t


def steer(law, memory, command, m, estimate, gains, t=None, advisory=None):
    law.step(memory, command, m, estimate, level() if t is None else t, free(len(command)) if advisory is None
             else advisory, CLEAN, gains, DT)


# L1


@pytest.mark.parametrize(("axis", "lost", "kept"), [("pitch", "Cm_elevator", 0.5), ("bank", "Cl_aileron", 0.35)])
def test_l1_gives_back_the_clean_answer_with_surface_power_30_percent_down(axis, lost, kept):
    iced = {lost: 0.7*float(CLEAN[lost][0])}
    left, without = (apart(answer(name, axis, iced), answer(name, axis)) for name in ("l1", "autopilot"))
    assert left < kept*without


@pytest.mark.parametrize(("moment", "told"), [(0.03, 0.03), (-0.05, -0.05), (0.5, 0.12)])
def test_l1_finds_the_moment_that_the_clean_aircraft_lacks_up_to_its_authority(moment, told):
    m, gains, a, c = cruise(), l1.default_gains(), l1.init(1), requested(1, 0)
    e = identified()
    for k in range(200):
        steer(l1, a, c, m, e, gains)
        acceleration = l1.clean_pitch(m[0], CLEAN[0])
        if k:
            acceleration += l1.pitch_power(m[0], CLEAN[0])*float(CLEAN["Cm_elevator"][0])*moment
        m["q"] += DT*acceleration
        m["elevator"] = 0.01  # held: what is foreign stays foreign
    assert a["sigma_pitch"][0] == pytest.approx(told, abs=2e-3)
    assert a["elevator_adaptive"][0] == pytest.approx(told - a["sigma_pitch_start"][0], abs=2e-3)


def test_l1_leaves_the_trim_of_engagement_to_the_trim():
    m, a, c = cruise(), l1.init(1), requested(1, 0)
    m["alpha"] = 0.05  # as in slow flight with the elevator of another trim: no moment of the moment
    steer(l1, a, c, m, identified(), l1.default_gains())
    assert abs(a["sigma_pitch_start"][0]) > 0.01 and a["elevator_adaptive"][0] == 0.0


# scheduled


def test_scheduled_is_the_autopilot_at_a_clean_estimate():
    n = 6
    mine, its = scheduled.init(n), autopilot.init(n)
    for k in range(25):
        m, c, d = scattered(n, k), requested(n, 1), requested(n, 1)
        e = np.concatenate([identified(density=air_density(m[i])) for i in range(n)])
        scheduled.step(mine, c, m, e, targets(n, 2), free(n), CLEAN, scheduled.default_gains(), DT)
        autopilot.step(its, d, m, e, targets(n, 2), free(n), CLEAN, autopilot.default_gains(), DT)
        for field in c.dtype.names:
            np.testing.assert_allclose(c[field], d[field], rtol=0, atol=1e-12, err_msg=field)


@pytest.mark.parametrize("poor", [{"health": 0.0}, {"excitation_longitudinal": 0.2}, {"Cm_elevator_std": 0.2},
                                  {"Cm_elevator_std": np.nan}])
def test_scheduled_freezes_where_the_estimate_is_poor(poor):
    m, a, c, gains, advisory = cruise(), scheduled.init(1), requested(1, 0), scheduled.default_gains(), free()
    for _ in range(50):
        steer(scheduled, a, c, m, identified(Cm_elevator=0.75), gains)
    before = float(a["Cm_elevator"][0])
    assert before < 0.97
    e = identified(Cm_elevator=0.9)
    for name, value in poor.items():
        e[name] = value
    for _ in range(50):
        steer(scheduled, a, c, m, e, gains, advisory=advisory)
    assert a["Cm_elevator"][0] == before and advisory["adaptation_frozen"][0] == 1.0


def test_an_estimate_that_is_no_number_is_not_followed():
    m, a, c, gains = cruise(), scheduled.init(1), requested(1, 0), scheduled.default_gains()
    e = identified()
    e["Cm_elevator"] = e["Cn_beta"] = np.nan
    steer(scheduled, a, c, m, e, gains)
    assert a["Cm_elevator"][0] == a["Cn_beta"][0] == 1.0
    assert all(np.isfinite(c[name]).all() for name in c.dtype.names)


@pytest.mark.parametrize(("share", "bound"), [(0.2, 0.7), (2.0, 1.3)])
def test_scheduled_is_bounded_and_never_jumps(share, bound):
    m, a, c, gains, advisory = cruise(), scheduled.init(1), requested(1, 0), scheduled.default_gains(), free()
    density = air_density(m[0])
    shares = [1.0]
    for _ in range(500):
        steer(scheduled, a, c, m, identified(density=density, Cm_elevator=share, Cm_alpha=share), gains,
              advisory=advisory)
        shares.append(float(a["Cm_elevator"][0]))
    assert np.abs(np.diff(shares)).max() <= 0.05*DT + 1e-12
    assert a["Cm_elevator"][0] == pytest.approx(bound) and a["Cm_alpha"][0] == pytest.approx(bound)
    assert advisory["adaptation"][0] == pytest.approx(1.0) and advisory["adaptation_frozen"][0] == 0.0


@pytest.mark.parametrize(("axis", "lost", "kept"), [("pitch", ("Cm_elevator",), 0.2), ("bank", ("Cl_aileron",), 0.1),
                                                   ("bank", ("Cl_p",), 0.7)])
def test_scheduled_gives_back_the_clean_answer_at_a_true_estimate(axis, lost, kept):
    iced = {name: SHARES[name]*float(CLEAN[name][0]) for name in lost}
    believe = {name: SHARES[name] for name in lost}
    left = apart(answer("scheduled", axis, iced, memory=believe), answer("scheduled", axis))
    assert left < kept*apart(answer("autopilot", axis, iced), answer("autopilot", axis))


# incremental inversion


def test_inversion_rejects_a_pitching_moment_better_than_the_autopilot():
    push = {"Cm_0": float(CLEAN["Cm_0"][0]) + 0.03}  # 1 deg of elevator, at 2 s
    worst = {name: np.abs(answer(name, "hold", later=push)["theta"]).max() for name in ("indi", "autopilot")}
    assert worst["autopilot"] > 5e-3
    assert worst["indi"] < 0.7*worst["autopilot"]


@pytest.mark.parametrize("power", [0.6, 1.5])
def test_inversion_stands_wrong_surface_power(power):
    wrong = {name: power*float(CLEAN[name][0]) for name in ("Cm_elevator", "Cl_aileron")}
    for axis, angle in (("pitch", "theta"), ("bank", "phi")):
        flown, right = (answer("indi", axis, p, seconds=13.0)[angle] for p in (wrong, None))
        assert flown.max() < 1.15*right.max()
        assert np.abs(flown[-50:]).max() < 0.01


def test_inversion_filters_rate_and_surface_alike():
    m, a, c, gains = cruise(), indi.init(1), requested(1, 0), indi.default_gains()
    steer(indi, a, c, m, identified(), gains)
    rng = np.random.default_rng(1)
    for _ in range(50):
        m["q"] = rng.normal(0.0, 0.05)
        m["elevator"] = 0.01 + m["q"]
        steer(indi, a, c, m, identified(), gains)
        assert a["elevator_filtered"][0] - 0.01 == pytest.approx(a["q_filtered"][0], abs=1e-12)
        assert a["elevator_rate"][0] == pytest.approx(a["q_dot"][0], abs=1e-12)


def test_inversion_uses_the_surface_power_that_is_believed():
    m, gains = cruise(), indi.default_gains()
    asked = []
    for share in (1.0, 0.75):
        a, c = indi.init(1), requested(1, 0)
        for _ in range(400):
            steer(indi, a, c, m, identified(density=air_density(m[0]), Cm_elevator=share), gains)
        m["theta"] += 0.01
        steer(indi, a, c, m, identified(density=air_density(m[0]), Cm_elevator=share), gains)
        m["theta"] -= 0.01
        asked.append(float(c["elevator"][0]) - 0.01)
    assert asked[1] == pytest.approx(asked[0]/0.75, rel=1e-6)
