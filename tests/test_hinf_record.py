"""The H-infinity identifier on recorded flights, against equation error with matched filters."""

from __future__ import annotations

import numpy as np
import pytest
from flights import flight_data

from estimators.hinf import record as hinf_record
from estimators.hinf.tuning import default_tuning
from estimators.observer.record import STARTS
from estimators.regression.equation_error import identify as equation_error
from icing_env import scenario
from icing_env.errors import InputError
from icing_env.record import FlightRecord, read
from testbed.flight import fly

BY_FIVE_PERCENT = ("Cm_alpha", "Cm_q", "Cm_elevator", "CL_alpha", "Cl_beta", "Cl_p", "Cl_aileron",
                   "Cn_beta", "Cn_r", "Cn_rudder")  # fmt: skip


@pytest.mark.parametrize("start", [0.4, 1.6])
@pytest.mark.parametrize("name", ["totter_demo_data", "totter_pred_data", "totter_f1_017_data"])
def test_recorded_flights_agree_with_equation_error(name: str, start: float) -> None:
    record = read(flight_data(f"{name}.mat"))
    reference, found = equation_error(record, "matched"), hinf_record.identify(record, start=start)
    compared = 0
    for derivative, estimate in found.items():
        other = reference.get(derivative)
        if not estimate.identifiable or other is None or not other.identifiable:
            assert estimate.identifiable or estimate.why
            continue
        difference, compared = abs(estimate.estimate - other.estimate), compared + 1
        limit = 0.05 * abs(other.estimate) if derivative in BY_FIVE_PERCENT else 2.0 * other.std_error
        assert difference < limit, (derivative, estimate, other)
    assert compared >= 7


def test_history_starts_where_it_was_told() -> None:
    record = read(flight_data("totter_demo_data.mat"))
    history = hinf_record.history(record, start=0.4)
    values, deviations = history.parameter("Cm_alpha")
    assert values[0] == pytest.approx(0.4 * -1.31) and len(values) == len(record)
    assert deviations[-1] < 0.2 * deviations[0]
    with pytest.raises(InputError, match="Cm_alfa"):
        history.parameter("Cm_alfa")


def test_seven_starts_end_together() -> None:
    """The paper's Figs. 23-26 on a recorded flight: what is left of the spread of the starts."""
    runs = hinf_record.histories(read(flight_data("totter_demo_data.mat")))
    assert len(runs) == len(STARTS) == 7
    for name in ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_elevator"):
        values = np.array([run.parameter(name)[0] for run in runs])
        assert np.ptp(values[:, 0]) > 1.1 * abs(np.mean(values[:, 0]))
        assert np.ptp(values[:, -1]) < 0.03 * np.ptp(values[:, 0]), name


def doublets(seed: int, airspeed: float, **changes: float) -> FlightRecord:
    flown = scenario.load("clear_air", duration=36.0, initial={"airspeed": airspeed}, ice_protection="off",
                          parameters=changes,
                          events=({"time": 10.0, "name": "doublets", "doublets": True},))  # fmt: skip
    return fly(flown, seed=seed, windows=[(5.0, 36.0)]).record


def test_lift_needs_accelerations() -> None:
    """A gust enters alphadot as if it were a force; without accelerometers CL_alpha falls, the more the slower."""
    lost = {}
    for airspeed in (72.0, 52.0):
        record = doublets(1, airspeed)
        reference = equation_error(record)["CL_alpha"].estimate
        with_them, without = (hinf_record.identify(record, accelerations=a) for a in (True, False))
        assert with_them["CL_alpha"].estimate == pytest.approx(reference, rel=0.04)
        assert without["CL_alpha"].std_error > 5.0 * with_them["CL_alpha"].std_error
        assert without["Cm_alpha"] == with_them["Cm_alpha"]  # moments do not hear the accelerometers
        lost[airspeed] = 1.0 - without["CL_alpha"].estimate / reference
    assert lost[72.0] > 0.15 and lost[52.0] > lost[72.0], lost


def test_no_convergence_is_refused_and_told() -> None:
    """An observer too sluggish for the manoeuvre ends where it started: that is no estimate."""
    record, tuning = read(flight_data("totter_demo_data.mat")), default_tuning()
    for name in ("d", "n", "accelerometer"):
        tuning[name][0, 1] *= 300.0
    found = hinf_record.identify(record, tuning)
    assert not found["CL_alpha"].identifiable and "no convergence: from 0.4 and 1.6" in found["CL_alpha"].why
    assert found["Cm_alpha"].identifiable


def test_turbulence_is_told() -> None:
    """Gusts at the tail bias the moments beyond their standard errors: the estimate says that it may be so."""
    calm, rough = (hinf_record.identify(doublets(2, 72.0, turbulence_sigma_w=s)) for s in (0.0, 2.0))
    assert not calm["Cm_q"].warning and "turbulence of about" in rough["Cm_q"].warning
