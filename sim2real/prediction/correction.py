"""What a step's prediction misses of the record, and the states corrected by it with the filter's gain.

Kernels of `along`: the rows of a block stand side by side in lanes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from icing_env.jit import kernel
from icing_env.lanes import LANES
from icing_env.types import MEASUREMENT, STATE
from sim2real.records.channels import FED_BACK

STATES = ("u", "v", "w", "p", "q", "r", "altitude", "alpha_downwash", "dryden_u", "dryden_v1", "dryden_v2",
          "dryden_w1", "dryden_w2", "dryden_p", "dryden_q", "dryden_r", "gust_u", "gust_v", "gust_w", "gust_w_tail",
          "gust_p", "gust_q", "gust_r", "pitot", "vane_alpha", "vane_beta",
          *(f"filtered_{c}" for c in ("alpha", "beta", "p", "q", "r", "ax", "ay", "az")))  # fmt: skip

ROTATION = ("dryden_p", "dryden_q", "dryden_r", "gust_p", "gust_q", "gust_r")  # zero where the air does not turn


def columns(kind: np.dtype, names: tuple[str, ...]) -> np.ndarray:
    """Where fields of eight bytes lie in a record seen as numbers."""
    return np.array([(kind.names or ()).index(name) for name in names])


X = columns(STATE, STATES)
MOVED = len(STATES)
CHANGED = MOVED + 2  # roll and pitch too, corrected through the quaternion
E0, E1, E2, E3 = (int(c) for c in columns(STATE, ("e0", "e1", "e2", "e3")))
_PHI = int(columns(MEASUREMENT, ("phi",))[0])


@kernel
def turn(x: Any, phi: float, roll: float, pitch: float) -> None:
    """Turn one row's attitude by small angles (rad): `roll` about body x, `pitch` about the horizontal y."""
    wy, wz = pitch * np.cos(phi), -pitch * np.sin(phi)
    e0, e1, e2, e3 = x[E0], x[E1], x[E2], x[E3]
    turned = (e0 + 0.5 * (-e1 * roll - e2 * wy - e3 * wz), e1 + 0.5 * (e0 * roll + e2 * wz - e3 * wy),
              e2 + 0.5 * (e0 * wy + e3 * roll - e1 * wz), e3 + 0.5 * (e0 * wz + e1 * wy - e2 * roll))
    x[E0], x[E1], x[E2], x[E3] = turned


@kernel
def miss(left: Any, measured: Any, stretch: Any, fed: Any, j: int) -> None:
    """Turn one row's prediction `left` into measured less predicted, and put what corrects it into lane `j`."""
    for c in range(len(left)):
        left[c] = measured[c] - left[c]
    for c in range(FED_BACK):
        fed[c*LANES + j] = left[c]*stretch[c] if np.isfinite(measured[c]) else 0.0


@kernel
def gained(gain: Any, fed: Any, change: Any) -> None:
    """Changes of a whole block's states by one gain [FED_BACK, CHANGED]; the same sums as `gained_by_one`."""
    for s in range(CHANGED):
        for j in range(LANES):
            total = 0.0
            for c in range(FED_BACK):
                total += gain[c, s]*fed[c*LANES + j]
            change[s*LANES + j] = total


@kernel
def gained_by_one(gain: Any, fed: Any, change: Any, j: int, scratch: Any) -> None:
    """Changes of the states of lane `j` by its own gain."""
    for s in range(CHANGED):
        scratch[s] = 0.0
    for c in range(FED_BACK):
        share = fed[c*LANES + j]
        for s in range(CHANGED):
            scratch[s] += gain[c, s]*share
    for s in range(CHANGED):
        change[s*LANES + j] = scratch[s]


@kernel
def correct(x: Any, phi: float, change: Any, j: int) -> None:
    """Move one row's states by what stands in lane `j`."""
    for s in range(MOVED):
        x[X[s]] += change[s*LANES + j]
    turn(x, phi, change[MOVED*LANES + j], change[(MOVED + 1)*LANES + j])


@kernel
def follow_record(x: Any, y: Any, left: Any, at: int, count: int, k: int, first: Any, last: Any, measured: Any,
                  stretch: Any, gain: Any, fed: Any, change: Any, scratch: Any) -> None:
    """Correct the `count` rows of a block from row `at` on by what they miss of the record at the end of step `k`.

    `left` [n, channels] becomes what they miss; fed, change, scratch: room for what corrects a block and one row; the
    others as in `along`. One gain at one sample for all rows of a block is used at once, which is quicker.
    """
    here, alike = min(first[at] + k, last[at] - 1), len(gain) == 1 and count == LANES
    for j in range(count):
        i = at + j
        now = min(first[i] + k, last[i] - 1)
        miss(left[i], measured[now + 1], stretch[i], fed, j)
        alike = alike and now == here
    if alike:
        gained(gain[0, min(here, gain.shape[1] - 1)], fed, change)
    else:
        for j in range(count):
            i = at + j
            now = min(first[i] + k, last[i] - 1)
            gained_by_one(gain[i if len(gain) > 1 else 0, min(now, gain.shape[1] - 1)], fed, change, j, scratch)
    for j in range(count):
        correct(x[at + j], y[at + j, _PHI], change, j)
