"""What instruments do to a record is declared, or found, before anything else is blamed."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.signal import butter, lfilter

from estimators.compatibility.flow_angles import at_centre_of_gravity
from estimators.signals.instruments import ATTITUDES, calibrated, with_prompt_attitudes
from icing_env import scenario
from icing_env.errors import InputError
from icing_env.record import FlightRecord
from sim2real.diagnosis import diagnose
from sim2real.records.instruments import UNFILTERED, lateness, recorder_lags, with_recorder
from sim2real.records.reconstruct import reconstruct
from testbed.flight import fly

FILE = lateness(1.0 / (2.0 * np.pi * 10.0), 0.02)
PERFECT = {"pitot_lag": 0.0, "vane_lag": 0.0, "boom_gain": 0.0, "filter_frequency": 1e4}


@cache
def flown(instruments: str = "", seed: int = 4, sigma: float = 0.5) -> FlightRecord:
    """Doublets of all three surfaces, and a side file that says nothing of instruments."""
    changed = PERFECT if instruments == "perfect" else {}
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": sigma, **changed})
    return stating(fly(chosen, seed=seed, observer=False, protection=False).record, {})


def stating(record: FlightRecord, sensors: dict[str, Any]) -> FlightRecord:
    """The record with another table `sensors`."""
    return replace(record, meta=replace(record.meta, sensors=sensors))


@pytest.mark.parametrize(("instruments", "late"), [("", FILE), ("perfect", 0.0)])
def test_attitudes_tell_how_late_the_rates_are(instruments: str, late: float) -> None:
    """In roll to two milliseconds, in gusts and without, whatever flies; half the samples tell the same."""
    for sigma in (0.0, 0.5, 1.5):
        whole = flown(instruments, sigma=sigma)
        for record in (whole, whole.take(np.arange(len(whole)) % 2 == 0)):
            _, (lag, error) = recorder_lags([record]) or [(0.0, 1.0)] * 2
            assert error < 0.0025
            assert abs(lag - late) < 3.0 * error


def test_a_recorder_is_found_only_where_it_is_not_the_files() -> None:
    """Records of the file's instruments stay as they are; others are told so; what is declared is believed."""
    usual, perfect = [flown(seed=s) for s in (4, 5)], [flown("perfect", s) for s in (4, 5)]
    assert with_recorder(usual) == usual
    for record in with_recorder(perfect):
        assert record.meta.sensors["filter"]["lag"] < 0.002
        assert any("low pass" in note for note in reconstruct(record).notes)
    declared = [stating(record, {"filter": {"frequency": 10.0}}) for record in perfect]
    assert with_recorder(declared) == declared


@pytest.mark.parametrize(("lags", "found"), [([(0.0030, 0.0005), (0.0076, 0.0009)], False),
                                             ([(0.0006, 0.0005), (0.0002, 0.0009)], True)])
def test_pitch_and_roll_have_one_recorder(lags, found, monkeypatch) -> None:
    """Where they contradict one another, neither is believed: a sharp error is sharp by luck."""
    monkeypatch.setattr("sim2real.records.instruments.recorder_lags", lambda records: lags)
    assert ("filter" in with_recorder([flown()])[0].meta.sensors) == found


def test_wrong_attitudes_do_not_change_the_recorder() -> None:
    """A delay far beyond a low pass is somebody else's (`data_checks` names it)."""
    record = flown()
    late = replace(record, channels={**record.channels, "phi": np.roll(record["phi"], 10),
                                     "theta": np.roll(record["theta"], 10)})
    assert with_recorder([late]) == [late]


def test_slow_attitudes_tell_of_the_recorder_at_their_samples_alone() -> None:
    """Held until the next sample they are late by two steps: a record was taken to have no low pass at all."""
    every, slow = [flown(seed=seed) for seed in (1, 2, 3)], list[FlightRecord]()
    for k, record in enumerate(every):
        since = np.arange(len(record)) // 5 * 5
        held = {n: record[n][since] if k else np.where(np.arange(len(record)) % 5 == 0, record[n], np.nan)
                for n in ("phi", "theta")}  # fmt: skip
        slow.append(replace(record, channels={**record.channels, **held}))
    for (lag, _), (own, error) in zip(recorder_lags(every), recorder_lags(slow), strict=True):
        assert abs(own - lag) < 4.0 * error < 0.008
    assert with_recorder(slow) == slow


def test_declared_instruments_are_the_models() -> None:
    """Lags, bending and low pass of the side file, and of the aircraft file where it is silent."""
    file = reconstruct(flown()).parameters
    said = reconstruct(stating(flown(), {"alpha": {"lag": 0.05, "bending": 0.0}, "airspeed": {"lag": 0.0},
                                         "filter": {"frequency": 0}})).parameters
    assert lateness(float(said["vane_lag"][0]), 0.02) == pytest.approx(0.05)
    assert said["boom_gain"] == 0.0
    assert said["pitot_lag"] == 0.0
    assert said["filter_frequency"] == UNFILTERED
    partly = reconstruct(stating(flown(), {"alpha": {"lag": 0.05}})).parameters
    for name in ("boom_gain", "pitot_lag", "filter_frequency"):
        assert partly[name] == file[name]


