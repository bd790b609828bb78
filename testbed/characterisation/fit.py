"""Fitting the rivals: classes, `iced` and severities each by itself, side by side in one network.

Cross-entropy for the classes and for `iced`, squares for severities, then the likelihood of what those left for their
deviations (both at once end where a large deviation excuses a poor mean). Each head has its own hidden units: their
losses differ in size by an order, one would starve the others. Minimised by scipy's L-BFGS
with the gradient written out (one hidden layer at most) and an L2 penalty on the slopes. Temperatures and a scale for
each severity's deviation are then fitted on other flights.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.optimize import minimize, minimize_scalar
from scipy.special import expit

from estimators.characterise.features import FEATURES
from estimators.characterise.model import CLASSES, ETA_SCALE, LARGEST, PARTS, SMALLEST, Model, softmax
from testbed.characterisation.dataset import Windows

FloatArray = NDArray[np.float64]
Loss = Callable[[FloatArray], tuple[float, FloatArray]]  # outputs [n, k] -> mean loss, gradient [n, k]
PENALTY = 1e-3  # L2 on the weights that meet standardised features, against the mean loss (assumed)
NEURONS = 16  # hidden units of each head (assumed)
K, S = len(CLASSES), len(PARTS)


@dataclass(frozen=True)
class Shape:
    """What a rival sees and has: columns of the features, hidden units of each head (0: no hidden layer)."""

    columns: tuple[int, ...]
    neurons: int = 0


SHAPES = {
    "threshold": Shape((FEATURES.index("shift_CX"),)),
    "logistic": Shape(tuple(range(len(FEATURES)))),
    "network": Shape(tuple(range(len(FEATURES))), NEURONS),
}


def class_loss(label: NDArray[np.int64]) -> Loss:
    """Cross-entropy of the five classes."""
    rows = np.arange(len(label))

    def loss(out: FloatArray) -> tuple[float, FloatArray]:
        p = softmax(out)
        value = -float(np.log(np.maximum(p[rows, label], 1e-300)).mean())
        p[rows, label] -= 1.0
        return value, p/len(label)

    return loss


def iced_loss(iced: FloatArray) -> Loss:
    """Cross-entropy of `iced`."""

    def loss(out: FloatArray) -> tuple[float, FloatArray]:
        z = out[:, 0]
        value = float((np.logaddexp(0.0, z) - iced*z).mean())
        return value, ((expit(z) - iced)/len(z))[:, None]

    return loss


def severity_loss(eta: FloatArray) -> Loss:
    """Half the squared error of the severities, in ETA_SCALE."""

    def loss(out: FloatArray) -> tuple[float, FloatArray]:
        r = out - eta/ETA_SCALE
        return float(0.5*(r*r).sum(axis=1).mean()), r/len(eta)

    return loss


def spread_loss(error: FloatArray) -> Loss:
    """Gaussian negative log-likelihood of errors [n, parts] in ETA_SCALE by the logarithm of their deviations."""

    def loss(out: FloatArray) -> tuple[float, FloatArray]:
        spread = np.clip(out, SMALLEST, LARGEST)
        r = (error*np.exp(-spread))**2
        inside = (out > SMALLEST) & (out < LARGEST)
        return float((0.5*r + spread).sum(axis=1).mean()), (1.0 - r)*inside/len(error)

    return loss


def fit_head(z: FloatArray, loss: Loss, outputs: int, neurons: int, seed: int, iterations: int) -> list[FloatArray]:
    """Weights of one head on standardised features z [n, columns]: [W, b], or [W1, b1, W, b] with a hidden layer."""
    rng = np.random.default_rng(seed)
    inputs = z.shape[1]
    sizes: list[tuple[int, ...]] = [(inputs, neurons), (neurons,)] if neurons else []
    sizes += [(neurons or inputs, outputs), (outputs,)]
    start = np.concatenate([rng.normal(0.0, 0.5/np.sqrt(size[0]), size).ravel() if len(size) == 2
                            else np.zeros(size) for size in sizes])
    edges = np.cumsum([0, *(int(np.prod(size)) for size in sizes)])
    slopes = np.zeros(len(start))
    slopes[:edges[1]] = PENALTY

    def unpack(theta: FloatArray) -> list[FloatArray]:
        return [theta[a:b].reshape(size) for a, b, size in zip(edges[:-1], edges[1:], sizes, strict=True)]

    def objective(theta: FloatArray) -> tuple[float, FloatArray]:
        *hidden, w, b = unpack(theta)
        h = np.tanh(z @ hidden[0] + hidden[1]) if hidden else z
        value, by_out = loss(h @ w + b)
        parts = [h.T @ by_out, by_out.sum(axis=0)]
        if hidden:
            back = (by_out @ w.T)*(1.0 - h*h)
            parts = [z.T @ back, back.sum(axis=0), *parts]
        gradient = np.concatenate([part.ravel() for part in parts])
        return value + float(slopes @ theta**2), gradient + 2.0*slopes*theta

    return unpack(minimize(objective, start, jac=True, method="L-BFGS-B",
                           options={"maxiter": iterations, "maxcor": 20}).x)


def forward(z: FloatArray, head: list[FloatArray]) -> FloatArray:
    """Outputs of one head [n, outputs]."""
    *hidden, w, b = head
    return np.asarray((np.tanh(z @ hidden[0] + hidden[1]) if hidden else z) @ w + b)


def fit(shape: Shape, x: FloatArray, data: Windows, seed: int, iterations: int = 400) -> Model:
    """Fit one rival of one kind to features `x` [n, features]; temperatures are left at one."""
    columns = np.array(shape.columns, np.int64)
    mean, scale = x[:, columns].mean(axis=0), np.maximum(x[:, columns].std(axis=0), 1e-3)
    z, single = np.clip((x[:, columns] - mean)/scale, -8.0, 8.0), data.label >= 0
    heads = [
        fit_head(z[single], class_loss(data.label[single]), K, shape.neurons, seed, iterations),
        fit_head(z, iced_loss(data.iced), 1, shape.neurons, seed + 1, iterations),
        fit_head(z, severity_loss(data.eta), S, shape.neurons, seed + 2, iterations),
    ]
    error = forward(z, heads[-1]) - data.eta/ETA_SCALE
    heads.append(fit_head(z, spread_loss(error), S, shape.neurons, seed + 3, iterations))
    last = [head[-2] for head in heads]
    arrays: dict[str, NDArray] = {
        "columns": columns, "mean": mean, "scale": scale, "temper": np.ones(2 + S),
        "W": block_diag(*last) if shape.neurons else np.concatenate(last, axis=1),
        "b": np.concatenate([head[-1] for head in heads])}
    if shape.neurons:
        arrays["W1"] = np.concatenate([head[0] for head in heads], axis=1)
        arrays["b1"] = np.concatenate([head[1] for head in heads])
    return Model(arrays)


def temper(model: Model, x: FloatArray, data: Windows) -> Model:
    """Temperatures of both probabilities and scales of the severities' deviations, by likelihood on other flights."""
    out, single = model.outputs(x), data.label >= 0
    losses = (lambda t: class_loss(data.label[single])(np.exp(t)*out[single, :K])[0],
              lambda t: iced_loss(data.iced)(np.exp(t)*out[:, K:K + 1])[0])
    found = [np.exp(minimize_scalar(loss, bounds=(-2.0, 2.0), method="bounded").x) for loss in losses]
    raw = Model({**model.arrays, "temper": np.ones(2 + S)}).judge(x)
    wide = np.sqrt(np.mean(((raw.eta - data.eta)/raw.std)**2, axis=0))
    return Model({**model.arrays, "temper": np.array([*found, *wide])})
