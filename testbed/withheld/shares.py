"""How many single effects or pairs of a set an ideal observer could name: designs and distances alone, nothing flown.

`python -m testbed.withheld.shares --cases 2400 [--seed N] [--only A,B] [--out FILE]` prints a table by effect,
on which the sizes drawn in `effects.py` and `draw.py` rest; with `--pairs` one of pairs, by their forms.
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

from testbed.withheld.draw import DEVELOPMENT_SEED, Design, designs
from testbed.withheld.generate import Parts, bank_of, smaller_until
from testbed.withheld.score import DETECTABLE, identifiable
from testbed.withheld.separation import Geometry, distances, geometry


def singles(cases: int, seed: int, progress: Callable[[str], None] = lambda text: None,
            only: Sequence[str] = ()) -> Iterator[dict[str, Any]]:
    """Key-like rows of the single effects of a set, without a flight of them; arguments of `_rows`."""
    return _rows("single", _row, cases, seed, progress, only)


def pairs(cases: int, seed: int, progress: Callable[[str], None] = lambda text: None,
          only: Sequence[str] = ()) -> Iterator[dict[str, Any]]:
    """The same of the pairs that hold any of `only`."""
    return _rows("pair", _pair, cases, seed, progress, only)


def _rows(tier: str, row: Callable[[Design, Geometry, Parts], dict[str, Any]], cases: int, seed: int,
          progress: Callable[[str], None], only: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Rows of a tier, sorted so that those that share gust and noise share their whitened bank.

    Args:
        cases: of the whole set.
        seed: of the set.
        progress: told after every gust and noise level.
        only: effects; all if empty.
    """
    drawn = [d for d in designs(cases, seed) if d.tier == tier and (not only or {p[0] for p in d.parts} & set(only))]
    drawn.sort(key=lambda d: (bank_of(d), d.conditions))
    done = 0
    for _, same in groupby(drawn, key=lambda d: (bank_of(d), d.conditions)):
        group = list(same)
        shape = geometry(*bank_of(group[0]), group[0].conditions)
        for design in group:
            yield smaller_until(design.parts, partial(row, design, shape))
        done += len(group)
        progress(f"{done} of {len(drawn)}")


def _row(design: Design, shape: Geometry, parts: Parts) -> dict[str, Any]:
    (effect, form, size), = parts
    found = distances(*bank_of(design), shape, parts)
    key = {"tier": "single", "effects": [effect], "D_none": found.none, "D": found.rivals}
    rival = min((d, name) for name, d in found.rivals.items() if name != effect)
    return {"effect": effect, "form": form, "size": size, "sigma_w": design.sigma, "D_none": found.none,
            "own": found.rivals[effect], "rival": rival[1], "D_rival": rival[0], "identifiable": identifiable(key)}


def _pair(design: Design, shape: Geometry, parts: Parts) -> dict[str, Any]:
    found = distances(*bank_of(design), shape, parts)
    key = {"tier": "pair", "D_none": found.none, "D_own_set": found.own_set, "D_rival_set": found.rival_set}
    return {"effects": [p[0] for p in parts], "forms": [p[1] for p in parts], "sizes": [p[2] for p in parts],
            "sigma_w": design.sigma, "own": found.own_set, "D_rival": found.rival_set, "D_none": found.none,
            "identifiable": identifiable(key)}


def pair_table(rows: list[dict[str, Any]]) -> list[str]:
    """Lines of a Markdown table: by forms, how many pairs are detectable and identifiable."""
    lines = ["| forms | pairs | detectable | identifiable |", "|---|---|---|---|"]
    for forms in sorted({tuple(sorted(r["forms"])) for r in rows}):
        mine = [r for r in rows if tuple(sorted(r["forms"])) == forms]
        lines.append(f"| {', '.join(forms)} | {len(mine)} | {sum(r['D_none'] >= DETECTABLE for r in mine)} | "
                     f"{sum(r['identifiable'] for r in mine)} |")
    return [*lines, f"identifiable: {sum(r['identifiable'] for r in rows) / len(rows):.3f} of {len(rows)}"]


def table(rows: list[dict[str, Any]]) -> list[str]:
    """Lines of a Markdown table: by effect, how many are detectable and identifiable, and the usual nearest rival."""
    by_effect = defaultdict(list)
    for row in rows:
        by_effect[row["effect"]].append(row)
    lines = ["| effect | cases | D to none, median | detectable | identifiable | nearest rival |",
             "|---|---|---|---|---|---|"]
    for effect, mine in sorted(by_effect.items(), key=lambda item: sum(r["identifiable"] for r in item[1])):
        none = sorted(r["D_none"] for r in mine)[len(mine) // 2]
        rivals = [r["rival"] for r in mine]
        lines.append(f"| `{effect}` | {len(mine)} | {none:.1f} | {sum(r['D_none'] >= DETECTABLE for r in mine)} | "
                     f"{sum(r['identifiable'] for r in mine)} | `{max(set(rivals), key=rivals.count)}` |")
    share = sum(r["identifiable"] for r in rows) / len(rows)
    return [*lines, f"identifiable: {share:.3f} of {len(rows)}"]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=int, default=2400)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, help="rows as JSON")
    parser.add_argument("--pairs", action="store_true", help="pairs, not single effects")
    parser.add_argument("--only", default="", help="effects, with commas between; all if omitted")
    given = parser.parse_args()
    only = tuple(name for name in given.only.split(",") if name)
    of, lines = (pairs, pair_table) if given.pairs else (singles, table)
    rows = list(of(given.cases, DEVELOPMENT_SEED + given.seed, lambda text: print(text, flush=True), only))
    if given.out is not None:
        given.out.write_text(json.dumps(rows), encoding="utf-8")
    print("\n".join(lines(rows)))


if __name__ == "__main__":
    main()
