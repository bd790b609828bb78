"""Draw a set of cases, fly and seal them: records in one folder, keys in another, hashes of both in a manifest.

`python -m testbed.withheld.generate OUT --cases 150 [--seed N]`; without a seed the operating system gives one. What
was finished before an interruption is kept.
"""

from __future__ import annotations

import argparse
import json
import secrets
from collections.abc import Callable
from dataclasses import asdict, replace
from itertools import groupby
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from testbed.withheld import files, published
from testbed.withheld.draw import USUAL, Design, Population, beside_designs, designs, stranger_designs
from testbed.withheld.effects import BY_NAME
from testbed.withheld.faults import excused, fault_count, fault_designs, spoiled
from testbed.withheld.flights import CATALOGUE, Aircraft, recorded
from testbed.withheld.manoeuvres import DIAGNOSED, PLANS
from testbed.withheld.plant import DT
from testbed.withheld.separation import Distances, Geometry, distances, geometry
from testbed.withheld.windows import Held, closures, held
from testbed.workers import a_core_each, processes

TRIES, SMALLER = 8, 0.75  # an aircraft that departs gets a smaller effect
SMALLEST_FACTOR = 0.01  # by which an unknown effect is scaled down
Parts = tuple[tuple[str, str, float], ...]
T = TypeVar("T")


def generate(out: Path, cases: int, seed: int | None = None, workers: int = 1,
             progress: Callable[[str], None] = lambda text: None, population: Population = USUAL
             ) -> dict[str, Any]:  # fmt: skip
    """Make (or finish, or draw again beside its keys) a sealed set in `out`: `records/`, `keys/`, `manifest.json`.

    Args:
        out: a folder, made if absent.
        cases: how many, beside which some records with faults are drawn.
        seed: for development; from the operating system if omitted.
        workers: processes.
        progress: told after every group of cases.
        population: what is drawn; distances in keys are those of the usual spread all the same.

    Returns:
        The manifest.

    Raises:
        ValueError: `out` holds another set than the one asked for, or what is drawn again is not what it was.
    """
    records, keys = out / "records", out / "keys"
    for folder in (records, keys):
        folder.mkdir(parents=True, exist_ok=True)
    names, seed, known = _roll(keys / "seed.json", cases, seed, population)
    drawn = population.placed(_designs(cases, seed, population), seed)
    jobs = [(name, design) for name, design in zip(names, drawn, strict=True)
            if not ((records / name).is_dir() and (keys / f"{name}.json").is_file())]
    groups = [list(group) for _, group in groupby(sorted(jobs, key=lambda job: bank_of(job[1])),
                                                  key=lambda job: bank_of(job[1]))]
    done = len(drawn) - len(jobs)
    if workers == 1:
        for group in groups:
            done += _make(group, records, keys)
            progress(f"flown {done} of {len(drawn)}")
    elif groups:
        with processes(workers) as pool:
            for made in pool.map(_make, groups, [records] * len(groups), [keys] * len(groups)):
                done += made
                progress(f"flown {done} of {len(drawn)}")
    sealed = files.manifest(records, keys, names) | {
        "numbers": published.digest(), "count": cases, "development_seed": seed if known else None,
        **population.told()}
    if (out / "manifest.json").is_file() and files.read_json(out / "manifest.json") != sealed:
        raise ValueError(f"{out}: what was drawn is not what its manifest tells: another generator, processor or "
                         "other versions")
    files.write_text(out / "manifest.json", json.dumps(sealed, indent=1))
    return sealed


def _designs(cases: int, seed: int, population: Population) -> list[Design]:
    if population.whole:
        return [*designs(cases, seed), *fault_designs(cases, seed)]
    return beside_designs(cases, seed) if population.beside else stranger_designs(cases, seed)


def _roll(path: Path, cases: int, seed: int | None, population: Population) -> tuple[list[str], int, bool]:
    """Names and seed of the set and whether it was given; kept with the keys: an interrupted draw goes on as begun."""
    if path.is_file():
        kept = files.read_json(path)
        wanted = (cases, seed is not None, kept["seed"] if seed is None else seed, population)
        there = (kept["cases"], kept["given"], kept["seed"], Population.of(kept))
        if there != wanted:
            raise ValueError(f"{path.parent.parent} holds a set of {kept['cases']} cases with another seed, number, "
                             "spread or gusts")
        return kept["names"], kept["seed"], kept["given"]
    given = seed is not None
    seed = seed if seed is not None else secrets.randbits(120)
    rng = np.random.default_rng(np.random.SeedSequence([seed, 1]))
    names: list[str] = []
    while len(names) < cases + (fault_count(cases) if population.whole else 0):
        name = rng.bytes(5).hex() if given else secrets.token_hex(5)
        if name not in names:
            names.append(name)
    files.write_text(path, json.dumps({"cases": cases, "seed": seed, "given": given, "names": names,
                                      **population._asdict()}))
    return names, seed, given


def bank_of(design: Design) -> tuple[int, float]:
    """Plan and gain of the inputs, on which the bank of departures depends."""
    return design.plan, design.gain


