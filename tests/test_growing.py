"""Air that is denser with height, what rises unevenly and drag that grows are told as what they are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from generated import in_still_air
from hypothesis import given
from hypothesis import strategies as st
from test_lateness import flown
from test_likeness import terms

from icing_env import effects
from sim2real.diagnosis import diagnose
from sim2real.library.bends import bends, grows
from sim2real.library.candidates import bank
from sim2real.library.pushes import pushes
from sim2real.library.terms import AIR_SIZE, DEVIATION, Term
from sim2real.posterior.hypotheses import Hypothesis, is_home
from sim2real.posterior.sets import SetFit
from sim2real.prediction.predictor import Predictor
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import reconstruct
from sim2real.words import term_named
from testbed.withheld.flights import Aircraft


@given(lapse=st.floats(-3e-4, 3e-4), reference=st.floats(0.0, 4000.0), above=st.floats(-500.0, 500.0))
def test_density_grows_from_the_height_of_reference(lapse: float, reference: float, above: float):
    plain = reconstruct(flown()).parameters
    row = effects.with_effects(plain, {"discrepancy": {"density_height": lapse, "at_height": reference}})[0]
    factor = row["density_factor"] + row["density_lapse"] * (reference + above)
    assert factor == pytest.approx(plain[0]["density_factor"] + lapse * above, abs=1e-9)


def test_air_that_is_denser_pushes_as_the_plants_does():
    flight = reconstruct(flown())
    about = replace(flight, about={"height": float(flight.altitude[0]) - DEVIATION["height"]})  # one unit of it
    denser = flight.parameters.copy()
    denser["density_factor"] *= 1.0 + AIR_SIZE
    step, term = 5, (Term("wind", "height", "wind", 0),)
    reads = []
    for rows, pushed in ((flight.parameters, ()), (flight.parameters, pushes(about, term)), (denser, ())):
        plant = Predictor(flight, rows)
        plant.place(0)
        reads.append(plant.fly(step, pushes=pushed)[-1, 0])
    plain, pushed_so, so = reads
    for channel in ("az", "ax"):
        at = MEASURED.index(channel)
        assert pushed_so[at] - plain[at] == pytest.approx(so[at] - plain[at], rel=0.25)
    assert abs(so[MEASURED.index("az")] - plain[MEASURED.index("az")]) > 0.05


def test_drag_of_ice_that_grows_lies_along_the_air_stream():
    flight = reconstruct(flown())
    grown = effects.with_effects(flight.parameters, {"ice_drag": {"growth": 3.0}})
    constant = effects.with_effects(flight.parameters, {"ice_drag": {"delta_CD_0": 0.02}})
    reads = []
    for rows in (flight.parameters, grown, constant):
        plant = Predictor(flight, rows)
        plant.place(0)
        reads.append(plant.fly(1)[-1, 0])
    plain, so, known = reads
    assert so[MEASURED.index("ax")] < plain[MEASURED.index("ax")] - 0.02
    share = (so - plain)[MEASURED.index("ax")] / (known - plain)[MEASURED.index("ax")]
    np.testing.assert_allclose(so - plain, share * (known - plain), rtol=1e-3, atol=1e-9)


def test_generic_terms_that_grow_are_the_effect_on_the_air_that_makes_them():
    families = {f.effect.name: f for f in bank().families}
    height, drift = terms("wind", {"height": 3.0}), terms("sensor:altitude", {"time": 2.0, "1": 1.0})
    gathers = terms("wind", {"along*time": 3.0, "height": 0.1})
    raw = np.eye(bank().size)

    def home(name: str, unknown: object) -> bool:
        family = families[name]
        alone = Hypothesis(SetFit((family,), weights={family.rows[0]: 1.0}), None, 0.0, 0.0)
        return is_home(alone, unknown, 300.0, 12.0, raw)

    assert home("air_density", height) and home("updraft", drift)  # however little a constant says of it
    assert not home("air_density", drift) and not home("updraft", height) and not home("wind_shear", height)
    assert not home("air_density", gathers)
    assert grows(effects.get("air_density")) == bends(effects.get("air_density")) == {("wind", "height")}
    assert not grows(effects.get("wind_shear"))
    assert "density" in term_named("height") and term_named("alpha") == "alpha"


@pytest.mark.slow
@pytest.mark.parametrize(("name", "size"), [("air_density", 0.067), ("updraft", -1.3), ("ice_drag", 0.026)])
def test_what_grows_is_told_as_what_it_is(name: str, size: float, tmp_path: Path):
    """The generator's other forms: a lapse of density, a wave of 50 s, drag with the square of alpha."""
    best = diagnose(in_still_air(tmp_path, "diagnose", Aircraft(parts=((name, "other", size),)), 12)).hypotheses[0]
    assert (best["effects"], best["unknown"]) == ([name], False)
