"""Scores of every rival second by second over fleets that fly on, and the truth beside them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.characterise import detection
from estimators.characterise.features import against, gust_intensity, offset_of
from estimators.characterise.model import KINDS, Model
from estimators.characterise.thresholds import Thresholds
from estimators.characterise.tuning import load_tuning
from icing_env import scenario
from icing_env.world import World
from testbed.characterisation.flights import CALM, COLD, ICING, SET, Watch, fleet_draws, truth_of
from testbed.environments import loop_factory

FloatArray = NDArray[np.float64]
Key = tuple[str, str]  # rival, kind


@dataclass
class Heard:
    """Once a second [seconds, n]: scores by rival and kind, measured gust, true excess drag, lost lift slope, alive.

    Scores are minus infinity before the first judgement and after a flight's end.
    """

    scores: dict[Key, NDArray[np.float32]]
    gust: FloatArray
    drag: FloatArray
    lost: FloatArray
    alive: NDArray[np.bool_]


def listen(name: str, sigma_w: float, n: int, seconds: float, seed: int, models: Mapping[str, dict[str, Model]],
           threads: int = 2) -> Heard:
    """Fly a scenario with a fleet, after a clean reference set in calm, cloudless air, and score it.

    Args:
        name: scenario; its ice protection stays off.
        sigma_w: m/s, after the reference.
        models: by rival, by kind.
    """
    duration = SET + 5.0 + seconds
    draws = fleet_draws(COLD if name == "clear_air" else ICING)
    flown = scenario.load(
        name, duration=duration, ice_protection="off", task={"kind": "hold"}, doublets_at=(2.0,),
        randomise={"initial": {"airspeed": {"low": 66.0, "high": 80.0}, "altitude": {"low": 1800.0, "high": 3000.0}},
                   "parameters": draws})
    world = World(flown, n, loop_factory(observer=True, management=False, protection=False, boots=False), mode=None,
                  threads=threads)
    world.reset(seeds=[seed*1_000_000 + i for i in range(n)])
    parameters = world.fleet.parameters
    cloud = parameters["cloud_mode"].copy()
    parameters["cloud_mode"], parameters["turbulence_sigma_w"] = 0.0, 0.5*CALM
    watch = Watch(world, load_tuning())
    watch.fly(SET)
    offset = offset_of(watch.read())
    parameters["cloud_mode"], parameters["turbulence_sigma_w"] = cloud, sigma_w
    watch.fly(5.0)
    watch.forget()
    return _score(watch, round(seconds), offset, models)


def _score(watch: Watch, seconds: int, offset: FloatArray, models: Mapping[str, dict[str, Model]]) -> Heard:
    n, tuning = watch.world.n, watch.tuning
    scores = {(rival, kind): np.full((seconds, n), -np.inf, np.float32) for rival in models for kind in KINDS}
    gust, drag, lost = (np.zeros((seconds, n)) for _ in range(3))
    alive = np.zeros((seconds, n), bool)
    for t in range(seconds):
        watch.fly(1.0)
        drag[t], lost[t] = truth_of(watch.world)
        gust[t] = gust_intensity(watch.evidence)
        alive[t] = ~watch.world.terminated & (t == 0 or alive[t - 1])
        if t + 1 < tuning.start:
            continue
        x = {"type": watch.read()}
        x["own"] = against(x["type"], offset)
        for (rival, kind), row in scores.items():
            row[t] = np.where(alive[t], models[rival][kind].judge(x[kind]).iced, -np.inf)
    return Heard(scores, gust, drag, lost, alive)


def detected(heard: Heard, key: Key, thresholds: Thresholds) -> tuple[NDArray[np.bool_], FloatArray]:
    """Whether ice is believed [seconds, n], and the onset when it is first believed [n], nan if never."""
    tuning = load_tuning()
    seconds, n = heard.gust.shape
    watch, believed, onset = detection.init(n), np.zeros((seconds, n), bool), np.full(n, np.nan)
    own, cold = np.full(n, key[1] == "own"), np.full(n, 250.0)
    for t in range(seconds):
        detection.detect(watch, heard.scores[key][t].astype(np.float64), heard.gust[t], cold, np.full(n, float(t)), own,
                         thresholds, tuning)
        believed[t] = watch["detected"] > 0.0
        onset = np.where(np.isnan(onset) & believed[t], watch["onset"], onset)
    return believed, onset


def confirmed(scores: NDArray[np.float32], confirm: int) -> FloatArray:
    """Largest score that was held for `confirm` seconds on end [n]: what a threshold must exceed."""
    windows = np.lib.stride_tricks.sliding_window_view(scores, confirm, axis=0)
    return np.asarray(windows.min(axis=-1).max(axis=0), np.float64)
