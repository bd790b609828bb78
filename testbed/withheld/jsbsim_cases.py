"""Cases with JSBSim as the aircraft: flights with a change, clean flights before it, and the key apart.

`python -m testbed.withheld.jsbsim_cases OUT --cases 16 --seed 0`. Case k has the k-th change of CHANGES in turn, every
NULL_EVERY-th none; sizes, plan, gust and noise come from the seed.
"""

from __future__ import annotations

import argparse
import json
import secrets
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from testbed.withheld import files, gusts, instruments, manoeuvres
from testbed.withheld.jsbsim_changes import BY_NAME, CHANGES
from testbed.withheld.jsbsim_edit import Edit, data_root, odd_dihedral
from testbed.withheld.jsbsim_flight import Aircraft, Papers, fly
from testbed.withheld.manoeuvres import DIAGNOSED, PLANS

DEVELOPMENT_SEED = 20_260_711
SIGMAS, NULL_EVERY = (0.0, 0.5, 1.5), 7
SMALLEST, LARGEST = 1.0, 2.0  # of the typical size
TIERS = ("jsbsim", "jsbsim_as_it_is", "jsbsim_alone")
# with clean reference flights; the same, its rolling moment not repaired; no change and no reference flights


@dataclass(frozen=True)
class Design:
    """One case; `effect` empty where nothing is changed."""

    name: str
    tier: str
    effect: str
    size: float
    plan: int
    sigma: float
    level: float
    seed: int


def designs(count: int, seed: int) -> list[Design]:
    """`count` cases with references, and for each gust intensity one as it is and one alone; drawn alike by a seed."""
    rng = np.random.default_rng(np.random.SeedSequence([DEVELOPMENT_SEED, seed]))
    found, turn = [], 0
    for k in range(count + 2 * len(SIGMAS)):
        tier = TIERS[0] if k < count else TIERS[1] if k < count + len(SIGMAS) else TIERS[2]
        effect, size = "", 0.0
        if tier != TIERS[2] and (tier == TIERS[1] or (k + 1) % NULL_EVERY):
            change = CHANGES[turn % len(CHANGES)]
            turn += 1
            effect, size = change.effect, change.typical * float(rng.uniform(SMALLEST, LARGEST))
            if change.signed and rng.random() < 0.3:
                size = -size
        found.append(Design(rng.bytes(5).hex(), tier, effect, size, int(rng.integers(len(PLANS))),
                            SIGMAS[k % 3], float(rng.choice((0.5, 1.0, 1.5))), int(rng.integers(2**62))))
    return found


def aircraft(root: Path, effect: str = "", size: float = 0.0, as_it_is: bool = False) -> Aircraft:
    """JSBSim's DHC-6 with a change; its rolling moment with sideslip repaired unless `as_it_is`."""
    edits: list[Edit] = [] if as_it_is else [odd_dihedral]
    if not effect:
        return Aircraft(root, edits)
    change = BY_NAME[effect]
    return Aircraft(root, [*edits, *change.edits(size)], size if change.rising else 0.0)


def make_case(design: Design, root: Path) -> tuple[dict[str, str], dict[str, Any]]:
    """Files of one case by name, and its key."""
    as_it_is = design.tier == TIERS[1]
    clean = aircraft(root, as_it_is=as_it_is)
    changed = aircraft(root, design.effect, design.size, as_it_is) if design.effect else clean
    wrong = BY_NAME[design.effect].wrong(design.size) if design.effect else {}
    texts: dict[str, str] = {}
    papers: Papers | None = None
    sets: list[tuple[str, Aircraft, Mapping[str, float]]] = [("", changed, wrong)]
    if design.tier != TIERS[2]:
        sets.insert(0, ("r", clean, {}))
    for j, (mark, flown, errors) in enumerate(sets):
        for i, manoeuvre in enumerate(PLANS[design.plan]):
            rng = np.random.default_rng(np.random.SeedSequence([design.seed, j, i]))
            samples = len(manoeuvres.inputs(manoeuvre)) - 1
            gust = gusts.draw(samples, design.sigma, 1.0, manoeuvre.speed, rng)
            flight = fly(flown, manoeuvre, 1.0, gust, errors)
            papers = papers or flight.papers  # of the clean aircraft where there is one: a change is not announced
            role = "reference" if mark else "diagnose" if i < DIAGNOSED else "held_out"
            read = instruments.read(flight.channels, design.level, rng)
            texts[f"{mark}{i + 1}.csv"] = without_levers(files.record_text(read, flight.commands))
            texts[f"{mark}{i + 1}.toml"] = side_text(design.name, role, papers)
    change = BY_NAME.get(design.effect)
    key = {"case": design.name, "salt": secrets.token_hex(16), "tier": design.tier, "sigma_w": design.sigma,
           "effects": [design.effect] if change else [], "forms": ["jsbsim"] if change else [],
           "parameters": {design.effect: {change.parameter: design.size}} if change else {},
           "where": sorted(change.where) if change else [], "design": asdict(design)}  # fmt: skip
    return texts, key


def without_levers(text: str) -> str:
    """A record without the engines' levers: JSBSim's turboprop answers them through tables no chart of ours has."""
    lines = [line.split(",") for line in text.splitlines()]
    keep = [i for i, name in enumerate(lines[0]) if not name.startswith("throttle")]
    return "\n".join(",".join(line[i] for i in keep) for line in lines) + "\n"


def side_text(flight: str, role: str, papers: Papers) -> str:
    """The TOML beside a record: JSBSim's own mass, inertia and geometry; thrust is JSBSim's own, changes included."""
    return "\n".join([
        'aircraft = "dhc6"', f'flight = "{flight}"', f'role = "{role}"', f"mass = {papers.mass}",
        "cg = [0.0, 0.0, 0.0]", "", "[sensors.thrust]", 'source = "measured"', "",
        "[inertia]", *(f"{a} = {v}" for a, v in papers.inertia.items()), "",
        "[geometry]", f"wing_area = {papers.wing_area}", f"span = {papers.span}", f"chord = {papers.chord}", ""])


def write_case(design: Design, root: Path, records: Path, keys: Path) -> str:
    """Fly one case and write it, key first; what is there already is kept."""
    if not ((records / design.name).is_dir() and (keys / f"{design.name}.json").is_file()):
        texts, key = make_case(design, root)
        files.write_text(keys / f"{design.name}.json", json.dumps(key, indent=1))
        files.write_case(records / design.name, texts)
    return design.name


def main() -> None:
    """Command line, for those who draw cases apart from the solver."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--cases", type=int, default=16)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    root = data_root()
    if root is None:
        raise SystemExit("JSBSim's DHC6 is not installed: pip install jsbsim, or set JSBSIM_ROOT")
    for folder in ("records", "keys"):
        (given.out / folder).mkdir(parents=True, exist_ok=True)
    for design in designs(given.cases, given.seed):
        print(write_case(design, root, given.out / "records", given.out / "keys"))


if __name__ == "__main__":
    main()
