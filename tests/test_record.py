"""Flight records in and out of files."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flights import META, flight_data, longitudinal
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.io import savemat

from estimators.signals.coefficients import dynamic_pressure
from icing_env.errors import InputError
from icing_env.record import COLUMNS, FlightRecord, RecordMeta, read, write
from icing_env.types import MEASUREMENT_FIELDS

CELL = st.one_of(st.just(float("nan")), st.floats(-0.9, 0.9, allow_subnormal=False))


def equal(a: FlightRecord, b: FlightRecord) -> bool:
    """Whether both hold the same columns and numbers."""
    return a.channels.keys() == b.channels.keys() and all(
        np.array_equal(a[name], b[name], equal_nan=True) for name in a.channels
    )


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
@settings(max_examples=20)
@given(data=st.data())
def test_what_is_written_is_read_back(
    tmp_path_factory: pytest.TempPathFactory, suffix: str, data: st.DataObject
) -> None:
    if suffix == ".parquet":
        pytest.importorskip("pyarrow")
    n = data.draw(st.integers(1, 30))
    names = data.draw(st.lists(st.sampled_from(["alpha", "q", "elevator", "beta", "lwc"]), unique=True))
    channels = {name: data.draw(arrays(np.float64, n, elements=CELL)) for name in names}
    record = FlightRecord({"time": np.cumsum(np.full(n, 0.1)), **channels}, replace(META, name="r", notes="a note"))
    path = tmp_path_factory.mktemp("record") / f"r{suffix}"
    write(record, path)
    back = read(path)
    assert equal(record, back)
    assert replace(back.meta, sha256="") == record.meta and len(back.meta.sha256) == 64


def test_side_file_carries_what_is_known(tmp_path: Path) -> None:
    meta = replace(META, flight="7", cg=(0.1, 0.0, -0.2), role="reference", sensors={"alpha": {"lag": 0.05}}, name="r")
    write(replace(longitudinal(), meta=meta), tmp_path / "r.csv")
    assert replace(read(tmp_path / "r.csv").meta, sha256="") == meta


def test_an_older_side_file_does_not_speak_for_a_new_record(tmp_path: Path) -> None:
    write(longitudinal(), tmp_path / "r.csv")
    write(replace(longitudinal(), meta=RecordMeta()), tmp_path / "r.csv")
    assert read(tmp_path / "r.csv").meta.mass is None


def test_writing_fails_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "r.csv"
    write(longitudinal(), path)
    before = path.read_bytes()
    full = lambda *a, **k: (_ for _ in ()).throw(OSError("disk full"))  # noqa: E731
    monkeypatch.setattr("icing_env.record.csv_file.csv.writer", full)
    with pytest.raises(OSError, match="disk full"):
        write(longitudinal(), path)
    assert path.read_bytes() == before and sorted(p.name for p in tmp_path.iterdir()) == ["r.csv", "r.toml"]


def test_slice_keeps_the_time_of_the_file() -> None:
    part = longitudinal().slice(102.0, 104.0)
    assert part.time[0] == pytest.approx(102.0) and part.time[-1] == pytest.approx(104.0)
    assert len(part) == 101 and part.dt == pytest.approx(0.02)


def test_a_record_is_checked_when_made() -> None:
    with pytest.raises(InputError, match="no column 'time'"):
        FlightRecord({"alpha": np.zeros(3)})
    with pytest.raises(InputError, match="did you mean 'elevator'"):
        FlightRecord({"time": np.arange(3.0), "elevater": np.zeros(3)})
    with pytest.raises(InputError, match="2 samples, time has 3"):
        FlightRecord({"time": np.arange(3.0), "q": np.zeros(2)})
    with pytest.raises(InputError, match=r"no column 'beta' \(rad\)"):
        longitudinal()["beta"]
    assert not longitudinal().has("beta")


def test_zero_thrust_is_absent(tmp_path: Path) -> None:
    record = longitudinal()
    zero = np.zeros(len(record))
    write(replace(record, channels={**record.channels, "thrust_left": zero, "thrust_right": zero}), tmp_path / "r.csv")
    back = read(tmp_path / "r.csv")
    assert not back.has("thrust_left") and {p.channel for p in back.problems} == {"thrust_left", "thrust_right"}


def test_parquet_without_pyarrow_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    (tmp_path / "r.parquet").write_bytes(b"PAR1")
    with pytest.raises(InputError, match="extra 'parquet'"):
        read(tmp_path / "r.parquet")


def test_recorded_flight_in_si() -> None:
    """Means and masses as the records' own table states them: 237.02 ft/s, 6223 ft, 56.3195 lbf/ft2, 339.339 slug."""
    record = read(flight_data("totter_f1_017_data.mat"))
    assert len(record) == 1001 and record.dt == pytest.approx(0.02) and record.time[0] == 54813.06
    assert np.mean(record["airspeed"]) == pytest.approx(237.02 * 0.3048, rel=1e-4)
    assert np.mean(record["altitude"]) == pytest.approx(6223 * 0.3048, rel=1e-4)
    assert np.mean(record["qbar"]) == pytest.approx(56.3195 * 47.880259, rel=1e-5)
    assert record["mass"][0] == pytest.approx(339.339 * 14.5939, rel=1e-5)
    assert record.meta.inertia == pytest.approx((28339, 32887, 52149, 1528), rel=1e-4)
    assert record.meta.geometry.wing_area == pytest.approx(39.25, rel=1e-4)
    assert np.degrees(record["rudder"]).max() == pytest.approx(3.14)
    assert record.has("thrust_left") and not record.has("flap") and "SHA-256 known" in record.meta.notes
    assert not record.problems


