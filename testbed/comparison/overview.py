"""What a comparison says at a glance: each controller over all cases, and the sentences that follow from it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

Rows = list[dict[str, Any]]
FUNCTIONS = {1: "1 sense ice", 2: "2 operate ice protection", 3: "3 protect the envelope", 4: "4 fly well"}
SAFETY = ("stalled", "losses")  # a controller is as safe as another if neither share is larger
SHARES = {**dict.fromkeys(("exceedances", "intervention_time", "nuisance_time"), " (share of time)"),
          **dict.fromkeys(("missed_alarms", "stalled", "losses", "upsets", "level_lost"), " (share of episodes)"),
          **dict.fromkeys(("altitude_overshoot", "heading_overshoot"), " (share of step)")}  # of metrics without a unit
STATED = "altitude_rms"  # the figure by which learned and classical controllers are ranked


def names_of(rows: Rows, function: int) -> list[str]:
    """Metrics of a function of the ice management, in order."""
    return [name for name, m in rows[0]["metrics"].items() if m["ims_function"] == function]


def told(rows: Rows, function: int) -> list[str]:
    """Metrics of a function that have a value in some row, in order."""
    return [name for name in names_of(rows, function) if any(row["metrics"][name]["mean"] is not None for row in rows)]


def heading(rows: Rows, name: str) -> str:
    """A metric's name with its unit, or what it is a share of."""
    unit = rows[0]["metrics"][name]["unit"]
    return f"{name.replace('_', ' ')} ({unit})" if unit != "1" else name.replace("_", " ") + SHARES.get(name, "")


def pooled(metrics: Iterable[Mapping[str, Any]]) -> tuple[float | None, float | None]:
    """Mean over cases and half its 95 % interval, from each case's own (cases are given, only episodes are drawn)."""
    there = [m for m in metrics if m["mean"] is not None]
    if not there:
        return None, None
    halves = [0.5*(m["high95"] - m["low95"]) for m in there]
    return sum(m["mean"] for m in there)/len(there), math.sqrt(sum(h*h for h in halves))/len(there)


def overview(rows: Rows) -> list[dict[str, Any]]:
    """One entry per controller, with and without protection: every metric over all cases.

    Returns:
        {"controller", "kind", "protection", "cases", "metrics": {name: (mean, half of the 95 % interval)}}
    """
    groups: dict[tuple[str, str, bool], Rows] = {}
    for row in rows:
        groups.setdefault((row["controller"], row["kind"], row["protection"]), []).append(row)
    return [{"controller": name, "kind": kind, "protection": protection, "cases": len(group),
             "metrics": {m: pooled(row["metrics"][m] for row in group) for m in group[0]["metrics"]}}
            for (name, kind, protection), group in groups.items()]


def sentences(rows: Rows) -> list[tuple[str, str]]:
    """What the comparison shows, each with its kind of verdict (`testbed.reports.page.Report.verdict`)."""
    seen = overview(rows)
    return [*_protection(seen), *_nuisance(rows), _learned(seen)]


def _protection(seen: list[dict[str, Any]]) -> list[tuple[str, str]]:
    """Stalls and losses of all controllers with and without protection; who does worse than 1 % with it."""
    out = []
    for metric, what in zip(SAFETY, ("stalled for more than 1 s", "lost"), strict=True):
        shares = {on: {one["controller"]: 100.0*one["metrics"][metric][0] for one in seen if one["protection"] == on}
                  for on in (True, False)}
        if not shares[True] or not shares[False]:
            continue
        spans = {on: _span(list(by.values())) for on, by in shares.items()}
        worse = ", ".join(name for name, value in shares[True].items() if value > 1.0)
        text = f"Episodes {what}, over all controllers: {spans[True]} protected, {spans[False]} unprotected"
        out.append((f"{text}{f'; above 1 % protected: {worse}' if worse else ''}.", "caution" if worse else "good"))
    return out


def _span(values: list[float]) -> str:
    low, high = f"{min(values):.1f}", f"{max(values):.1f}"
    return f"{low} %" if low == high else f"{low} to {high} %"


def _nuisance(rows: Rows) -> list[tuple[str, str]]:
    clear = [row for row in rows if row["protection"] and row["scenario"] in ("clear_air", "steps_clean")]
    by: dict[str, float] = {}
    for row in clear:
        by[row["controller"]] = max(by.get(row["controller"], 0.0), row["metrics"]["nuisance_time"]["mean"] or 0.0)
    if not by:
        return []
    worst = max(by, key=lambda name: by[name])
    most = f"at most {100*by[worst]:.2f} % of the time ({worst})" if by[worst] > 0.0 else "none"
    return [(f"Nuisance interventions in clear air: {most}.", "good" if by[worst] <= 0.001 else "bad")]


def _learned(seen: list[dict[str, Any]]) -> tuple[str, str]:
    """Does a learned controller beat every classical one on the stated figure, at equal safety?"""
    guarded = [one for one in seen if one["protection"] and one["metrics"][STATED][0] is not None]
    learned = [one for one in guarded if one["kind"] == "learned"]
    rivals = [one for one in guarded if one["kind"] in ("classical", "adaptive")]
    if not learned or not rivals:
        return "No learned controller was compared with classical ones.", "info"
    best, rival = (min(group, key=lambda one: one["metrics"][STATED][0]) for group in (learned, rivals))
    (mean, half), (other, width) = best["metrics"][STATED], rival["metrics"][STATED]
    safe = all(best["metrics"][m][0] <= rival["metrics"][m][0] + 1e-9 for m in SAFETY)
    what = (f"{best['controller']} {mean:.2f} ± {half:.2f} m, best classical {rival['controller']} "
            f"{other:.2f} ± {width:.2f} m ({STATED}, protected, all cases)")
    if mean + half < other - width and safe:
        return f"A learned policy beats every classical controller at equal safety: {what}.", "good"
    why = "less safe" if mean + half < other - width else "intervals overlap or it is worse"
    return f"No learned policy beats the classical controllers: {what}; {why}.", "caution"
