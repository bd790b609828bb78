"""Fly held-out records again with what the answers say: closure that no solver computes for itself.

`python -m testbed.withheld.refly ANSWERS KEYS OUT`, once the keys are open. The published aircraft with what an answer
changes by its command (effects in the library's form, derivatives, terms beside), on the generator's plant, flies the
windows of `windows.py`; one file per single effect or pair goes to OUT, where the scorer reads it. What is there of the
same command stays.
"""

from __future__ import annotations

import argparse
import json
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product, repeat
from pathlib import Path
from typing import Any

import numpy as np

from testbed.withheld.described import CENTRE, CENTRED, DESCRIBED, OWN
from testbed.withheld.distance import MOTION
from testbed.withheld.draw import Design
from testbed.withheld.effects import BY_NAME
from testbed.withheld.files import read_json, write_text
from testbed.withheld.flights import Aircraft, offset, recorded
from testbed.withheld.manoeuvres import DIAGNOSED, PLANS
from testbed.withheld.published import DERIVATIVES, SENSOR_KNOBS
from testbed.withheld.windows import gap_of, held
from testbed.workers import a_core_each, processes

FLOWN_AGAIN = ("single", "pair", "beside")  # tiers with an effect that the library holds
# All that the plant has to add to: derivatives, constants, instruments' errors, what describes something unknown.
NUMBERS = {*DERIVATIVES, *SENSOR_KNOBS, *DESCRIBED, *OWN, *CENTRED, "CY_0", "Cl_0", "Cn_0", "Cl_alpha", "Cn_aileron",
           "Cm_CT", "CZ_CT", "Cm_alphadot", *(f"{s}_{own}" for s in ("elevator", "aileron", "rudder")
                                              for own in ("gearing", "offset", "lag", "cubic"))}  # fmt: skip
# Numbers of surfaces' paths, each the generator's times so much.
BENT = {f"{s}_{of}": (f"{s}_{own}", times) for s in ("elevator", "aileron", "rudder")
        for of, own, times in (("gearing", "gearing", 1.0), ("offset", "offset", 1.0), ("lag", "lag", 1.0),
                               ("cube", "cubic", 0.01))}  # fmt: skip
Parts = tuple[tuple[str, str, float], ...]


def refly(answers: Path, keys: Path, out: Path, workers: int = 1,
          progress: Callable[[str], None] = lambda text: None) -> None:
    """Write OUT/NAME.json for every answered case of FLOWN_AGAIN that has none of its answer's command.

    Args:
        answers, keys: folders with one JSON file per case.
        out: a folder, made if absent.
        workers: processes.
        progress: told how far it is.
    """
    out.mkdir(parents=True, exist_ok=True)
    left = [path for path in sorted(answers.glob("*.json"))
            if read_json(keys / path.name)["tier"] in FLOWN_AGAIN and not _flown(path, out / path.name)]
    if workers == 1 or not left:
        done = map(_one, left, repeat(keys), repeat(out))
        _tell(done, len(left), progress)
        return
    with processes(workers) as pool:
        _tell(pool.map(_one, left, repeat(keys), repeat(out), chunksize=8), len(left), progress)


def _flown(answer: Path, there: Path) -> bool:
    """Whether a file holds what an answer's command does, and not that of an answer that was there before."""
    return there.is_file() and read_json(there).get("command") == command_of(read_json(answer))


def _tell(done: Any, total: int, progress: Callable[[str], None]) -> None:
    for k, _ in enumerate(done, start=1):
        if k % 50 == 0 or k == total:
            progress(f"answers flown again: {k} of {total}")


def _one(answer: Path, keys: Path, out: Path) -> None:
    write_text(out / answer.name, json.dumps(flown_again(read_json(answer), read_json(keys / answer.name))))


def flown_again(answer: dict[str, Any], key: dict[str, Any]) -> dict[str, Any]:
    """Gaps of an answer's model on the held-out records of its case.

    Returns:
        `after` of all that the answer changes, `effects_after` of its effects alone, both from the published aircraft;
        `own_after` of these from the aircraft's own derivatives and mass; `flown`: the effects, `not_flown`: what the
        generator has no number for; `command`: of the answer.
    """
    model = told(answer)
    design = Design(key["tier"], true_parts(key), **key["design"])
    aircraft = Aircraft(design.baseline, design.parts)
    flights = [held(*recorded(aircraft, m, design.gain, design.conditions, design.random(i)))
               for i, m in enumerate(PLANS[design.plan]) if i >= DIAGNOSED]
    own = np.array([key["held_out"]["f"][name] for name in MOTION]) ** 2
    return {"after": gap_of(Aircraft(model.factors, model.parts, model.terms), flights, own),
            "effects_after": gap_of(Aircraft(parts=model.parts), flights, own),
            "own_after": gap_of(Aircraft(design.baseline, model.parts), flights, own),
            "flown": {name: size for name, _, size in model.parts}, "not_flown": list(model.lacking),
            "command": command_of(answer)}