def test_owner_density_agrees_with_the_standard_atmosphere() -> None:
    record = read(flight_data("totter_f1_017_data.mat"))
    channels = dict(record.channels)
    assert np.mean(dynamic_pressure(channels)) == pytest.approx(np.mean(record["qbar"]), rel=0.02)


def bare_mat(path: Path, **changes: object) -> Path:
    """A made record in SIDPAC's form without thrust, density, Mach, heading or coefficients."""
    n = 300
    fdata = np.zeros((n, 90))
    fdata[:, 0] = np.arange(n) * 0.01
    for column, value in {2: 185.4, 4: 3.7, 9: 4.0, 11: 0.06, 13: -1.0, 14: -2.0, 30: 5636.0, 48: 323.03}.items():
        fdata[:, column - 1] = value + 0.01 * np.sin(np.arange(n) / 9.0)
    savemat(path, {"fdata": fdata, "sarea": 420.008, "bspan": 65.0, "cbar": 6.5, **changes})
    return path


def test_a_bare_mat_is_read_with_what_it_has(tmp_path: Path) -> None:
    record = read(bare_mat(tmp_path / "bare.mat", p5003=np.array([9750.0, 1.0])))
    assert record.dt == pytest.approx(0.01) and record.meta.geometry.wing_area == pytest.approx(420.008 * 0.3048**2)
    assert not any(record.has(n) for n in ("thrust_left", "psi", "beta", "density", "CX"))
    assert record.meta.inertia is None
    assert "mass disagrees" in record.meta.notes and "not among known" in record.meta.notes
    assert np.mean(dynamic_pressure(record.channels)) == pytest.approx(33.43 * 47.88, rel=0.05)


def test_mat_time_falls_back_and_bad_matrices_are_named(tmp_path: Path) -> None:
    record = read(bare_mat(tmp_path / "t.mat", fdata=np.ones((50, 90)), dt=0.02))
    assert record.dt == pytest.approx(0.02)
    for changes, message in (
        ({"fdata": np.ones((5, 3))}, r"\(5, 3\)"),
        ({"fdata": np.ones((50, 90))}, "there is no dt"),
        ({"fdata": "text"}, "matrix is N x 90"),
    ):
        with pytest.raises(InputError, match=message):
            read(bare_mat(tmp_path / "b.mat", **changes))
    savemat(tmp_path / "c.mat", {"other": 1.0})
    with pytest.raises(InputError, match=r"no matrix 'fdata'.*found: other"):
        read(tmp_path / "c.mat")
    (tmp_path / "d.mat").write_bytes(b"not matlab")
    with pytest.raises(InputError, match="not a MATLAB file"):
        read(tmp_path / "d.mat")


