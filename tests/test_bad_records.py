"""Bad records: each fault is named in one line, or mended and reported."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from flights import PITCH, flight_data, lateral, longitudinal, with_channel
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.regression.equation_error import identify
from estimators.signals.data_checks import check
from icing_env.errors import InputError
from icing_env.record import FlightRecord, read, write


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file is empty"),
        ("\n\n", "the file is empty"),
        ("time,alpha\n", "no rows below the header"),
        ("alpha,q\n1,2\n", "column 'time' .* is missing"),
        ("time,alfa\n0,0\n", "unknown column 'alfa'; did you mean 'alpha'"),
        ("time,q,q\n0,0,0\n", "'q' stands twice"),
        ("time,alpha\n0,0.1\n0.02,abc\n", "row 3, column 'alpha': 'abc' is not a number"),
        ("time,alpha\n0,0.1\n0.02,inf\n", "row 3, column 'alpha' is infinite"),
        ("time,alpha\n0,0.1\n,0.1\n", "row 3, column 'time' is blank"),
        ("time,alpha\n0,0.1\n0.02,0.1\n0.02,0.1\n", "row 4, column 'time' does not increase: 0.02 after 0.02"),
        ("time,alpha\n0,0.1\n0.02\n", "the last line is cut off: row 3 has 1 cells, the header has 2"),
        ("time,alpha\n0\n0.02,0.1\n", "row 2 has 1 cells, the header has 2"),
        ("time,alpha\n0,5.2\n0.02,-1\n", "column 'alpha' looks like degrees: largest 5.2; rad is required"),
        ("time,elevator\n0,-6.98\n0.02,1.8\n", "column 'elevator' looks like degrees: largest 6.98"),
        ('time,alpha\n0,"0.1\n', "not a CSV file"),
    ],
)
def test_csv_faults_are_named(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read(path)
    assert "\n" not in str(caught.value) and str(path) in str(caught.value)


def test_files_that_are_no_records(tmp_path: Path) -> None:
    (tmp_path / "latin.csv").write_bytes("time,alpha\n0,0.1 \xb0\n".encode("latin-1"))
    with pytest.raises(InputError, match="not UTF-8"):
        read(tmp_path / "latin.csv")
    with pytest.raises(InputError, match="no such file"):
        read(tmp_path / "absent.csv")
    with pytest.raises(InputError, match=r"'\.pkl' is no flight record"):
        read(tmp_path / "r.pkl")
    with pytest.raises(InputError, match=r"cannot write '\.mat'"):
        write(longitudinal(), tmp_path / "r.mat")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mas = 4900", "unknown key 'mas'; did you mean 'mass'"),
        ("mass = -1", "mass must be a positive number"),
        ("inertia = {xx = 1.0}", "inertia must give a number for each of inertia = {xx, yy, zz, xz}"),
        ("inertia = {xx = 1.0, yx = 2.0}", "unknown key 'inertia.yx'"),
        ("cg = [1.0, 2.0]", r"cg must be \[x, y, z\]"),
        ("role = 'test'", "role 'test' is unknown; valid are: diagnose, held_out, reference"),
        ("mass = ", "not valid TOML"),
    ],
)
def test_side_file_faults_are_named(tmp_path: Path, text: str, message: str) -> None:
    write(longitudinal(), tmp_path / "r.csv")
    (tmp_path / "r.toml").write_text(text)
    with pytest.raises(InputError, match=message):
        read(tmp_path / "r.csv")


@settings(max_examples=60)
@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused_in_one_line(tmp_path_factory: pytest.TempPathFactory, raw: bytes) -> None:
    folder = tmp_path_factory.mktemp("bytes")
    for suffix in (".csv", ".mat"):
        path = folder / f"r{suffix}"
        path.write_bytes(b"time,alpha\n" + raw if suffix == ".csv" else raw)
        try:
            read(path)
        except InputError as error:
            assert len(str(error).splitlines()) == 1


def test_clean_records_have_no_problems() -> None:
    for seed in range(5):
        for record in (longitudinal(seed), lateral(seed)):  # made with engines and airspeed that do stand still
            assert all(p.kind.endswith("kept: held still, or a dead sensor") for p in check(record).problems)
    for name in ("totter_demo_data.mat", "totter_pred_data.mat", "totter_f1_017_data.mat"):
        assert check(read(flight_data(name))).problems == ()


@settings(max_examples=25)
@given(st.sampled_from(["alpha", "q", "theta", "az"]), st.integers(5, 590), st.sampled_from([-1.0, 1.0]))
def test_a_spike_is_found_and_mended(name: str, row: int, sign: float) -> None:
    record = longitudinal(1)
    values = record[name].copy()
    values[row] += sign * {"az": 20.0}.get(name, 0.5)
    mended = check(with_channel(record, name, values))
    assert [(p.channel, p.start, p.repaired) for p in mended.problems if "spike" in p.kind] == [
        (name, record.time[row], True)
    ]
    assert identify(mended)["Cm_alpha"].estimate == pytest.approx(PITCH["Cm_alpha"], rel=0.03)


@settings(max_examples=25)
@given(st.sampled_from(["alpha", "q", "az"]), st.integers(20, 400), st.integers(15, 60))
def test_a_gap_is_left_out_and_said(name: str, first: int, length: int) -> None:
    record = longitudinal(2)
    values = record[name].copy()
    values[first : first + length] = np.nan
    worn = check(with_channel(record, name, values))
    assert {p.kind for p in worn.problems if p.channel == name} >= {"gap, left out"}
    assert identify(worn)["Cm_alpha"].estimate == pytest.approx(PITCH["Cm_alpha"], rel=0.05)


def test_lost_samples_are_put_on_a_grid() -> None:
    record = longitudinal(3)
    keep = np.ones(len(record), dtype=bool)
    keep[np.random.default_rng(0).integers(10, 590, 40)] = False
    keep[300:340] = False
    worn = check(record.take(keep))
    assert any(p.channel == "time" and "irregular" in p.kind for p in worn.problems)
    assert identify(worn)["Cm_alpha"].estimate == pytest.approx(PITCH["Cm_alpha"], rel=0.05)


def test_repeated_instants_are_dropped_and_backward_time_refused() -> None:
    record = longitudinal(4)
    rows = np.sort(np.concatenate([np.arange(len(record)), [50, 51, 52]]))
    mended = check(record.take(rows))
    assert len(mended) == len(record) and mended.problems[0].kind == "3 instants repeated, dropped"
    with pytest.raises(InputError, match="runs backwards at 100 s"):
        check(record.take(np.concatenate([np.arange(100), np.arange(100)])))


def test_a_dead_channel_is_set_aside_and_missed_where_it_is_needed() -> None:
    record = longitudinal(5)
    dead = check(with_channel(record, "theta", np.full(len(record), 0.1)))
    assert dead.problems[0].kind == "constant at 0.1, set aside" and not dead.has("theta")
    assert identify(dead)["Cm_alpha"].identifiable
    with pytest.raises(InputError, match="longitudinal needs alpha"):
        identify(with_channel(record, "alpha", np.full(len(record), 0.1)))


def test_a_frozen_stretch_is_left_out() -> None:
    record = longitudinal(6)
    values = record["alpha"].copy()
    values[70:140] = values[70]
    worn = check(with_channel(record, "alpha", values))
    assert any(p.kind == "frozen, left out" and p.channel == "alpha" for p in worn.problems)
    assert identify(worn)["Cm_alpha"].estimate == pytest.approx(PITCH["Cm_alpha"], rel=0.05)


def test_too_short_is_refused() -> None:
    with pytest.raises(InputError, match=r"has 3 samples over 0.04 s; at least 20 over 1 s"):
        identify(longitudinal().take(slice(0, 3)))
    with pytest.raises(InputError, match="0 samples"):
        check(longitudinal().take(slice(0, 0)))


FAULTS = ("constant", "gap", "spike", "reversed", "unit", "few", "nan run", "repeated", "frozen", "all missing")


sound = cache(longitudinal)


def spoil(record: FlightRecord, fault: str, name: str, rng: np.random.Generator) -> FlightRecord:
    """`record` with one fault in one channel, at a place drawn."""
    values, at = record[name].copy(), int(rng.integers(50, 400))
    if fault == "few":
        return record.take(slice(at, at + 3))
    if fault == "repeated":
        return record.take(np.sort(np.append(np.arange(len(record)), [at, at + 1])))
    if fault == "constant":
        values[:] = values[0]
    elif fault in ("gap", "nan run"):
        values[at : at + (60 if fault == "gap" else 4)] = np.nan
    elif fault == "spike":
        values[at] += {"az": 25.0}.get(name, 0.6)
    elif fault == "frozen":
        values[60:140] = values[60]
    elif fault == "all missing":
        values[:] = np.nan
    else:
        values *= -1.0 if fault == "reversed" else {"az": 3.2808}.get(name, 57.29578)
    return with_channel(record, name, values)


@settings(max_examples=60)
@given(st.sampled_from(FAULTS), st.sampled_from(["alpha", "q", "theta", "az"]), st.integers(0, 10_000))
def test_every_fault_is_named_or_refused_and_never_passes_unseen(fault: str, name: str, seed: int) -> None:
    record = spoil(sound(seed % 3), fault, name, np.random.default_rng(seed))
    try:
        mended = check(record)
    except InputError as error:
        assert len(str(error).splitlines()) == 1
        named = (f"'{name}'" in str(error), fault == "few" and "3 samples" in str(error), name in str(error))
        assert any(named) and fault not in ("spike", "gap", "nan run", "repeated", "frozen")
        return
    if fault == "all missing":
        assert not mended.has(name)
        return
    assert fault not in ("few", "reversed", "unit")
    channel = "time" if fault == "repeated" else name
    told = [p for p in mended.problems if p.channel == channel and p.repaired]
    assert told, fault
    found = identify(mended) if mended.has("alpha") and mended.has("q") and mended.has("az") else {}
    if found:
        assert found["Cm_alpha"].estimate == pytest.approx(PITCH["Cm_alpha"], rel=0.08)
