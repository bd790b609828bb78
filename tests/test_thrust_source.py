"""Whether recorded thrust was measured: reference flights have another chart then, and only then."""

from dataclasses import replace
from functools import cache

import pytest

from icing_env import scenario
from icing_env.record import FlightRecord
from sim2real.diagnosis import diagnose
from sim2real.records.reconstruct import reconstruct
from sim2real.records.thrust_source import as_measured, differs
from testbed.flight import fly

SIDES = ("left", "right")


@cache
def flown(seed: int, sigma: float = 0.5) -> FlightRecord:
    """Doublets, levers moved by the autothrottle; the side file does not say where thrust comes from."""
    chosen = scenario.load("clear_air", duration=52.0, parameters={"turbulence_sigma_w": sigma})
    record = fly(chosen, seed=seed, observer=False, protection=False).record
    sensors = {name: value for name, value in record.meta.sensors.items() if name != "thrust"}
    return replace(record, meta=replace(record.meta, name=f"flight {seed}", sensors=sensors))


def charted(record: FlightRecord, factor: float, slope: float = -0.004, sides: tuple[str, ...] = SIDES) -> FlightRecord:
    """As an owner with another propeller chart has it: at the same thrust another torque, the more so at speed."""
    share = factor + slope * (record["airspeed"] - 61.0)
    return replace(record, channels=record.channels | {f"torque_{s}": record[f"torque_{s}"] / share for s in sides})


def weaker(record: FlightRecord, loss: float, sides: tuple[str, ...] = SIDES) -> FlightRecord:
    """Thrust of the same torque lower by `loss`, as one reads that measures it."""
    lost = {f"thrust_{s}": record[f"thrust_{s}"] * (1.0 - loss) for s in sides}
    return replace(record, channels=record.channels | lost)


@pytest.mark.parametrize(("own", "theirs"), [((1, 2), (3, 4)), ((1,), (3,)), ((3, 5), (1,))])
def test_another_chart_on_every_flight_is_computed_thrust(own, theirs):
    records, references = ([charted(flown(seed), 1.2) for seed in some] for some in (own, theirs))
    assert not differs(records, references)


@pytest.mark.parametrize("loss", [0.15, -0.1])
@pytest.mark.parametrize("sides", [SIDES, ("right",)])
def test_another_thrust_of_the_same_torque_than_in_the_references_was_measured(loss, sides):
    records = [weaker(charted(flown(seed), 1.2), loss, sides) for seed in (1, 2)]
    references = [charted(flown(seed), 1.2) for seed in (3, 4)]
    assert differs(records, references)


def test_engines_that_were_not_recorded_tell_nothing():
    bare = replace(flown(1), channels={n: v for n, v in flown(1).channels.items() if not n.startswith("torque")})
    assert not differs([bare], [flown(3)]) and not differs([flown(1)], [bare]) and not differs([flown(1)], [])


def test_what_a_side_file_declares_stays():
    record = flown(1)
    sensors = record.meta.sensors | {"thrust": {"source": "computed"}}
    now = as_measured([record, replace(record, meta=replace(record.meta, sensors=sensors))])
    assert reconstruct(now[0]).power_from == "torque" and reconstruct(now[1]).power_from == "thrust"
    assert any("in the references" in note for note in reconstruct(now[0]).notes)
    assert not any("in the references" in note for note in reconstruct(now[1]).notes)


@pytest.mark.slow
def test_a_loss_of_measured_thrust_is_named_beside_references_though_no_side_file_tells():
    """A propeller that pulls 15 % less of the same torque than its own chart, which pulls a fifth more than ours."""
    lost = scenario.load("clear_air", duration=52.0, effects={"thrust_loss": {"change": -0.15}},
                         parameters={"turbulence_sigma_w": 0.5})  # fmt: skip
    record = fly(lost, seed=1, observer=False, protection=False).record
    record = charted(replace(record, meta=flown(1).meta), 1.2, 0.0)
    references = [charted(flown(seed), 1.2, 0.0) for seed in (3, 4)]
    found = diagnose([record], reference=references)
    assert found.hypotheses[0]["effects"] == ["thrust_loss"]
    assert abs(found.effects[0]["parameters"]["change"]["estimate"]) == pytest.approx(0.15, abs=0.02)
