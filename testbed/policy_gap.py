"""What a gap means for those who fly: controllers ranked on the aircraft, and by the simulator before and after.

A simulator is used to choose between controllers; so the last question to a gap is whether the choice would have been
another one. The same controllers fly the same seeds on three plants: the aircraft of the records, the simulator as it
was, and the simulator with the diagnosed effects. Compared are ranks (Spearman's and Kendall's coefficients), the pairs
whose order turns round, and the mean maximum rank violation (MMRV: Li et al., Evaluating Real-World Robot Manipulation
Policies in Simulation, CoRL 2024): mean over controllers of the largest loss of performance on the aircraft that
believing the simulator about a pair would cost.

The aircraft itself can only be flown in a study, where its effects are known. For records made elsewhere a stand-in
takes its place: each episode has the diagnosed effects at sizes drawn from their 95 % intervals, so that the figures
say what the ranking would be if the diagnosis were right.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from icing_env.errors import InputError
from icing_env.record import FloatArray
from icing_env.scenario import Range, Scenario, load
from testbed.comparison.compare import Progress, Row, in_order
from testbed.comparison.metrics import METRICS
from testbed.flight import controller

PILOTS = ("autopilot", "l1", "scheduled", "indi", "sis", "lqr", "lqg", "h_infinity", "pilot", "adapted")
SCENARIO, DURATION, SIGMA_W = "steps_clean", 100.0, 1.5  # s, m/s: holds, a step of altitude, two of heading, in gusts
EPISODES, RESAMPLES = 16, 400
PLANTS = ("aircraft", "before", "after")
# Deviations from what was asked for in tolerances of 14 CFR Part 60 (altitude, airspeed, psi), as gaps are told.
TRACKED = {"altitude_rms": 30.5, "airspeed_rms": 1.54, "heading_rms": math.radians(2.0)}
FIGURES = ("tracking", *TRACKED, "elevator_activity", "aileron_activity", "losses")
SAME = 1e-9  # coefficients of a figure in which all controllers are equal say nothing

Sizes = Mapping[str, Mapping[str, float | tuple[float, float]]]


@dataclass(frozen=True)
class Flown:
    """A figure of every controller in every episode on every plant: [plants, controllers, episodes]; less is better."""

    controllers: tuple[str, ...]
    values: dict[str, FloatArray]


def rank(aircraft: Sizes, diagnosed: Sizes, controllers: Sequence[str] = PILOTS, episodes: int = EPISODES,
         seed: int = 0, *, duration: float = DURATION, workers: int = 1,
         progress: Progress | None = None) -> dict[str, Any]:
    """Fly every controller on the three plants and compare how they rank.

    Args:
        aircraft: effects of the aircraft, by name and parameter; (low, high) is drawn anew in each episode.
        diagnosed: effects that the diagnosis adds to the simulator.
        controllers: names in `testbed.flight.CONTROLLERS`, three at least.
        episodes: flights of each controller on each plant, the same seeds everywhere.
        seed: of everything drawn.
        duration: of a flight, s.
        workers: processes.
        progress: told what is flown.

    Raises:
        InputError: an unknown effect or controller, or too few of them to rank.
    """
    if len(controllers) < 3 or episodes < 2:
        raise InputError(f"{len(controllers)} controllers, {episodes} episodes: ranks need 3 controllers, 2 episodes")
    flown = _fly([aircraft, {}, diagnosed], controllers, episodes, seed, duration, workers, progress)
    return {"controllers": list(controllers), "episodes": episodes, "scenario": SCENARIO, "duration": duration,
            "sigma_w": SIGMA_W, "figures": {name: _compared(flown, name, seed) for name in FIGURES}}


def scenario_with(effects: Sizes, duration: float = DURATION) -> Scenario:
    """The scenario of the comparison with these effects in the aircraft."""
    fixed = {name: {p: v for p, v in values.items() if not isinstance(v, tuple)} for name, values in effects.items()}
    drawn = {name: {p: Range(low=v[0], high=v[1]) for p, v in values.items() if isinstance(v, tuple)}
             for name, values in effects.items()}
    return load(SCENARIO, duration=duration, parameters={"turbulence_sigma_w": SIGMA_W},
                effects={name: values for name, values in fixed.items() if values},
                randomise={"effects": {name: values for name, values in drawn.items() if values}})


def intervals(found: Mapping[str, Any]) -> tuple[Sizes, Sizes]:
    """Effects of the leading explanation of a diagnosis as JSON has it: with their intervals, and as estimated."""
    first: list[str] = next((h["effects"] for h in found["hypotheses"] if h["effects"]), [])
    if found["verdict"] != "explained" or not first:
        return {}, {}
    told = {e["name"]: e["parameters"] for e in found["effects"] if e["name"] in first}
    wide = {name: {p: (v["low95"], v["high95"]) if v["low95"] < v["high95"] else v["estimate"]
                   for p, v in parameters.items()} for name, parameters in told.items()}
    return wide, {name: {p: v["estimate"] for p, v in parameters.items()} for name, parameters in told.items()}


def _fly(plants: Sequence[Sizes], controllers: Sequence[str], episodes: int, seed: int, duration: float, workers: int,
         progress: Progress | None) -> Flown:
    seeds = tuple(seed*1_000_000 + i for i in range(episodes))
    scenarios = [scenario_with(effects, duration) for effects in plants]
    asked = [Row(controller(who), True, label, chosen, seeds)
             for who in controllers for label, chosen in zip(PLANTS, scenarios, strict=True)]
    values: dict[str, list[NDArray[np.float64]]] = {name: [] for name in FIGURES}
    for runs in in_order(asked, workers, progress):
        run = {name: np.mean([r[name] for r in runs], axis=0) for name in METRICS if name in FIGURES}
        run["tracking"] = np.sqrt(np.mean([(run[n]/unit)**2 for n, unit in TRACKED.items()], axis=0))
        for name, found in values.items():
            found.append(run[name])
    shape = (len(controllers), len(PLANTS), episodes)
    return Flown(tuple(controllers), {n: np.array(v).reshape(shape).transpose(1, 0, 2) for n, v in values.items()})


def _compared(flown: Flown, name: str, seed: int) -> dict[str, Any]:
    """One figure: means of the plants, and how well the simulator ranks before and after."""
    values = flown.values[name]
    means = values.mean(axis=2)
    rng = np.random.default_rng(seed)
    draws = rng.integers(0, values.shape[2], (RESAMPLES, values.shape[2]))
    resampled = values[:, :, draws].mean(axis=3)  # [plants, controllers, resamples]
    out: dict[str, Any] = {"unit": METRICS[name].unit if name in METRICS else "tolerances",
                           **{plant: means[i].tolist() for i, plant in enumerate(PLANTS)}}
    for i, plant in enumerate(PLANTS[1:], start=1):
        low, high = spread([correlation(resampled[0, :, b], resampled[i, :, b]) for b in range(RESAMPLES)])
        out[f"rank_{plant}"] = {
            "spearman": correlation(means[0], means[i]), "spearman_low95": low, "spearman_high95": high,
            "kendall": kendall(means[0], means[i]), "mmrv": mmrv(means[0], means[i]),
            "flips": flips(flown.controllers, values[0], values[i]),
            "best": flown.controllers[int(np.argmin(means[i]))],
            "regret": float(means[0][np.argmin(means[i])] - means[0].min())}  # fmt: skip
    out["best"] = flown.controllers[int(np.argmin(means[0]))]
    return out


def correlation(real: FloatArray, simulated: FloatArray) -> float | None:
    """Spearman's coefficient; None where one side has no ranks."""
    if np.ptp(real) < SAME or np.ptp(simulated) < SAME:
        return None
    return float(stats.spearmanr(real, simulated).statistic)


