"""Score answers of `icing diagnose --json` against the keys of a sealed set, with json and NumPy alone.

`python score.py ANSWERS KEYS [REFLY [WITHOUT [RIVAL ...]]]`: folders of one JSON file a case. REFLY is what `refly.py`
writes (without it closure is null, and the solver's own stands under `closure_told_median`), WITHOUT answers to single
effects with the true effect left out of the library, RIVAL `answers_NAME` of another solver, a baseline. What counts as
right is said in docs/benchmark_diagnosis.md.
"""

from __future__ import annotations

import json
import math
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np

DETECTABLE, APART, SAME = 6.0, 5.0, 3.5  # D to none; D beyond which a rival is another; D within which it is not
BINS, LOWEST, HIGHEST, NORMAL = 15, 0.02, 0.98, NormalDist()
HARMLESS = ("slow", "between", "engines", "powerless")  # what formats allow
# Gap before, the least that is one (that of the spread, or of noise and gust), gap of the truth, gap of the answer: of
# all that it changes in the published aircraft, of its effects alone, of these in the aircraft with its own spread.
CLOSURES = {"published": ("before", "spread", "own_oracle", "after"),
            "effects_alone": ("before", "spread", "oracle", "effects_after"),
            "own": ("own_before", "noise", "own_oracle", "own_after")}  # fmt: skip
RIGHT = {"null": "silent", "single": "top1", "pair": "exact", "unknown": "exact", "beside": "exact"}  # counts, by tier
BESIDE = ("exact_if_able", "has_known", "has_unknown", "placed")  # also, of an effect with an unknown one beside
Case = dict[str, Any]


def load(answers: Path, keys: Path, refly: Path | None = None) -> list[Case]:
    """A flat record of every answered case, ordered by name; `refly`: gaps of the answers' models, where flown again.

    Raises:
        ValueError: an answer without a key, or none at all.
    """
    found = []
    for path in sorted(answers.glob("*.json")):
        key = keys / path.name
        if not key.is_file():
            raise ValueError(f"{path.name}: no key of that name in {keys}")
        again = [json.loads(p.read_text()) for p in ([] if refly is None else [refly / path.name]) if p.is_file()]
        found.append(flat(json.loads(path.read_text()), json.loads(key.read_text()), *again))
    if not found:
        raise ValueError(f"no answers in {answers}")
    return found


def flat(answer: dict[str, Any], key: dict[str, Any], flown: dict[str, Any] | None = None) -> Case:
    """What the figures need of one answer ({"error": ...} is wrong everywhere), its key, its model's gaps reflown."""
    hypotheses = sorted(answer.get("hypotheses", []), key=lambda h: -h["probability"])
    known = key.get("known", () if key["tier"] == "unknown" else key["effects"])  # told where one of no list is beside
    truth = (frozenset(known), key["tier"] in ("unknown", "beside"))
    listed, able = [_label(h) for h in hypotheses], identifiable(key)
    exact = listed[:1] == [truth]
    near = (answer.get("verdict") == "explained" and not listed[0][1] and len(listed[0][0]) == 1
            and key["D"].get(*listed[0][0], math.inf) < SAME)
    inclusion = {name: sum(h["probability"] for h in hypotheses if name in h["effects"])
                 for name in {n for h in hypotheses for n in h["effects"]}}  # fmt: skip
    told = [_label(answer["hypotheses"][i]) for i in answer.get("credible_set_95", [])]
    return {
        "tier": key["tier"], "sigma": key["sigma_w"], "other": "other" in key["forms"], "truth": truth,
        "effects": tuple(key["effects"]), "failed": "error" in answer, "none": key["D_none"], "pair": key["D_pair"],
        # By an ideal observer: half of those SAME from none, or as near to a rival as to their name (about).
        "ideal": NORMAL.cdf(key["D_none"] - SAME) * NORMAL.cdf(math.sqrt(max(_apart(key), 0.0)) / 2.0),
        "identifiable": able, "exact": exact, "exact_if_able": exact if able else None, "top3": truth in listed[:3],
        "top1": exact or (bool(listed) and _in_class(answer, listed[0], key)),
        "alarm": answer.get("verdict") != "no_gap", "silent": answer.get("verdict") == "no_gap",
        "told_unknown": (unknown := answer.get("verdict") == "unknown"), "near": near, "open": near or unknown,
        "placed": (answer.get("unknown") or {}).get("component") in key.get("where_strange", key["where"]),
        "has_known": bool(listed) and truth[0] <= listed[0][0], "has_unknown": bool(listed) and listed[0][1],
        "p_unknown": sum(h["probability"] for h in hypotheses if h["unknown"]),
        "p_truth": sum(h["probability"] for h in hypotheses if _label(h) == truth),
        "inclusion": [(p, name in key["effects"]) for name, p in sorted(inclusion.items())],
        "covered": truth in told, "size": len(told), "where": frozenset(key["where"]), **_closures(key, flown),
        "closure_told": answer.get("gap", {}).get("held_out", {}).get("closure"),
        "seen": frozenset(c for c, p in answer.get("where", {}).get("components", {}).items() if p >= 0.5),
        "interval": _interval(answer, key), "seconds": answer.get("seconds"), **_faulty(answer, key),
    }  # fmt: skip


