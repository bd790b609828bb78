"""Three rivals that turn features into ice, in one form: a network with no or one hidden layer, from safetensors.

    z = (x[columns] - mean)/scale,   h = tanh(z W1 + b1) or z,   out = h W + b

`threshold` sees the drag shift alone, `logistic` every feature without a hidden layer (multinomial logistic
regression), `network` has one hidden layer. Each comes twice: `type` for an aircraft known by its type only, `own` for
features taken from the aircraft's own clean flight (`features.against`). Probabilities are tempered (Guo et al.,
On Calibration of Modern Neural Networks, 2017) on flights that the fit has not seen.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load_file, save_file

from estimators.characterise.features import FEATURES
from icing_env.configuration import folder
from icing_env.errors import InputError, nearest

FloatArray = NDArray[np.float64]
CLASSES = ("clean", "moderate_wing", "severe_wing", "moderate_tail", "severe_tail")
PARTS = ("left_wing", "right_wing", "htail", "propeller")  # whose severity is told
RIVALS = ("threshold", "logistic", "network")
KINDS = ("type", "own")
ETA_SCALE = 0.1  # severities inside the network are in units of this
SMALLEST, LARGEST = -4.0, 2.0  # bounds of the logarithm of a severity's standard deviation, in ETA_SCALE
OUTPUTS = len(CLASSES) + 1 + 2*len(PARTS)  # classes, iced, severities, logarithms of their standard deviations
NAMES = ("columns", "mean", "scale", "W", "b", "temper")
HIDDEN = ("W1", "b1")


@dataclass(frozen=True)
class Judgement:
    """What a model says of `n` aircraft.

    Attributes:
        classes: probability of each of CLASSES [n, 5], for ice on one surface.
        iced: log-odds that ice matters (excess CD_0 above 0.01, or a tenth of CL_alpha lost) [n].
        eta: severity of each of PARTS [n, 4]; std: its standard deviation.
    """

    classes: FloatArray
    iced: FloatArray
    eta: FloatArray
    std: FloatArray


@dataclass(frozen=True)
class Model:
    """One rival of one kind. `arrays`: NAMES, and HIDDEN where it has a hidden layer."""

    arrays: dict[str, NDArray]

    def outputs(self, x: FloatArray) -> FloatArray:
        """Untempered outputs [n, OUTPUTS] for features [n, features]."""
        a = self.arrays
        z = np.clip((x[..., a["columns"]] - a["mean"])/a["scale"], -8.0, 8.0)
        if "W1" in a:
            z = np.tanh(z @ a["W1"] + a["b1"])
        return np.asarray(z @ a["W"] + a["b"])

    def judge(self, x: FloatArray) -> Judgement:
        """Ice from features [n, features]."""
        out, temper, k = self.outputs(x), self.arrays["temper"], len(CLASSES)
        eta = ETA_SCALE*out[..., k + 1:k + 1 + len(PARTS)]
        std = ETA_SCALE*np.exp(np.clip(out[..., k + 1 + len(PARTS):], SMALLEST, LARGEST))*temper[2:]
        return Judgement(softmax(out[..., :k]*temper[0]), out[..., k]*temper[1], eta, std)


def softmax(logits: FloatArray) -> FloatArray:
    """Probabilities along the last axis."""
    raised = np.exp(logits - logits.max(axis=-1, keepdims=True))
    return np.asarray(raised/raised.sum(axis=-1, keepdims=True))


def save_models(path: Path, models: dict[str, Model]) -> None:
    """Write the kinds of one rival into one safetensors file, renamed into place."""
    tensors = {f"{kind}.{name}": np.ascontiguousarray(array)
               for kind, model in models.items() for name, array in model.arrays.items()}
    draft = path.with_suffix(".part")
    save_file(tensors, draft, metadata={"features": ",".join(FEATURES), "classes": ",".join(CLASSES)})
    draft.replace(path)


def read_models(path: Path) -> dict[str, Model]:
    """Both kinds of one rival.

    Raises:
        InputError: not a safetensors file, or one of another set of features or another shape.
    """
    try:
        tensors = load_file(path)
    except (SafetensorError, OSError) as problem:
        raise InputError(f"{path}: not a characteriser's weights: {problem}") from None
    models = {}
    for kind in KINDS:
        arrays = {name: tensors[f"{kind}.{name}"] for name in (*NAMES, *HIDDEN) if f"{kind}.{name}" in tensors}
        _check(path, kind, arrays)
        models[kind] = Model(arrays)
    return models


def _check(path: Path, kind: str, arrays: dict[str, NDArray]) -> None:
    missing = [name for name in NAMES if name not in arrays]
    if missing:
        raise InputError(f"{path}: '{kind}.{missing[0]}' is missing")
    columns = arrays["columns"]
    width = arrays["W1"].shape[1] if "W1" in arrays else len(columns)
    fits = columns.max() < len(FEATURES) and arrays["W"].shape == (width, OUTPUTS)
    if not (fits and all(np.isfinite(array).all() for array in arrays.values())):
        raise InputError(f"{path}: weights of '{kind}' do not fit {len(FEATURES)} features; train again: "
                         "icing characterise --train")


@cache
def load_models(name: str = "network", where: Path | None = None) -> dict[str, Model]:
    """One rival's models by kind, as they come or of a folder; InputError names the nearest rival."""
    if name not in RIVALS:
        raise InputError(f"no characteriser '{name}': {nearest(name, list(RIVALS))}")
    return read_models((where or folder() / "estimators" / "characterise") / f"{name}.safetensors")