def kendall(real: FloatArray, simulated: FloatArray) -> float | None:
    """Kendall's tau-b; None where one side has no ranks."""
    if np.ptp(real) < SAME or np.ptp(simulated) < SAME:
        return None
    return float(stats.kendalltau(real, simulated).statistic)


def mmrv(real: FloatArray, simulated: FloatArray) -> float:
    """Mean maximum rank violation, in the figure's unit; 0 where no pair is in the wrong order."""
    apart = np.abs(real[:, None] - real[None, :])
    wrong = (simulated[:, None] < simulated[None, :]) != (real[:, None] < real[None, :])
    return float(np.mean(np.max(apart*wrong, axis=1)))


def flips(names: Sequence[str], real: FloatArray, simulated: FloatArray) -> list[list[str]]:
    """Pairs whose order turns round, [better on the aircraft, better in the simulator], beyond chance.

    Args:
        names: of the controllers.
        real, simulated: [controllers, episodes], the same seeds: a pair counts where its mean difference exceeds 1.96
            standard errors of paired differences on both plants.
    """
    out = []
    for i in range(len(names)):
        for j in range(i + 1, len(names)):
            there, here = (_sign(v[i] - v[j]) for v in (real, simulated))
            if there*here < 0:
                out.append([names[i], names[j]] if there < 0 else [names[j], names[i]])
    return out


