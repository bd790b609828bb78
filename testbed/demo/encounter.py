"""First part of the demonstration: one hold in icing cloud, flown without protection, with it, and over many seeds."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from icing_env.scenario import CloudPoint, Scenario, load
from testbed.demo.fleet import ALL, LIMITS, NONE, Fleet, fly_fleet
from testbed.demo.parts import COUNT, FOOT, Tell, Verdict, rms
from testbed.flight import Flight, fly

MINUTE = 60.0  # s
RATE = 5.0  # Hz, samples kept
# A racetrack stays in the one cloud, so that cloud follows cloud without a gap: the 45-minute hold in continuous
# maximum icing that certification looks at (FAA AC 25-25A). Content: the upper half of the envelope. 120 kt, 10,000 ft
# and -6 C: assumed.
HOLD = {
    "base": "clear_air",
    "name": "holding_in_ice",
    "description": "45 min racetrack at 120 kt and 9,800 ft in continuous-maximum cloud at -6 C, light turbulence",
    "weather": "stratiform",
    "duration": 2700.0,
    "task": {"kind": "holding_pattern"},
    "initial": {"airspeed": 62.0, "altitude": 3000.0},
    "parameters": {"turbulence_sigma_w": 0.5, "temperature_offset": -1.6, "cloud_gap_mean": 0.0,
                   "cloud_lwc_share_low": 0.5, "cloud_lwc_share_high": 1.0},
}  # fmt: skip
@dataclass(frozen=True)
class Encounter:
    """The flights of this part: two in detail with `seed`, and `fleets` by way of protecting, over `seeds`."""

    scenario: Scenario
    seed: int
    unprotected: Flight
    protected: Flight
    seeds: list[int]
    fleets: dict[str, Fleet]


def scenario(duration: float | None = None) -> Scenario:
    """The hold, shortened if asked."""
    changes = {key: value for key, value in HOLD.items() if key not in ("base", "name")}
    flown = load(str(HOLD["base"]), **{**changes, **({"duration": duration} if duration else {})})
    return flown.model_copy(update={"name": HOLD["name"]})


def measure(seed: int, flights: int, tell: Tell, duration: float | None = None) -> Encounter:
    """Fly the hold: twice in detail with `seed`, then with `flights` seeds from `seed` on, in three ways."""
    hold = scenario(duration)
    tell("compiling the flight model (once; kept for later)", 0.0)
    protected = fly(hold, seed=seed, rate=RATE)
    tell("the hold without protection", 0.3)
    unprotected = fly(in_the_cloud_of(protected, hold), seed=seed, rate=RATE, protection=False)
    seeds = list(range(seed, seed + flights))
    tell(f"the same hold with {flights} seeds, protected", 0.4)
    first, cloud = fly_fleet(hold, seeds, ALL)
    tell(f"the same hold with {flights} seeds, without boots and without anything", 0.7)
    with ThreadPoolExecutor(2) as pool:  # stepping releases the interpreter; two cores
        done = {name: pool.submit(fly_fleet, hold, seeds, name, cloud) for name in (NONE, LIMITS)}
        fleets = {name: done[name].result()[0] for name in (NONE, LIMITS)}
    return Encounter(hold, seed, unprotected, protected, seeds, {**fleets, ALL: first})


def in_the_cloud_of(flight: Flight, hold: Scenario) -> Scenario:
    """The hold in the very cloud that `flight` met: a slower aircraft would else come to its next cloud later."""
    t = flight.truth
    every = round(2.0*RATE)
    rows = zip(*(t[name][::every].tolist() for name in ("time", "lwc", "mvd", "temperature")), strict=True)
    points = tuple(CloudPoint(time=a, lwc=b, mvd=c, temperature=d) for a, b, c, d in rows)
    return hold.model_copy(update={"cloud": points})


def margin_of(flight: Flight) -> NDArray[np.float64]:
    """Stall margin over a flight, rad."""
    t = flight.truth
    return np.minimum(t["alpha_stall_left"], t["alpha_stall_right"]) - t["true_alpha"]


def excess_drag(flight: Flight) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """True excess of CD_0 over the clean aircraft's, and the estimate of it."""
    return flight.truth["quasi_CD_0"] - flight.truth["quasi_CD_0"][0], flight.estimate["excess_drag"].copy()


def detected_at(flight: Flight) -> float | None:
    """When ice was first declared, s; None if never."""
    found = np.flatnonzero(flight.advisory["ice_detected"] > 0.5)
    return float(flight.truth["time"][found[0]]) if len(found) else None


def verdicts(e: Encounter) -> list[Verdict]:
    """What the flights show."""
    return [_of_the_pair(e), _of_the_fleets(e), *_of_the_observer(e)]


def _end(flight: Flight) -> str:
    """How a flight went, in words."""
    margin = np.degrees(margin_of(flight))
    minutes = flight.truth["time"][-1]/MINUTE
    if flight.reason:
        first = np.flatnonzero(margin < 0.0)
        stall = f"stalled at {flight.truth['time'][first[0]]/MINUTE:.1f} min and " if len(first) else ""
        return f"{stall}was lost at {minutes:.1f} min ({flight.reason})"
    if margin.min() < 0.0:
        return f"stalled, {-margin.min():.1f} deg beyond the onset of separation, but flew on to {minutes:.0f} min"
    return f"flew all {minutes:.0f} min and never came nearer to the stall than {margin.min():.1f} deg"


def _of_the_pair(e: Encounter) -> Verdict:
    helped = bool(e.unprotected.reason) and not e.protected.reason
    kind = "good" if helped else "bad" if e.protected.reason else "info"
    text = f"Seed {e.seed}: without protection the aircraft {_end(e.unprotected)}; with boots and limits it " \
           f"{_end(e.protected)}."  # fmt: skip
    return Verdict(text, kind)


def _of_the_fleets(e: Encounter) -> Verdict:
    n, lost = len(e.seeds), {name: fleet.lost for name, fleet in e.fleets.items()}
    word = {name: str(number) if number else "none" for name, number in lost.items()}
    cost = np.max(e.fleets[LIMITS].descent)/FOOT
    kind = "bad" if lost[ALL] > lost[NONE] else "info" if not any(lost.values()) else \
        "good" if lost[ALL] == 0 else "caution"  # fmt: skip
    text = f"Of {n} seeds {word[NONE]} were lost without protection, {word[LIMITS]} with the limits alone " \
           f"(which gave up as much as {cost:,.0f} ft), {word[ALL]} with boots and limits."  # fmt: skip
    return Verdict(text, kind)


def _of_the_observer(e: Encounter) -> list[Verdict]:
    truth, estimate = excess_drag(e.protected)
    error, most = rms(estimate - truth)/COUNT, truth.max()/COUNT
    drag = Verdict(f"Excess drag: the observer's estimate is within {error:.0f} counts (rms) of the truth, which rises "
                   f"to {most:.0f} counts (1 count = 0.0001).", "good" if error < 0.1*most else "caution")
    when = detected_at(e.protected)
    if when is None:
        return [drag, Verdict("Ice was not declared in the protected flight.", "info")]
    inflations = e.protected.truth["boot_cycles"][-1]
    row = int(np.searchsorted(e.protected.truth["time"], when))
    return [drag, Verdict(f"Ice was declared {when/MINUTE:.1f} min into the hold, at {truth[row]/COUNT:.0f} counts of "
                          f"excess drag; the boots inflated {inflations:.0f} times from then on.", "info")]
