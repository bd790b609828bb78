"""The demonstration: what the testbed does, in one report with figures, in about a minute once compiled.

Each part measures, then says in verdicts what its figures bear out, then writes its section; the parts are modules of
their own (testbed/demo_*.py).
"""

from __future__ import annotations

import platform
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import perf_counter
from typing import Any

import tomli_w

from testbed.demo import encounter, encounter_report, gap, identify, identify_report, observer
from testbed.demo.parts import Tell, Verdict
from testbed.reports.page import Report

NEXT = """
Everything in this report is one command or a few lines away. icing --help lists the verbs; every verb has an
example in its own --help. The hold of the first section lies beside this report as a scenario file: change it, and fly
it again.
"""
COMMANDS = (
    ("icing fly {hold} --seed 3 --out hold.csv", "fly the hold, write its record and the truth beside it"),
    ("icing fly {hold} --seed 3 --no-protection", "the same hold without protection"),
    ("icing fly clear_air --effect tail_ice --out iced.csv", "two doublet sets with ice on the tail"),
    ("icing identify iced.csv --method hinf", "what the observer finds in that record"),
    ("icing diagnose {folder}/blind.csv --held-out {folder}/blind_held_out.csv --out diagnosis",
     "the hidden difference again, with a report of its own"),
    ("icing effects", "the ways in which an aircraft may differ from its model"),
    ("icing compare --help", "controllers with and without protection on the same cases"),
    ("icing demo --seed 7", "this report from another seed"),
)
EXAMPLE = """
import gymnasium as gym
import icing_env  # registers the environments

env = gym.make("icing_env/TwinOtter-v0", scenario="stratiform", mode="targets")
observation, info = env.reset(seed=1)
names = env.unwrapped.observation_names
print(len(names), "channels, among them", ", ".join(names[:6]))

total = 0.0
for step in range(3000):                         # one minute at 50 Hz
    action = 0.0 * env.action_space.sample()     # level flight; put your policy here
    observation, reward, terminated, truncated, info = env.step(action)
    total += reward
    if step % 500 == 0:
        seen = dict(zip(names, observation))
        print(f"{step/50:4.0f} s  {seen['airspeed']:.1f} m/s  drag +{seen['excess_drag']:.4f}")
    if terminated or truncated:
        break
print("sum of rewards", round(total, 1))
"""


@dataclass(frozen=True)
class Size:
    """How much is flown: seeds of the batch, and seconds of the hold (None: all) and of the observer's flight."""

    flights: int = 24
    hold: float | None = None
    observed: float = 1500.0


FULL, QUICK = Size(), Size(flights=4, hold=600.0, observed=240.0)


@dataclass(frozen=True)
class Demonstration:
    """What was found, by section: results, and the verdicts they bear out; where the report is; how long it took."""

    report: Path
    seconds: float
    results: dict[str, Any] = field(repr=False)
    verdicts: dict[str, list[Verdict]] = field(default_factory=dict)


def run(folder: Path, seed: int, size: Size, tell: Tell) -> Demonstration:
    """Measure everything, write `report.html` and the hold's scenario into `folder`.

    Args:
        folder: made if absent.
        seed: of every draw.
        size: FULL or QUICK.
        tell: called with what is being done and the share of all that is done.
    """
    start = perf_counter()
    flown = encounter.measure(seed, size.flights, _part(tell, 0.0, 0.6), size.hold)
    observed = observer.measure(seed, size.observed, _part(tell, 0.6, 0.65))
    identified = identify.measure(seed, _part(tell, 0.65, 0.7))
    blind = gap.measure(seed, folder, _part(tell, 0.7, 0.94))
    tell("drawing the report", 0.94)
    report = Report("An aircraft in ice, and what can be known of it",
                    "A Twin Otter collects ice, an observer notices, the protection acts; flight records are "
                    "identified, and a hidden difference is diagnosed. Every sentence marked ✓, ! or ✕ is computed "
                    "from the flights below.",
                    provenance(seed, size))  # fmt: skip
    encounter_report.write(report, flown)
    observer.write(report, observed)
    identify_report.write(report, identified)
    gap.write(report, blind)
    scenario = folder / "holding_in_ice.toml"
    write_next(report, folder, scenario)
    path = report.write(folder / "report.html")
    scenario.write_text(tomli_w.dumps(encounter.HOLD), encoding="utf-8")
    tell("done", 1.0)
    return Demonstration(
        path, perf_counter() - start, {"encounter": flown, "observer": observed, "identification": identified,
                                       "diagnosis": blind},
        {"encounter": encounter.verdicts(flown), "observer": observer.verdicts(observed),
         "identification": identify.verdicts(identified), "diagnosis": gap.verdicts(blind)})  # fmt: skip


def _part(tell: Tell, low: float, high: float) -> Tell:
    """`tell` for a part that fills the share from `low` to `high`."""
    return lambda what, share: tell(what, low + share*(high - low))


def provenance(seed: int, size: Size) -> dict[str, str]:
    """What made the report."""
    try:
        ours = f"icing-testbed {version('icing-testbed')}"
    except PackageNotFoundError:
        ours = "run from its sources, not installed"
    return {"command": f"icing demo --seed {seed}" + (" --quick" if size == QUICK else ""),
            "version": ours, "python": platform.python_version(),
            "numba": version("numba"), "machine": f"{platform.system()} {platform.machine()}"}  # fmt: skip


def write_next(report: Report, folder: Path, scenario: Path) -> None:
    """Add the section on what to try."""
    report.section("What to do next", NEXT)
    report.table(("command", "what it does"), [(c.format(hold=scenario, folder=folder), what) for c, what in COMMANDS],
                 "Commands to try (.venv/bin/icing, unless .venv is active).")
    report.text("And the environment from Python:")
    report.code(EXAMPLE)