def _faulty(answer: dict[str, Any], key: dict[str, Any]) -> dict[str, Any]:
    """Whether the faulty channel is named (refused by name counts, "could not be checked" does not) and what is blamed.

    Blamed falsely is an unknown effect, or one that neither is there nor enters at the faulty channel alone. Caught is
    a fault named, nothing being blamed; a HARMLESS one need not be named, but is not refused either.
    """
    if key.get("fault") is None:
        return {}
    kind, channel, excused = (key["fault"][name] for name in ("kind", "channel", "excused"))
    words = [p["channel"] for p in answer.get("data_problems", []) if "could not be checked" not in p["kind"]]
    named = channel in [*words, *re.findall(r"\w+", answer.get("error", ""))]
    first: Case = max(answer.get("hypotheses", []), key=lambda h: h["probability"], default={"effects": []})
    foreign = not set(first["effects"]) <= {*key["effects"], *excused}
    blamed = answer.get("verdict") == "unknown" or (answer.get("verdict") == "explained" and foreign)
    caught = not blamed and ("error" not in answer if kind in HARMLESS else named)
    return {"fault": kind, "named": named, "blamed": blamed, "caught": caught}


def _closures(key: dict[str, Any], flown: dict[str, Any] | None) -> dict[str, tuple[float, float] | None]:
    """Closure of the answer and of the truth, as CLOSURES; None where not flown again or no gap is to be closed."""
    found: dict[str, tuple[float, float] | None] = dict.fromkeys(CLOSURES)
    held = key.get("held_out", {})
    for kind, (gap, least, true, after) in CLOSURES.items():
        if flown and after in flown and held[gap] > held[least]:
            found[kind] = (1.0 - flown[after] / held[gap], 1.0 - held[true] / held[gap])
    return found


def _label(hypothesis: dict[str, Any]) -> tuple[frozenset[str], bool]:
    return frozenset(hypothesis["effects"]), bool(hypothesis["unknown"])


def _apart(key: dict[str, Any]) -> float:
    """Whitened square by which an effect (a pair) is nearer to its name than to other effects (and pairs)."""
    own, rival = key.get("D_own_set") or 0.0, key.get("D_rival_set") or 0.0  # not there before 24 November 2026
    if key["tier"] == "single":
        own, rival = key["D"][key["effects"][0]], min(d for n, d in key["D"].items() if n not in key["effects"])
    return float(rival**2 - own**2)