@pytest.mark.parametrize("order", [1, 2, 4])
def test_a_low_pass_is_as_late_as_a_filter_of_its_order(order: int) -> None:
    """A slow change, through Butterworth's."""
    said = reconstruct(stating(flown(), {"filter": {"frequency": 5.0, "order": order}})).parameters
    ramp = 1e-3 * np.arange(4000)
    shown = lfilter(*butter(order, 5.0, fs=1000.0), ramp)
    late = lateness(1.0 / (2.0 * np.pi * float(said["filter_frequency"][0])), 0.02)
    assert late == pytest.approx(ramp[-1] - shown[-1], rel=1e-3)


def quiet(record: FlightRecord) -> FlightRecord:
    """The record with attitudes without most of their noise, which a delay makes twice of."""
    smooth = {name: gaussian_filter1d(record[name], 5) for name in ATTITUDES}
    return replace(record, channels={**record.channels, **smooth})


def test_attitudes_that_are_declared_late_are_no_more() -> None:
    """By the rates, in turns, blanks left as they were; what else is declared stays, and a second time does nothing."""
    record, lag = quiet(flown()), 0.04
    late = {name: np.interp(record.time - lag, record.time, record[name]) for name in ATTITUDES}
    late["phi"][5] = np.nan
    told = stating(replace(record, channels={**record.channels, **late}),
                   {"attitude": {"lag": lag}, "alpha": {"lag": 0.01}})  # fmt: skip
    found = with_prompt_attitudes(told)
    for name, behind in late.items():
        off, was = (np.nanstd((angle - record[name])[5:]) for angle in (found[name], behind))
        assert off < 0.1 * was + 2.5e-4  # and what smoothing leaves of their noise
    assert np.isnan(found["phi"][5]) and np.isfinite(found["phi"][6:]).all()
    assert found.meta.sensors == {"attitude": {}, "alpha": {"lag": 0.01}}
    assert [p.channel for p in found.problems] == ["phi", "theta", "psi"] and all(p.repaired for p in found.problems)
    assert with_prompt_attitudes(found) is found
    for again in (with_recorder([told])[0], calibrated(told)):
        assert np.array_equal(again["theta"], found["theta"])


def test_late_attitudes_without_gyros_are_brought_forward_by_their_own_slope() -> None:
    record = quiet(flown())
    theta = np.interp(record.time - 0.04, record.time, record["theta"])
    stated = replace(record.meta, sensors={"attitude": {"lag": 0.04}})
    told = FlightRecord({"time": record.time, "theta": theta}, stated)
    found = with_prompt_attitudes(told)["theta"]
    assert np.std(found - record["theta"]) < 0.3 * np.std(theta - record["theta"])


def test_a_flown_record_declares_the_instruments_it_has() -> None:
    """Through its side file, the model is that of the aircraft file again."""
    own = fly(scenario.load("clear_air", duration=6.0), observer=False, protection=False).record
    file, said = reconstruct(stating(own, {})).parameters, reconstruct(own).parameters
    for name in ("vane_lag", "pitot_lag", "boom_gain", "filter_frequency"):
        assert said[name] == pytest.approx(file[name])


def test_lags_are_as_late_at_any_rate() -> None:
    """Half the samples of a record show a slow change as late as all of them do."""
    whole = flown()
    half = reconstruct(whole.take(np.arange(len(whole)) % 2 == 0))
    full = reconstruct(whole)
    for name in ("vane_lag", "pitot_lag"):
        late = [lateness(float(f.parameters[name][0]), f.dt) for f in (full, half)]
        assert late[1] == pytest.approx(late[0])
    cut = [lateness(1.0 / (2.0 * np.pi * float(f.parameters["filter_frequency"][0])), f.dt) for f in (full, half)]
    assert cut[1] == pytest.approx(cut[0])


def test_sensors_away_from_the_centre_of_gravity_are_brought_there() -> None:
    """A vane 4 m ahead and accelerometers 1 m behind, not corrected, leave the same as those at the c.g."""
    record = flown()
    away: dict[str, Any] = {"alpha": {"position": [4.0, 0.0, 0.0]}, "accelerometers": {"position": [-1.0, 0.0, 0.5]}}
    back, _ = at_centre_of_gravity(record.channels, away, record.dt)
    moved = {n: 2.0 * record[n] - back[n] for n in ("alpha", "ax", "ay", "az")}
    there = reconstruct(stating(replace(record, channels={**record.channels, **moved}), away))
    here = reconstruct(record)
    for name in moved:
        assert np.allclose(there.channel(name), here.channel(name), atol=1e-9)
    assert sum("centre of gravity" in note for note in there.notes) == 2


@pytest.mark.parametrize("sensors", [{"filter": {"lag": "fast"}}, {"filter": {"frequency": -1.0}},
                                     {"alpha": {"lag": 3.0}}, {"accelerometers": {"position": [1.0]}},
                                     {"filter": {"frequency": 10.0, "order": "two"}}])
def test_a_declaration_that_is_none_is_refused(sensors: dict[str, Any]) -> None:
    """With a line that names it."""
    with pytest.raises(InputError, match="sensors"):
        reconstruct(stating(flown(), sensors))


@pytest.mark.slow
@pytest.mark.parametrize("instruments", ["", "perfect"])
@pytest.mark.parametrize("sigma", [0.0, 0.5])
def test_nothing_is_blamed_for_instruments_that_are_not_described(instruments: str, sigma: float) -> None:
    """Without lags, boom and low pass, or with the file's, and a side file that is silent: no gap."""
    answer = diagnose([flown(instruments, seed, sigma) for seed in (4, 5, 6)])
    assert answer.verdict == "no_gap", answer.hypotheses[:3]
