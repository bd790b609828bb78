"""Function 4 in figures: how near the adaptation brings an iced aircraft to the clean one.

`icing benchmark adaptation` prints the tables of docs/controllers.md.

* flying qualities (`testbed.flying_qualities`) of the true iced aircraft at 64 m/s without adaptation, with the
  oracle's gains, and with gains from the estimate after one doublet set flown by the autopilot in turbulence
* attitude: steps of pitch and bank by the autopilot on the clean aircraft, the iced one, and the iced one adapted
* altitude, airspeed and heading, split by the power there is: `testbed.benchmarks.tracking`
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from icing_env import scenario
from icing_env.trim import Trim, trim
from icing_env.types import TARGET
from icing_env.world import World
from testbed.benchmarks import tracking
from testbed.flight import make_world
from testbed.flying_qualities import Qualities, level, qualities

FloatArray = NDArray[np.float64]
WINGS, TAIL = ("left_wing", "right_wing"), ("htail", "vtail")
WHERE = {"wing": WINGS, "tail": TAIL, "left wing": ("left_wing",), "wing and tail": (*WINGS, *TAIL)}
CASES = tuple((name, eta) for name in WHERE for eta in (0.1, 0.2, 0.3) if not (name == "wing and tail" and eta > 0.2))
AIRSPEED = 64.0  # m/s: every case but one of wing and tail can be held in level flight there
FIGURES = ("short_period", "short_period_damping", "pitch", "turn", "yaw", "dutch_roll", "roll")
LIGHT, CALM = 2.0, 0.5  # m/s, sigma_w: light turbulence at 7500 ft (MIL-F-8785C figure 7), and nearly none
FIRST_SEED = 61_000_000
SOURCES = {  # sigma_w m/s, doublets flown
    "sigma_w 0.5, doublets": (CALM, True), "sigma_w 2, doublets": (LIGHT, True), "sigma_w 2, autopilot": (LIGHT, False),
}
STEPS = {  # s, rad
    "theta": ((5.0, 0.05), (15.0, -0.03), (25.0, 0.0)),
    "phi": ((10.0, 0.35), (20.0, -0.35), (30.0, 0.0)),
}


@dataclass(frozen=True)
class Judged:
    """One case: relative deviations from the clean aircraft's figures, and levels."""

    case: str
    eta: float
    unadapted: dict[str, float]
    adapted: tuple[dict[str, float], ...]  # one for each flight, or one for the oracle
    levels: tuple[int, ...]
    level_unadapted: int


