"""Vanes on a boom meet a gust before the wings: told by when the accelerations feel it, and taken out."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from generated import written
from scipy.signal import lfilter

from icing_env.atmosphere import G0
from sim2real.diagnosis import _reconstructed, diagnose
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import Reconstruction, reconstruct
from sim2real.records.vane_lead import _ago, boom_of_vanes, met_together, motion
from testbed.withheld import instruments
from testbed.withheld import plant as pl
from testbed.withheld.conditions import Conditions
from testbed.withheld.flights import Aircraft, fly, turbulence
from testbed.withheld.manoeuvres import DIAGNOSED, PLANS
from testbed.withheld.published import PUBLISHED

BOOM = 5.6  # m
AIRCRAFT = Aircraft()


def flown(folder, sigma: float, boom: float, count: int = DIAGNOSED, noise: float = 1.0,
          aircraft: Aircraft = AIRCRAFT) -> list:  # fmt: skip
    """Records of the generator's plant, its vanes `boom` m ahead of the centre of gravity in the gusts.

    `noise`: times the instruments' own.
    """
    out = []
    for i, manoeuvre in enumerate(PLANS[2][:count]):
        rng = np.random.default_rng([7, i])
        gust = turbulence(manoeuvre, Conditions(sigma, 1.0, 1.0, "at_once"), rng)
        flight, ahead = fly(aircraft, manoeuvre, 1.0, gust), round(boom / manoeuvre.speed * pl.SUB / pl.DT)
        channels = dict(flight.channels)
        for name, column in (("alpha", pl.G_W), ("beta", pl.G_V)):
            now = gust[:: pl.SUB, column]
            there = np.append(gust[ahead:, column], np.repeat(gust[-1, column], ahead))[:: pl.SUB]
            channels[name] = channels[name] + late((now - there) / manoeuvre.speed)
        seen = instruments.read(channels, noise, rng)
        out.append(written(folder / f"{i}", seen, flight.commands))
    return out


def late(angle: np.ndarray) -> np.ndarray:
    """As the vane and the recorder show it."""
    cut = 1.0 / (2.0 * np.pi * PUBLISHED["filter_frequency"])
    for share in (instruments.gain(PUBLISHED["vane_lag"]), instruments.gain(cut)):
        angle = lfilter([share], [1.0, share - 1.0], angle)
    return np.asarray(angle)


def noted(flights: list[Reconstruction]) -> bool:
    return all(any("before the wings" in note for note in flight.notes) for flight in flights)


@pytest.mark.parametrize("sigma", [0.5, 1.5])
def test_the_boom_is_told_and_taken_out(tmp_path, sigma):
    records = flown(tmp_path, sigma, BOOM)
    boom, error = boom_of_vanes([reconstruct(record) for record in records])
    assert boom == pytest.approx(BOOM, abs=1.0) and error < 0.3
    assert noted(_reconstructed(records, None, None))


@pytest.mark.parametrize(("place", "taken"), [
    ([5.6, 0.0, 0.0], "5.6 m before the wings, as declared"), ([25.0, 0.0, 0.0], "m before the wings: "),
    (5.6, "m before the wings: ")])  # fmt: skip
def test_a_boom_that_is_told_is_as_long_as_declared(tmp_path, place, taken):
    """Where the gusts say so: told by the accelerations it may be a metre off, which is a phase of az to a filter."""
    entry = {"position": place, "corrected": True}
    records = [replace(record, meta=replace(record.meta, sensors={**record.meta.sensors, "alpha": entry}))
               for record in flown(tmp_path, 0.5, BOOM)]
    assert all(any(taken in note for note in flight.notes) for flight in _reconstructed(records, None, None))


@pytest.mark.parametrize("samples", [0.3, 0.87, 1.0, 1.49, 4.38, 4.999, 5.0])
def test_some_samples_ago_a_gust_is_what_it_was_and_white_noise_as_strong(samples):
    t, noise = np.arange(4000) * 0.02, np.random.default_rng(3).standard_normal(4000)
    for hertz, off in ((0.5, 1e-4), (2.0, 3e-3)):
        wave = np.sin(2.0 * np.pi * hertz * t)
        assert _ago(wave, samples)[500:] == pytest.approx(np.sin(2.0 * np.pi * hertz * (t - samples * 0.02))[500:],
                                                          abs=off)  # fmt: skip
    then = _ago(noise, samples)
    assert np.std(then) == pytest.approx(np.std(noise), rel=0.03)
    assert abs(np.corrcoef(then[1:], then[:-1])[0, 1]) < 0.05
    assert _ago(np.full(9, 0.3), samples) == pytest.approx(0.3)


def test_angles_at_the_centre_of_gravity_are_those_that_it_meets(tmp_path_factory):
    """Not some milliseconds later: a gust's lift would be early to a filter, and its vanes too quiet."""
    entry, made = {"position": [BOOM, 0.0, 0.0], "corrected": True}, tmp_path_factory.mktemp
    ahead = [replace(record, meta=replace(record.meta, sensors={**record.meta.sensors, "alpha": entry}))
             for record in flown(made("ahead"), 1.5, BOOM, noise=0.05)]
    there = [reconstruct(record) for record in flown(made("there"), 1.5, 0.0, noise=0.05)]
    taken = met_together([reconstruct(record) for record in ahead])
    assert noted(taken)
    for one, other in zip(taken, there, strict=True):
        assert one.parameters["vane_lag"] == other.parameters["vane_lag"]
        late = lateness_between(one.channel("alpha"), other.channel("alpha"), other.dt)
        assert abs(late) < 2.5e-3


