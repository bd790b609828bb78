"""What a diagnosis cannot name, described by the terms it has, and flown."""

import pytest
from described import GUST, record

from icing_env.effects import parse
from sim2real.closing import gap
from sim2real.closing.remedy import Remedy
from sim2real.diagnosis import diagnose
from sim2real.prediction.gusts import Gusts

# Pitching moment, as no effect has it, about the trimmed angle: about 0.08 rad most of it is trim, and is called so.
BENT = {"Cm_alpha_elevator": 16.0, "Cm_alpha_alpha": 6.0, "at_alpha": 0.055}


@pytest.fixture(scope="module")
def unknown():
    return diagnose([record(BENT, 3)], [record(BENT, 13)])


def test_an_unknown_is_described_by_the_terms_it_has(unknown):
    assert unknown.verdict == "unknown"
    assert unknown.unknown["component"] == "pitching_moment"
    assert unknown.unknown["kind"] == "static"
    found = {t["term"]: t for t in unknown.unknown["terms"]}
    for term, size in (("alpha*elevator", 16.0), ("alpha*alpha", 6.0)):
        assert abs(found[term]["coefficient"] - size) < 3.0 * found[term]["std_error"] < size
    assert "time" not in found and "airspeed" not in found  # what is not there does not earn a place


def test_an_unknown_closes_the_gap_as_knowing_it_does(unknown):
    """Both over the gusts that were flown: over stronger ones, knowing it leaves less than they make."""
    held, flight = unknown.gap["held_out"], unknown.details.held_out[0]
    found, known = (gap.held_out(gap.energies(flight, change, Gusts(GUST), 1), 0)
                    for change in (unknown.details.change, Remedy({"discrepancy": BENT})))  # fmt: skip
    assert found["closure"] > 0.9 * known["closure"] > 0.9 * 0.7
    assert held["closure_low95"] <= held["closure"] <= held["closure_high95"] and held["closure"] > 0.7


def test_the_command_flies_the_aircraft_that_was_diagnosed(unknown):
    own, terms = unknown.resimulate["command"].split(" --effect ")[1:]
    assert parse(own)[1] == pytest.approx(unknown.details.change.values["derivatives"], rel=1e-5)
    name, values = parse(terms)
    assert name == "discrepancy"
    assert values == pytest.approx(unknown.details.change.values["discrepancy"], rel=1e-5)
    assert len(unknown.resimulate["parameter_covariance"]) == len(unknown.unknown["terms"])


# A moment that bends, with and without a change of trim: the effect of that name in another form, and none that is.
BENDS = {"Cm_alpha_elevator": 8.0, "Cm_alpha_alpha": 3.0, "at_alpha": 0.08}
MOSTLY_TRIM = {"Cm_0": 0.03, **BENDS, "at_alpha": 0.055}  # the trimmed angle: from another, elevators are others too


@pytest.mark.slow
def test_the_form_of_a_known_effect_is_flown_with_it():
    found = diagnose([record(MOSTLY_TRIM, 3)], [record(MOSTLY_TRIM, 13)])
    assert found.verdict == "explained" and found.unknown is None
    assert found.hypotheses[0]["effects"] == ["pitch_trim"]
    form = next(e for e in found.effects if e["name"] == "pitch_trim")["other_form"]
    terms = {t["term"]: t for t in form["terms"]}
    assert form["component"] == "pitching_moment"
    for term, size in (("alpha*elevator", 8.0), ("alpha*alpha", 3.0)):
        assert abs(terms[term]["coefficient"] - size) < 3.0 * terms[term]["std_error"] < size
    assert list(found.details.change.values) == ["derivatives", "pitch_trim", "discrepancy"]
    # counted from the trimmed angle the form changes no derivative
    assert found.resimulate["model"]["Cm_alpha"]["change"] == pytest.approx(0.0, abs=0.05)
    assert found.gap["held_out"]["closure"] > 0.7


@pytest.mark.slow
def test_a_form_that_goes_with_speed_is_no_size_that_changes():
    """Derivatives at the component are among the form's terms: moved beside these, they would count twice."""
    grows = {"Cl_0": 0.006, "Cl_airspeed": 2e-4, "Cl_beta": -0.03, "at_airspeed": 75.0}
    found = diagnose([record(grows, seed) for seed in (3, 4)])
    entry = next(e for e in found.effects if e["name"] == "roll_trim")
    assert "airspeed" in {t["term"] for t in entry["other_form"]["terms"]}
    assert (entry["scope"], entry["sizes"]) == ("shared", None)


@pytest.mark.slow
def test_what_an_effect_says_little_of_is_not_its_other_form():
    """Beside the model's own numbers a change of trim takes a fifth of it, though both are a pitching moment."""
    found = diagnose([record(BENDS, 3)])
    assert found.verdict == "unknown" and found.unknown["component"] == "pitching_moment"
    assert {"alpha*elevator", "alpha*alpha"} <= {t["term"] for t in found.unknown["terms"]}