def identifiable(key: dict[str, Any]) -> bool:
    """Whether an ideal observer could name one effect or a pair: it stands out, nearer to its name than to others."""
    if key["tier"] == "beside":  # each of both, by itself
        return bool(key["D_known"] >= DETECTABLE and key["D_strange"] >= APART)
    return bool(key["D_none"] >= DETECTABLE and _apart(key) >= APART**2)


def _in_class(answer: dict[str, Any], first: tuple[frozenset[str], bool], key: dict[str, Any]) -> bool:
    """Whether the truth is in the class stated with the first effect, every member of it truly that near."""
    names, unknown = first
    if key["tier"] != "single" or unknown or len(names) != 1:
        return False
    (name,) = names
    entry = next((e for e in answer["effects"] if e["name"] == name), None)
    members, true = {name, *(entry or {}).get("indistinguishable_from", [])}, key["effects"][0]
    return true in members and all(key["D"].get(m, math.inf) < SAME for m in members - {true})


def _interval(answer: dict[str, Any], key: dict[str, Any]) -> bool | None:
    """Whether the interval holds the parameter: single effects in the library's form that were named; else None."""
    if key["tier"] != "single" or "other" in key["forms"]:
        return None
    entry = next((e for e in answer.get("effects", []) if e["name"] == key["effects"][0]), None)
    (parameter, value), = key["parameters"][key["effects"][0]].items()
    if entry is None or entry["probability"] < 0.5 or parameter not in entry["parameters"]:
        return None
    told = entry["parameters"][parameter]
    return bool(told["low95"] <= value <= told["high95"])


def share(values: Sequence[Any]) -> float | None:
    """Mean of truth values; None of none."""
    return float(np.mean(known)) if (known := [float(v) for v in values if v is not None]) else None


def auroc(positive: Sequence[float], negative: Sequence[float]) -> float | None:
    """Probability that a positive scores above a negative, ties counted half."""
    p, n = np.asarray(positive)[:, None], np.asarray(negative)
    return float(np.mean((p > n) + 0.5 * (p == n))) if p.size and n.size else None


def _unknown(cases: Sequence[Case], low: float, high: float) -> tuple[list[float], list[float]]:
    """P(unknown) of unknown effects with D to the nearest pair within bounds, and of library gaps as detectable."""
    chosen = [c for c in cases if c["tier"] == "unknown" and low <= c["pair"] < high]
    if not chosen:
        return [], []
    nearest, farthest = min(c["none"] for c in chosen), max(c["none"] for c in chosen)
    matched = [c["p_unknown"] for c in cases if c["tier"] in ("single", "pair") and nearest <= c["none"] <= farthest]
    return [c["p_unknown"] for c in chosen], matched


def tpr_at(positive: Sequence[float], negative: Sequence[float], false: float = 0.05) -> float | None:
    """Share of positives above the threshold that `false` of the negatives exceed."""
    return float(np.mean(np.asarray(positive) > np.quantile(negative, 1.0 - false))) if positive and negative else None


def calibration_error(cases: Sequence[Case], by_luck: bool = False) -> float | None:
    """Mean |share true - mean probability| over equal-count bins of inclusion probabilities; or luck's part of it."""
    pairs = sorted(pair for c in cases for pair in c["inclusion"] if LOWEST <= pair[0] <= HIGHEST)
    if len(pairs) < BINS:
        return None
    parts = [part.T for part in np.array_split(np.array(pairs, dtype=float), BINS)]
    if by_luck:  # of the mean of so many independent truths, as nearly normal
        return float(np.mean([math.sqrt(2.0 / math.pi * np.mean(p * (1.0 - p)) / len(p)) for p, _ in parts]))
    return float(np.mean([abs(p.mean() - true.mean()) for p, true in parts]))


