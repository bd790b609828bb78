"""Records of the benchmark's own generator for tests, written and read as files are."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from icing_env.record import FlightRecord, read
from testbed.withheld.conditions import Conditions
from testbed.withheld.files import record_text, side_text
from testbed.withheld.flights import Aircraft, recorded
from testbed.withheld.manoeuvres import DIAGNOSED, PLANS


def written(path: Path, channels: Mapping[str, np.ndarray], commands: Mapping[str, np.ndarray],
            role: str = "diagnose") -> FlightRecord:  # fmt: skip
    """A record at PATH.csv, with its side file."""
    file = path.with_name(f"{path.name}.csv")
    file.write_text(record_text(channels, commands))
    file.with_suffix(".toml").write_text(side_text("x", role))
    return read(file)


def in_still_air(folder: Path, role: str, aircraft: Aircraft, seed: int, gain: float = 1.15) -> list[FlightRecord]:
    """Three manoeuvres of the third plan."""
    out = []
    for i, manoeuvre in enumerate(PLANS[2][:DIAGNOSED]):
        rng = np.random.default_rng([seed, i])
        flight, seen = recorded(aircraft, manoeuvre, gain, Conditions(0.0, 1.0, 1.0), rng)
        out.append(written(folder / f"{role}{i}", seen, flight.commands, role))
    return out
