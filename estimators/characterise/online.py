"""The characteriser in flight: `init` and `step` over arrays with a row per aircraft, judging once a second."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.characterise import detection
from estimators.characterise import evidence as evidence_of
from estimators.characterise.detection import SWITCHES
from estimators.characterise.features import FEATURES, OFFSET, against, features, gust_intensity, offset_of
from estimators.characterise.model import CLASSES, PARTS, Judgement, Model, load_models
from estimators.characterise.thresholds import Thresholds, load_thresholds
from estimators.characterise.tuning import Tuning, load_tuning
from icing_env.errors import InputError
from icing_env.types import Field, structured

FloatArray = NDArray[np.float64]
SEVERITY_FIELDS: list[Field] = [
    *((f"eta_{part}", "1", "severity of the ice there") for part in PARTS),
    *((f"eta_{part}_std", "1", "its standard deviation") for part in PARTS),
    *((f"p_{name}", "0..1", "probability, for ice on one surface alone") for name in CLASSES),
    ("p_iced", "0..1", "probability that ice matters: excess CD_0 above 0.01 or a tenth of CL_alpha lost"),
    ("ice_detected", "0/1", "ice is believed, at the stated rate of false alarms"),
    ("onset", "s", "when it began, nan before it is detected"),
    *((f"p_failed_{part}", "0..1", "probability that its ice protection has failed") for part in PARTS),
    *((f"tested_{part}", "1", "inflations, or heating, whose outcome was looked at") for part in PARTS),
    ("gust", "m/s", "standard deviation of the vertical gusts that were met"),
    ("judged", "0/1", "there has been enough evidence for a judgement"),
]
SEVERITY = structured(SEVERITY_FIELDS)


@dataclass(frozen=True)
class Character:
    """How evidence is judged: models by kind, thresholds and tuning of one rival."""

    models: dict[str, Model]
    thresholds: Thresholds
    tuning: Tuning


@dataclass
class Memory:
    """What is remembered of `n` aircraft: evidence and watch rows, own clean offsets, the last judgement, a clock.

    `on`: switches of PARTS that were on at any sample since then [n, 4].
    """

    evidence: NDArray[np.void]
    watch: NDArray[np.void]
    offset: FloatArray
    referenced: NDArray[np.bool_]
    judged: Judgement
    on: NDArray[np.bool_]
    clock: FloatArray = field(default_factory=lambda: np.zeros(1))  # s since the last judgement


def load(rival: str = "network", where: Path | None = None) -> Character:
    """One rival with its thresholds, as it comes with the project or of a folder; InputError names the nearest."""
    return Character(load_models(rival, where), load_thresholds(rival, where), load_tuning())


def init(n: int) -> tuple[Memory, NDArray[np.void]]:
    """Memory of `n` aircraft that have seen nothing, and their SEVERITY rows."""
    blank = Judgement(np.tile(np.eye(len(CLASSES))[0], (n, 1)), np.full(n, -10.0), np.zeros((n, len(PARTS))),
                      np.ones((n, len(PARTS))))
    severity = np.zeros(n, SEVERITY)
    severity["onset"], severity["p_clean"] = np.nan, 1.0
    return Memory(evidence_of.init(n), detection.init(n), np.zeros((n, OFFSET)), np.zeros(n, bool), blank,
                  np.zeros((n, len(PARTS)), bool)), severity


def refer(memory: Memory, reference: FloatArray, rows: slice | NDArray = slice(None)) -> None:
    """Take these features [rows, features] as the aircraft's own clean ones from now on."""
    memory.offset[rows], memory.referenced[rows] = offset_of(np.asarray(reference)), True


def reset(memory: Memory, severity: NDArray[np.void], rows: NDArray) -> None:
    """Let `rows` (indices) begin anew, in place; what they were told of their own clean flight (`refer`) is forgotten.

    The clock is common to all: a row that begins between judgements is judged with the others.
    """
    fresh, said = init(len(rows))
    was, new = arrays(memory), arrays(fresh)
    for name, array in was.items():
        if name != "clock":
            array[rows] = new[name]
    severity[rows] = said


def arrays(memory: Memory) -> dict[str, NDArray[Any]]:
    """Every array of a memory by name: views, to be kept and written back."""
    judged = memory.judged
    return {"evidence": memory.evidence, "watch": memory.watch, "offset": memory.offset,
            "referenced": memory.referenced, "on": memory.on, "clock": memory.clock, "classes": judged.classes,
            "iced": judged.iced, "eta": judged.eta, "std": judged.std}


