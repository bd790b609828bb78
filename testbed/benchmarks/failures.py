"""What a solver failed at in a scored set: case by case, worst first, so that a reader sees more than shares."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from testbed.withheld.files import read_json
from testbed.withheld.score import RIGHT, Case, flat

LEFT_OUT = "left out"  # tier of single effects that were left out of the library
TIERS = ("single", LEFT_OUT, "pair", "beside", "unknown", "null", "faults")
HEADERS = {"tier": "left", "sigma_w, m/s": "right", "D": "right", "can be told": "left", "truth": "left",
           "answer": "left"}  # fmt: skip


def failures(answers: Path, keys: Path, without: Path | None = None) -> list[dict[str, Any]]:
    """Every case that was answered wrongly, by tier, the farthest from what it was taken for first.

    Args:
        without: answers to single effects that were left out of the library, if there are any.

    Returns:
        case, tier, sigma_w (m/s), D (to none; of unknown effects to the nearest pair), can_be_told (of known effects),
        truth and answer in words.
    """
    found = []
    for path in sorted(answers.glob("*.json")):
        answer, key = read_json(path), read_json(keys / path.name)
        case = flat(answer, key)
        if _wrong(case):
            near = key["D_pair"] if key["tier"] == "unknown" else key["D_none"]
            found.append({"case": path.stem, "tier": key["tier"], "sigma_w": key["sigma_w"], "D": near,
                          "can_be_told": case["identifiable"] if key["tier"] in ("single", "pair", "beside") else None,
                          "truth": _truth(key), "answer": _told(answer)})  # fmt: skip
    for path in sorted(without.glob("*.json")) if without is not None else ():
        answer, key = read_json(path), read_json(keys / path.name)
        if not flat(answer, key)["open"]:
            found.append({"case": path.stem, "tier": LEFT_OUT, "sigma_w": key["sigma_w"], "D": key["D_none"],
                          "can_be_told": None, "truth": _truth(key), "answer": _told(answer)})  # fmt: skip
    return sorted(found, key=lambda one: (TIERS.index(one["tier"]), not one["can_be_told"], -(one["D"] or 0.0)))


def rows(found: list[dict[str, Any]]) -> list[list[str]]:
    """Of a table with HEADERS."""
    said = {True: "yes", False: "no", None: ""}
    return [[one["tier"], f"{one['sigma_w']:g}", "-" if one["D"] is None else f"{one['D']:.0f}",
             said[one["can_be_told"]], one["truth"], one["answer"]] for one in found]  # fmt: skip


def _wrong(case: Case) -> bool:
    """As the scorer's tiers count it; of single effects those that could have been told alone."""
    able = case["identifiable"] or case["tier"] != "single"
    return bool(able and not case[(RIGHT | {"faults": "caught"})[case["tier"]]])


def _truth(key: dict[str, Any]) -> str:
    fault, effects = key.get("fault"), [f"{n} ({form})" for n, form in zip(key["effects"], key["forms"], strict=True)]
    said = " + ".join(effects) or "no gap"
    return f"{fault['kind']} {fault['channel']}, {said}" if fault else said


def _told(answer: dict[str, Any]) -> str:
    said, probability = leading(answer)
    return said if probability is None else f"{said}, {probability:.2f}"


def leading(answer: dict[str, Any]) -> tuple[str, float | None]:
    """The most probable explanation in words, and its probability; of a refusal why, and None."""
    if "error" in answer:
        return f"refused: {answer['error']}", None
    first = max(answer["hypotheses"], key=lambda h: h["probability"])
    names = [*first["effects"], *(["something unknown"] if first["unknown"] else [])]
    return " + ".join(names) or "no gap", first["probability"]
