"""Gaps that are known, diagnosed from a record, and what each does to a choice between controllers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from icing_env.errors import InputError, nearest
from icing_env.scenario import load
from sim2real.diagnosis import diagnose
from testbed import policy_gap
from testbed.commands.diagnose import answer
from testbed.flight import fly
from testbed.policy_gap import PILOTS

# Effects that meet laws of different make differently: a slower elevator those with high gain or narrow phase margin, a
# gyro's error those that hold pitch by it. Sizes are up to three times the library's typical ones.
CASES: dict[str, dict[str, dict[str, float]]] = {
    "elevator_lag": {"elevator_lag": {"extra": 0.25}},
    "pitch_gyro_bias": {"pitch_gyro_bias": {"offset": 0.015}},
    "elevator_rate_limit": {"elevator_rate_limit": {"reduction": 0.9}},
    "thrust_loss": {"thrust_loss": {"change": -0.3}},
}
RECORD_SECONDS, RECORD_SEED = 70.0, 7  # of clear_air, with both of its doublet sets


@dataclass(frozen=True)
class Studied:
    """One gap: what was built in, what was diagnosed, and the rankings."""

    name: str
    true: dict[str, dict[str, float]]
    verdict: str
    diagnosed: dict[str, dict[str, float]]
    ranking: dict[str, Any]
    sentences: list[str]


def measure(names: Sequence[str] = (), progress: Callable[[str], None] = lambda text: None,
            controllers: Sequence[str] = PILOTS, episodes: int = policy_gap.EPISODES, workers: int = 2
            ) -> list[Studied]:  # fmt: skip
    """Fly, diagnose and rank every case asked for, all if none is.

    Raises:
        InputError: no such case.
    """
    for name in names:
        if name not in CASES:
            raise InputError(f"no case '{name}' of the policies: {nearest(name, list(CASES))}")
    return [_studied(name, controllers, episodes, workers, progress) for name in names or CASES]


def _studied(name: str, controllers: Sequence[str], episodes: int, workers: int, progress: Callable[[str], None]
             ) -> Studied:  # fmt: skip
    true = CASES[name]
    progress(f"{name}: flying a record")
    flown = fly(load("clear_air", duration=RECORD_SECONDS, effects=true), seed=RECORD_SEED, observer=False,
                protection=False)
    found = answer(diagnose([flown.record], progress=progress))
    _, diagnosed = policy_gap.intervals(found)
    progress(f"{name}: {len(controllers)} controllers on three plants")
    ranking = policy_gap.rank(true, diagnosed, controllers, episodes, workers=workers)
    return Studied(name, true, found["verdict"], {k: dict(v) for k, v in diagnosed.items()},  # type: ignore[arg-type]
                   ranking, policy_gap.sentences(ranking))


def tables(found: Sequence[Studied]) -> list[tuple[str, dict[str, str], list[list[str]]]]:
    """Ranks before and after, a table per case."""
    out = []
    for case in found:
        named = "; ".join(f"{name} ({', '.join(f'{p} {v:.3g}' for p, v in values.items())})"
                          for name, values in case.diagnosed.items()) or case.verdict
        out.append((f"{case.name}, diagnosed: {named}", *policy_gap.rows(case.ranking)))
    return out
