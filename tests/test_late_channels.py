"""A channel that comes late against what makes it is named; vanes and compasses may lag by themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimators.signals.data_checks import check
from icing_env.errors import InputError
from icing_env.record import FlightRecord, read
from sim2real.records.reconstruct import reconstruct
from testbed.withheld import files, flights, manoeuvres
from testbed.withheld.conditions import Conditions


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> FlightRecord:
    """Doublets and 3-2-1-1 in all axes at 72 m/s in light gusts."""
    rng = np.random.default_rng(4)
    flown, seen = flights.recorded(flights.Aircraft(), manoeuvres.PLANS[0][1], 1.0, Conditions(0.5, 1.0, 1.0), rng)
    path = tmp_path_factory.mktemp("sound") / "1.csv"
    path.write_text(files.record_text(seen, flown.commands))
    return read(path)


def late(record: FlightRecord, name: str, seconds: float) -> FlightRecord:
    """The record with one channel shifted."""
    k = round(seconds / record.dt)
    values = record[name]
    return replace(record, channels={**record.channels, name: np.concatenate([np.full(k, values[0]), values[:-k]])})


@pytest.mark.parametrize("name", ["p", "q", "r", "phi", "theta", "az", "ay"])
def test_a_late_channel_is_refused_by_name(sound, name):
    with pytest.raises(InputError, match=f"column '{name}' is 0.[34]. s late"):
        check(late(sound, name, 0.4))


@pytest.mark.parametrize(("name", "seconds"), [("alpha", 0.2), ("beta", 0.2), ("psi", 0.4), ("q", 0.04), ("az", 0.06)])
def test_lags_of_sound_instruments_pass(sound, name, seconds):
    check(late(sound, name, seconds))


def test_what_a_lateral_diagnosis_lacks_is_said(sound):
    without = replace(sound, channels={n: v for n, v in sound.channels.items() if n != "r"})
    assert [p.kind for p in reconstruct(without).record.problems if p.channel == "r"] == [
        "not recorded: a lateral diagnosis lacks it"]  # fmt: skip
    longitudinal = {n: v for n, v in sound.channels.items() if n not in ("beta", "p", "r", "ay", "aileron", "rudder")}
    kinds = [p.kind for p in reconstruct(replace(sound, channels=longitudinal)).record.problems]
    assert not [kind for kind in kinds if kind.startswith("not recorded")]
