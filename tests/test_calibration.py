"""Lags and bending that a record declares are undone, noise in regressors is allowed for, zero-lift drag is honest."""

from dataclasses import replace

import numpy as np
import pytest

from estimators.methods import method
from estimators.observer.measurements import airframe_of_record
from estimators.regression.least_squares import least_squares
from estimators.regression.noisy_regressors import compensated
from estimators.signals.instruments import calibrated, calibration, time_constant
from icing_env import scenario as scenarios
from icing_env.errors import InputError
from icing_env.record import FlightRecord, RecordMeta, read, write
from testbed.benchmarks.coverage import DEVELOPMENT, doublet_record
from testbed.flight import fly
from testbed.reproduce.windows import part

DT = 0.02


def _doublets(lag: float) -> tuple[FlightRecord, dict[str, float]]:
    """A calm doublet set with vanes of that time constant (s), and the truth."""
    scenario = scenarios.load(
        "clear_air", aircraft="twin_otter_flight", duration=50.0, doublet_scale=0.78,
        parameters={"turbulence_sigma_w": 0.0, "vane_lag": lag}, initial={"airspeed": 72.0}, ice_protection="off",
        events=({"time": 10.0, "name": "doublets", "doublets": True},))  # fmt: skip
    flight = fly(scenario, seed=2, protection=False, observer=False)
    rows = flight.truth["time"] >= 8.0
    truth = {name: float(np.mean(flight.truth[f"quasi_{name}"][rows])) for name in ("CL_alpha", "Cm_alpha", "Cm_q")}
    late = lag and DT/np.expm1(DT/lag)
    told = {"alpha": {"lag": late, "bending": 0.0002}, "beta": {"lag": late}}
    record = part(flight.record, rows)
    return replace(record, meta=replace(record.meta, sensors=told)), truth


@pytest.fixture(scope="module")
def flown() -> tuple[FlightRecord, dict[str, float]]:
    """With slow vanes, 0.05 s, and a side file that says so."""
    return _doublets(0.05)


def _undeclared(record: FlightRecord) -> FlightRecord:
    return replace(record, meta=replace(record.meta, sensors={}))


def test_a_simulated_record_declares_what_a_slow_change_would_show() -> None:
    """y += g (x - y) every DT is late by DT (1 - g)/g; what was changed about the instruments it does not know."""
    scenario = scenarios.load("clear_air", duration=1.0, parameters={"vane_lag": 0.2}, ice_protection="off")
    record = fly(scenario, protection=False, observer=False).record
    gain = 1.0 - np.exp(-DT/0.02)
    assert record.meta.sensors["alpha"]["lag"] == pytest.approx(DT*(1.0 - gain)/gain)
    assert record.meta.sensors["alpha"]["bending"] == pytest.approx(0.0002)
    assert time_constant(record.meta.sensors["beta"]["lag"], DT) == pytest.approx(0.02)
    assert airframe_of_record(record, None)["vane_lag"][0] == pytest.approx(0.02)


def test_the_declaration_goes_through_the_side_file(flown: tuple, tmp_path) -> None:
    """Written and read again, a record declares the same."""
    write(flown[0].take(slice(0, 60)), tmp_path/"a.csv")
    assert read(tmp_path/"a.csv").meta.sensors == flown[0].meta.sensors


@pytest.mark.parametrize("name", ["stepwise", "hinf", "rls"])
def test_a_declared_lag_is_undone(flown: tuple, name: str) -> None:
    """With the lag declared the truth lies within the errors."""
    record, truth = flown
    found = method(name)(record)
    for key, true in truth.items():
        assert abs(found[key].estimate - true) < 3.0*found[key].std_error, key


@pytest.mark.parametrize("name", ["stepwise", "hinf"])
def test_an_undeclared_lag_biases(name: str) -> None:
    """tau 2V/c of Cm_alpha goes into Cm_q: 21 ms are 6 to 8 % of it; declared they are gone."""
    record, truth = _doublets(0.03)
    found, blind = (method(name)(r)["Cm_q"].estimate/truth["Cm_q"] for r in (record, _undeclared(record)))
    assert 0.04 < blind - found < 0.10
    assert abs(found - 1.0) < 0.05


def test_a_lagged_oscillation_is_advanced() -> None:
    """A vane behind the simulator's own lag, at the short period's frequency, comes back to 1 % of its amplitude."""
    time = np.arange(0.0, 20.0, DT)
    true = 0.05*np.sin(3.0*time)
    gain, read_, vane = 1.0 - np.exp(-DT/0.05), np.zeros(len(time)), 0.0
    for i, x in enumerate(true):
        vane += gain*(x - vane)
        read_[i] = vane
    lag = DT*(1.0 - gain)/gain
    record = FlightRecord({"time": time, "alpha": read_}, RecordMeta(sensors={"alpha": {"lag": lag}}))
    back = calibrated(record)
    inside = slice(100, -100)
    assert np.max(np.abs(read_ - true)[inside]) > 0.1*0.05
    assert np.max(np.abs(back["alpha"] - true)[inside]) < 0.01*0.05
    assert [p.channel for p in back.problems] == ["alpha"] and "as declared" in back.problems[0].kind
    assert calibrated(back) is back


def test_nothing_declared_nothing_done(flown: tuple) -> None:
    """The same record, not a copy."""
    silent = _undeclared(flown[0])
    assert calibrated(silent) is silent
    place = replace(silent, meta=replace(silent.meta, sensors={"alpha": {"position": [5.0, 0.0, 0.0]}, "note": "x"}))
    assert calibrated(place) is place


@pytest.mark.parametrize("lag", ["slow", -0.1, 3.0, True, float("nan")])
def test_a_lag_that_is_none_is_refused(lag: object) -> None:
    """One line that names the entry."""
    with pytest.raises(InputError, match=r"sensors\.beta\.lag"):
        calibration({"beta": {"lag": lag}})


def test_noise_in_a_regressor_is_put_back() -> None:
    """Least squares shrinks the noisy derivative by a tenth and bends its neighbour; compensated it does neither."""
    rng, n = np.random.default_rng(1), 4000
    true = np.column_stack([rng.standard_normal(n), np.ones(n)])
    true = np.column_stack([true[:, 0], true[:, 0] + rng.standard_normal(n), true[:, 1]])
    theta, noise = np.array([2.0, -1.0, 0.5]), np.array([0.06, 0.0, 0.0])
    noisy = true + rng.standard_normal(true.shape)*np.sqrt(noise)
    target = true @ theta + 0.1*rng.standard_normal(n)
    plain = least_squares(noisy, target, fade=True)
    better = compensated(plain, noisy, target, noise)
    assert abs(plain.theta[0] - 2.0) > 5.0*plain.std_error[0]
    assert np.all(np.abs(better.theta - theta) < 3.5*better.std_error)
    assert compensated(plain, noisy, target, np.zeros(3)) is plain


def test_zero_lift_drag_of_a_cambered_wing() -> None:
    """Six records at CL 0.5: 95 % intervals hold the truth in five or more; a parabola in CL misses it always."""
    held = []
    for seed in range(DEVELOPMENT, DEVELOPMENT + 6):
        record, truth = doublet_record(0.0, seed)
        found = method("stepwise")(record)["CD_0"]
        assert 0.03 < found.std_error/found.estimate < 0.3
        held.append(abs(found.estimate - truth["CD_0"]) < 1.96*found.std_error)
    assert sum(held) >= 5
