"""Side by side with the founding paper: the rules, the form of every row, and the shape of flight 010302f1."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from icing_env.errors import InputError
from testbed.reproduce import flight as reproduce_flight
from testbed.reproduce import table1 as reproduce_table1
from testbed.reproduce import textbook as reproduce_textbook
from testbed.reproduce.items import ITEMS, reproduce
from testbed.reproduce.row import Row, Rule, row
from testbed.reproduce.windows import Window


def test_rules_say_what_they_do():
    near, within, bound = Rule(relative=0.15), Rule(absolute=0.006), Rule(absolute=0.1, at_least=True)
    assert near.holds(-2.0, -2.29) and not near.holds(-2.0, -2.31) and near.text("1/rad") == "within 15 %"
    assert within.holds(0.02, 0.026) and not within.holds(0.02, 0.0261) and within.text("1") == "within 0.006"
    assert bound.holds(1.0, 5.0) and not bound.holds(1.0, 0.8) and bound.text("m") == "not lower by more than 0.1 m"
    assert Rule().text("1") == "equal" and Rule(at_least=True).text("1") == "not lower"
    assert Rule(absolute=10.0).text("%") == "within 10 points"
    assert not near.holds(1.0, float("nan")) and not bound.holds(1.0, float("inf"))


def test_a_row_keeps_a_disagreement_and_its_reason():
    found = row("x", "y", 2.0, 3.0, "m", Rule(relative=0.1), "how", miss="why not")
    assert not found.agrees and found.difference_percent == 50.0 and found.why == "how; why not"
    assert row("x", "y", 2.0, 2.1, "m", Rule(relative=0.1), "how", miss="why not").why == "how"
    assert row("x", "y", 0.0, 2.1, "m", Rule(relative=0.1), "how").difference_percent is None


def check(rows: list[Row], item: str) -> None:
    """The form that every row has."""
    assert rows
    for r in rows:
        assert r.item == item and r.kind in ("simulated", "recorded") and r.quantity and r.why and r.rule
        assert isinstance(r.agrees, bool)
        for value in (r.paper, r.project):
            assert isinstance(value, str) or math.isfinite(value), r
    assert len({r.quantity for r in rows}) == len(rows)


@pytest.fixture(scope="module")
def table() -> list[Row]:
    return reproduce(["table1"])


def test_table1_flies_every_case(table: list[Row]):
    check(table, "table1")
    for case in ("1.1", "1.2", "1.3", "1.4", "2.1", "2.2", "2.3", "2.4", "2.5"):
        assert any(f"case {case}," in r.quantity for r in table), case
    ice = {r.quantity[5:8]: r.project for r in table if "ice on the aircraft" in r.quantity}
    assert ice == {case: float(case[0] == "2") for case in ice} and len(ice) == 9


def test_larger_doublets_give_more_load_factor(table: list[Row]):
    sizes = [(r.paper, r.project) for r in table if "case 1.2" in r.quantity and "load factor" in r.quantity]
    assert [paper for paper, _ in sizes] == [0.10, 0.25, 0.50]
    assert np.polyfit(*np.transpose(sizes), 1)[0] == pytest.approx(1.0, abs=0.1)


@pytest.fixture(scope="module")
def flight() -> dict[str, Window]:
    return reproduce_flight.fly_all("flight_010302f1", 0, 1)[0]


def test_every_printed_event_of_the_flight_is_finite(flight: dict[str, Window]):
    assert {p.event for p in reproduce_flight.PRINTED} <= set(flight)
    for p in reproduce_flight.PRINTED:
        assert p.quantity in reproduce_flight.UNITS
        assert math.isfinite(reproduce_flight.value(flight, p.event, p.quantity, reproduce_flight.stepwise)), p
        assert math.isfinite(reproduce_flight.value(flight, p.event, "CL_alpha", reproduce_flight.hinf)), p


def test_the_flight_has_the_shape_of_the_paper(flight: dict[str, Window]):
    def drag(event: str) -> float:
        return flight[event].truth["quasi_CD_0"] - flight["baseline"].truth["quasi_CD_0"]

    assert drag("first_encounter") == pytest.approx(0.0233, abs=0.002)  # the one calibration
    assert drag("second_encounter") > drag("first_encounter") > drag("after_deicing") > 0.01
    assert drag("second_encounter") > drag("wing_deiced") > drag("tail_deiced") > drag("vtail_struts_deiced") > 0.01
    assert drag("wing_deiced") - drag("tail_deiced") < 0.5*(drag("second_encounter") - drag("wing_deiced"))
    lift = {name: w.truth["quasi_CL_alpha"]/flight["baseline"].truth["quasi_CL_alpha"] for name, w in flight.items()}
    assert 0.86 < lift["first_encounter"] < 0.92 and lift["wing_deiced"] > 0.94 and lift["final_deicing"] > 0.97
    weight = [w.truth["mass"]*9.80665/(0.5*w.truth["density"]*w.trim["airspeed"]**2*39.02) for w in flight.values()]
    assert all(0.5 < CL < 0.7 for CL in weight)


def test_anchors_and_drag_agree_where_exposure_and_ice_go_together(flight: dict[str, Window]):
    """CL_alpha within 15 % at four of five anchors; drag within 0.006 but at the two sets that exposure denies."""
    rows = [reproduce_flight._row(p, [flight], "", reproduce_flight.stepwise) for p in reproduce_flight.PRINTED]
    check(rows, "flight_010302f1")
    anchors = [r for p, r in zip(reproduce_flight.PRINTED, rows, strict=True) if p.quantity == "CL_alpha"]
    assert len(anchors) == 5 and sum(r.agrees for r in anchors) >= 4
    missed = {p.event for p, r in zip(reproduce_flight.PRINTED, rows, strict=True)
              if p.quantity == "delta_CD0" and not r.agrees}
    assert missed <= {"third_encounter_1", "third_encounter_2"}


def test_recorded_flights_are_left_out_where_they_are_absent(monkeypatch: pytest.MonkeyPatch, capsys, tmp_path):
    monkeypatch.setenv("ICING_FLIGHT_DATA", str(tmp_path))
    assert reproduce_textbook.rows(0) == []
    assert capsys.readouterr().err.count("ICING_FLIGHT_DATA") == 2


def test_recorded_flights_print_the_textbook():
    if not (reproduce_textbook.folder() / "totter_demo_data.mat").is_file():
        pytest.skip("the recorded flights are absent: set ICING_FLIGHT_DATA to their folder")
    rows = reproduce(["textbook"])
    check(rows, "textbook")
    assert all(r.kind == "recorded" for r in rows)
    assert all(r.agrees for r in rows if "stored columns" in r.quantity)


def test_an_unknown_item_names_the_nearest():
    with pytest.raises(InputError, match="table1"):
        reproduce(["tabel1"])


def test_every_item_has_its_module_and_rows_are_plain():
    from importlib import import_module

    for module, what in ITEMS.values():
        assert callable(import_module(f"testbed.reproduce.{module}").rows) and what
    assert dataclasses.is_dataclass(Row) and reproduce_table1.ITEM == "table1"
