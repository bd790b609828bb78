"""Shares of identifiable effects: one row a single effect, counted by effect."""

from __future__ import annotations

from testbed.withheld import draw, shares


def test_distances_alone_tell_who_is_identifiable(monkeypatch):
    parts = (("elevator_power", -0.4), ("rudder_power", 0.05), ("elevator_power", -0.02), ("tail_ice", 0.1))
    drawn = [draw.Design("single", ((name, "same", size),), 0, 1.0, 0.5, 1.3, 1.0, {}, 1) for name, size in parts]
    monkeypatch.setattr(shares, "designs", lambda cases, seed: [*drawn, draw.Design("null", (), 0, 1, 0, 1, 1, {}, 1)])
    rows = list(shares.singles(5, 0, only=("elevator_power", "rudder_power")))
    assert [(r["effect"], r["identifiable"]) for r in rows] == [
        ("elevator_power", True), ("rudder_power", False), ("elevator_power", False)]  # fmt: skip
    assert all(r["rival"] != r["effect"] and r["own"] < 1.0 for r in rows)
    lines = shares.table(rows)
    assert [line.split("|")[5].strip() for line in lines[2:4]] == ["0", "1"] and lines[-1] == "identifiable: 0.333 of 3"


def test_pairs_are_counted_by_their_forms(monkeypatch):
    clear = (("elevator_power", "same", -0.3), ("rudder_power", "same", 0.5))
    weak = (("elevator_power", "same", -0.3), ("rudder_power", "other", 0.05))
    drawn = [draw.Design("pair", parts, 0, 1.0, 0.5, 1.3, 1.0, {}, 1) for parts in (clear, weak)]
    monkeypatch.setattr(shares, "designs", lambda cases, seed: drawn)
    rows = list(shares.pairs(2, 0))
    assert [r["identifiable"] for r in rows] == [True, False] and rows[0]["own"] < 1.5
    assert shares.pair_table(rows)[2:] == ["| other, same | 1 | 1 | 0 |", "| same, same | 1 | 1 | 1 |",
                                           "identifiable: 0.500 of 2"]