def f1(cases: Sequence[Case]) -> float | None:
    """Of components named with probability at least one half, over detectable single effects."""
    both = [(c["seen"], c["where"]) for c in cases if c["tier"] == "single" and c["none"] >= DETECTABLE]
    total = sum(len(seen) + len(where) for seen, where in both)
    return 2.0 * sum(len(seen & where) for seen, where in both) / total if total else None


def figures(cases: Sequence[Case]) -> dict[str, Any]:
    """The figures of the interface for a set of cases; None where it holds none of the kind."""
    clear, pairs = ([c for c in cases if c["identifiable"] and c["tier"] == tier] for tier in ("single", "pair"))
    elsewhere = [c for c in cases if not c["identifiable"] and c["tier"] == "single"]
    closures = [c["closure_told"] for c in cases if c["tier"] in ("single", "pair") and c["closure_told"] is not None]
    return {
        "cases": len(cases), "failed": sum(c["failed"] for c in cases), "identifiable_singles": len(clear),
        "top1": share([c["top1"] for c in clear]), "top3": share([c["top3"] or c["top1"] for c in clear]),
        "top1_by_gust": {f"{s:g}": share([c["top1"] for c in clear if c["sigma"] == s]) for s in (0.0, 0.5, 1.5)},
        **{f"elsewhere_{name}": share([c[name] for c in elsewhere]) for name in ("top1", "ideal")},
        "null_false_alarm": share([c["alarm"] for c in cases if c["tier"] == "null"]),
        "pair_exact_set": share([c["exact"] for c in cases if c["tier"] == "pair"]), "identifiable_pairs": len(pairs),
        "unknown_auroc_5_to_8": auroc(*_unknown(cases, APART, 8.0)),
        "unknown_auroc_above_8": auroc(*_unknown(cases, 8.0, math.inf)),
        "unknown_placed": share([c["placed"] for c in cases if c["tier"] == "unknown" and c["told_unknown"]]),
        "unknown_tpr_at_5_fpr": tpr_at(*_unknown(cases, APART, math.inf)),
        "where_f1": f1(cases), "ece": calibration_error(cases), "ece_by_luck": calibration_error(cases, by_luck=True),
        "identifiable_pair_exact_set": share([c["exact"] for c in pairs]),
        "coverage95": share([c["covered"] for c in cases]),
        "mean_set_size": share([c["size"] for c in cases if not c["failed"]]),
        "parameter_coverage95": share([c["interval"] for c in cases]),
        "log_score": float(np.mean([-math.log(max(c["p_truth"], 1e-6)) for c in cases])) if cases else None,
        **_closed(cases, "published"), **_closed(cases, "effects_alone", "_effects"), **_closed(cases, "own", "_own"),
        "closure_told_median": float(np.median(closures)) if closures else None,
        "seconds_per_case": share([c["seconds"] for c in cases]),
    }  # fmt: skip


def _closed(cases: Sequence[Case], kind: str, suffix: str = "") -> dict[str, float | None]:
    """Median and tenth percentile of the closure of singles and pairs, and the median over that of the truth."""
    found = np.array([c[kind] for c in cases if c[kind] is not None])
    names = (f"closure{suffix}_median", f"closure{suffix}_p10", f"oracle_fraction{suffix}")
    if not len(found):
        return dict.fromkeys(names)
    told, true = np.median(found, axis=0)
    return dict(zip(names, (float(told), float(np.quantile(found[:, 0], 0.1)), float(told / true)), strict=True))


def intervals(cases: Sequence[Case], repeats: int = 200) -> dict[str, list[float]]:
    """Bootstrap 95 % intervals over cases of every figure that is one number."""
    rng, found = np.random.default_rng(0), {}
    drawn = [figures([cases[i] for i in rng.integers(0, len(cases), len(cases))]) for _ in range(repeats)]
    for name in figures(cases):
        values = [d[name] for d in drawn if isinstance(d[name], int | float)]
        if len(values) > repeats // 2 and name not in ("cases", "failed"):
            found[name] = [float(np.quantile(values, q)) for q in (0.025, 0.975)]
    return found


