"""Every channel of a record with every fault: named, mended or refused, or without harm to what is found."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from flights import flight_data, with_channel
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.estimate import Estimate
from estimators.regression.equation_error import identify
from estimators.signals.axial_check import factor, tilt
from estimators.signals.data_checks import check
from estimators.signals.resample import common_grid
from icing_env import scenario as scenarios
from icing_env.errors import InputError
from icing_env.record import FlightRecord, read
from testbed.flight import fly

RECORDED = ("totter_demo_data.mat", "totter_pred_data.mat", "totter_f1_017_data.mat")
ANGLES = ("alpha", "beta", "p", "q", "r", "phi", "theta", "psi", "elevator", "aileron", "rudder")
UNITS = {**dict.fromkeys(ANGLES, (57.29578,)), **dict.fromkeys(("ax", "ay", "az"), (1.0/9.80665, 3.2808)),
         "airspeed": (1.9438, 3.2808), "ground_speed": (1.9438,), "altitude": (3.2808,), "pressure": (0.01,),
         "temperature": (0.02,), "thrust_left": (0.2248,), "thrust_right": (0.2248,), "mass": (2.2046, 0.06852),
         "lwc": (1000.0,), "throttle_left": (100.0,)}  # fmt: skip
FAULTS = ("constant", "gap", "spike", "reversed", "unit", "nan runs", "frozen")


@cache
def doublets(sigma: float, airspeed: float, seed: int = 3) -> FlightRecord:
    """A simulated set of doublets in all three axes."""
    scenario = scenarios.load("clear_air", aircraft="twin_otter_flight", duration=57.0, doublet_scale=0.78,
                              parameters={"turbulence_sigma_w": sigma}, initial={"airspeed": airspeed})  # fmt: skip
    record = fly(scenario, seed=seed, observer=False, protection=False).record
    return record.take(record.time >= 5.0)


@cache
def sound(name: str) -> tuple[FlightRecord, dict[str, Estimate]]:
    """A record without fault, and what regression finds in it."""
    where = {"calm": (0.0, 60.0), "gusts": (1.0, 72.0)}
    record = doublets(*where[name]) if name in where else read(flight_data(name))
    return record, identify(record)


def spoil(values: np.ndarray, fault: str, place: float, factor: float) -> np.ndarray:
    """A channel with one fault at a place in (0, 1) of its samples."""
    out, rows = values.copy(), np.flatnonzero(np.isfinite(values))
    at = rows[int(place*len(rows))]
    if fault == "constant":
        out[rows] = values[at]
    elif fault == "gap":
        out[at:at + 60] = np.nan
    elif fault == "spike":
        out[at] += max(10.0*float(np.nanstd(values)), 0.1*abs(values[at]))
    elif fault == "nan runs":
        for start in rows[:: max(1, len(rows)//6)]:
            out[start:start + 5] = np.nan
    elif fault == "frozen":
        stretch = rows[(rows >= at) & (rows < at + 100)]
        out[stretch] = values[at]
    else:
        out *= -1.0 if fault == "reversed" else factor
    return out


def harm(before: dict[str, Estimate], after: dict[str, Estimate]) -> list[str]:
    """Derivatives told that moved by more than three standard errors and 15 %."""
    return [n for n, e in before.items() if e.identifiable and n in after and after[n].identifiable and n[-2:] != "_0"
            and abs(after[n].estimate - e.estimate) > max(3.0*e.std_error, 0.15*abs(e.estimate))]  # fmt: skip


@settings(max_examples=80)
@given(st.data(), st.sampled_from(("calm", "gusts", *RECORDED)), st.sampled_from(FAULTS), st.floats(0.2, 0.6))
def test_no_fault_in_any_channel_does_harm_in_silence(data: st.DataObject, name: str, fault: str, place: float) -> None:
    record, before = sound(name)
    channels = [n for n in record.channels if n != "time" and record.has(n) and (fault != "unit" or n in UNITS)]
    channel = data.draw(st.sampled_from(channels))
    unit = data.draw(st.sampled_from(UNITS.get(channel, (1.0,))))
    bad = with_channel(record, channel, spoil(record[channel], fault, place, unit))
    try:
        mended = check(bad)
    except InputError as error:
        assert fault in ("reversed", "unit"), str(error)
        assert f"'{channel}'" in str(error) and "\n" not in str(error)
        return
    if any(p.channel == channel for p in mended.problems):
        return
    assert not harm(before, identify(bad)), (name, channel, fault)


@pytest.mark.parametrize(("name", "channel"), [(RECORDED[0], "elevator"), (RECORDED[1], "elevator"),
                                               (RECORDED[2], "rudder")])  # fmt: skip
@pytest.mark.parametrize("place", [0.25, 0.5, 0.55])
def test_a_position_that_flickers_and_then_stands_still_is_frozen(name: str, channel: str, place: float) -> None:
    """Hands rest for a third of a second at most in these records, and their last bit flickers."""
    record, before = sound(name)
    bad = with_channel(record, channel, spoil(record[channel], "frozen", place, 1.0))
    assert any(p.channel == channel and "frozen" in p.kind for p in check(bad).problems)
    assert not harm(before, identify(bad))
    assert not any("frozen" in p.kind for p in check(record).problems)


@pytest.mark.parametrize("name", RECORDED[:2])
def test_lift_tilted_forward_tells_the_sign_and_unit_of_ax(name: str) -> None:
    record, _ = sound(name)
    share, error = tilt(common_grid(record))
    assert 0.4 < share < 1.0 and error < 0.15
    for wrong, message in ((-1.0, "'ax' has its sign reversed"), (3.2808, "'ax' looks like ft/s2")):
        with pytest.raises(InputError, match=message):
            check(with_channel(record, "ax", wrong*record["ax"]))
    told = check(with_channel(record, "ax", record["ax"]/9.80665)).problems
    assert [(p.channel, p.kind) for p in told] == [("ax", "sign and unit could not be checked from this record")]


@pytest.mark.parametrize("sigma", [0.0, 1.0])
def test_gravity_and_airspeed_tell_the_factor_of_ax(sigma: float) -> None:
    record = doublets(sigma, 55.0)
    k, error = factor(common_grid(record))
    assert abs(k - 1.0) < 3.0*error and error < 0.25
    with pytest.raises(InputError, match="'ax' looks like g: airspeed and gravity need"):
        check(with_channel(record, "ax", record["ax"]/9.80665))


def test_drag_without_a_thrust_that_can_be_is_refused_and_lift_is_not() -> None:
    record, before = sound("calm")
    both = {n: 0.2248*record[n] for n in ("thrust_left", "thrust_right")}
    mended = check(replace(record, channels={**record.channels, **both}))
    assert {p.channel for p in mended.problems if "thrust looks like lbf" in p.kind} == set(both)
    after = identify(mended)
    assert not after["CD_0"].identifiable and not harm(before, after)


@pytest.mark.parametrize("speed", [55.0, 72.0, 82.0])
@pytest.mark.parametrize("sigma", [0.0, 0.5, 2.0])
def test_sound_records_are_not_doubted(sigma: float, speed: float) -> None:
    record = doublets(sigma, speed, seed=11)
    for part in (record, record.take((record.time >= 8.0) & (record.time < 28.0))):
        assert all("could not be checked" in p.kind for p in check(part).problems)


@pytest.mark.parametrize("eta", [0.2, 0.3])
def test_a_wing_that_stalls_under_ice_is_not_taken_for_a_wrong_unit(eta: float) -> None:
    ice = dict.fromkeys(("left_wing", "right_wing", "htail", "vtail", "struts", "other"), eta)
    scenario = scenarios.load("clear_air", aircraft="twin_otter_flight", duration=57.0, doublet_scale=0.78,
                              parameters={"turbulence_sigma_w": 0.3}, initial={"airspeed": 72.0, "eta": ice})
    record = fly(scenario, seed=3, observer=False, protection=False).record
    check(record.take(record.time >= 5.0))
