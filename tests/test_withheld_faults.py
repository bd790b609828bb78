"""Records with faults: drawn fairly, spoiled as said, and right only where named and nothing else is blamed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from testbed.withheld import draw, faults, generate, score

N, DT = 2001, 0.02
OTHERS = (*faults.SURFACES, *faults.ENGINES, *faults.LEVERS)
X = {name: np.sin(0.01 * np.arange(N)) + 2.0 for name in (*faults.EVERY, "altitude", *OTHERS)}


def test_every_kind_is_drawn_beside_the_set_and_the_set_stays_as_it_was():
    drawn = faults.fault_designs(2400, 1)
    assert len(drawn) == 60 and len(faults.fault_designs(150, 1)) == 24 and not faults.fault_designs(3, 1)
    assert {d.fault.kind for d in drawn} == set(faults.KINDS)
    assert {len(d.parts) for d in drawn} == {0, 1} and {d.tier for d in drawn} == {"faults"}
    assert len({d.fault.channel for d in drawn}) > 10
    assert faults.fault_designs(150, 1) == faults.fault_designs(150, 1) != faults.fault_designs(150, 2)
    assert len(draw.designs(150, 1)) == 150 and all(d.fault is None for d in draw.designs(150, 1))


@pytest.mark.parametrize("kind", sorted(kind for kind, where in faults.KINDS.items() if "alpha" in where))
def test_only_the_faulty_channel_is_touched_and_as_the_fault_says(kind):
    fault = draw.Fault(kind, "alpha", 5)
    found = faults.spoiled(X, fault, DT)
    assert all(np.array_equal(found[n], X[n]) for n in X if n != "alpha")
    if kind == "dropped":
        assert "alpha" not in found
        return
    x, true = found["alpha"], X["alpha"]
    assert not np.array_equal(x, true)
    known = np.isfinite(x)
    if kind in ("sign", "unit"):
        assert np.allclose(x / true, {"sign": -1.0, "unit": 180.0 / np.pi}[kind])
    elif kind == "stuck":
        still = np.flatnonzero(np.diff(x) == 0.0)
        assert faults.STUCK[0] < len(still) * DT < faults.STUCK[1] and np.ptp(still) == len(still) - 1
    elif kind == "skew":
        late = int(np.argmin([np.max(np.abs(x[100:] - np.roll(true, k)[100:])) for k in range(40)]))
        assert faults.SKEW[0] <= late * DT <= faults.SKEW[1]
    else:
        assert np.array_equal(x[known], true[known])
        share = {"blank": (0.0, 0.0), "slow": (0.15, 0.25), "dropouts": (0.5, 0.99)}[kind]
        assert share[0] <= known.mean() <= share[1]
        if kind == "slow":
            assert len(set(np.diff(np.flatnonzero(known)))) > 1  # at no constant rate


def test_what_formats_allow_is_in_the_records_of_a_case_and_nothing_else():
    late = faults.spoiled(X, draw.Fault("between", "commands", 5), DT)
    assert {n for n in X if not np.array_equal(late[n], X[n])} == set(faults.SURFACES)
    found, true = late["elevator_command"][5:-5], X["elevator_command"][5:-5]
    samples = float(np.median((true - found) / np.gradient(true)))
    assert faults.BETWEEN[0] < samples < faults.BETWEEN[1] and abs(samples) > 0.01
    for kind, gone in (("engines", faults.ENGINES), ("powerless", (*faults.ENGINES, *faults.LEVERS))):
        found = faults.spoiled(X, draw.Fault(kind, "engines", 5), DT)
        assert {n for n in X if not np.isfinite(found[n]).any()} == set(gone)
        assert all(np.array_equal(found[n], X[n]) for n in X if n not in gone)
    design = draw.Design("faults", (), 0, 1.0, 0.5, 1.3, 1.0, {}, 7, fault=draw.Fault("powerless", "engines", 3))
    header, first = generate.make_case("a", design, None)[0]["1.csv"].splitlines()[:2]
    row = dict(zip(header.split(","), first.split(","), strict=True))
    assert {n for n, cell in row.items() if cell == ""} == {*faults.ENGINES, *faults.LEVERS}


def test_files_of_a_faulty_case_hold_the_fault_and_the_key_tells_it():
    design = draw.Design("faults", (), 0, 1.0, 0.5, 1.3, 1.0, {}, 7, fault=draw.Fault("dropped", "beta", 3))
    texts, key = generate.make_case("a", design, None)
    assert "beta" not in texts["1.csv"].splitlines()[0].split(",")
    assert key["fault"]["channel"] == "beta" and "beta_bias" in key["fault"]["excused"]
    blank, _ = generate.make_case("a", replace(design, fault=draw.Fault("blank", "beta", 3)), None)
    header, first = blank["4.csv"].splitlines()[:2]
    assert first.split(",")[header.split(",").index("beta")] == "" and "nan" not in blank["4.csv"]


def key(kind: str, effects: list[str]) -> dict:
    return {"tier": "faults", "sigma_w": 0.0, "effects": effects, "forms": [], "D_none": 0.0, "D_pair": 0.0, "D": {},
            "where": [], "parameters": {},
            "fault": {"kind": kind, "channel": "q", "excused": ["pitch_gyro_bias"]}}  # fmt: skip


def answer(verdict: str, effects: list[str], *problems: tuple[str, str]) -> dict:
    return {"verdict": verdict, "hypotheses": [{"effects": effects, "unknown": verdict == "unknown", "probability": 1}],
            "credible_set_95": [0], "effects": [], "where": {}, "gap": {},
            "data_problems": [{"channel": c, "kind": k, "from": 0, "to": 1, "repaired": False} for c, k in problems]}


@pytest.mark.parametrize(("kind", "told", "right"), [
    ("sign", answer("no_gap", [], ("q", "sign reversed")), True),
    ("sign", answer("no_gap", [], ("p", "sign reversed")), False),
    ("sign", answer("no_gap", [], ("q", "sign and unit could not be checked from this record")), False),
    ("sign", answer("explained", ["cg_shift"], ("q", "sign reversed")), True),
    ("sign", answer("explained", ["pitch_gyro_bias"], ("q", "sign reversed")), True),
    ("sign", answer("explained", ["pitch_damping"], ("q", "sign reversed")), False),
    ("sign", answer("unknown", [], ("q", "sign reversed")), False),
    ("sign", {"error": "record 'a': q looks like deg/s"}, True),
    ("sign", {"error": "record 'a': quite unusable"}, False),
    ("slow", answer("no_gap", []), True), ("between", answer("no_gap", []), True),
    ("between", answer("explained", ["elevator_lag"]), False), ("powerless", answer("unknown", []), False),
    ("slow", {"error": "record 'a': q has too few samples"}, False),
])  # fmt: skip
def test_right_is_named_and_nothing_blamed(kind, told, right):
    found = score.by_tier([score.flat(told, key(kind, ["cg_shift"]))], [])["faults"]
    assert found["right"] == found["right_by_kind"][kind] == float(right)