def world_of(cases: tuple[tuple[str, float], ...], copies: int, sigma_w: float, duration: float, who: str,
             doublets: tuple[float, ...] = ()) -> World:  # fmt: skip
    """World with `copies` aircraft of every case, just reset, in cold clear air."""
    flown = scenario.load("clear_air", duration=duration, doublets_at=doublets, task={"kind": "hold"},
                          ice_protection="off",
                          parameters={"turbulence_sigma_w": sigma_w, "temperature_offset": -15.0})
    world = make_world(flown, len(cases)*copies, who, protection=False)
    for i in range(world.n):
        name, eta = cases[i//copies]
        ice = dict.fromkeys(WHERE.get(name, ()), eta)
        world.reset(np.array([i]), [FIRST_SEED + i % copies], {"eta": ice, "airspeed": AIRSPEED})
    return world


def found(sigma_w: float, copies: int, who: str = "adapted", doublets: bool = True) -> NDArray:
    """ADAPTATION rows [cases and clean, copies] after a doublet set, or 46 s of autopilot alone."""
    cases = (*CASES, ("clean", 0.0))
    world = world_of(cases, copies, sigma_w, 46.0, who, (2.0,) if doublets else ())
    for _ in range(world.limit):
        world.step()
    if world.terminated.any():
        raise RuntimeError(f"{int(world.terminated.sum())} of {world.n} flights ended early")
    return world.loop.memory()["adaptation"].reshape(len(cases), copies)


def judge(beliefs: NDArray) -> Iterator[Judged]:
    """Every case with the adaptation's rows [cases and clean, copies]."""
    parameters = scenario.load("clear_air", parameters={"temperature_offset": -15.0}).true_parameters()
    reference = qualities(_trim(parameters, {}), parameters)
    for (name, eta), rows in zip((*CASES, ("clean", 0.0)), beliefs, strict=True):
        steady = _trim(parameters, dict.fromkeys(WHERE.get(name, ()), eta))
        plain = qualities(steady, parameters)
        with_it = [qualities(steady, parameters, parameters, rows[i:i + 1]) for i in range(len(rows))]
        yield Judged(name, eta, _deviation(plain, reference), tuple(_deviation(q, reference) for q in with_it),
                     tuple(level(q) for q in with_it), level(plain))


def _trim(parameters: NDArray, eta: dict[str, float]) -> Trim:
    return trim(parameters, eta, airspeed=AIRSPEED, altitude=2200.0)


def _deviation(q: Qualities, reference: Qualities) -> dict[str, float]:
    now, clean = asdict(q), asdict(reference)
    return {name: now[name]/clean[name] - 1.0 for name in FIGURES}


def worst(judged: list[Judged]) -> dict[str, tuple[float, float, float]]:
    """By figure: worst deviation without and with the adaptation, and how much nearer its root mean square comes."""
    out = {}
    for name in FIGURES:
        plain = np.array([j.unadapted[name] for j in judged])
        with_it = np.array([[a[name] for a in j.adapted] for j in judged])
        nearer = 1.0 - np.sqrt(np.mean(with_it**2))/max(np.sqrt(np.mean(plain**2)), 1e-9)
        out[name] = float(np.abs(plain).max()), float(np.abs(with_it).max()), float(nearer)
    return out


def attitude(who: str, cases: tuple[tuple[str, float], ...], sigma_w: float, copies: int) -> dict[str, FloatArray]:
    """Root mean square error of pitch and bank [rad] by case, over steps flown after a doublet set."""
    world = world_of(cases, copies, sigma_w, 90.0, who, (2.0,))
    f, target = world.fleet, world.loop.target
    start = f.measurement["theta"].copy()
    wanted = np.zeros(world.n, TARGET)
    sums, count = {"theta": np.zeros(world.n), "phi": np.zeros(world.n)}, 0
    for step in range(world.limit):
        now = step*world.dt - 48.0
        if abs(now) < 0.5*world.dt:
            start = f.measurement["theta"].copy()
        if now >= 0.0:
            for name, steps in STEPS.items():
                wanted[name] = [0.0, *(value for at, value in steps if at <= now)][-1]
            target["pitch_mode"], target["theta"] = 0.0, start + wanted["theta"]
            target["roll_mode"], target["phi"] = 0.0, wanted["phi"]
        world.step()
        if now >= 0.0:
            for name, total in sums.items():
                total += (f.measurement[name] - target[name])**2
            count += 1
    return {name: np.sqrt(total/count).reshape(len(cases), copies).mean(axis=1) for name, total in sums.items()}


def measure(quick: bool = False, progress: Callable[[str], None] = lambda what: None) -> dict[str, Any]:
    """Every figure, as `icing benchmark adaptation --json` prints them; relative deviations from the clean aircraft.

    Args:
        quick: one flight of each case instead of four, of estimates only that in light turbulence, few steps.
        progress: called with what is flown next.
    """
    copies = 1 if quick else 4
    out: dict[str, Any] = {"cases": [f"{name} {eta}" for name, eta in CASES], "airspeed": AIRSPEED}
    progress("the oracle")
    out["flying_qualities"] = {"oracle": _figures(list(judge(found(0.0, 1, "oracle"))))}
    for name, (sigma_w, doublets) in list(SOURCES.items())[-2 if quick else 0:]:
        progress(f"estimate, {name}")
        out["flying_qualities"][name] = _figures(list(judge(found(sigma_w, copies, doublets=doublets))))
    iced = tuple(case for case in CASES if case[1] == 0.2)
    progress("attitude")
    clean = attitude("autopilot", (("clean", 0.0),), CALM, copies)
    out["attitude_error"] = {}
    for who in ("autopilot", "adapted", "oracle"):
        flown = attitude(who, iced, CALM, copies)
        out["attitude_error"][who] = {name: {case: float(e/clean[name][0] - 1.0) for (case, _), e in
                                             zip(iced, error, strict=True)} for name, error in flown.items()}
    out["tracking"] = tracking.measure(quick, progress)
    return out


def _figures(judged: list[Judged]) -> dict[str, Any]:
    figures = {name: {"worst_without": plain, "worst_with": with_it, "nearer": nearer}
               for name, (plain, with_it, nearer) in worst(judged).items()}
    return {"figures": figures, "level_1_with": float(np.mean([lv == 1 for j in judged for lv in j.levels])),
            "level_1_without": float(np.mean([j.level_unadapted == 1 for j in judged]))}


def tables(measured: dict[str, Any]) -> Iterator[tuple[str, dict[str, str], list[list[str]]]]:
    """Title, headers and rows of each table."""
    headers = {"gains from": "left", **{name.replace("_", " "): "right" for name in FIGURES}, "level 1": "right"}
    found_by = measured["flying_qualities"]
    plain = found_by["oracle"]
    rows = [["no adaptation", *(f"{100*plain['figures'][name]['worst_without']:.0f} %" for name in FIGURES),
             f"{100*plain['level_1_without']:.0f} %"]]
    for who, what in found_by.items():
        rows.append([who, *(f"{100*what['figures'][name]['worst_with']:.0f} %" for name in FIGURES),
                     f"{100*what['level_1_with']:.0f} %"])
    yield "worst deviation from the clean aircraft, 64 m/s", headers, rows
    rows = [[who, *(f"{100*what['figures'][name]['nearer']:.0f} %" for name in FIGURES), ""]
            for who, what in found_by.items()]
    yield "nearer to clean than unadapted, root mean square", headers, rows
    cases = list(measured["attitude_error"]["autopilot"]["theta"])
    yield "attitude error against the clean aircraft's, eta 0.2", {"": "left", **dict.fromkeys(cases, "right")}, [
        [f"{who}, {name}", *(f"{100*error[case]:+.0f} %" for case in cases)]
        for who, by in measured["attitude_error"].items() for name, error in by.items()]
    yield from tracking.tables(measured["tracking"])
