"""What `icing identify` puts into its report, and flights flown again with identified derivatives."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from flights import PITCH, flight_data, longitudinal
from test_cli import run

from estimators.estimate import Estimate
from estimators.methods import METHODS
from estimators.regression import equation_error
from icing_env.errors import InputError
from icing_env.record import read, write
from testbed.reports.flown_again import derivatives, explained, fly_again, published
from testbed.reports.identification_figures import autocorrelation


def test_a_flight_flown_again_with_its_own_derivatives_is_that_flight():
    record = longitudinal()
    (flown,) = [f for f in fly_again(record, equation_error.identify(record)) if f.axis == "longitudinal"]
    assert min(flown.r2[name] for name in ("alpha", "q", "az")) > 0.995
    assert np.allclose(flown.residual["q"], flown.measured["q"] - flown.simulated["q"])


def test_a_wrong_derivative_shows_in_the_flight_flown_again():
    record = longitudinal()
    right = equation_error.identify(record)
    wrong = {**right, "Cm_alpha": replace(right["Cm_alpha"], estimate=0.5*right["Cm_alpha"].estimate)}
    found = [next(f for f in fly_again(record, e) if f.axis == "longitudinal").r2["q"] for e in (right, wrong)]
    assert found[1] < found[0] - 0.05


def test_lift_becomes_body_force_where_only_lift_is_known():
    def of(value: float, seen: bool = True) -> Estimate:
        return Estimate(value, 0.1, "1/rad", "", None, seen)

    known = derivatives({"CL_alpha": of(6.0), "CL_elevator": of(0.5), "Cm_q": of(-30.0, seen=False)})
    assert known == {"CZ_alpha": pytest.approx(published()["CX_0"] - 6.0), "CZ_elevator": -0.5, "CZ_q": 0.0}


def test_a_flight_that_diverges_explains_nothing():
    with pytest.raises(InputError, match="diverges"):
        explained(np.zeros(3), np.array([0.0, np.inf, 0.0]))


def test_autocorrelation_is_that_of_a_known_process():
    rng, rho = np.random.default_rng(3), 0.9
    x = np.zeros(20000)
    for k in range(1, len(x)):
        x[k] = rho*x[k - 1] + rng.standard_normal()
    found = autocorrelation(x, 10)
    assert found[0] == 1.0 and found == pytest.approx(rho**np.arange(11), abs=0.04)
    white = autocorrelation(rng.standard_normal(20000), 50)[1:]
    assert np.mean(np.abs(white) < 1.96/np.sqrt(20000)) > 0.85


@pytest.mark.parametrize("name", METHODS)
def test_every_method_answers_the_command_line(name, capsys, tmp_path):
    write(longitudinal(seed=2), tmp_path / "pitch.csv")
    code, out, err = run(capsys, "identify", tmp_path / "pitch.csv", "--method", name, "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)["derivatives"]
    assert {"estimate", "std_error", "unit", "method"} <= set(found["Cm_alpha"])
    assert found["Cm_alpha"]["estimate"] == pytest.approx(PITCH["Cm_alpha"], rel=0.15)


@pytest.mark.parametrize("options, says", [
    (("--method", "hinf", "--mode", "textbook"), "stepwise"),
    (("--method", "stepwise", "--start", "0.5"), "leave it out"),
])  # fmt: skip
def test_options_that_do_not_go_together_are_refused(options, says, capsys, tmp_path):
    write(longitudinal(), tmp_path / "pitch.csv")
    code, out, err = run(capsys, "identify", tmp_path / "pitch.csv", *options)
    assert (code, out) == (2, "") and len(err.splitlines()) == 1 and says in err


@pytest.mark.slow
def test_the_report_stands_alone_and_tells_everything(capsys, tmp_path):
    write(longitudinal(seed=2), tmp_path / "pitch.csv")
    code, out, _ = run(capsys, "identify", tmp_path / "pitch.csv", "--compatible", "kinematic", "--out", tmp_path / "r",
                       "--json")
    page = (tmp_path / "r" / "identify.html").read_text()
    assert code == 0 and json.loads(out)["report"].endswith("identify.html")
    assert list((tmp_path / "r").iterdir()) == [tmp_path / "r" / "identify.html"]  # no part is left behind
    assert not re.findall(r"(?:src|href)=\"(?!data:|#)", page)
    for text in ("Cm_elevator", "1/deg", "95 % from", "autocorrelation", "PSE",
                 "Data compatibility", *METHODS):
        assert text in page, text


def test_a_recorded_flight_predicts_another():
    source, target = read(flight_data("totter_demo_data.mat")), read(flight_data("totter_pred_data.mat"))
    (flown,) = [f for f in fly_again(target, equation_error.identify(source)) if f.axis == "longitudinal"]
    assert flown.r2["q"] > 0.99 and flown.r2["alpha"] > 0.97 and flown.r2["az"] > 0.98
