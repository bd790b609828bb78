"""The sums of real-time frequency domain: transforms that grow sample by sample, and the regression between them.

Equations and sources: `estimators.recursive.real_time_frequency`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from estimators.observer.layout import ACCELEROMETER, COUNT, FIRST, SEEN
from icing_env.jit import block, kernel

FREQUENCIES = 36
SIGNALS = 32  # 26 regressors and 6 targets
LOW = 6  # frequencies next to zero, whose residuals tell those at zero
MEMORY = np.dtype([
    *SEEN,
    ("re", "f8", (FREQUENCIES, SIGNALS)), ("im", "f8", (FREQUENCIES, SIGNALS)), ("zero", "f8", (SIGNALS,)),
    ("phase", "f8", (FREQUENCIES, 2)), ("turn", "f8", (FREQUENCIES, 2)),  # cosine and sine of w t, and of w dt
    ("length", "f8", (6,)),  # s, of what each channel's sums hold
    ("prior", "f8", (26,)),  # where the estimates started
    ("leak", "f8", (6,)),  # the bias term as fitted over the band
    ("square", "f8", (6,)),  # mean |residual|^2 over the band after the last fit
    ("clock", "f8"),  # s until the next estimate
    ("signal", "f8", (SIGNALS,)), ("keep", "f8", (SIGNALS,)),  # scratch
    ("a", "f8", (6, 6)), ("b", "f8", (6, 6)), ("score", "f8", (6,)), ("right", "f8", (6,)),  # scratch
])  # fmt: skip


@block
def set_phases(ob: Any, tn: Any, dt: float) -> None:
    """Phases at half a step, and the turn of a step, of equally spaced frequencies."""
    for k in range(FREQUENCIES):
        w = 2.0 * math.pi * (tn["lowest"] + k * (tn["highest"] - tn["lowest"]) / (FREQUENCIES - 1))
        ob["phase"][k, 0], ob["phase"][k, 1] = math.cos(0.5 * w * dt), math.sin(0.5 * w * dt)
        ob["turn"][k, 0], ob["turn"][k, 1] = math.cos(w * dt), math.sin(w * dt)


@block
def transform(ob: Any, tn: Any, heard: Any, dt: float) -> None:
    """Take one sampling interval into the sums; heard: how much of it each channel is to hear (s, six)."""
    signal, keep = ob["signal"], ob["keep"]
    for c in range(6):
        weight = heard[c] / dt
        lasts = math.exp(-heard[c] / (tn["drag_memory"] if c == 0 else tn["memory"]))
        ob["length"][c] = lasts * ob["length"][c] + heard[c]
        for i in range(FIRST[c], FIRST[c] + COUNT[c]):
            signal[i], keep[i] = 0.5 * heard[c] * (ob["row_before"][i] + ob["row"][i]), lasts
        a = ACCELEROMETER[c]
        if a >= 0:
            signal[26 + c] = 0.5 * heard[c] * (ob["felt_before"][a] + ob["felt"][a])
        else:
            change = ob["y"][c] - ob["y_before"][c]
            signal[26 + c] = weight * change - 0.5 * heard[c] * (ob["rest_before"][c] + ob["rest"][c])
        keep[26 + c] = lasts
    for i in range(SIGNALS):
        ob["zero"][i] = keep[i] * ob["zero"][i] + signal[i]
    for k in range(FREQUENCIES):
        cosine, sine = ob["phase"][k, 0], ob["phase"][k, 1]
        for i in range(SIGNALS):
            ob["re"][k, i] = keep[i] * ob["re"][k, i] + cosine * signal[i]
            ob["im"][k, i] = keep[i] * ob["im"][k, i] - sine * signal[i]
        ob["phase"][k, 0] = cosine * ob["turn"][k, 0] - sine * ob["turn"][k, 1]
        ob["phase"][k, 1] = sine * ob["turn"][k, 0] + cosine * ob["turn"][k, 1]


@kernel
def residual(ob: Any, c: int, k: int) -> tuple[float, float]:
    """Z - X theta of a channel at frequency k, with its present estimates."""
    re, im = ob["re"][k, 26 + c], ob["im"][k, 26 + c]
    for i in range(FIRST[c], FIRST[c] + COUNT[c]):
        re -= ob["re"][k, i] * ob["theta"][i]
        im -= ob["im"][k, i] * ob["theta"][i]
    return re, im


@block
def invert(ob: Any, m: int) -> bool:
    """ob["a"] (m, m) by its inverse, in place, Gauss-Jordan on a positive definite matrix. False if it is not.

    A pivot that elimination leaves less than 1e-10 of is the rounding of terms that cannot be told apart.
    """
    a, whole = ob["a"], ob["score"]
    for k in range(m):
        whole[k] = a[k, k]
    for k in range(m):
        pivot = a[k, k]
        if not pivot > 1e-10 * whole[k]:
            return False
        a[k, k] = 1.0
        for j in range(m):
            a[k, j] /= pivot
        for i in range(m):
            if i != k:
                factor = a[i, k]
                a[i, k] = 0.0
                for j in range(m):
                    a[i, j] -= factor * a[k, j]
    return True


@kernel
def spectrum(ob: Any, c: int) -> float:
    """Mean |residual|^2 of a channel over the band."""
    energy = 0.0
    for k in range(FREQUENCIES):
        re, im = residual(ob, c, k)
        energy += re * re + im * im
    return energy / FREQUENCIES


@block
def fit(ob: Any, tn: Any, c: int) -> bool:
    """Estimates of one channel from its sums over the band. False if they cannot be told, even with the prior."""
    first, m, a, right = FIRST[c], COUNT[c], ob["a"], ob["right"]
    level, ob["theta"][first] = ob["theta"][first], ob["leak"][c]
    if ob["square"][c] == 0.0:
        ob["square"][c] = spectrum(ob, c)
    for i in range(m):
        prior = ob["square"][c] * tn["q0"] / (ob["scale"][first + i] * ob["scale"][first + i])
        right[i] = prior * (ob["prior"][first + i] - ob["theta"][first + i])
        for j in range(m):
            a[i, j] = prior if i == j else 0.0
    for k in range(FREQUENCIES):
        re, im = residual(ob, c, k)
        for i in range(m):
            right[i] += ob["re"][k, first + i] * re + ob["im"][k, first + i] * im
            for j in range(m):
                a[i, j] += ob["re"][k, first + i] * ob["re"][k, first + j]
                a[i, j] += ob["im"][k, first + i] * ob["im"][k, first + j]
    if not invert(ob, m):
        ob["theta"][first] = level
        return False
    for i in range(m):
        for j in range(m):
            ob["theta"][first + i] += a[i, j] * right[j]
    ob["leak"][c], ob["square"][c] = ob["theta"][first], spectrum(ob, c)
    scatter(ob, tn, c)
    return True


@block
def scatter(ob: Any, tn: Any, c: int) -> None:
    """Standard deviations of a channel's derivatives after `fit`, from the scores that its residuals leave."""
    first, m, a, b, score = FIRST[c], COUNT[c], ob["a"], ob["b"], ob["score"]
    spacing = (tn["highest"] - tn["lowest"]) / (FREQUENCIES - 1)
    apart = max(1.0, 1.0 / (spacing * max(ob["length"][c], 1e-9)))
    inflation = FREQUENCIES / max(1.0, FREQUENCIES / apart - 0.5 * m)  # apart times m/(m - p)
    for i in range(m):
        prior = ob["square"][c] * tn["q0"] / (ob["scale"][first + i] * ob["scale"][first + i])
        for j in range(m):
            b[i, j] = prior * ob["square"][c] if i == j else 0.0
    for k in range(FREQUENCIES):
        re, im = residual(ob, c, k)
        for i in range(m):
            score[i] = ob["re"][k, first + i] * re + ob["im"][k, first + i] * im
        for i in range(m):
            for j in range(m):
                b[i, j] += inflation * score[i] * score[j]
    for i in range(m):
        total = 0.0
        for j in range(m):
            for k in range(m):
                total += a[i, j] * b[j, k] * a[i, k]
        ob["deviation"][first + i] = math.sqrt(max(total, 0.0))


@block
def level(ob: Any, tn: Any, c: int) -> None:
    """The channel's bias (its first parameter) from w = 0, the derivatives given.

    Its variance: that of the residual at zero, taken to be that next to zero, and what the derivatives' bring.
    """
    first, energy = FIRST[c], 0.0
    if not abs(ob["zero"][first]) > 0.0:
        return
    rest = ob["zero"][26 + c]
    if COUNT[c] == 1:
        ob["leak"][c] = ob["theta"][first]
    ob["theta"][first] = ob["leak"][c]
    for i in range(first + 1, first + COUNT[c]):
        rest -= ob["zero"][i] * ob["theta"][i]
    for k in range(LOW):
        re, im = residual(ob, c, k)
        energy += re * re + im * im
    variance = energy / LOW
    for i in range(first + 1, first + COUNT[c]):
        variance += (ob["zero"][i] * ob["deviation"][i]) ** 2
    ob["theta"][first] = rest / ob["zero"][first]
    prior = ob["scale"][first] / math.sqrt(tn["q0"])
    ob["deviation"][first] = min(prior, math.sqrt(variance) / abs(ob["zero"][first]))
