"""A channel that comes late against what makes it is named; compasses may lag by themselves, and both vanes alike."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from estimators.signals.data_checks import check
from icing_env.errors import InputError
from icing_env.record import FlightRecord, read
from sim2real.records.reconstruct import reconstruct
from testbed.withheld import files, flights, manoeuvres
from testbed.withheld.conditions import Conditions


@cache
def flown(sigma: float, plan: int = 1) -> FlightRecord:
    """Doublets and 3-2-1-1 in all axes at 72 m/s, or another plan."""
    rng = np.random.default_rng(4)
    aircraft, seen = flights.recorded(flights.Aircraft(), manoeuvres.PLANS[0][plan], 1.0,
                                      Conditions(sigma, 1.0, 1.0), rng)  # fmt: skip
    with TemporaryDirectory() as folder:
        path = Path(folder) / "1.csv"
        path.write_text(files.record_text(seen, aircraft.commands))
        return read(path)


@pytest.fixture(scope="module")
def sound() -> FlightRecord:
    """In light gusts."""
    return flown(0.5)


def late(record: FlightRecord, seconds: float, *names: str) -> FlightRecord:
    """The record with some channels shifted."""
    k = round(seconds / record.dt)
    moved = {name: np.concatenate([np.full(k, record[name][0]), record[name][:-k]]) for name in names}
    return replace(record, channels={**record.channels, **moved})


@pytest.mark.parametrize("name", ["p", "q", "r", "phi", "theta", "az", "ay", "alpha", "beta", "elevator", "aileron",
                                  "rudder"])  # fmt: skip
@pytest.mark.parametrize("sigma", [0.0, 0.5, 1.5])
def test_a_late_channel_is_refused_by_name(sigma, name):
    with pytest.raises(InputError, match=f"column '{name}' is 0.[34]. s late"):
        check(late(flown(sigma), 0.4, name))


@pytest.mark.parametrize(("name", "plan"), [("airspeed", 0), ("ax", 0), ("ax", 1)])
def test_a_late_airspeed_or_axial_force_is_refused_in_still_air(name, plan):
    with pytest.raises(InputError, match=f"column '{name}' is 0.[345]. s late"):
        check(late(flown(0.0, plan), 0.4, name))


@pytest.mark.parametrize(("seconds", "names"), [(0.2, ("alpha", "beta")), (0.4, ("psi",)), (0.04, ("q",)),
                                                (0.06, ("az",)), (0.1, ("alpha",)), (0.06, ("elevator",)),
                                                (0.06, ("ax",)), (0.1, ("airspeed",))])  # fmt: skip
@pytest.mark.parametrize("sigma", [0.0, 0.5, 1.5])
def test_lags_of_sound_instruments_pass(sigma, seconds, names):
    check(late(flown(sigma), seconds, *names))


@pytest.mark.parametrize("plan", range(len(manoeuvres.PLANS[0])))
@pytest.mark.parametrize("sigma", [0.0, 1.5])
def test_nothing_is_late_in_sound_records_and_parts_of_them(sigma, plan):
    """In a part where an axis hardly moves, some shift is always the best."""
    record = flown(sigma, plan)
    for first, last in ((0.0, 60.0), (0.0, 20.0), (10.0, 30.0), (20.0, 60.0)):
        check(record.take((record.time >= first) & (record.time < last)))


def test_a_surface_at_rest_and_a_gap_do_not_hide_what_is_late(sound):
    record = late(sound, 0.4, "elevator")
    alpha = np.where((record.time > 20.0) & (record.time < 22.0), np.nan, record["alpha"])
    spoiled = replace(record, channels={**record.channels, "rudder": np.zeros(len(alpha)), "alpha": alpha})
    with pytest.raises(InputError, match=r"column 'elevator' is 0.4. s late against 'q'; shift it back"):
        check(spoiled)


def test_what_a_lateral_diagnosis_lacks_is_said(sound):
    without = replace(sound, channels={n: v for n, v in sound.channels.items() if n != "r"})
    assert [p.kind for p in reconstruct(without).record.problems if p.channel == "r"] == [
        "not recorded: a lateral diagnosis lacks it"]  # fmt: skip
    longitudinal = {n: v for n, v in sound.channels.items() if n not in ("beta", "p", "r", "ay", "aileron", "rudder")}
    kinds = [p.kind for p in reconstruct(replace(sound, channels=longitudinal)).record.problems]
    assert not [kind for kind in kinds if kind.startswith("not recorded")]
