"""Free simulation of a record in 10 s windows: our plant under the recorded controls, nobody correcting it.

The state at the start of a window is estimated from its first 2 s by Gauss-Newton on airspeed, flow angles, rates and
attitude, with the same freedom for every model, so that no model profits from being started better.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from icing_env.record import FloatArray
from sim2real.prediction.gusts import Gusts
from sim2real.prediction.predictor import Predictor, put
from sim2real.records.channels import MEASURED, TOLERANCE
from sim2real.records.reconstruct import Reconstruction

LENGTH, START = 10.0, 2.0  # s
FREE = ("airspeed", "alpha", "beta", "p", "q", "r", "phi", "theta")
COMPARED = MEASURED[:12]
ITERATIONS = 2
FARTHEST = 100.0  # tolerances: farther off is no better than no numbers
# What pushes the plant as it flies: told the rows and the sample each stands at, it returns what accelerometers feel of
# it [rows, 3]. One is made for every flight, since it may remember.
Pusher = Callable[[Predictor, NDArray[np.intp]], FloatArray]
_AX = COMPARED.index("ax")
_TOLERANCE = np.array([TOLERANCE[c] for c in COMPARED])


@dataclass(frozen=True)
class Windows:
    """Where windows begin [samples] and how long they are."""

    first: NDArray[np.intp]
    length: int
    start: int


def cut(flight: Reconstruction) -> Windows:
    """Windows one after another; one shorter window if the record is shorter than that."""
    length = min(round(LENGTH / flight.dt), len(flight.time) - 1)
    first = np.arange(0, len(flight.time) - length, length)
    return Windows(first if len(first) else np.zeros(1, np.intp), length, min(round(START / flight.dt), length))


def measured_windows(flight: Reconstruction, windows: Windows) -> FloatArray:
    """What was measured [windows, samples, channels], the first sample left out."""
    index = windows.first[:, None] + 1 + np.arange(windows.length)
    return np.asarray(flight.measured[index][:, :, : len(COMPARED)])


def fly(flight: Reconstruction, parameters: NDArray, first: NDArray[np.intp], start: FloatArray, steps: int,
        gusts: tuple[Gusts, int] | None = None, push: Callable[[], Pusher] | None = None) -> FloatArray:
    """Fly rows freely from sample `first` of each.

    Args:
        parameters: a PARAMETERS row each.
        start: [rows, FREE].
        steps: how many samples.
        gusts: what gusts, and a seed, to make a synthetic measurement with noise; none if omitted.
        push: makes what pushes the rows beside their own equations; nothing if omitted.

    Returns:
        Readings [rows, steps, channels compared].
    """
    flown = Predictor(flight, parameters)
    if gusts is not None:
        gusts[0].put(flown.fleet.parameters)
    values = {name: start[:, j] for j, name in enumerate(FREE)}
    values |= {name: series[first] for name, series in flight.controls.items()}
    put(flown.fleet, values | {"altitude": flight.altitude[first]})
    flown.fleet.state["step"] = first  # what grows with time has grown by then
    if gusts is not None:
        flown.fleet.state["seed"] = np.arange(len(first), dtype=np.uint64) + np.uint64(gusts[1])
        flown.fleet.start()
    read = flown.fly(steps, first) if push is None else _pushed(flown, first, steps, push())
    out = np.ascontiguousarray(read.transpose(1, 0, 2)[:, :, : len(COMPARED)])
    if gusts is not None:
        rng = np.random.default_rng(gusts[1])
        out += rng.standard_normal(out.shape) * flight.noise[: len(COMPARED)]
    return out


def _pushed(flown: Predictor, first: NDArray[np.intp], steps: int, push: Pusher) -> FloatArray:
    """Step by step, pushed before each: readings [steps, rows, channels of MEASURED]."""
    out = np.empty((steps, flown.n, len(MEASURED)))
    for k in range(steps):
        felt = push(flown, first + k)
        out[k] = flown.fly(1, first + k)[0]
        out[k, :, _AX : _AX + 3] += felt
    return out


def estimate_start(flight: Reconstruction, parameters: NDArray, first: NDArray[np.intp], measured: FloatArray,
                   steps: int, push: Callable[[], Pusher] | None = None) -> FloatArray:
    """State at the start of each row [rows, FREE] that best gives the first `steps` samples of `measured`."""
    guess = _guess(flight, measured[:, : max(3, steps // 4)], first)
    rows, size = len(first), np.array([0.5, *np.full(7, 0.005)])
    weight = 1.0 / _TOLERANCE
    spread = np.concatenate([np.zeros((1, len(FREE))), np.diag(size)])
    for _ in range(ITERATIONS):
        tried = (guess[:, None, :] + spread).reshape(-1, len(FREE))
        y = fly(flight, np.repeat(parameters, len(spread)), np.repeat(first, len(spread)), tried, steps,
                push=push)  # fmt: skip
        y = y.reshape(rows, len(spread), steps, -1)
        left = np.nan_to_num((measured[:, :steps] - y[:, 0]) * weight)
        known = np.isfinite(measured[:, :steps])
        with np.errstate(invalid="ignore", over="ignore"):  # of a model that departs: its windows reach no numbers
            J = (y[:, 1:] - y[:, :1]) * weight * known[:, None] / size[:, None, None]
            J, r = J.reshape(rows, len(FREE), -1), left.reshape(rows, -1)
            normal = J @ J.transpose(0, 2, 1) + np.diag(1e-2 / (10.0 * size) ** 2)
            guess = guess + np.linalg.solve(normal, np.einsum("rfn,rn->rf", J, r)[..., None])[..., 0]
    return guess


def _guess(flight: Reconstruction, early: FloatArray, first: NDArray[np.intp]) -> FloatArray:
    """Mean of the first samples; the record's own where a channel is blank there, zero where it was not recorded."""
    out = np.empty((len(early), len(FREE)))
    for j, name in enumerate(FREE):
        values = early[:, :, COMPARED.index(name)]
        known = np.isfinite(values)
        mean = np.where(known, values, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
        out[:, j] = np.where(known.any(axis=1), mean, flight.channel(name)[first])
    return out


def residuals(flight: Reconstruction, parameters: NDArray, windows: Windows,
              push: Callable[[], Pusher] | None = None) -> tuple[FloatArray, FloatArray]:
    """Measured less freely simulated, in tolerances [windows, samples, channels], and the starts [windows, FREE]."""
    measured, rows = measured_windows(flight, windows), np.repeat(parameters, len(windows.first))
    start = estimate_start(flight, rows, windows.first, measured, windows.start, push)
    left = (measured - fly(flight, rows, windows.first, start, windows.length, push=push)) / _TOLERANCE
    away = np.clip(np.nan_to_num(left, nan=FARTHEST), -FARTHEST, FARTHEST)  # no numbers are no agreement
    return np.where(np.isfinite(measured), away, np.nan), start


def null_residuals(flight: Reconstruction, parameters: NDArray, windows: Windows, start: FloatArray, gusts: Gusts,
                   repeats: int, seed: int) -> FloatArray:
    """The same for synthetic records of the model itself, with noise and gusts alone, blank where the record is.

    A model far from the aircraft does not stay in the air under its controls: a window in which it departs by more than
    FARTHEST says nothing of noise and gusts, and is blank.

    Returns:
        [repeats, windows, samples, channels], in tolerances.
    """
    rows, first = np.repeat(parameters, repeats * len(windows.first)), np.tile(windows.first, repeats)
    made = fly(flight, rows, first, np.tile(start, (repeats, 1)), windows.length, (gusts, seed))
    blank = np.tile(~np.isfinite(measured_windows(flight, windows)), (repeats, 1, 1))
    made[blank] = np.nan
    found = estimate_start(flight, rows, first, made, windows.start)
    left = (made - fly(flight, rows, first, found, windows.length)) / _TOLERANCE
    left[(~blank & ~(np.abs(left) < FARTHEST)).any(axis=(1, 2))] = np.nan
    return left.reshape(repeats, len(windows.first), windows.length, -1)


