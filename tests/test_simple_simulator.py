"""Records as a simple simulator of another house would make them, built on the same published derivatives.

Its plant is the benchmark's own. Where published facts are silent it has other numbers than our aircraft file: servos,
the height of the thrust line; its slipstream does nothing, its derivatives are quasi-steady; it writes thrust and no
torque, and the gusts meet all of the aircraft at once. Nothing of that is a gap.
"""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from testbed.benchmarks.diagnosis import solve
from testbed.withheld import draw, files, generate

OWN = {"Cm_alphadot": 0.0, "engine_arm_z": 0.0, "CZ_CT": 0.0, "Cm_elevator_CT": 0.0,
       **{f"{s}_lag": 2.0 for s in ("elevator", "aileron", "rudder")}}
UNWRITTEN = ("torque", "rpm")


def case(folder: Path, sigma: float, gusts: str, seed: int, parts: tuple = ()) -> Path:
    """A folder of records, as it would come from there."""
    rng = np.random.default_rng([77, seed])
    usual = draw.Design("null", parts, *draw.conditions(sigma, rng), draw.published_spread(rng),
                        int(rng.integers(2**60)))  # fmt: skip
    (drawn,) = draw.Population(calibrated=True).placed([usual], seed)
    aircraft = replace(drawn, parts=parts, baseline=drawn.baseline | OWN, gusts=gusts)
    texts, _ = generate.make_case("simple", aircraft, None)
    files.write_case(folder, {name: _as_there(name, text) for name, text in texts.items()})
    return folder


def _as_there(name: str, text: str) -> str:
    if name.endswith(".toml"):
        return text.replace('[sensors.thrust]\nsource = "measured"\n', "")
    rows = list(csv.reader(text.splitlines()))
    kept = [i for i, title in enumerate(rows[0]) if not title.startswith(UNWRITTEN)]
    return "".join(",".join(row[i] for i in kept) + "\n" for row in rows)


# Its rudder has 10.5 % less of the yawing moment than published, its drag 9 % more of a slope: beside a thrust line and
# a slipstream of nothing, thin air makes these likelier by 5.6 of log evidence (probabilities 0.39 and 0.38)
UNLUCKY = pytest.param(1.5, "later", 2, marks=pytest.mark.xfail(strict=True, reason="numbers off by 2 deviations"))


@pytest.mark.slow
@pytest.mark.parametrize(("sigma", "gusts", "seed"), [
    (0.0, "later", 0), (0.5, "at_once", 3), UNLUCKY, (1.5, "later", 20), (1.5, "at_once", 4), (0.5, "rolling", 5),
    (0.5, "turning", 6)])  # fmt: skip
def test_its_clean_aircraft_has_no_gap(tmp_path, sigma, gusts, seed):
    found = solve(case(tmp_path / "case", sigma, gusts, seed))
    assert found["verdict"] == "no_gap", found["hypotheses"][:3]


@pytest.mark.slow
@pytest.mark.parametrize(("effect", "size"), [("elevator_power", -0.25), ("aileron_gearing", -0.2)])
def test_an_effect_of_it_is_told_alone(tmp_path, effect, size):
    found = solve(case(tmp_path / "case", 0.5, "at_once", 7, ((effect, "same", size),)))
    assert found["hypotheses"][0]["effects"] == [effect], found["hypotheses"][:3]
