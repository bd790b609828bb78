"""What every recursive identifier does at the beginning and at the end of a sample; between them it learns."""

from __future__ import annotations

from typing import Any

from estimators.observer.filters import look, remember
from estimators.observer.report import follow_drag, report
from estimators.observer.rows import readable
from icing_env.jit import kernel


@kernel
def open_sample(
    ob: Any, est: Any, m: Any, af: Any, tn: Any, dt: float
) -> tuple[bool, tuple[float, float, float, float]]:
    """Whether the sample is to be learned from, and the shares of excitation of pitch, turn, lift and side force.

    Health falls to 0 until `close_sample`. After a sample that cannot be read the filters start again; an identifier
    that has failed stays failed.
    """
    est["health"] = 0.0
    if ob["failed"] > 0.0:
        return False, (0.0, 0.0, 0.0, 0.0)
    if not readable(m):
        ob["seated"] = 0.0
        return False, (0.0, 0.0, 0.0, 0.0)
    return True, look(ob, m, af, tn, dt)


@kernel
def close_sample(
    ob: Any, est: Any, af: Any, tn: Any, good: bool, excited: tuple[float, float, float, float], dt: float
) -> None:
    """Remember the sample and report the estimates; not `good` marks the identifier failed and reports nothing."""
    if not good:
        ob["failed"] = 1.0
        return
    if ob["seated"] > 0.0:
        follow_drag(ob, af, tn, dt)
    remember(ob)
    report(ob, est, excited[0], excited[1])