def _shares(cases: Sequence[Case], right: str, *others: str) -> dict[str, Any]:
    """How many cases of a tier are right, at each gust level too, and shares of whatever else is asked for."""
    return {"cases": len(cases), "right": share([c[right] for c in cases]),
            "right_by_gust": {f"{s:g}": share([c[right] for c in cases if c["sigma"] == s]) for s in (0.0, 0.5, 1.5)},
            **{name: share([c[name] for c in cases]) for name in others}}  # fmt: skip


def by_tier(cases: Sequence[Case], without: Sequence[Case]) -> dict[str, Any]:
    """Each tier by itself, with every effect's recall; `without`: right where unknown or a rival within D of SAME."""
    of = {tier: [c for c in cases if c["tier"] == tier] for tier in (*RIGHT, "faults")}
    tiers = {tier: _shares(of[tier], rule, *(BESIDE if tier == "beside" else ()))
             | {"detectable": sum(c["none"] >= DETECTABLE for c in of[tier])}
             for tier, rule in RIGHT.items() if of[tier] or tier != "beside"}  # fmt: skip
    clear = [c for c in cases if c["identifiable"] and c["tier"] == "single"]
    tiers["single"]["recall"] = {n: share([c["top1"] for c in clear if c["effects"] == (n,)])
                                 for n in sorted({c["effects"][0] for c in clear})}  # fmt: skip
    if of["faults"]:
        kinds = {k: [c["caught"] for c in of["faults"] if c["fault"] == k] for k in {c["fault"] for c in of["faults"]}}
        tiers["faults"] = _shares(of["faults"], "caught", "named", "failed", "blamed")
        tiers["faults"]["right_by_kind"] = {kind: share(caught) for kind, caught in sorted(kinds.items())}
    if without:
        tiers["without"] = _shares(without, "open", "told_unknown", "near", "silent")
    return tiers


def baselines(answers: Path, keys: Path, rivals: Sequence[Path]) -> dict[str, Any]:
    """What knowing nothing scores: the answers dealt to other cases, and "no gap" always; and what each rival does."""
    both = [tuple(json.loads((folder / path.name).read_text()) for folder in (answers, keys))
            for path in sorted(answers.glob("*.json"))]
    told, true = zip(*(pair for pair in both if pair[1]["tier"] != "faults"), strict=True)
    dealt = np.random.default_rng(0).permutation(len(told))
    silent = {"verdict": "no_gap", "hypotheses": [{"effects": [], "unknown": False, "probability": 1.0}],
              "credible_set_95": [0], "effects": [], "where": {"components": {}}, "gap": {"held_out": {}}}
    return {"permuted_keys": figures([flat(told[i], key) for i, key in zip(dealt, true, strict=True)]),
            "always_no_gap": figures([flat(silent, key) for key in true])} | {
        f.name.removeprefix("answers_"): figures([c for c in load(f, keys) if c["tier"] != "faults"]) for f in rivals}


def score(answers: Path, keys: Path, refly: Path | None = None, without: Path | None = None,
          *rivals: Path) -> dict[str, Any]:
    """Every figure of the interface, intervals, tiers, mismatched forms (nulls and unknown included) and baselines."""
    everything = load(answers, keys, refly)
    left_out = load(without, keys) if without is not None and without.is_dir() else []
    cases = [c for c in everything if c["tier"] != "faults"]
    mismatched = [c for c in cases if c["tier"] in ("null", "unknown") or c["other"]]
    return {**figures(cases), "intervals95": intervals(cases), "by_tier": by_tier(everything, left_out),
            "mismatched_form": {**figures(mismatched), "intervals95": intervals(mismatched)},
            "baselines": baselines(answers, keys, rivals)}  # fmt: skip


if __name__ == "__main__":
    print(json.dumps(score(*(Path(folder) for folder in sys.argv[1:])), indent=2))
