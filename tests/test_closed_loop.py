"""Autopilot, ice management and protection flying the aircraft model: holds, steps, abuse, severe ice."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from controlled import believed
from numpy.typing import NDArray

from controllers import ice_management
from controllers.laws import autopilot
from controllers.protection import surfaces
from estimators.airframe import airframe_from
from estimators.hinf import init
from estimators.hinf import step as observe
from estimators.hinf.tuning import default_tuning
from icing_env import aircraft
from icing_env.simulate import Fleet
from icing_env.trim import trim
from icing_env.types import ESTIMATE, SURFACES, TARGET

DT = 0.02
LEVEL = 2200.0


class Flight:
    """A fleet in level trim, one row per airspeed, with everything that controls it."""

    def __init__(self, speeds: list[float], instruments: str = "perfect", turbulence: float = 0.0, seed: int = 5,
                 observed: bool = False):
        n = len(speeds)
        parameters = aircraft.changed(aircraft.load(instruments=instruments), turbulence_sigma_w=turbulence)
        self.fleet = Fleet(parameters, n, DT)
        for i, speed in enumerate(speeds):
            t = trim(parameters, airspeed=speed, altitude=LEVEL)
            self.fleet.state[i], self.fleet.command[i], self.fleet.current[i] = t.state[0], t.command[0], t.current[0]
        self.fleet.state["seed"] = np.arange(n) + seed
        self.fleet.state["temperature"] = 263.0
        self.fleet.start()
        self.trimmed = self.fleet.command.copy()
        self.autopilot, self.advisory = autopilot.init(n), ice_management.init(n)
        self.target = np.zeros(n, TARGET)
        for name, value in {"pitch_mode": 1, "altitude": LEVEL, "speed_mode": 1, "roll_mode": 1}.items():
            self.target[name] = value
        self.target["airspeed"] = speeds
        self.estimate: NDArray = np.zeros(n, ESTIMATE)
        self.estimate[:] = believed(n)
        self.estimate["excitation_longitudinal"] = 0.0
        self.airframe, self.tuning = airframe_from(parameters), default_tuning()
        self.observer = init(self.airframe, self.tuning, n) if observed else None
        self.gains = autopilot.default_gains(), ice_management.load_tuning(), surfaces.load_tuning()
        self.changed = np.zeros(n, bool)

    def fly(self, seconds: float, stick: Callable[[NDArray], None] | None = None, protect: bool = True) -> NDArray:
        """Fly on the autopilot, or on `stick`, which changes the trimmed command.

        Returns altitude, airspeed, alpha, phi, psi, load factor, bank limit (deg); shape (steps, 7, rows).
        """
        gains, ims, protection = self.gains
        f, rows = self.fleet, []
        for _ in range(round(seconds/DT)):
            if self.observer is not None:
                observe(self.observer, self.estimate, f.measurement, self.airframe, self.tuning, DT)
            ice_management.step(self.advisory, self.estimate, f.measurement, f.parameters, ims, DT)
            if stick is None:
                autopilot.step(self.autopilot, f.command, f.measurement, self.estimate, self.target, self.advisory,
                               f.parameters, gains, DT)
            else:
                f.command[:] = self.trimmed
                stick(f.command)
            asked = f.command.copy()
            if protect:
                surfaces.protect(
                    surfaces.init(f.n), f.command, self.advisory, f.measurement, self.estimate, f.parameters,
                    protection, DT)
            self.changed |= asked != f.command
            f.step()
            o, m = f.outcome, f.measurement
            rows.append(np.stack([f.state["altitude"], o["airspeed"], np.degrees(o["alpha"]), np.degrees(m["phi"]),
                                  np.degrees(m["psi"]), o["load_factor"], np.degrees(self.advisory["bank_limit"])]))
        return np.array(rows)


def test_holds_in_light_turbulence_from_slow_to_fast():
    speeds = [55.0, 63.0, 72.0, 82.0]
    flight = Flight(speeds, "nasa_2002", turbulence=1.0)
    flight.fly(5.0)
    log = flight.fly(60.0)
    altitude, airspeed, heading = log[:, 0], log[:, 1], log[:, 4]
    assert np.abs(altitude - LEVEL).max() < 5.0
    assert np.abs(airspeed.mean(0) - speeds).max() < 0.5
    assert airspeed.std(0).max() < 1.2  # the gust along the flight path alone has 1 m/s
    assert np.abs(heading).max() < 2.5 and heading.std(0).max() < 0.8
    assert not flight.changed.any()  # the protection has nothing to do in clear air


def test_steps_of_altitude_heading_and_airspeed_are_well_damped():
    speeds = np.array([55.0, 72.0, 80.0])
    flight = Flight(list(speeds))
    flight.target["altitude"] += 30.0
    climb = flight.fly(40.0)
    assert climb[:, 0].max() < LEVEL + 32.0 and (climb[-1, 0] > LEVEL + 29.0).all()
    assert climb[:, 5].min() > 0.8 and climb[:, 5].max() < 1.2  # comfortable
    flight.target["heading"] = np.radians(60.0)
    turn = flight.fly(45.0)
    assert turn[:, 4].max() < 60.5 and (turn[-1, 4] > 59.0).all()
    assert 20.0 < turn[:, 3].max() < 27.0 and np.abs(turn[:, 0] - LEVEL - 30.0).max() < 2.0
    flight.target["airspeed"] = speeds + np.array([5.0, 5.0, -5.0])
    change = np.abs(flight.fly(40.0)[:, 1] - speeds)
    assert change.max() < 6.0 and (np.abs(change[-1] - 5.0) < 0.5).all()
    assert not flight.changed.any()


def test_left_and_right_turns_are_mirror_images():
    flight = Flight([72.0, 72.0])
    flight.target["heading"] = np.radians([40.0, -40.0])
    log = flight.fly(20.0)
    for column in (3, 4):
        assert np.abs(log[:, column, 0] + log[:, column, 1]).max() < 1e-9
    assert np.abs(log[:, 0, 0] - log[:, 0, 1]).max() < 1e-9


def back(command: NDArray) -> None:
    command["elevator"] -= 0.4


def test_full_back_stick_stalls_the_aircraft_but_not_the_protected_one():
    speeds = [50.0, 55.0, 60.0, 72.0]
    onset = np.degrees(0.2)
    assert Flight(speeds).fly(10.0, back, protect=False)[:, 2].max(0).min() > onset + 10.0
    assert Flight(speeds).fly(20.0, back)[:, 2].max() < onset


def test_full_aileron_is_caught_at_the_bank_limit():
    def roll(command: NDArray) -> None:
        command["aileron"][:] = -0.28, 0.28

    log = Flight([60.0, 60.0]).fly(6.0, roll)
    assert (np.abs(log[:, 3]) < log[:, 6] + 5.0).all()
    assert np.abs(log[-1, 3]).min() > 30.0
    assert np.abs(Flight([60.0, 60.0]).fly(6.0, roll, protect=False)[:, 3]).max() > 100.0


def test_ordinary_manoeuvres_in_clear_air_pass_untouched():
    flight = Flight([60.0, 72.0])
    flight.gains[0]["bank_max"] = np.radians(45.0)
    flight.target["roll_mode"], flight.target["phi"] = 0, np.radians(45.0)
    assert flight.fly(15.0)[:, 3].max() > 44.0 and not flight.changed.any()

    for step in ([-0.066, -0.043], [0.066, 0.043]):  # pull up and push over by about half a g

        def move(command: NDArray, step: list[float] = step) -> None:
            command["elevator"] += step

        flight = Flight([60.0, 72.0])
        load = flight.fly(2.5, move)[:, 5]
        assert (np.abs(load - 1.0).max(0) > 0.42).all() and not flight.changed.any()


@pytest.mark.parametrize("error", [0.8, 1.2])
def test_severe_ice_is_flown_down_not_into_the_stall(error):
    """More drag than power: the climb yields to the airspeed, though the severity is estimated 20 % wrong."""
    flight = Flight([70.0], "nasa_2002", turbulence=0.5)
    severity = 0.75
    for k in range(60):  # a minute of accretion
        for surface in SURFACES:
            flight.fleet.state[f"eta_{surface}"] = 0.19*severity*k/60
        flight.estimate[:] = believed(1, error*severity*k/60)
        log = flight.fly(1.0)
    log = flight.fly(60.0)
    a = flight.advisory[0]
    assert a["ice_detected"] == 1 and a["shot_wing"] > 0
    assert log[-1, 0, 0] < LEVEL - 20.0
    assert np.degrees(flight.fleet.current["alpha_stall_left"][0]) - log[:, 2].max() > 1.0
    assert log[:, 1].min() > a["airspeed_limit"] - 2.0


def test_the_observer_in_the_loop_sees_ice_and_raises_no_alarm_in_clear_air():
    clear = Flight([60.0, 66.0, 72.0], "nasa_2002", turbulence=1.5, observed=True)
    clear.fly(120.0)
    assert (clear.advisory["ice_detected"] == 0).all() and clear.advisory["severity"].max() < 0.1
    iced = Flight([60.0, 66.0, 70.0], "nasa_2002", turbulence=1.0, observed=True)
    for k in range(121):
        for surface in SURFACES:
            iced.fleet.state[f"eta_{surface}"] = 0.06*k/120
        iced.fly(1.0)
    assert (iced.advisory["ice_detected"] == 1).all() and (iced.advisory["shot_tail"] > 0).all()
    assert iced.advisory["severity"] == pytest.approx(0.06/0.19, abs=0.08)


def test_batch_flies_as_the_single_aircraft_bit_for_bit():
    together = Flight([60.0, 72.0], "nasa_2002", turbulence=1.0)
    together.target["heading"] = 0.3, -0.3
    both = together.fly(5.0)
    alone = Flight([72.0], "nasa_2002", turbulence=1.0, seed=6)
    alone.target["heading"] = -0.3
    assert alone.fly(5.0)[..., 0].tobytes() == both[..., 1].tobytes()
    assert alone.fleet.command.tobytes() == together.fleet.command[1:].tobytes()
