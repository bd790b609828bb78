"""Set what turns a rival's units into probabilities, on a development set whose keys are open.

`python -m testbed.rivals.scales RIVAL SET [--of K]` considers every K-th case of SET (the first of them in the order of
names), prints the scale that gives the truth the largest probability, and is the only part of the rivals that reads
a key.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from icing_env.errors import InputError
from icing_env.record import read
from testbed.rivals import RIVALS
from testbed.rivals.opinion import Opinion, Scale, probabilities
from testbed.rivals.solve import consider

LEAST = 1e-6  # probability below which the benchmark's log score does not go
SHARPEST = 5.0  # log of the largest range of evidence in units of log probability: few cases would take any
Seen = Sequence[tuple[Opinion, str]]  # an opinion and the true effect alone; "" without a gap


def opinions(name: str, folder: Path, every: int) -> list[tuple[Opinion, str]]:
    """Opinions on every so many cases without a gap or with one effect of the library."""
    found = []
    for path in sorted(p for p in (folder / "keys").glob("*.json") if p.stem != "seed")[::every]:
        key = json.loads(path.read_text())
        if key["tier"] in ("null", "single"):
            records = [read(p) for p in sorted((folder / "records" / path.stem).glob("*.csv"))]
            shown = [record for record in records if record.meta.role == "diagnose"]
            found.append((consider(name, shown), key["effects"][0] if key["effects"] else ""))
    return found


def fit(seen: Seen) -> Scale:
    """The scale under which the truth is most probable.

    Raises:
        InputError: no case without a gap, or none with one.
    """
    if len({truth == "" for _, truth in seen}) < 2:
        raise InputError("scales: the cases need some without a gap and some with one")

    def scale(x: Sequence[float]) -> Scale:
        return Scale(float(np.exp(x[0])), float(np.exp(x[1])), float(np.exp(x[2])), float(expit(x[3])))

    def loss(x: Sequence[float]) -> float:
        told = [probabilities(opinion, scale(x)) for opinion, _ in seen]
        right = [max(p.get(truth, 0.0), LEAST) for p, (_, truth) in zip(told, seen, strict=True)]
        return -float(np.mean(np.log(right)))

    middle = float(np.median([np.log(opinion.alarm) for opinion, _ in seen]))
    reach = float(np.median([np.log(np.ptp(list(opinion.evidence.values())) + 1e-9) for opinion, _ in seen]))
    bounds = [(None, None), (-4.0, 4.0), (None, SHARPEST - reach), (-8.0, 8.0)]
    tried = (minimize(loss, (middle, 0.0, k - reach, -1.0), method="Nelder-Mead", bounds=bounds,
                      options={"maxiter": 2000}) for k in range(1, 5))  # fmt: skip
    return scale(min(tried, key=lambda found: float(found.fun)).x)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rival", choices=RIVALS)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--of", type=int, default=1)
    told = parser.parse_args()
    print(fit(opinions(told.rival, told.folder, told.of)))