def lateness_between(one: np.ndarray, other: np.ndarray, dt: float) -> float:
    """By how much one is later than the other between 1 and 3 Hz, s."""
    hertz = np.fft.rfftfreq(len(one), dt)
    inside = (hertz >= 1.0) & (hertz < 3.0)
    a, b = (np.fft.rfft((x - x.mean()) * np.hanning(len(x)))[inside] for x in (one, other))
    delays = np.linspace(-0.02, 0.02, 401)
    fits = np.real(np.exp(2j * np.pi * hertz[inside] * delays[:, None]) @ (a * np.conj(b)))
    return float(delays[np.argmax(fits)])


@pytest.mark.parametrize("sigma", [0.0, 0.5, 1.5])
def test_vanes_at_the_centre_of_gravity_are_left_alone(tmp_path, sigma):
    assert not noted(_reconstructed(flown(tmp_path, sigma, 0.0), None, None))


@pytest.mark.parametrize("sigma", [0.5, 1.5])
def test_lift_that_comes_late_is_no_boom(tmp_path, sigma):
    """The normal force lags behind alpha as behind vanes 5 m ahead, the side force behind beta does not."""
    late = Aircraft(parts=(("unsteady_lift", "same", 33.0),))  # per alphadot c/2V
    flights = [reconstruct(record) for record in flown(tmp_path, sigma, 0.0, aircraft=late)]
    boom, error = boom_of_vanes(flights)
    assert boom - 5.0 * error > 2.0
    assert not noted(met_together(flights))


def test_in_still_air_the_motion_is_all_that_moves_the_flow(tmp_path):
    (record,) = flown(tmp_path, 0.0, 0.0, 1)
    flight = reconstruct(record)
    for name, rate in zip(("alpha", "beta"), motion(flight), strict=True):
        angle, made = flight.channel(name), np.cumsum(rate) * flight.dt
        left = angle - made
        trend = np.polyval(np.polyfit(flight.time, left, 3), flight.time)
        assert np.std(left - trend) < 0.25 * np.std(angle), name


def test_gusts_do_not_turn_with_the_aircraft():
    """They have body axes, as the Dryden model has them: what a roll of 0.3 rad/s would make of a side gust of 1.5 m/s
    of alpha was taken for motion, 0.6 mrad in the time that a boom of 5.6 m is ahead."""
    t = np.arange(0.0, 40.0, 0.02)
    p, q, r = 0.3 * np.sin(0.9 * t), 0.05 * np.sin(0.6 * t), 0.04 * np.cos(0.7 * t)
    gust = 1.5 * np.array([np.sin(0.5 * t), np.sin(0.8 * t + 1.0), np.sin(1.1 * t)])
    inertial = np.array([65.0 + np.sin(0.3 * t), 2.0 * np.sin(0.9 * t), 6.0 + np.sin(0.6 * t)])
    felt = np.gradient(inertial, 0.02, axis=1) + np.cross(np.array([p, q, r]), inertial, axis=0)
    u, v, w = inertial - gust
    V, zero = np.sqrt(u**2 + v**2 + w**2), np.zeros_like(t)
    channels = {"airspeed": V, "alpha": np.arctan2(w, u), "beta": np.arcsin(v / V), "p": p, "q": q, "r": r,
                "phi": zero, "theta": zero, "ax": felt[0], "ay": felt[1], "az": felt[2] - G0}  # fmt: skip
    own = motion(SimpleNamespace(dt=0.02, channel=channels.__getitem__))
    steady = _rates_of_flow(inertial - gust, np.gradient(inertial, 0.02, axis=1))
    for made, true in zip(own, steady, strict=True):
        assert np.std((made - true)[50:-50]) < 1e-3


def _rates_of_flow(air: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rates of alpha and beta where the velocity through the air changes so, by differences over a millisecond."""
    def angles(velocity: np.ndarray) -> np.ndarray:
        u, v, w = velocity
        return np.array([np.arctan2(w, u), np.arcsin(v / np.sqrt(u**2 + v**2 + w**2))])

    rates = (angles(air + 1e-3 * change) - angles(air - 1e-3 * change)) / 2e-3
    return rates[0], rates[1]


def test_flow_angles_that_were_not_sampled_stay_so(tmp_path):
    records = flown(tmp_path, 1.5, BOOM)
    records[0].channels["alpha"][100:120] = np.nan
    flights = _reconstructed(records, None, None)
    assert noted(flights)
    assert np.isnan(flights[0].measured[100:120, MEASURED.index("alpha")]).all()


def test_flow_angles_of_a_record_that_does_not_tell_the_motion_stay_as_they_are(tmp_path):
    """A channel that was not recorded is no zero of it: without az the aircraft would fall."""
    records = flown(tmp_path, 1.5, BOOM)
    flights = [reconstruct(record) for record in records]
    column = MEASURED.index("az")
    measured = flights[1].measured.copy()
    measured[:, column] = np.nan
    flights[1] = replace(flights[1], measured=measured)
    first, second, *_ = met_together(flights)
    assert noted([first]) and not noted([second])
    assert second.channel("alpha") == pytest.approx(flights[1].channel("alpha"), abs=0.0)


def test_a_clean_aircraft_with_a_boom_is_not_blamed(tmp_path):
    """Its gusts were of no kind that made sense, and what they did was a vane's, a damping's or unknown."""
    assert diagnose(flown(tmp_path, 1.5, BOOM)).verdict == "no_gap"
