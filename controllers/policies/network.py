"""The arithmetic of a learned policy: features, layers and a long short-term memory, row by row.

Sums run in one order whatever the number of rows, so that an aircraft in a batch is flown bit for bit as one alone.
Weights lie one layer after another in a single array: [inputs, outputs] of the matrix, then the offsets.
"""

from __future__ import annotations

import math
from typing import Any

from numpy.typing import NDArray

from icing_env.jit import entry, kernel

TANH, RELU, LINEAR = 0, 1, 2


@kernel
def feature(value: float, centre: float, per_scale: float) -> float:
    """One input of the network: asinh, so that small errors count in proportion and large ones by their order."""
    return math.asinh((value - centre)*per_scale)


@kernel
def activated(value: float, kind: int) -> float:
    """Activation of a unit."""
    if kind == TANH:
        return math.tanh(value)
    if kind == RELU:
        return max(value, 0.0)
    return value


@kernel
def sigmoid(value: float) -> float:
    """Logistic function."""
    return 1.0/(1.0 + math.exp(-value))


@kernel
def dense(weights: Any, at: int, x: Any, inputs: int, out: Any, outputs: int, kind: int) -> int:
    """One layer of a row: `out` = activation(x W + b); returns where the next layer's weights begin."""
    bias = at + inputs*outputs
    for j in range(outputs):
        out[j] = weights[bias + j]
    for k in range(inputs):
        row, value = at + k*outputs, x[k]
        for j in range(outputs):
            out[j] += value*weights[row + j]
    for j in range(outputs):
        out[j] = activated(out[j], kind)
    return bias + outputs


@kernel
def remember(weights: Any, x: Any, inputs: int, hidden: Any, cell: Any, units: int, gates: Any) -> int:
    """One step of a long short-term memory (Hochreiter & Schmidhuber 1997; gates in the order i, f, g, o of PyTorch).

    `hidden` and `cell` are changed; returns where the next layer's weights begin.
    """
    at, four = inputs*4*units, 4*units
    bias = at + units*four
    for j in range(four):
        gates[j] = weights[bias + j]
    for k in range(inputs):
        row, value = k*four, x[k]
        for j in range(four):
            gates[j] += value*weights[row + j]
    for k in range(units):
        row, value = at + k*four, hidden[k]
        for j in range(four):
            gates[j] += value*weights[row + j]
    for k in range(units):
        cell[k] = (sigmoid(gates[units + k])*cell[k]
                   + sigmoid(gates[k])*math.tanh(gates[2*units + k]))
        hidden[k] = sigmoid(gates[3*units + k])*math.tanh(cell[k])
    return bias + four


@entry
def features(seen: NDArray[Any], centre: NDArray[Any], per_scale: NDArray[Any], out: NDArray[Any]) -> None:
    """Inputs of the network [n, channels] from observations [n, channels]."""
    for i in range(seen.shape[0]):
        for j in range(seen.shape[1]):
            out[i, j] = feature(seen[i, j], centre[j], per_scale[j])


@entry
def act(seen: NDArray[Any], centre: NDArray[Any], per_scale: NDArray[Any], weights: NDArray[Any], sizes: NDArray[Any],
        units: int, kind: int, squash: bool, hold: int, age: NDArray[Any], hidden: NDArray[Any], cell: NDArray[Any],
        work: NDArray[Any], action: NDArray[Any]) -> None:
    """Actions of every row whose last one has stood for `hold` steps; the others keep theirs.

    Args:
        seen: observations [n, channels].
        centre, per_scale: of the features [channels].
        weights: of all layers in order, the memory's first.
        sizes: width of the input of the first layer and of every layer's output.
        units: of the memory, 0 without one.
        kind: activation of the hidden layers.
        squash: tanh on the output, else it is cut at -1 and 1.
        hold: steps for which an action stands.
        age: steps since the reset [n]; counted on.
        hidden, cell: state of the memory [n, units]; changed.
        work: room [3, widest].
        action: [n, actions]; written.
    """
    for i in range(seen.shape[0]):
        due = age[i] % hold == 0
        age[i] += 1
        if not due:
            continue
        channels = seen.shape[1]
        for j in range(channels):
            work[0, j] = feature(seen[i, j], centre[j], per_scale[j])
        at, source = 0, 0
        if units > 0:
            at = remember(weights, work[0], channels, hidden[i], cell[i], units, work[2])
            for j in range(units):
                work[0, j] = hidden[i, j]
        last = len(sizes) - 2
        for layer in range(last + 1):
            at = dense(weights, at, work[source], sizes[layer], work[1 - source], sizes[layer + 1],
                       kind if layer < last else LINEAR)
            source = 1 - source
        for j in range(action.shape[1]):
            value = work[source, j]
            action[i, j] = math.tanh(value) if squash else min(max(value, -1.0), 1.0)
