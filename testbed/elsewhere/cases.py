"""Draws a case's effects and sizes, flies it, and writes records and key."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from testbed.elsewhere import sensors
from testbed.elsewhere.distance import compare
from testbed.elsewhere.effects import KNOWN, UNKNOWN, Effect
from testbed.elsewhere.flight import DT, PREROLL
from testbed.elsewhere.hooks import Channels
from testbed.elsewhere.record import write_csv, write_toml
from testbed.elsewhere.setting import Setting, draw_setting
from testbed.elsewhere.simulation import sane, simulate

ENOUGH = {"whitened_distance": 12.0, "largest_error": 0.15}
TRIES, GROWTH = 4, 1.5


def draw_effects(kind: str, turn: int, rng: np.random.Generator) -> tuple[list[Effect], list[float]]:
    """Effects and sizes; singles and unknowns go round their lists so that all come up, pairs differ in family."""
    if kind == "null":
        return [], []
    if kind == "pair":
        first = KNOWN[rng.integers(len(KNOWN))]
        others = [e for e in KNOWN if e.family != first.family]
        chosen = [first, others[rng.integers(len(others))]]
    else:
        pool = KNOWN if kind == "single" else UNKNOWN
        chosen = [pool[turn % len(pool)]]
    sizes = [rng.uniform(e.low, e.high) * (rng.choice([-1.0, 1.0]) if e.either_sign else 1.0) for e in chosen]
    return chosen, [float(s) for s in sizes]


def _part(setting: Setting, effects: Sequence[Effect], sizes: Sequence[float], i: int
          ) -> tuple[list[Channels], dict[str, Any]]:
    """Distances of the flights with effect `i` alone, on the records that carry it."""
    rows = [k for k, card in enumerate(setting.programme) if card[0] != "reference"]
    groups, _ = simulate(setting, effects[i : i + 1], sizes[i : i + 1])
    found = compare(groups, 1, rows, setting.faults["noise"], setting.outfit["rate"])
    return groups, found


def settle_sizes(setting: Setting, effects: Sequence[Effect], sizes: list[float]
                 ) -> tuple[list[float], list[dict[str, Any]]]:
    """Each effect alone grows until it shows, never beyond its upper bound, and shrinks where the flight gets wild."""
    alone = []
    for i, effect in enumerate(effects):
        for _ in range(TRIES):
            groups, found = _part(setting, effects, sizes, i)
            size, most = abs(sizes[i]), max(found["rms_in_tolerances"].values())
            if not sane(groups[0]):
                sizes[i] *= 0.7
            elif (found["whitened_distance"] < ENOUGH["whitened_distance"]
                  or most < ENOUGH["largest_error"]) and size < effect.high:
                sizes[i] *= min(GROWTH, effect.high / size)
            else:
                break
        alone.append(found)
    return sizes, alone


def make_case(rng: np.random.Generator, kind: str, turn: int, references: bool, centre: str
              ) -> tuple[Setting, Channels, dict[str, Any]]:
    """Setting, channels and key of one case; a setting that cannot be flown sanely is drawn again."""
    while True:
        setting = draw_setting(rng, references, centre)
        effects, sizes = draw_effects(kind, turn, rng)
        sizes, alone = settle_sizes(setting, effects, sizes)
        groups, hooks = simulate(setting, effects, sizes)
        if sane(groups[0]):
            break
    setting.outfit["commands"] |= any(hook.by_command for hook in hooks)
    rows = [k for k, card in enumerate(setting.programme) if card[0] != "reference"]
    key = {
        "kind": kind,
        "effects": [{"name": e.name, "library_number": e.library, "components": list(e.components), "family": e.family,
                     "size": s, "unit": e.unit, "other_form": e.other_form, "parameters": h.parameters, "alone": a}
                    for e, s, h, a in zip(effects, sizes, hooks, alone, strict=True)],
        "components": sorted({c for e in effects for c in e.components}),
        "other_form": any(e.other_form for e in effects),
        "sigma_w": setting.sigma, "rotational_gusts": setting.rotational and setting.sigma > 0,
        "slow_air": setting.slow[0], "slow_air_m_s": setting.slow[1] if setting.slow[0] != "none" else 0.0,
        "references": references, "commands": setting.outfit["commands"], "rate": setting.outfit["rate"],
        "noise_factor": setting.faults["noise"],
        "difference": compare(groups, 1, rows, setting.faults["noise"], setting.outfit["rate"]),
        "difference_from_published": compare(groups, 3, rows, setting.faults["noise"], setting.outfit["rate"]),
        "aircraft": setting.aircraft, "centre": centre, "thrust_factor": setting.thrust_factor,
        "temperature_offset": setting.offset, "instrument_bias": setting.faults["bias"],
        "instrument_scale": setting.faults["scale"],
        "true_mass": setting.mass.tolist(), "true_inertia": setting.inertia.T.tolist(),
    }
    return setting, groups[0], key


def write_case(folder: Path, key_path: Path, setting: Setting, channels: Channels, key: dict[str, Any],
               rng: np.random.Generator) -> None:
    """CSV and TOML of every record in a shuffled order, and the key apart from them."""
    folder.mkdir(parents=True)
    outfit = setting.outfit
    every = round(1.0 / (DT * outfit["rate"]))
    start = round(PREROLL / DT)
    noise = np.random.default_rng([setting.seed, 99])
    day = [f"F{number}" for number in rng.choice(np.arange(100, 999), 3, replace=False)]
    files = {}
    for number, i in enumerate(rng.permutation(len(setting.programme))):
        role, card, _, flight = setting.programme[i]
        end = channels["airspeed"].shape[1] - int(noise.uniform(0.0, 2.5) / DT)
        samples = sensors.sample(channels, i, np.arange(start, end, every), setting.faults, noise)
        name = f"record_{number + 1:02d}"
        write_csv(folder / f"{name}.csv", samples, outfit)
        write_toml(folder / f"{name}.toml", role, day[flight], setting.loadings[i], outfit)
        files[name] = {"role": role, "card": card.__name__}
    key_path.parent.mkdir(parents=True, exist_ok=True)
    key_path.write_text(json.dumps(key | {"records": files}, indent=1, ensure_ascii=False), encoding="utf-8")