def step(memory: Memory, severity: NDArray[np.void], estimate: NDArray[Any], measurement: NDArray[Any],
         switches: NDArray[Any], clean: NDArray[np.void], character: Character, dt: float) -> None:
    """Advance every aircraft by one sample, in place.

    Args:
        memory, severity: of `init`.
        estimate: ESTIMATE rows of any recursive observer [n].
        measurement: MEASUREMENT rows [n].
        switches: rows with boots_wing, boots_tail and prop_heat, such as COMMAND [n].
        clean: CLEAN, one row or n.
        character: of `load`.
        dt: s since the last sample.
    """
    tuning = character.tuning
    evidence_of.step(memory.evidence, measurement, clean, dt, tuning.memory, tuning.shift_memory)
    for i, name in enumerate(SWITCHES):
        memory.on[:, i] |= switches[name] > 0.5
    memory.clock += dt
    if memory.clock[0] < tuning.period - 0.5*dt:
        return
    memory.clock -= tuning.period
    now = np.asarray(measurement["time"], np.float64)
    fires = detection.inflations(memory.watch, memory.on, now, memory.judged, tuning)
    memory.on[:] = False
    restart(memory.evidence, np.asarray(fires.any(axis=1)))
    _judge(memory, severity, estimate, clean, character, now)


def restart(evidence: NDArray[np.void], rows: NDArray[np.bool_]) -> None:
    """Let the regressions of `rows` [n] begin anew: an inflation may have changed the aircraft."""
    for name in ("matrix", "vector", "square", "weight"):
        evidence[name][rows] = 0.0


def _judge(memory: Memory, severity: NDArray[np.void], estimate: NDArray[Any], clean: NDArray[np.void],
           character: Character, now: FloatArray) -> None:
    """One judgement of every aircraft that has shown enough; the others keep their last."""
    evidence = memory.evidence
    values = features(evidence, estimate, clean)
    ready = (evidence["age"] >= character.tuning.start) & np.isfinite(values).all(axis=1)
    values = np.where(ready[:, None], values, 0.0)
    judged = judge(values, memory.offset, memory.referenced, character.models)
    last = memory.judged
    memory.judged = judged = Judgement(*(
        np.where(ready.reshape(-1, *[1]*(new.ndim - 1)), new, old)
        for new, old in zip((judged.classes, judged.iced, judged.eta, judged.std),
                            (last.classes, last.iced, last.eta, last.std), strict=True)))
    gust = gust_intensity(evidence)
    detection.detect(memory.watch, judged.iced, gust, evidence["temperature"], now, memory.referenced,
                     character.thresholds, character.tuning)
    detection.outcomes(memory.watch, now, judged)
    _tell(severity, memory, judged, gust, ready)


def judge(values: FloatArray, offset: FloatArray, referenced: NDArray[np.bool_], models: dict[str, Model]) -> Judgement:
    """Judgement of features [n, features]: of the `own` model where there is a reference, else of `type`."""
    if values.shape[-1] != len(FEATURES):
        raise InputError(f"features have {values.shape[-1]} columns, must have {len(FEATURES)}")
    own, known = models["own"].judge(against(values, offset)), models["type"].judge(values)
    column = referenced[:, None]
    return Judgement(np.where(column, own.classes, known.classes), np.where(referenced, own.iced, known.iced),
                     np.where(column, own.eta, known.eta), np.where(column, own.std, known.std))


def _tell(severity: NDArray[np.void], memory: Memory, judged: Judgement, gust: FloatArray,
          ready: NDArray[np.bool_]) -> None:
    """Write the SEVERITY rows."""
    broken = detection.failed(memory.watch)
    for i, part in enumerate(PARTS):
        severity[f"eta_{part}"], severity[f"eta_{part}_std"] = judged.eta[:, i], judged.std[:, i]
        severity[f"p_failed_{part}"], severity[f"tested_{part}"] = broken[:, i], memory.watch["tested"][:, i]
    for i, name in enumerate(CLASSES):
        severity[f"p_{name}"] = judged.classes[:, i]
    severity["p_iced"] = 1.0/(1.0 + np.exp(-np.clip(judged.iced, -50.0, 50.0)))
    severity["ice_detected"], severity["onset"] = memory.watch["detected"], memory.watch["onset"]
    severity["gust"], severity["judged"] = gust, ready
