"""What a comparison says at a glance: each controller over all cases, and the sentences that follow from it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

Rows = list[dict[str, Any]]
FUNCTIONS = {1: "1 sense ice", 2: "2 operate ice protection", 3: "3 protect the envelope", 4: "4 fly well"}
SAFETY = ("stalled", "losses")  # a controller is as safe as another if neither share is larger
STATED = "altitude_rms"  # the figure by which learned and classical controllers are ranked


def names_of(rows: Rows, function: int) -> list[str]:
    """Metrics of a function of the ice management, in order."""
    return [name for name, m in rows[0]["metrics"].items() if m["ims_function"] == function]


def pooled(metrics: Iterable[Mapping[str, Any]]) -> tuple[float | None, float | None]:
    """Mean over cases and half its 95 % interval, from each case's own (cases are given, only episodes are drawn)."""
    told = [m for m in metrics if m["mean"] is not None]
    if not told:
        return None, None
    halves = [0.5*(m["high95"] - m["low95"]) for m in told]
    return sum(m["mean"] for m in told)/len(told), math.sqrt(sum(h*h for h in halves))/len(told)


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
    """What the comparison shows, each with its kind of verdict (`testbed.report.Report.verdict`)."""
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
        spans = {on: f"{min(told.values()):.1f} to {max(told.values()):.1f} %" for on, told in shares.items()}
        worse = ", ".join(name for name, value in shares[True].items() if value > 1.0)
        text = f"Episodes {what}, over all controllers: {spans[True]} protected, {spans[False]} unprotected"
        out.append((f"{text}{f'; above 1 % protected: {worse}' if worse else ''}.", "caution" if worse else "good"))
    return out


def _nuisance(rows: Rows) -> list[tuple[str, str]]:
    clear = [row for row in rows if row["protection"] and row["scenario"] in ("clear_air", "steps_clean")]
    told: dict[str, float] = {}
    for row in clear:
        told[row["controller"]] = max(told.get(row["controller"], 0.0), row["metrics"]["nuisance_time"]["mean"] or 0.0)
    if not told:
        return []
    worst = max(told, key=lambda name: told[name])
    return [(f"Nuisance interventions in clear air: at most {100*told[worst]:.2f} % of the time ({worst}).",
             "good" if told[worst] <= 0.001 else "bad")]


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