def _sign(difference: FloatArray) -> int:
    """Of a mean difference of paired episodes; 0 where it may be chance."""
    mean = float(np.mean(difference))
    error = float(np.std(difference, ddof=1))/math.sqrt(len(difference))
    return int(np.sign(mean)) if abs(mean) > 1.96*error else 0


def spread(values: Sequence[float | None]) -> tuple[float | None, float | None]:
    """95 % of them lie between; None where fewer than half have a value."""
    kept = [v for v in values if v is not None]
    if len(kept) < len(values)/2:
        return None, None
    return float(np.quantile(kept, 0.025)), float(np.quantile(kept, 0.975))


def sentences(found: Mapping[str, Any]) -> list[str]:
    """What the choice between controllers would have lost, before and after."""
    changed = [(name, figure) for name, figure in found["figures"].items() if figure["rank_before"]["flips"]]
    many = len(found["controllers"])
    if not changed:
        return [f"No pair of the {many} controllers changes its order beyond chance: this gap does not matter to the "
                "choice between them."]
    before, after = (sum(len(f[f"rank_{side}"]["flips"]) for f in found["figures"].values())
                     for side in ("before", "after"))
    worst, figure = max(changed, key=lambda item: len(item[1]["rank_before"]["flips"]))
    good, bad = figure["rank_before"]["flips"][0]
    return [f"The simulator as it was puts {before} pairs of the {many} controllers in the wrong order (over "
            f"{len(found['figures'])} figures), with the diagnosed effects {after}; most in {worst.replace('_', ' ')}, "
            f"where {good} beats {bad} on the aircraft and the simulator said the opposite."]


def rows(found: Mapping[str, Any]) -> tuple[dict[str, str], list[list[str]]]:
    """Headings and cells of a table: a line per figure."""
    headers = {"figure": "left", "Spearman before": "right", "after": "right", "MMRV before": "right",
               "after ": "right", "pairs that turn round, before": "left", "after  ": "left"}  # fmt: skip
    out = []
    for name, figure in found["figures"].items():
        before, after = figure["rank_before"], figure["rank_after"]
        unit = "" if figure["unit"] == "1" else f" [{figure['unit']}]"
        out.append([f"{name.replace('_', ' ')}{unit}", _coefficient(before), _coefficient(after),
                    f"{before['mmrv']:.2g}", f"{after['mmrv']:.2g}", _pairs(before), _pairs(after)])
    return headers, out


def _coefficient(side: Mapping[str, Any]) -> str:
    return "-" if side["spearman"] is None else f"{side['spearman']:.2f}"


def _pairs(side: Mapping[str, Any]) -> str:
    count = len(side["flips"])
    shown = ", ".join(f"{a} > {b}" for a, b in side["flips"][:2])
    return "none" if not count else shown if count < 3 else f"{count}: {shown}, ..."
