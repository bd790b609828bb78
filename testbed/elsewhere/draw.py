"""Which cases a seed draws: kinds in turn, and singles and unknowns round their lists, each in an order of the seed."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from testbed.elsewhere.cases import make_case, write_case
from testbed.elsewhere.effects import KNOWN, UNKNOWN

KINDS = ("null", "single", "null", "single", "unknown", "pair")
LETTERS = "abcdefghjkmnpqrstuvwxyz23456789"  # of names, none that looks like another


class Turn(NamedTuple):
    """A case before it is drawn: its number and kind, its effect's number in the list, whether it has references."""

    case: int
    kind: str
    effect: int
    references: bool


def order(cases: int, seed: int) -> list[Turn]:
    """The first `cases` of a seed; every second case of a kind has references."""
    rng = np.random.default_rng([seed, 7])
    single, other = rng.permutation(len(KNOWN)), rng.permutation(len(UNKNOWN))
    turns = dict.fromkeys(KINDS, 0)
    found = []
    for i in range(cases):
        kind = KINDS[i % len(KINDS)]
        pool = other if kind == "unknown" else single
        found.append(Turn(i, kind, int(pool[turns[kind] % len(pool)]), turns[kind] % 2 == 1))
        turns[kind] += 1
    return found


def draw_case(turn: Turn, seed: int, out: Path, keys: Path, centre: str = "uiuc") -> str:
    """Fly a case; its records go to OUT/NAME, its key to KEYS/NAME.json. The name says nothing."""
    rng = np.random.default_rng([seed, 1000 + turn.case])
    setting, channels, key = make_case(rng, turn.kind, turn.effect, turn.references, centre)
    name = "".join(rng.choice(list(LETTERS), 8))
    write_case(out / name, keys / f"{name}.json", setting, channels, key, rng)
    return name