def _make(group: list[tuple[str, Design]], records: Path, keys: Path) -> int:
    """Fly and write cases of one plan; cases that share gust and noise share their whitened bank."""
    group = sorted(group, key=lambda job: job[1].conditions)
    for _, same in groupby(group, key=lambda job: job[1].conditions):
        shape: Geometry | None = None
        for name, design in same:
            if shape is None and design.parts:
                shape = geometry(*bank_of(design), design.conditions)
            texts, key = make_case(name, design, shape)
            if not (keys / f"{name}.json").is_file():  # of a set that was published, or a draw that was interrupted
                files.write_text(keys / f"{name}.json", json.dumps(key, indent=1))
            files.write_case(records / name, texts)
    return len(group)


def make_case(name: str, design: Design, shape: Geometry | None) -> tuple[dict[str, str], dict[str, Any]]:
    """Files of one case by name, and its key.

    Args:
        name: says nothing.
        design: what to fly.
        shape: where distances are measured; None for a case without effects.
    """
    return smaller_until(design.parts, lambda parts: _flown(name, design, parts, shape))


def smaller_until(parts: Parts, made: Callable[[Parts], T]) -> T:
    """What `made` gives of the effects at their sizes, or at smaller ones if an aircraft with them cannot be flown.

    Raises:
        ArithmeticError: no size can be flown.
    """
    for _ in range(TRIES):
        try:
            return made(parts)
        except ArithmeticError:
            parts = tuple((effect, form, SMALLER * size) for effect, form, size in parts)
    raise ArithmeticError(f"no size of {[p[0] for p in parts]} can be flown")


def _flown(name: str, design: Design, parts: Parts,
           shape: Geometry | None) -> tuple[dict[str, str], dict[str, Any]]:
    found = Distances(0.0, {}, 0.0)
    if parts and shape is not None:
        found = distances(design.plan, design.gain, shape, parts)
        if design.target:
            parts, found = _scaled(design, shape, parts, found)
    aircraft = Aircraft(design.baseline, parts)
    texts: dict[str, str] = {}
    flights: list[Held] = []
    for i, manoeuvre in enumerate(PLANS[design.plan]):
        flown, read = recorded(aircraft, manoeuvre, design.gain, design.conditions, design.random(i))
        flights.append(held(flown, read))
        seen = read | dict(zip(files.COMMANDS, flown.commands.T, strict=True))
        if design.fault is not None:
            seen = spoiled(seen, design.fault, DT)
        texts[f"{i + 1}.csv"] = files.record_text(seen, np.column_stack([seen[name] for name in files.COMMANDS]))
        texts[f"{i + 1}.toml"] = files.side_text(name, "diagnose" if i < DIAGNOSED else "held_out")
    closed = closures(design.baseline, parts, PLANS[design.plan][DIAGNOSED:], flights[DIAGNOSED:], design.gain,
                      design.conditions)
    return texts, _key(name, design, parts, found) | {"held_out": closed}


def _scaled(design: Design, shape: Geometry, parts: Parts, found: Distances) -> tuple[Parts, Distances]:
    """An unknown effect at the size that stands `design.target` from the nearest pair, taken as proportional.

    What is known beside it keeps its size: each is scaled, and measured, by itself.
    """
    def apart(parts: Parts) -> Distances:
        return distances(design.plan, design.gain, shape, parts)

    known, strange = (tuple(p for p in parts if (p[0] in BY_NAME) is held) for held in (True, False))
    alone = apart(strange) if known else found
    factor = min(max(design.target / max(alone.pair, 1e-6), SMALLEST_FACTOR), 1.0 / SMALLER)
    smaller = tuple((effect, form, factor * size) for effect, form, size in strange)
    there = apart(smaller)
    if there.pair < 0.3 * design.target:  # a dead zone or a delay that has vanished altogether
        smaller, there = strange, alone
    if not known:
        return smaller, there
    return (*known, *smaller), replace(apart((*known, *smaller)), known=apart(known).none, strange=there.pair)


def _key(name: str, design: Design, parts: Parts, found: Distances) -> dict[str, Any]:
    where = sorted({place for effect, _, _ in parts for place in CATALOGUE[effect].where})
    fault = None if design.fault is None else {**asdict(design.fault), "excused": excused(design.fault.channel)}
    key = {
        "case": name, "salt": secrets.token_hex(16), "tier": design.tier, "sigma_w": design.sigma,
        "effects": [effect for effect, _, _ in parts], "forms": [form for _, form, _ in parts],
        "parameters": {effect: {CATALOGUE[effect].parameter: size} for effect, _, size in parts},
        "where": where, "D_none": found.none, "D": found.rivals, "D_pair": found.pair,
        "D_own_set": found.own_set, "D_rival_set": found.rival_set, "fault": fault,
        "design": {k: v for k, v in asdict(design).items() if k not in ("tier", "parts", "fault")},
    }  # fmt: skip
    if design.tier == "beside":
        strange = [effect for effect, _, _ in parts if effect not in BY_NAME]
        key |= {"known": [effect for effect, _, _ in parts if effect in BY_NAME], "D_known": found.known,
                "D_strange": found.strange, "where_strange": sorted(CATALOGUE[strange[0]].where)}
    return key


def main() -> None:
    """Command line of the generator alone, for those who draw a set apart from the solver."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--cases", type=int, default=2400)
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--workers", type=int, default=1)
    given = parser.parse_args()
    try:
        with a_core_each():
            generate(given.out, given.cases, given.seed, given.workers, print)
    except ValueError as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