def command_of(answer: dict[str, Any]) -> str:
    """The command by which the simulator flies what an answer says; nothing where it says nothing."""
    return str(answer.get("resimulate", {}).get("command", ""))


def true_parts(key: dict[str, Any]) -> Parts:
    """Effects, forms and sizes of a key."""
    sizes = (next(iter(key["parameters"][name].values())) for name in key["effects"])
    return tuple(zip(key["effects"], key["forms"], sizes, strict=True))


@dataclass(frozen=True)
class Told:
    """An answer's model in the generator's terms.

    Attributes:
        parts: effects, all in the library's form.
        factors: its derivatives, mass and thrust line over the published ones, and offsets of its instruments, by name.
        terms: what it adds to numbers of the airframe and the instruments, by name.
        lacking: what the generator has no number for.
    """

    parts: Parts
    factors: dict[str, float]
    terms: dict[str, float]
    lacking: tuple[str, ...]


def told(answer: dict[str, Any]) -> Told:
    """What the command of an answer says; nothing where there is none."""
    parts, factors, terms = list[tuple[str, str, float]](), dict[str, float](), dict[str, float]()
    lacking = list[str]()
    for name, values in _effects(command_of(answer)):
        if name == "derivatives":
            factors |= {key: value if offset(key) else 1.0 + value for key, value in values.items()}
        elif name == "discrepancy":
            more, missing = numbers(values)
            terms |= more
            lacking += missing
        else:
            for parameter, value in values.items():
                full = name if name in BY_NAME and BY_NAME[name].parameter == parameter else f"{name}.{parameter}"
                if full in BY_NAME:
                    parts.append((full, "same", value))
                else:
                    lacking.append(full)
    return Told(tuple(parts), factors, terms, tuple(lacking))


def _effects(command: str) -> list[tuple[str, dict[str, float]]]:
    """`--effect NAME:PARAM=VALUE,...` of a command."""
    found = []
    for name, values in re.findall(r"--effect (\w+):(\S+)", command):
        pairs = (pair.split("=") for pair in values.split(","))
        found.append((name, {key: float(value) for key, value in pairs}))
    return found


def numbers(values: dict[str, float]) -> tuple[dict[str, float], list[str]]:
    """Terms of `discrepancy` as numbers of the generator, and those that it lacks: delays, drifts, some scales."""
    found, lacking = dict[str, float](), list[str]()
    for name, value in values.items():
        if value == 0.0 or name.startswith("at_"):
            continue
        of, _, term = name.partition("_")
        if name in BENT:
            more = {BENT[name][0]: value * BENT[name][1]}
        elif of == "scale":
            more = {name: value, f"bias_{term}": -value * values.get(f"at_{term}", 0.0)}
        elif of in ("bias", "delay", "drift"):
            more = {name: value}
        else:
            more = written_out(of, [] if term == "0" else term.split("_"), value, values)
        more = {key: added for key, added in more.items() if added != 0.0}
        if not set(more) <= NUMBERS:
            lacking.append(f"discrepancy.{name}")
            continue
        for key, added in more.items():
            found[key] = found.get(key, 0.0) + added
    return found, lacking


def written_out(coefficient: str, factors: list[str], value: float, values: dict[str, float]) -> dict[str, float]:
    """A product of deviations from what `values` has as `at_*`, multiplied out."""
    found = dict[str, float]()
    for kept in product((True, False), repeat=len(factors)):
        left = [f for f, keep in zip(factors, kept, strict=True) if keep]
        about = [-values.get(f"at_{f}", 0.0) for f, keep in zip(factors, kept, strict=True) if not keep]
        of = f"{left[0]}{len(left)}" if len(left) > 1 and len(set(left)) == 1 else "_".join(left) or "0"
        name, size = f"{coefficient}_{of}", value * math.prod(about)
        found[name] = found.get(name, 0.0) + size
        if name in CENTRED:
            found[CENTRED[name]] = found.get(CENTRED[name], 0.0) + CENTRE * size
        if name == "Cm_alphadot":  # which the plant has as a part of Cm_q
            found["Cm_q"] = found.get("Cm_q", 0.0) + size
    return found


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    for name in ("answers", "keys", "out"):
        parser.add_argument(name, type=Path)
    parser.add_argument("--workers", type=int, default=1)
    given = parser.parse_args()
    with a_core_each():
        refly(given.answers, given.keys, given.out, given.workers, print)


if __name__ == "__main__":
    main()
