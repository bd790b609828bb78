"""Table 1, the test matrix: every case flown in short, with what it asks for measured in the records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from icing_env import scenario as scenarios
from icing_env.scenario import Scenario
from testbed.flight import fly
from testbed.reproduce.row import Row, Rule, row
from testbed.reproduce.windows import Window, fly_sets

ITEM = "table1"
LOAD = Rule(relative=0.2)
YES = Rule()
VISIBLE_DRAG = 0.001  # excess drag from which there is ice on the aircraft: 2 % of the clean drag
CLOUD = ({"time": 0.0, "lwc": 3e-4, "mvd": 18e-6, "temperature": 268.15},)  # most of flight 010302f1
BOOTS = ("wing", "tail", "vtail_struts")


@dataclass(frozen=True)
class Case:
    """A line of the table: name, ice or not, doublet sizes [g], and how it is flown here."""

    name: str
    icing: bool
    sizes: tuple[float, ...]
    information: str
    changes: dict[str, Any] = field(default_factory=dict)
    shots: tuple[tuple[float, tuple[str, ...]], ...] = ()  # boots at times [s]

    def scenario(self) -> Scenario:
        """The case without doublets."""
        return self._load(1.0, 1.0, doublets=False)

    def sets(self, per_scale: float) -> list[tuple[float, Scenario]]:
        """A scenario for each doublet size."""
        return [(size, self._load(per_scale, size, doublets=True)) for size in self.sizes]

    def _load(self, per_scale: float, size: float, *, doublets: bool) -> Scenario:
        at = 360.0 if self.icing else 10.0
        events: list[dict[str, Any]] = [{"time": time, "boots": boots} for time, boots in self.shots]
        if self.icing:
            events.append({"time": 0.0, "prop_heat": True})
        if doublets:
            events.append({"time": at, "name": "doublets", "doublets": True})
        changes = {"task": {"kind": "hold"}, "duration": at + 45.0, "ice_protection": "schedule",
                   "events": tuple(sorted(events, key=lambda e: e["time"])), "doublet_scale": size/per_scale}
        if self.icing:
            changes["cloud"] = CLOUD
        return scenarios.load("clear_air", **{**changes, **self.changes})


TURNS: dict[str, Any] = {"task": {"kind": "holding_pattern", "leg_time": 20.0}}
CASES = (
    Case("1.1", False, (0.25,), "baseline"),
    Case("1.2", False, (0.10, 0.25, 0.50), "doublet magnitude varied"),
    Case("1.3", False, (), "standard manoeuvres", {**TURNS, "duration": 90.0}),
    Case("1.4", False, (), "clear-air turbulence", {"parameters": {"turbulence_sigma_w": 2.0}, "duration": 120.0}),
    Case("2.1", True, (0.25,), "doublets during ice accretion"),
    Case("2.2", True, (0.25,), "doublets with selective de-icing", shots=((340.0, ("wing",)),)),
    Case("2.3", True, (0.25,), "doublets with intercycle ice", shots=((120.0, BOOTS), (300.0, BOOTS))),
    Case("2.4", True, (), "intercycle ice", shots=((120.0, BOOTS), (300.0, BOOTS))),
    Case("2.5", True, (), "standard manoeuvres", TURNS),
)


def rows(seed: int) -> list[Row]:
    """Every case: the doublets' load factor, whether there is ice, and what else the case is about."""
    calm = calibrate()
    found: list[Row] = []
    for case in CASES:
        for size, flown in case.sets(calm.load_factor):
            window = fly_sets(flown, seed, hinf=False)[0]["doublets"]
            found.append(_doublet(case, size, window))
        if case.sizes:
            found.append(_ice(case, window.truth, calm.truth))
        else:
            found += _without_doublets(case, calm, seed)
    return found


def calibrate() -> Window:
    """The standard doublet set on the clean aircraft in calm air: the load factor that one scale gives, clean drag."""
    calm = scenarios.load("clear_air", parameters={"turbulence_sigma_w": 0.0}, duration=55.0,
                          events=({"time": 10.0, "name": "doublets", "doublets": True},))
    return fly_sets(calm, 0, hinf=False)[0]["doublets"]


def _doublet(case: Case, size: float, window: Window) -> Row:
    why = "elevator sized once, on the clean aircraft in calm air; half the peak-to-peak of measured az"
    return row(ITEM, f"case {case.name}, {case.information}: load factor of the {size:g} g doublets", size,
               window.load_factor, "g", LOAD, why, miss="ice changes the response" if case.icing else "gusts add to it")


def _without_doublets(case: Case, calm: Window, seed: int) -> list[Row]:
    flight = fly(case.scenario(), seed=seed, rate=10.0)
    truth = {name: float(values[-1]) for name, values in flight.truth.items()}
    found, what = [_ice(case, truth, calm.truth)], f"case {case.name}, {case.information}"
    if "turbulence" in case.information:
        rms = float(np.std(flight.truth["gust_w"]))
        found.append(Row(ITEM, f"{what}: RMS of the vertical gust", "simulated", "turbulence", rms, "m/s", None,
                         rms > 0.5, "above 0.5 m/s", "the paper gives no figure; 2 m/s asked for"))
    if "manoeuvres" in case.information:
        bank = float(np.degrees(np.max(np.abs(flight.record["phi"]))))
        found.append(Row(ITEM, f"{what}: largest bank", "simulated", "manoeuvres", bank, "deg", None, bank > 10.0,
                         "above 10 deg", "the paper does not list them; a racetrack of standard-rate turns here"))
    return found


def _ice(case: Case, truth: Mapping[str, float], clean: Mapping[str, float]) -> Row:
    """Whether the aircraft carries ice at the end of the case."""
    excess = truth["quasi_CD_0"] - clean["quasi_CD_0"]
    note = f"true excess drag {excess:.4f}" + (f" after {truth['boot_cycles']:.0f} inflations" if case.shots else "")
    return row(ITEM, f"case {case.name}, {case.information}: ice on the aircraft (1 yes, 0 no)", float(case.icing),
               float(excess > VISIBLE_DRAG), "1", YES, f"{note}; ice counts from {VISIBLE_DRAG} on")
