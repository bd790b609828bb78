"""What a surface leaves that answers as predicted, rigged and picked up as is likeliest.

How a surface is rigged, and how its position is picked up, is as uncertain here as everywhere: a gear that is off by a
hundredth is no other answer.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from icing_env.record import FloatArray
from sim2real.actuators.paths import believed
from sim2real.library.candidates import PICK_UPS
from sim2real.records.reconstruct import Reconstruction


def squares_left(answers: Sequence[tuple[Reconstruction, FloatArray]], surface: str, first: int = 0) -> FloatArray:
    """Whitened square that is left of a surface's recorded positions by each of some predictions [M].

    Args:
        answers: records, each with the predicted positions along it [N, M].
        first: sample from which they count.
    """
    gear, offset = (PICK_UPS[f"{surface}_{of}"] for of in ("gearing", "offset"))
    count = answers[0][1].shape[1]
    grams = np.tile(np.diag([0.0, 1.0, 1.0]), (count, 1, 1))
    for flight, predicted in answers:
        left = believed(flight, surface, np.column_stack([predicted, predicted * (1.0 + gear), predicted + offset]))
        own = left[first:].reshape(-1, 3, count).transpose(2, 0, 1)
        own = np.concatenate([own[:, :, :1], own[:, :, 1:] - own[:, :, :1]], axis=2)
        grams += np.swapaxes(own, 1, 2) @ own
    taken = np.linalg.solve(grams[:, 1:, 1:], grams[:, 1:, :1])
    return np.asarray(grams[:, 0, 0] - (grams[:, 0, None, 1:] @ taken)[:, 0, 0])
