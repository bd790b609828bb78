"""Real-time frequency domain: regression between Fourier transforms that grow sample by sample.

Each channel's equation holds over every sampling interval by itself,
    y(k) - y(k-1) - h rest = h row'theta        (moments; for forces: h felt = h row'theta),
rows and rest in the mean of both ends. So it holds between recursive transforms, X(k) = lambda X(k-1) + x e^(-jwt), of
its two sides at any frequency: the transform of differences is that of the derivative, jwX with its end terms, and the
transforms of a gap or of flight without excitation, which weigh nothing, need no patching. Over a band without w = 0
    thetahat = Re(X'X)^-1 Re(X'Z)
is free of drifts, and of noise above the band without a filter. What a constant leaks into the band is fitted as the
bias term; the bias itself, and zero-lift drag, come from the same sums at w = 0.
Source: Morelli, AIAA 99-4043 and J. Aircraft 37(1), 2000; Klein and Morelli, chapters 7 and 8.

Covariance: (X'X)^-1 {sum of squared scores Re(x e)} (X'X)^-1, which needs no white spectrum of the residuals, times
1/(df T) where the frequencies stand closer than the record's length T can tell apart, times m/(m - p).
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.estimate import Estimate
from estimators.observer import record as runs
from estimators.observer.excitation import gate
from estimators.observer.filters import look, remember
from estimators.observer.layout import ACCELEROMETER, COUNT, FIRST, SEEN, seat
from estimators.observer.report import follow_drag, report
from estimators.observer.rows import readable
from estimators.observer.tuning import read_tuning, tuning_type
from icing_env.configuration import folder
from icing_env.jit import block, entry, kernel
from icing_env.record import FlightRecord

NUMBERS = ("lowest", "highest", "interval", "memory", "drag_memory", "bandwidth", "q0")
TUNING = tuning_type(NUMBERS, ())
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


def tuning_from(path: str | Path) -> NDArray[np.void]:
    """Read a tuning file; a `TUNING` array of one row. Raises InputError on an unknown or missing key."""
    return read_tuning(path, NUMBERS, ())


@cache
def _default() -> NDArray[np.void]:
    return tuning_from(folder() / "estimators" / "real_time_frequency.toml")


def default_tuning() -> NDArray[np.void]:
    """A fresh copy of the one tuning that everything uses (a `TUNING` array of one row)."""
    return _default().copy()


def init(parameters: NDArray[np.void], tuning: NDArray[np.void], n: int, start: float = 1.0) -> NDArray[np.void]:
    """Memory of `n` identifiers that start at `start` times the clean aircraft (`MEMORY` array).

    parameters: structured array with the fields of AIRFRAME, one row or n rows. tuning: `TUNING` array of one row.
    """
    memory = np.zeros(n, MEMORY)
    seat(memory, parameters, tuning, np.repeat(tuning["bandwidth"], 6), start)
    memory["prior"] = memory["theta"]
    memory["leak"] = memory["theta"][:, list(FIRST)]
    return memory


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


@kernel
def learn(ob: Any, tn: Any, excited: tuple[float, float, float, float], dt: float) -> bool:
    """One sample into the sums; at the end of an interval, new estimates. False if an estimate is not finite."""
    low, high = tn["share_low"], tn["share_high"]
    pitch, turn, lift, side = excited
    turning = dt * gate(turn, low, high)
    heard = (dt, dt * gate(lift, low, high), dt * gate(pitch, low, high), dt * gate(side, low, high), turning, turning)
    transform(ob, tn, heard, dt)
    ob["clock"] -= dt
    if ob["clock"] > 0.5 * dt:
        return True
    ob["clock"] += tn["interval"]
    total = 0.0
    for c in range(6):
        if heard[c] > 0.0 and (c == 0 or fit(ob, tn, c)):
            level(ob, tn, c)
    for i in range(26):
        total += ob["theta"][i] + ob["deviation"][i]
    return math.isfinite(total)


@kernel
def observe(ob: Any, est: Any, m: Any, af: Any, tn: Any, dt: float) -> None:
    """One aircraft, one sample. See `step`."""
    est["health"] = 0.0
    if ob["failed"] > 0.0:
        return
    if not readable(m):
        ob["seated"] = 0.0
        return
    excited = look(ob, m, af, tn, dt)
    if ob["seated"] > 0.0:
        if not learn(ob, tn, excited, dt):
            ob["failed"] = 1.0
            return
        follow_drag(ob, af, tn, dt)
    elif ob["turn"][0, 0] == 0.0:
        set_phases(ob, tn, dt)
        ob["clock"] = tn["interval"]
    remember(ob)
    report(ob, est, excited[0], excited[1])


@entry
def step(memory: Any, estimate: Any, measurement: Any, airframe: Any, tuning: Any, dt: float) -> None:
    """Advance `n` identifiers by one sample of `dt` seconds, in place; arguments as `estimators.hinf.step` has them.

    dt must be the same at each call. A sample with a NaN leaves estimates as they are and reports health 0.
    """
    for i in range(len(memory)):
        observe(memory[i], estimate[i], measurement[i], airframe[i if len(airframe) > 1 else 0], tuning[0], dt)


METHOD = runs.Method("real-time frequency domain", init, step, default_tuning, own_errors=True)


def identify(
    record: FlightRecord,
    tuning: NDArray[np.void] | None = None,
    start: float = 1.0,
    airframe: NDArray[np.void] | None = None,
) -> dict[str, Estimate]:
    """Derivatives by name at the end of the record; see `estimators.observer.record.identify`.

    Standard errors are the method's own (see above).
    """
    return runs.identify(METHOD, record, tuning, start, airframe)
