"""Fourth part of the demonstration: an aircraft that differs from its model in a way that the diagnosis is not told."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from icing_env import effects, record
from icing_env.record import FlightRecord
from icing_env.scenario import load
from sim2real.closing import gap
from sim2real.diagnosis import Diagnosis, diagnose
from sim2real.words import sentences
from testbed.demo.parts import Tell, Verdict, write_verdicts
from testbed.flight import fly
from testbed.reports.page import Cell, Report
from testbed.reports.plotting import gap_bars

DRAW, FLIGHTS = 4, 2  # stream of the draw, apart from those of the flights; one flight to diagnose, one held out
SMALLEST, LARGEST = 0.75, 1.5  # of an effect's typical size
WORDS = """
No simulator is the aircraft. Here one effect of the library is drawn at random, with a random size, and built into an
aircraft that flies two doublet sets in light turbulence; then again with other gusts. The diagnosis gets the two
records and nothing else: not the effect, not the size, not the truth. It flies every effect of the library along the
first record, weighs each against "no gap" and "something that is not in the library", and says what it finds. Only then
is the effect revealed. The second record was never fitted: it shows how far the finding closes the gap.
"""
LISTED = 6  # explanations in the table


@dataclass(frozen=True)
class Blind:
    """What was hidden (effect and its parameters) and what was found."""

    effect: str
    values: dict[str, float]
    found: Diagnosis

    @property
    def outcome(self) -> str:
        """right, close (named as one that cannot be told apart), untestable, small, or wrong."""
        d = self.found
        if d.verdict == "explained" and d.hypotheses[0]["effects"] == [self.effect]:
            return "right"
        if d.verdict == "explained" and any(self.effect in e["indistinguishable_from"] for e in d.effects
                                            if [e["name"]] == d.hypotheses[0]["effects"]):  # fmt: skip
            return "close"
        if self.effect not in d.detection_limits:
            return "untestable"
        limit = d.detection_limits[self.effect]
        size = abs(self.values[limit["parameter"]] - effects.get(self.effect).neutral()[limit["parameter"]])
        if d.verdict == "no_gap" and (limit["smallest"] is None or size < limit["smallest"]):
            return "small"
        return "wrong"

    def interval(self) -> tuple[str, float, float, float] | None:
        """Parameter, estimate and 95 % interval of the hidden effect, where the diagnosis lists it."""
        listed = next((e for e in self.found.effects if e["name"] == self.effect), None)
        fitted = [(n, p) for n, p in (listed["parameters"].items() if listed else ()) if p["low95"] != p["high95"]]
        return (fitted[0][0], *(fitted[0][1][k] for k in ("estimate", "low95", "high95"))) if fitted else None


def draw(seed: int) -> tuple[str, dict[str, float]]:
    """An effect and its size, at random."""
    rng = np.random.default_rng([seed, DRAW])
    name = sorted(effects.LIBRARY)[int(rng.integers(len(effects.LIBRARY)))]
    share = rng.uniform(SMALLEST, LARGEST)
    return name, {p.name: float(np.clip(p.neutral + share*(p.typical - p.neutral), p.low, p.high))
                  for p in effects.get(name).parameters}  # fmt: skip


def measure(seed: int, folder: Path, tell: Tell) -> Blind:
    """Draw, fly, hide, diagnose. The records lie in `folder` as blind.csv and blind_held_out.csv."""
    name, values = draw(seed)
    tell("flying an aircraft with a hidden difference", 0.0)
    scenario, records = load("clear_air", effects={name: values}), []
    folder.mkdir(parents=True, exist_ok=True)
    for k, file in enumerate(("blind.csv", "blind_held_out.csv")):
        flight = fly(scenario, seed=seed*FLIGHTS + k, protection=False, observer=False)
        record.write(_hidden(flight.record), folder / file)
        records.append(record.read(folder / file))
    found = diagnose(records[:1], records[1:], seed=seed, progress=lambda what: tell(f"diagnosis: {what}", 0.2))
    return Blind(name, values, found)


def _hidden(flown: FlightRecord) -> FlightRecord:
    """The record as a stranger would hand it over: nothing about where it comes from."""
    return replace(flown, meta=replace(flown.meta, flight="blind", name="blind", notes=""))


def verdicts(b: Blind) -> list[Verdict]:
    """What was hidden, what was found, and whether they agree; how far the gap closes."""
    hidden = f"{b.effect} ({', '.join(f'{name} {value:.3g}' for name, value in b.values.items())})"
    said = sentences(b.found)
    words = {
        "right": ("The diagnosis is right", "good"),
        "close": ("The diagnosis is right as far as these records can tell", "good"),
        "untestable": ("The diagnosis could not have named it: these records do not show this effect", "caution"),
        "small": ("The diagnosis finds nothing, and the effect is smaller than its detection limit", "caution"),
        "wrong": ("The diagnosis is wrong", "bad"),
    }  # fmt: skip
    text, kind = words[b.outcome]
    found = [Verdict(f"Hidden: {hidden}. Found: {said[0]} {text}.", kind)]
    interval = b.interval()
    if interval is not None and b.outcome in ("right", "close"):
        parameter, estimate, low, high = interval
        inside = low <= b.values[parameter] <= high
        found.append(Verdict(f"Its size: {parameter} is estimated as {estimate:.3g} (95 % interval {low:.3g} to "
                             f"{high:.3g}); the hidden value {b.values[parameter]:.3g} lies "
                             f"{'inside' if inside else 'outside'}.", "good" if inside else "caution"))
    return [*found, Verdict(said[1], "info")]


def write(report: Report, b: Blind) -> None:
    """Add the section."""
    report.section("A hidden difference, diagnosed", WORDS)
    write_verdicts(report, verdicts(b))
    energy = b.found.details.tested
    assert energy is not None  # a held-out record was given
    report.figure(gap_bars(gap.by_channel(energy.before), gap.by_channel(energy.after),
                           gap.by_channel(energy.alone.mean(axis=0))),
                  "The held-out record against the simulator, flown freely in windows of ten seconds, before and after "
                  "the diagnosis is built in. One tolerance is what 14 CFR 60 lets a simulator be off; those of α, ax "
                  "and ay are assumed.")
    described = {e["name"]: e for e in b.found.effects}
    rows: list[list[Cell]] = [[_label(h), 100.0*h["probability"], _size(described.get(_only(h)))]
                              for h in b.found.hypotheses[:LISTED]]
    report.table(("explanation", "probability (%)", "size (95 % interval)"), rows,
                 "The most probable explanations, before anything is revealed.")


def _only(hypothesis: dict[str, object]) -> str:
    named = hypothesis["effects"]
    return str(named[0]) if isinstance(named, list) and named else ""


def _label(hypothesis: dict[str, object]) -> str:
    return _only(hypothesis) or ("not in the library" if hypothesis["unknown"] else "no gap")


def _size(effect: dict[str, dict[str, dict[str, float]]] | None) -> str:
    fitted = [(n, p) for n, p in (effect["parameters"].items() if effect else ()) if p["low95"] != p["high95"]]
    return ", ".join(f"{n} {p['estimate']:.3g} ({p['low95']:.3g} to {p['high95']:.3g})" for n, p in fitted) or "–"
