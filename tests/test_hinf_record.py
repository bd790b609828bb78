"""The H-infinity identifier on recorded flights, against equation error with matched filters."""

from __future__ import annotations

import pytest
from flights import flight_data

from estimators.hinf import record as hinf_record
from estimators.regression.equation_error import identify as equation_error
from icing_env.errors import InputError
from icing_env.record import read

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
