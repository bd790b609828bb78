"""The gap between model and aircraft, in tolerances, before and after a diagnosis, and how much of it closes.

e_c = RMS of a channel's residual over its tolerance; f_c the same for noise and gust alone (the model's own synthetic
records through the same windows); g = sqrt(mean over channels of max(e_c^2 - f_c^2, 0)); closure is
1 - g_after/g_before.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from icing_env.record import FloatArray
from sim2real.actuators.paths import driven
from sim2real.prediction.gusts import Gusts
from sim2real.prediction.windows import COMPARED, Pusher, cut, null_residuals, residuals
from sim2real.records.reconstruct import Reconstruction

REPEATS = 20  # synthetic records behind f_c and behind the gap that no gap shows
RESAMPLES = 400

Change = Callable[[NDArray], NDArray]
Paths = Collection[str]  # surfaces whose actuators are flown too, from the recorded commands


@dataclass(frozen=True)
class Energy:
    """Mean square residual per window and channel, before and after, and of noise and gust alone.

    before, after: [windows, channels]; alone: [repeats, windows, channels]; starts: [windows, free states].
    """

    before: FloatArray
    after: FloatArray
    alone: FloatArray
    starts: FloatArray


def energies(flight: Reconstruction, change: Change, gusts: Gusts, seed: int, paths: Paths = ()) -> Energy:
    """Residual energy of one record under the model and under the model changed by the diagnosis.

    Args:
        change: what the diagnosis changes in PARAMETERS.
        gusts, seed: of the synthetic records behind noise and gusts alone.
        paths: surfaces that follow the recorded commands through the actuator, before and after alike; the others
            are where they were recorded.
    """
    windows, base = cut(flight), flight.parameters
    asked = driven(flight, base, paths)
    left, start = residuals(asked, base, windows)
    before = _mean_square(left)
    same = change(base).tobytes() == base.tobytes()
    after = before if same else squares(flight, change, paths)
    alone = null_residuals(asked, base, windows, start, gusts, REPEATS, seed)
    return Energy(before, after, _mean_square(alone), start)


def squares(flight: Reconstruction, change: Change, paths: Paths = (),
            push: Callable[[], Pusher] | None = None) -> FloatArray:
    """Mean square residual [windows, channels] of one record under a changed model.

    Args:
        change, paths: as for `energies`.
        push: as for `sim2real.prediction.windows.fly`.
    """
    changed = change(flight.parameters)
    return _mean_square(residuals(driven(flight, changed, paths), changed, cut(flight), push)[0])


def of_all(flights: Sequence[Reconstruction], change: Change, paths: Paths = ()) -> FloatArray:
    """`squares` [windows, channels] of several records, one after the other."""
    return np.concatenate([squares(flight, change, paths) for flight in flights])


def together(parts: list[Energy]) -> Energy:
    """Windows of several records as one set."""
    return Energy(np.concatenate([p.before for p in parts]), np.concatenate([p.after for p in parts]),
                  np.concatenate([p.alone for p in parts], axis=1), np.concatenate([p.starts for p in parts]))


def _mean_square(left: FloatArray) -> FloatArray:
    """Over the samples of a window; nan where a channel has none."""
    known = np.isfinite(left)
    total = np.where(known, left, 0.0) ** 2
    count = known.sum(axis=-2)
    return np.asarray(np.where(count > 0, total.sum(axis=-2) / np.maximum(count, 1), np.nan))


def by_channel(energy: FloatArray) -> dict[str, float]:
    """e_c by channel, those recorded."""
    values = np.sqrt([np.mean(c[np.isfinite(c)]) if np.isfinite(c).any() else np.nan for c in energy.T])
    return {name: float(v) for name, v in zip(COMPARED, values, strict=True) if np.isfinite(v)}


def g(energy: FloatArray, alone: FloatArray) -> float:
    """Gap of windows [windows, channels] above that of noise and gust alone [..., windows, channels]."""
    mine = _channel_mean(energy)
    repeats = _channel_mean(alone.reshape(-1, *energy.shape))
    theirs = np.nan_to_num(_channel_mean(repeats))  # of those in which the model itself stays in the air
    excess = np.maximum(mine - theirs, 0.0)
    return float(np.sqrt(np.mean(excess[np.isfinite(excess)])))


def _channel_mean(energy: FloatArray) -> FloatArray:
    """Mean over windows (or repeats) [..., windows, channels]; nan where a channel has none."""
    known = np.isfinite(energy)
    count = known.sum(axis=-2)
    return np.asarray(np.where(count > 0, np.where(known, energy, 0.0).sum(axis=-2) / np.maximum(count, 1), np.nan))


def null_quantile(alone: FloatArray, q: float = 0.95) -> float:
    """Gap that records without a gap reach with probability `q`; zero where the model stays in the air in none."""
    flown = [i for i, energy in enumerate(alone) if np.isfinite(energy).any()]
    found = [g(alone[i], np.delete(alone, i, axis=0)) for i in flown]
    return float(np.quantile(found, q)) if found else 0.0


def held_out(energy: Energy | None, seed: int, effects_alone: FloatArray | None = None) -> dict[str, object]:
    """The figures of `gap.held_out`; null where there is no held-out record or no gap to close.

    Args:
        energy: with all that the diagnosis changes.
        seed: of the interval.
        effects_alone: what its effects alone leave [windows, channels], the model's own numbers as they were.
    """
    keys = ("before", "after", "closure", "closure_low95", "closure_high95", "after_effects_alone",
            "closure_effects_alone", "worst_channel", "by_channel")  # fmt: skip
    out: dict[str, object] = dict.fromkeys(keys)
    if energy is None:
        return out
    gap, left = g(energy.before, energy.alone), {"": g(energy.after, energy.alone)}
    if effects_alone is not None:
        left["_effects_alone"] = g(effects_alone, energy.alone)
    out |= {"before": gap} | {f"after{which}": value for which, value in left.items()}
    before, after = by_channel(energy.before), by_channel(energy.after)
    out["by_channel"] = {c: {"before": before[c], "after": after[c]} for c in before}
    out["worst_channel"] = max(after, key=lambda c: after[c])
    if gap > null_quantile(energy.alone):
        out |= {f"closure{which}": 1.0 - value / gap for which, value in left.items()}
        out["closure_low95"], out["closure_high95"] = _interval(energy, seed)
    return out


def _interval(energy: Energy, seed: int) -> tuple[float | None, float | None]:
    """95 % interval of the closure over windows drawn anew (each window a block)."""
    rng, n = np.random.default_rng(seed), len(energy.before)
    found = []
    for _ in range(RESAMPLES):
        rows = rng.integers(0, n, n)
        before = g(energy.before[rows], energy.alone[:, rows])
        if before > 0.0:
            found.append(1.0 - g(energy.after[rows], energy.alone[:, rows]) / before)
    if len(found) < RESAMPLES // 2:
        return None, None
    return float(np.quantile(found, 0.025)), float(np.quantile(found, 0.975))
