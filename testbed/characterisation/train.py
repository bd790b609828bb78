"""Train the characteriser: fly, fit, calibrate, set thresholds on clear air, write weights, thresholds and a card.

Every flight's rows are kept in the run's folder as they come and are not flown again when a killed run goes on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray
from scipy.stats import genextreme

from estimators.characterise.features import FEATURES
from estimators.characterise.model import KINDS, RIVALS, Model, save_models
from estimators.characterise.tuning import load_tuning
from testbed.characterisation.dataset import SEEDS, TURBULENCE, Windows, draw, join
from testbed.characterisation.fit import NEURONS, PENALTY, SHAPES, fit, temper
from testbed.characterisation.flights import SPREAD
from testbed.characterisation.listen import confirmed, listen

FloatArray = NDArray[np.float64]
Say = Callable[[str], None]
BLOCK = 600.0  # s of clear air that each aircraft of the Monte Carlo flies
RATE = 0.2  # false alarms in 100 flight hours that thresholds are set for: a fifth of what is asked
LEAST = -4.6  # log-odds below which no threshold lies: nothing is believed that is told to be less likely than 1 %


@dataclass(frozen=True)
class Options:
    """Size of a training: aircraft of each sort and part, parts, hours of clear air per class, seed of the weights."""

    aircraft: int = 1000
    parts: int = 4
    hours: float = 100.0
    iterations: int = 250
    seed: int = 0
    threads: int = 2


def train(out: Path, options: Options, say: Say) -> dict[str, Any]:
    """Train all rivals into `out` (safetensors, thresholds.toml, card.toml); returns the card."""
    out.mkdir(parents=True, exist_ok=True)
    work = out / "flights"
    work.mkdir(exist_ok=True)
    data = join([_flown(work, "fit", options, k, say) for k in range(options.parts)])
    check = _flown(work, "calibrate", options, 0, say)
    models: dict[str, dict[str, Model]] = {}
    for rival in RIVALS:
        models[rival] = {}
        for kind in KINDS:
            say(f"fitting {rival}, {kind}, to {len(data.label)} rows")
            found = fit(SHAPES[rival], getattr(data, kind), data, options.seed, options.iterations)
            models[rival][kind] = temper(found, getattr(check, kind), check)
        save_models(out / f"{rival}.safetensors", models[rival])
    thresholds = set_thresholds(models, options, say)
    _write(out / "thresholds.toml", thresholds)
    card = _card(options, len(data.label), len(check.label), thresholds)
    _write(out / "card.toml", card)
    return card


def _flown(work: Path, purpose: str, options: Options, part: int, say: Say) -> Windows:
    """One part of the flights, from the run's folder if it was flown before."""
    count = options.aircraft if purpose == "fit" else max(20, options.aircraft//3)
    path = work / f"{purpose}_{part}_{count}.npz"
    if not path.is_file():
        say(f"flying {4*count} aircraft to {purpose}, part {part + 1}")
        found = draw(purpose, count, part, options.threads)
        draft = path.with_suffix(".part")
        with draft.open("wb") as file:
            np.savez(file, **{f.name: getattr(found, f.name) for f in fields(Windows)})
        draft.replace(path)
    with np.load(path, allow_pickle=False) as kept:
        return Windows(**{f.name: kept[f.name] for f in fields(Windows)})


def set_thresholds(models: dict[str, dict[str, Model]], options: Options, say: Say) -> dict[str, Any]:
    """Thresholds at RATE on clear air, for every rival, kind and class of turbulence.

    The largest confirmed score of each aircraft's BLOCK is an extreme value: the generalised law fitted to them (Coles,
    An Introduction to Statistical Modeling of Extreme Values, 2001, section 3.1; its shape free, because the scatter
    of a fleet is bounded) is read where a block has the allowed chance of an alarm, never below the largest score met
    and LEAST.
    """
    blocks = max(4, round(options.hours*3600.0/BLOCK))
    allowed = RATE/100.0*BLOCK/3600.0
    hours: list[float] = []
    levels: dict[str, Any] = {rival: {kind: {"threshold": [], "usual": []} for kind in KINDS} for rival in models}
    for k, (name, sigma) in enumerate(TURBULENCE.items()):
        say(f"clear air, {name}: {blocks} aircraft for {BLOCK:g} s")
        heard = listen("clear_air", sigma, blocks, BLOCK, SEEDS["thresholds"] + k, models, options.threads)
        for (rival, kind), scores in heard.scores.items():
            most = confirmed(scores, round(load_tuning().confirm))
            most = most[np.isfinite(most)]
            limit = max(float(genextreme.ppf(1.0 - allowed, *genextreme.fit(most))), float(most.max()), LEAST)
            levels[rival][kind]["threshold"].append(round(limit, 4))
            levels[rival][kind]["usual"].append(round(float(np.median(scores[np.isfinite(scores)])), 4))
        hours.append(round(float(heard.alive.sum())/3600.0, 2))
    return {"command": command_of(options), "false_alarms_per_100_h": RATE,
            "hours": hours, "turbulence": TURBULENCE, "levels": levels}


def command_of(options: Options) -> str:
    """The command that does it again."""
    return (f"icing characterise --train --aircraft {options.aircraft} --parts {options.parts} "
            f"--hours {options.hours:g} --seed {options.seed}")


def _card(options: Options, rows: int, check: int, thresholds: dict[str, Any]) -> dict[str, Any]:
    return {
        "command": command_of(options), "seeds": SEEDS, "rows_fit": rows, "rows_calibrated": check,
        "fleet_spread": SPREAD, "neurons": NEURONS, "penalty": PENALTY, "iterations": options.iterations,
        "features": list(FEATURES), "figures": "icing benchmark characterisation",
        "false_alarms_per_100_h": thresholds["false_alarms_per_100_h"],
    }


def _write(path: Path, data: dict[str, Any]) -> None:
    draft = path.with_suffix(".part")
    draft.write_text(tomli_w.dumps(data), encoding="utf-8")
    draft.replace(path)
