"""How far JSBSim's DHC-6 is from the published aircraft, by axis: both asked for the same state of the same flight.

Clean flights in still air; at every sample the published plant gives forces and moments for JSBSim's state, surfaces
and power. Forces are told in tolerances of the accelerometers, moments in those of the rates, as what the difference
of angular acceleration makes of a rate in HALF_SECOND, about half a short period (assumed).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from testbed.withheld import manoeuvres
from testbed.withheld import plant as pl
from testbed.withheld.instruments import G0
from testbed.withheld.jsbsim_cases import aircraft
from testbed.withheld.jsbsim_flight import Flight, fly
from testbed.withheld.manoeuvres import DEG, Manoeuvre
from testbed.withheld.published import airframe

HALF_SECOND = 0.5  # s
# tolerances of docs/interfaces: ax 0.02 g, ay 0.05 g, az 0.10 g, rates 2 deg/s
TOLERANCE = {"x_force": 0.02 * G0, "y_force": 0.05 * G0, "z_force": 0.10 * G0,
             "rolling_moment": 2.0 * DEG / HALF_SECOND, "pitching_moment": 2.0 * DEG / HALF_SECOND,
             "yawing_moment": 2.0 * DEG / HALF_SECOND}  # fmt: skip
THRUST = 0.02 * G0  # thrust counts by the axial acceleration that it makes
LEVEL = 1.0  # tolerances: what is beyond differs


@dataclass(frozen=True)
class Difference:
    """Of one component, in tolerances: mean over the flights, and RMS of what changes during them."""

    mean: float
    changing: float

    @property
    def rms(self) -> float:
        """Both together."""
        return float(np.hypot(self.mean, self.changing))


def differences(root: Path, flown: Sequence[Manoeuvre] = manoeuvres.PLANS[0]) -> dict[str, Difference]:
    """JSBSim less the published aircraft, by component, the largest first."""
    rows = np.concatenate([compared(fly(aircraft(root), m)) for m in flown])
    names = (*TOLERANCE, "propulsion")
    found = {n: Difference(float(np.mean(c)), float(np.std(c))) for n, c in zip(names, rows.T, strict=True)}
    return dict(sorted(found.items(), key=lambda item: -item[1].rms))


def compared(flight: Flight) -> NDArray:
    """JSBSim less published along one still-air flight, in tolerances [N, 7]."""
    row, Y, seen = _published(flight), flight.states, flight.outputs
    true = np.column_stack([seen[:, pl.FX : pl.FZ + 1], np.gradient(Y[:, pl.P : pl.R + 1], pl.DT, axis=0)])
    model, thrust = np.empty((len(Y), 6)), np.empty(len(Y))
    d, o, u, still = np.empty(pl.STATES), np.empty(pl.OUTPUTS), np.zeros(5), np.zeros(pl.GUSTS)
    for k, y in enumerate(Y):
        pl.rates(y, row[0], u, still, 0.0, d, o)
        model[k] = (*o[pl.FX : pl.FZ + 1], *d[pl.P : pl.R + 1])
        thrust[k] = o[pl.TL] + o[pl.TR]
    force = (seen[:, pl.TL] + seen[:, pl.TR] - thrust) / flight.papers.mass
    left = (true - model) / np.array(list(TOLERANCE.values()))
    left[:, 0] -= force / THRUST  # thrust is told by itself
    return np.column_stack([left, force / THRUST])


def _published(flight: Flight) -> NDArray:
    """Published aerodynamics and engines with the mass, inertia and geometry of JSBSim's papers."""
    papers = flight.papers
    return airframe({"mass": papers.mass, **{f"inertia_{a}": v for a, v in papers.inertia.items()},
                     "wing_area": papers.wing_area, "span": papers.span, "chord": papers.chord})  # fmt: skip


def differing(found: dict[str, Difference]) -> list[str]:
    """Components beyond LEVEL."""
    return [name for name, difference in found.items() if difference.rms > LEVEL]
