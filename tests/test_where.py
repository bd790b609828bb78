"""Stretches of flight are named where the energy is, and hardly ever where there is only noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from icing_env import scenario
from sim2real.library.candidates import bank
from sim2real.records.channels import MEASURED
from sim2real.records.reconstruct import reconstruct
from sim2real.signatures.evidence import Evidence, gather
from sim2real.where import REGIME_VARIABLES, regimes, stretches
from testbed.flight import fly


@pytest.fixture(scope="module")
def evidence() -> Evidence:
    chosen = scenario.load("clear_air", duration=60.0, parameters={"turbulence_sigma_w": 0.5})
    flight = reconstruct(fly(chosen, seed=4, observer=False, protection=False).record)
    return gather(flight, replace(bank(), families=(), terms=(), nuisances=(), size=1))


def white(evidence: Evidence, seed: int, level: float = 1.0) -> np.ndarray:
    """Whitened innovations of a model that lacks nothing, the noise's size misjudged by `level`."""
    noise = np.random.default_rng(seed).standard_normal(evidence.whitened.shape)
    return level * noise * (evidence.whitened != 0.0)


def test_noise_alone_names_hardly_any_stretch(evidence):
    found = [regimes([replace(evidence, whitened=white(evidence, s, 1.03)),
                      replace(evidence, whitened=white(evidence, 100 + s, 0.98))]) for s in range(40)]
    assert sum(bool(f) for f in found) <= 2


@pytest.mark.parametrize("variable", ["q", "airspeed"])
def test_energy_in_one_stretch_is_named_there(evidence, variable):
    assert variable in REGIME_VARIABLES
    noise, values = white(evidence, 7), evidence.flight.channel(variable)[1:]
    high = values > np.quantile(values, 0.7)
    noise[high] *= 1.6
    found = [r for r in regimes([replace(evidence, whitened=noise)]) if r["variable"] == variable]
    assert found and found[0]["high"] == pytest.approx(max(values), abs=0.5 * np.ptp(values))
    assert found[0]["excess"] > 0.5


def test_a_channel_is_named_where_it_alone_errs(evidence):
    noise, values = white(evidence, 9), evidence.flight.channel("alpha")[1:]
    noise[values > np.quantile(values, 0.75), MEASURED.index("az")] *= 2.0
    found = [r for r in regimes([replace(evidence, whitened=noise)]) if r["variable"] == "alpha" and r["channels"]]
    assert [set(r["channels"]) for r in found] == [{"az"}]
    assert found[0]["channels"]["az"] == pytest.approx(3.0, abs=1.0)


def test_too_short_a_record_has_no_stretches(evidence):
    short = replace(evidence, whitened=white(evidence, 1)[:300])
    assert regimes([short]) == [] == stretches([short])
