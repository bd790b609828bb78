"""The pilot model: crossover and margins with the clean aircraft, delay, remnant, and what the pilot does not see."""

from __future__ import annotations

import numpy as np
import pytest
from controlled import airframe, cruise, free, requested

from controllers.laws import pilot
from icing_env import aircraft
from icing_env.linearise import LATERAL, LONGITUDINAL, linearise
from icing_env.trim import trim
from icing_env.types import ESTIMATE, TARGET

DT = 0.02
CLEAN = aircraft.load("twin_otter")
FREQUENCY = np.geomspace(0.05, 20.0, 2000)
GAINS = pilot.default_gains()


def flown_by_hand(airspeed: float, axis: str) -> np.ndarray:
    """Open loop of pilot, actuator and clean aircraft over FREQUENCY."""
    state, surface, states = {"pitch": ("theta", "elevator", LONGITUDINAL), "bank": ("phi", "aileron", LATERAL)}[axis]
    plant = linearise(trim(CLEAN, airspeed=airspeed, altitude=2200.0), CLEAN, states)[state, surface]
    scale = 72.0/airspeed  # root of the ratio of dynamic pressures
    s = 1j*FREQUENCY
    return -scale*pilot.transfer(GAINS, axis, FREQUENCY)*plant(s)/(0.05*s + 1.0)


def fly(m, errors, gains=GAINS, field="theta"):
    """Commands of a pilot who sees `errors` one after another."""
    a, c, t = pilot.init(1), requested(1, 0), np.zeros(1, TARGET)
    t["theta"], t["airspeed"], t["altitude"] = m["theta"], 72.0, 2200.0
    out, start = [], float(m[field][0])
    for error in errors:
        m[field] = start + error
        pilot.step(a, c, m, np.zeros(1, ESTIMATE), t, free(), airframe(), gains, DT)
        out.append([float(c[name][0]) for name in ("elevator", "aileron", "rudder")])
    return np.array(out)


@pytest.mark.parametrize("airspeed", [55.0, 72.0, 82.0])
@pytest.mark.parametrize("axis", ["pitch", "bank"])
def test_crossover_and_phase_margin_are_a_trained_pilots(axis, airspeed):
    loop = flown_by_hand(airspeed, axis)
    above = np.abs(loop) > 1.0
    last = int(np.flatnonzero(above)[-1])
    assert 0.9 < FREQUENCY[last] < 2.0
    assert 45.0 < 180.0 + np.degrees(np.angle(loop[last])) < 80.0
    phase = np.unwrap(np.angle(loop))
    reversal = int(np.flatnonzero(phase < -np.pi)[0])
    assert np.abs(loop[reversal]) < 0.65  # gain margin above 1.5


@pytest.mark.parametrize(("axis", "field", "column"), [("pitch", "theta", 0), ("bank", "phi", 1)])
@pytest.mark.parametrize("frequency", [0.7, 1.5, 4.0])
def test_what_is_flown_is_the_transfer_function(axis, field, column, frequency):
    gains = GAINS.copy()
    for name in ("remnant", "K_trim_pitch", "K_trim_bank"):
        gains[name] = 0.0
    time = np.arange(0.0, 6.0*2.0*np.pi/frequency, DT)
    answer = fly(cruise(), 0.02*np.sin(frequency*time), gains, field)[:, column]
    late = time > time[-1] - 2.0*2.0*np.pi/frequency
    basis = np.stack([np.sin(frequency*time), np.cos(frequency*time), np.ones(len(time))], axis=1)[late]
    sine, cosine, _ = np.linalg.lstsq(basis, answer[late], rcond=None)[0]
    expected = 0.02*complex(pilot.transfer(gains, axis, np.array(frequency)))
    expected *= np.sqrt(0.5*1.0087*72.0**2/2560.0)**-1  # density of `cruise` is not that of the reference
    assert complex(sine, cosine) == pytest.approx(expected, rel=0.02 + 0.03*frequency)  # a sample or so early


def test_nothing_moves_before_the_delay_is_over():
    errors = np.r_[np.zeros(5), np.full(40, 0.05)]
    elevator = fly(cruise(), errors)[:, 0]
    moved = np.flatnonzero(np.abs(elevator - elevator[0]) > 1e-9)
    assert 5 + 10 <= moved[0] <= 5 + 12  # 0.2 s


def test_rates_flow_angles_and_accelerations_of_the_moment_are_not_seen():
    quiet, shaken = cruise(), cruise()
    for name, value in {"p": 0.3, "q": 0.2, "r": 0.2, "beta": 0.1, "ay": 1.0}.items():
        shaken[name] = value
    errors = np.full(30, 0.02)
    np.testing.assert_array_equal(fly(quiet, errors), fly(shaken, errors))


def test_the_remnant_is_drawn_anew_for_each_aircraft_and_again_the_same():
    other = cruise()
    other["airspeed"] += 0.1
    errors = np.full(200, 0.02)
    first, again, another = (fly(m, errors)[:, 0] for m in (cruise(), cruise(), other))
    np.testing.assert_array_equal(first, again)
    assert np.std(first - another) > 1e-5


def test_the_feet_are_on_the_floor():
    m = cruise()
    m["rudder"] = 0.02
    assert (fly(m, np.full(50, 0.05), field="phi")[:, 2] == 0.02).all()
