"""A diagnosis in three plain sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sim2real.actuators.second_order import DAMPING, FREQUENCY
from sim2real.diagnosis import Diagnosis
from sim2real.library.candidates import SPREAD
from sim2real.library.terms import PURE_DELAY
from sim2real.posterior.generic import COURSE

FEW = 3  # names that a list shows


def sentences(found: Diagnosis) -> list[str]:
    """What is found, how far the gap closes, what to do next."""
    return [_finding(found), _closing(found), _next(found)]


def of_the_model(found: Diagnosis) -> str:
    """What the reference flights said of the model with its numbers at their best, or how far off its numbers are.

    Nothing where they are off as published ones are.
    """
    told, spread = found.provenance["model"], found.provenance.get("spread")
    if told is None:
        return "" if not spread or spread <= SPREAD else (
            f"The model's derivatives are off by about {100 * spread:.2g} % together, where published sets differ by "
            f"{100 * SPREAD:.0f} %: a gap is what lies beyond that.")  # fmt: skip
    count, walk = found.provenance["references"], told["walk"]
    flights = "its reference flight is" if count == 1 else f"its {count} reference flights are"
    noise = "the process noise" if walk == 1.0 else f"{walk:g} times the process noise"
    kept = f"{flights} followed with {noise} of an aircraft that the model knows"
    slow = sorted(told["colour"].items(), key=lambda item: -item[1])[:3]
    colour = [f"{channel} (by {ratio:.3g})" for channel, ratio in slow]
    less = f"; slow errors count for less in {', '.join(colour)}" if colour else ""
    home = list(told["explained_without_a_gap"])
    terms = f"; part of what {', '.join(home)} would explain is there without a gap" if home else ""
    return f"With the model corrected, {kept}{less}{terms}."


def _finding(found: Diagnosis) -> str:
    first = found.hypotheses[0]
    sure = f"probability {first['probability']:.2f}"
    if found.verdict == "no_gap":
        return f"The records show no gap beyond the model's own uncertainty ({sure})."
    named = [_named(next(e for e in found.effects if e["name"] == name)) for name in first["effects"]]
    if found.unknown and "places" in found.unknown and first["unknown"]:
        return _another_aircraft(found.unknown, named, sure)
    if found.verdict == "unknown" and not first["effects"]:
        where = found.unknown["component"] if found.unknown else "nowhere in particular"
        late = late_by(found.unknown) if found.unknown else 0.0
        answers = f", which answers {late:.2g} s late" if late else ""
        return f"There is a gap that nothing in the library explains; it enters at {where}{answers} ({sure})."
    if not first["effects"]:
        return "There is a gap, but no single explanation stands out."
    beside = ["something that the library lacks"] if first["unknown"] else []
    return f"The gap is best explained by {' and '.join(named + beside)} ({sure})."


def late_by(unknown: Mapping[str, Any]) -> float:
    """By how much a path answers late [s], if that is what the library lacks; else zero."""
    return float(sum(t["coefficient"] for t in unknown["terms"] if t["term"] == PURE_DELAY))


def listed(names: Sequence[str]) -> str:
    """A few names, and how many more: an effect too small to be seen is like every other."""
    more = len(names) - FEW
    return ", ".join(names[:FEW]) + (f" and {more} more" if more > 0 else "")


def term_named(term: str) -> str:
    """A term as people read it; a free course of time is told by the root mean square of its heights."""
    return {COURSE: "course of time, RMS", "height": "air density with height"}.get(term, term)


def _another_aircraft(unknown: dict[str, Any], named: list[str], sure: str) -> str:
    """A gap in many numbers at once: where, and what each is."""
    places = sorted(((c, rms) for c, rms in unknown["places"].items() if rms >= 1.0), key=lambda item: -item[1])
    where = ", ".join(f"{c} {rms:.1f}" for c, rms in places)
    others = ", ".join(t["term"] for t in unknown["terms"][:6])
    also = [f"numbers that no effect of the library changes ({others})"] * bool(others)
    has = f"; it has {', '.join(named + also)}" if named or also else ""
    return (f"The aircraft differs from the model in many numbers at once ({sure}), in tolerances: "
            f"{where or 'less than one anywhere'}{has}.")


def _named(effect: dict[str, Any]) -> str:
    """An effect with its size, and what it may be taken for."""
    size = ", ".join(f"{k} {p['estimate']:.3g} {'' if p['unit'] == '1' else p['unit']}".rstrip()
                     for k, p in effect["parameters"].items() if p["low95"] != p["high95"])  # fmt: skip
    told, form = effect["indistinguishable_from"], effect["other_form"]
    other = f", which these records cannot tell from {listed(told)}," if told else ""
    if servo := _servo(form):
        return f"{effect['name']} ({size}), which is a servo of second order ({servo}){other}"
    terms = ", ".join(term_named(t["term"]) for t in form["terms"] if t["term"] != "1") if form else ""
    bent = f" in another form than the library's ({form['component']} by {terms or 'a constant'})" if form else ""
    return f"{effect['name']} ({size}{_varying(effect)}){bent}{other}"


def _servo(form: Mapping[str, Any] | None) -> str:
    """Frequency and damping of an actuator of second order; nothing for any other form."""
    known = {t["term"]: t["coefficient"] for t in form["terms"]} if form else {}
    return f"{known[FREQUENCY]:.3g} rad/s, damping ratio {known[DAMPING]:.2g}" if DAMPING in known else ""


def _varying(effect: dict[str, Any]) -> str:
    """How the size went along the records, if it was not the same everywhere."""
    if not effect["sizes"]:
        return ""
    least, most = (f(s["estimate"] for s in effect["sizes"]) for f in (min, max))
    where = {"shared": "", "per_flight": "another in every flight", "per_record": "another in every record"}
    how = [where[effect["scope"]]] * bool(where[effect["scope"]]) + ["changing in time"] * bool(effect["history"])
    return f", {' and '.join(how)}: {least:.3g} to {most:.3g}"


def _closing(found: Diagnosis) -> str:
    held = found.gap["held_out"]
    training = found.gap["training"]
    if held["before"] is None:
        return (f"On the diagnosed records the gap goes from {training['before']:.2f} to {training['after']:.2f} "
                "tolerances; no held-out record was given, so how far it closes is not measured.")
    if held["closure"] is None:
        return (f"On the held-out records the gap is {held['before']:.2f} tolerances, "
                "no more than noise and gusts alone may give, so there is nothing to close.")
    change = f"{100 * held['closure']:.0f} % closed" if held["closure"] > 0.0 else "it does not close"
    if found.resimulate["model"]:
        change += (f" ({100 * max(held['closure_effects_alone'], 0.0):.0f} % by the effects alone, "
                   "the model's own numbers left as they were)")
    return (f"On the held-out records the gap goes from {held['before']:.2f} to {held['after']:.2f} tolerances: "
            f"{change}; the worst channel is {held['worst_channel']}.")


def _next(found: Diagnosis) -> str:
    if found.next_manoeuvre is not None:
        pairs = "; ".join(f"{a} from {b}" for a, b in found.next_manoeuvre["separates"][:3])
        return f"Fly {found.next_manoeuvre['name']} next: it separates {pairs}."
    if found.verdict == "no_gap":
        shown = sum(1 for limit in found.detection_limits.values() if limit["smallest"] is not None)
        missed = len(found.not_testable)
        return f"{shown} effects would have shown at their detection limits; {missed} could not be tested."
    return "No further manoeuvre is needed to tell the explanations apart."