def test_everything_measured_has_a_column_in_the_same_unit() -> None:
    assert {name: COLUMNS.get(name) for name, _, _ in MEASUREMENT_FIELDS} == {n: u for n, u, _ in MEASUREMENT_FIELDS}


@pytest.mark.parametrize(("theirs", "ours"), [
    ("[sensors.alpha]\nposition = [5.6, 0.0, 0.0]\ncorrected_to_cg = true\n",
     {"alpha": {"position": [5.6, 0.0, 0.0], "corrected": True}}),
    ("[sensors.vanes]\nlag_s = 0.01\n[sensors.beta]\nlag = 0.02\n", {"alpha": {"lag": 0.01}, "beta": {"lag": 0.02}}),
    ("[sensors.accelerometer]\nposition_m = [0.1, 0.0, 0.2]\n", {"accelerometers": {"position": [0.1, 0.0, 0.2]}}),
    ("[sensors]\npitot = {lag = 0.08}\nrecorder = {frequency_hz = 10.0}\n",
     {"airspeed": {"lag": 0.08}, "filter": {"frequency": 10.0}}),
    ("[sensors]\nalpha = {lag = 0.0, filter_hz = 12.0}\naccelerometer = {filter_hz = 10.0}\nins = {latency = 0.02}\n"
     "gyros = {filter = {lag = 0.003}}\n",
     {"alpha": {"lag": 0.0}, "accelerometers": {}, "attitude": {"lag": 0.02},
      "filter": {"frequency": 10.0, "order": 2}}),
    ("[sensors]\nalpha = {filter_hz = 12.0}\nfilter = {cutoff_hz = 20.0}\n",
     {"alpha": {}, "filter": {"frequency": 20.0}}),
    ("[sensors]\nalpha = {filter_hz = 0.0}\nbeta = {filter_hz = 15.0}\n",
     {"alpha": {}, "beta": {}, "filter": {"frequency": 15.0, "order": 2}}),
])  # fmt: skip
def test_sensors_are_read_in_the_words_of_others_too(tmp_path, theirs, ours):
    """`corrected_to_cg` was passed over in silence, and what was corrected already corrected again."""
    (tmp_path / "a.csv").write_text("time,airspeed\n0.0,60.0\n0.02,60.0\n")
    (tmp_path / "a.toml").write_text(theirs)
    record = read(tmp_path / "a.csv")
    assert record.meta.sensors == ours and not record.problems


def test_what_is_not_read_of_sensors_is_told(tmp_path):
    (tmp_path / "a.csv").write_text("time,airspeed\n0.0,60.0\n0.02,60.0\n")
    (tmp_path / "a.toml").write_text("[sensors]\nalpha = {lag = 0.01, colour = 10.0}\ncompass = {lag = 0.02}\n")
    record = read(tmp_path / "a.csv")
    assert record.meta.sensors == {"alpha": {"lag": 0.01}}
    (told,) = record.problems
    assert (told.channel, told.repaired) == ("sensors", False)
    assert told.kind == "not read of the side file: sensors.alpha.colour, sensors.compass"


def test_sensors_that_are_no_table_are_refused(tmp_path):
    (tmp_path / "a.csv").write_text("time,airspeed\n0.0,60.0\n0.02,60.0\n")
    (tmp_path / "a.toml").write_text('sensors = "good"\n')
    with pytest.raises(InputError, match="sensors must be a table"):
        read(tmp_path / "a.csv")
