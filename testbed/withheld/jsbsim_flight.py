"""JSBSim's DHC-6 flown through the benchmark's manoeuvres, read by the benchmark's instruments.

JSBSim computes the flight at 200 Hz. The rig adds what the DHC-6 file lacks: lags and rate limits between command and
surface, an autopilot that finds the steady state before the record begins (jsbsim_trim.py), the benchmark's mild pilot
during it, and Dryden gusts along the body axes, given to JSBSim as wind. North from 45 degrees of latitude, over
JSBSim's own turning Earth.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.withheld import instruments, manoeuvres
from testbed.withheld import plant as pl
from testbed.withheld.jsbsim_edit import AIRCRAFT, QUIET, Edit, edited
from testbed.withheld.jsbsim_trim import FT, SIDES, settle
from testbed.withheld.manoeuvres import Manoeuvre
from testbed.withheld.published import PUBLISHED

LBF, SLUG, HP = 4.4482216152605, 14.593902937, 745.69987158227
SLUG_FT2 = SLUG * FT * FT
STEP = pl.DT / pl.SUB
LAG = 0.05  # s, of the rig's actuators, and their rates: those of the published aircraft
RATES = np.array([PUBLISHED[f"{name}_rate"] for name in ("elevator", "aileron", "rudder")])
ELEVATOR, AILERON, RUDDER = (-0.454, 0.244), (-0.28, 0.33), 0.28  # rad at full lever of the DHC-6 file


@dataclass(frozen=True)
class Papers:
    """What JSBSim itself says of the loaded aircraft, SI, signs of the interface."""

    mass: float
    inertia: dict[str, float]
    wing_area: float
    span: float
    chord: float


@dataclass(frozen=True)
class Flight:
    """Exact channels [N], commands [N, 5], the benchmark's states [N, 27] and outputs [N, 9], and the papers."""

    channels: dict[str, NDArray]
    commands: NDArray
    states: NDArray
    outputs: NDArray
    papers: Papers


class Aircraft:
    """One JSBSim executive with the DHC-6 in it, changed by `edits`; `wind_up` [m/s] lifts the air."""

    def __init__(self, root: Path, edits: Sequence[Edit] = (), wind_up: float = 0.0) -> None:
        os.environ[QUIET] = "0"
        import jsbsim

        self.wind_up = wind_up
        with edited(root, edits) as folder:
            self.fdm: Any = jsbsim.FGFDMExec(str(root), None)
            self.fdm.set_debug_level(0)
            if not self.fdm.load_model_with_paths(AIRCRAFT, str(folder), str(root / "engine"), str(root / "systems")):
                raise ValueError(f"JSBSim cannot load {AIRCRAFT} from {root}")
        self.fdm.set_dt(STEP)

    def papers(self) -> Papers:
        """Mass, inertia and geometry as loaded."""
        get = self.fdm.get_property_value
        inertia = {a: get(f"inertia/i{a}-slugs_ft2") * SLUG_FT2 for a in ("xx", "yy", "zz", "xz")}
        inertia["xz"] = -inertia["xz"]  # found on its own answer to an aileron: it is minus the integral of x z dm
        return Papers(get("inertia/mass-slugs") * SLUG, inertia, get("metrics/Sw-sqft") * FT**2,
                      get("metrics/bw-ft") * FT, get("metrics/cbarw-ft") * FT)

    def command(self, surfaces: NDArray, levers: NDArray) -> None:
        """Surface angles [rad] and levers [0..1] as JSBSim's normalised commands."""
        f = self.fdm
        de, da, dr = (float(x) for x in surfaces)
        f["fcs/elevator-cmd-norm"] = de / (-ELEVATOR[0] if de < 0.0 else ELEVATOR[1])
        # positive aileron rolls left; JSBSim's command and its left aileron's angle roll right
        f["fcs/aileron-cmd-norm"] = -da / (AILERON[1] if da < 0.0 else -AILERON[0])
        f["fcs/rudder-cmd-norm"] = dr / RUDDER
        for (_, index), lever in zip(SIDES, levers, strict=True):
            f[f"fcs/throttle-cmd-norm{index}"] = float(lever)

    def positions(self) -> tuple[float, float, float]:
        """Elevator, aileron, rudder [rad] in the interface's signs."""
        f = self.fdm
        return f["fcs/elevator-pos-rad"], -f["fcs/left-aileron-pos-rad"], f["fcs/rudder-pos-rad"]

    def blow(self, gust: NDArray) -> None:
        """Gust velocities u, v, w [m/s] along the body axes, and the rising air, as JSBSim's wind."""
        f = self.fdm
        phi, theta, psi = (f[f"attitude/{a}-rad"] for a in ("phi", "theta", "psi"))
        u, v, w = float(gust[0]), float(gust[1]), float(gust[2])
        sp, cp, st, ct, ss, cs = (g(a) for a in (phi, theta, psi) for g in (math.sin, math.cos))
        level = v * sp + w * cp
        ahead, side = u * ct + level * st, v * cp - w * sp
        f["atmosphere/wind-north-fps"] = (ahead * cs - side * ss) / FT
        f["atmosphere/wind-east-fps"] = (ahead * ss + side * cs) / FT
        f["atmosphere/wind-down-fps"] = (level * ct - u * st - self.wind_up) / FT


def fly(aircraft: Aircraft, manoeuvre: Manoeuvre, gain: float = 1.0, gust: NDArray | None = None,
        wrong: Mapping[str, float] | None = None) -> Flight:
    """Trim and fly a manoeuvre; still air if no gusts are given.

    Args:
        aircraft: with its change.
        manoeuvre, gain: as in `manoeuvres.inputs`.
        gust: [samples*SUB + 1, GUSTS]; only velocities are used: JSBSim has no tail in the wind.
        wrong: errors of the instruments, as `instruments.exact` knows them.

    Raises:
        ArithmeticError: no steady state, or the aircraft did not come back from the manoeuvre.
    """
    aircraft.blow(np.zeros(3))
    held = settle(aircraft.fdm, aircraft.command, manoeuvre.speed)
    surfaces, plan = held[:3].copy(), manoeuvres.inputs(manoeuvre, gain)
    n, f = len(plan), aircraft.fdm
    air = np.zeros(((n - 1) * pl.SUB + 1, pl.GUSTS)) if gust is None else gust
    theta0, phi0 = f["attitude/theta-rad"], f["attitude/phi-rad"]
    commands, rows, share, most = np.zeros((n, 5)), [], 1.0 - math.exp(-STEP / LAG), STEP * RATES
    commands[0] = held
    rows.append(_row(aircraft))
    for k in range(1, n):
        c = held + plan[k]
        c[0] += manoeuvres.HOLD[0] * (f["attitude/theta-rad"] - theta0) + manoeuvres.HOLD[1] * f["velocities/q-rad_sec"]
        c[1] += manoeuvres.HOLD[2] * (f["attitude/phi-rad"] - phi0) + manoeuvres.HOLD[3] * f["velocities/p-rad_sec"]
        c[3:] = np.clip(c[3:], 0.0, 1.0)
        commands[k] = c
        for s in range(pl.SUB):
            surfaces += np.clip(share * (c[:3] - surfaces), -most, most)
            aircraft.command(surfaces, c[3:])
            aircraft.blow(air[(k - 1) * pl.SUB + s + 1])
            f.run()
        rows.append(_row(aircraft))
    Y, seen, engines = _states(np.array(rows))
    if not np.isfinite(Y).all() or np.max(np.abs(Y[:, [pl.PHI, pl.THETA]])) > 1.2:
        raise ArithmeticError("the aircraft departed")
    channels = instruments.exact(Y, seen, wrong or {})
    for j, side in enumerate(("left", "right")):
        channels[f"rpm_{side}"] = engines[:, j]
        channels[f"torque_{side}"] = engines[:, 2 + j]
    return Flight(channels, commands, Y, seen, aircraft.papers())


_READ = (
    "position/h-sl-meters", *(f"velocities/{a}-fps" for a in "uvw"),
    *(f"attitude/{a}-rad" for a in ("phi", "theta", "psi")), *(f"velocities/{a}-rad_sec" for a in "pqr"),
    "velocities/vt-fps", "aero/alpha-rad", "aero/beta-rad", *(f"forces/fb{a}-total-lbs" for a in "xyz"),
    "inertia/mass-slugs",
    *(f"propulsion/engine{i}/{n}" for i in ("", "[1]") for n in ("thrust-lbs", "power-hp", "propeller-rpm")))


def _row(aircraft: Aircraft) -> list[float]:
    return [*(aircraft.fdm[name] for name in _READ), *aircraft.positions()]


def _states(rows: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """The benchmark's states [N, 27] and outputs [N, 9], and rpm and torque [N m] of both engines [N, 4]."""
    (h, u, v, w, phi, theta, psi, p, q, r, vt, alpha, beta, fx, fy, fz, slugs, tl, pwl, nl, tr, pwr, nr,
     de, da, dr) = rows.T
    Y, seen, mass = np.zeros((len(rows), pl.STATES)), np.zeros((len(rows), pl.OUTPUTS)), slugs * SLUG
    for column, values in ((pl.H, h), (pl.U, u * FT), (pl.V, v * FT), (pl.W, w * FT), (pl.PHI, phi), (pl.THETA, theta),
                           (pl.PSI, _turning(psi)), (pl.P, p), (pl.Q, q), (pl.R, r), (pl.DE, de), (pl.DA, da),
                           (pl.DR, dr), (pl.PL, pwl * HP), (pl.PR, pwr * HP), (pl.ADW, alpha)):
        Y[:, column] = values
    for column, values in ((pl.VT, vt * FT), (pl.ALPHA, alpha), (pl.BETA, beta), (pl.FX, fx * LBF / mass),
                           (pl.FY, fy * LBF / mass), (pl.FZ, fz * LBF / mass), (pl.TL, tl * LBF), (pl.TR, tr * LBF)):
        seen[:, column] = values
    engines = np.column_stack([nl, nr, *(power * HP * 30.0 / (math.pi * np.maximum(rpm, 1.0))
                                         for power, rpm in ((pwl, nl), (pwr, nr)))])  # fmt: skip
    return Y, seen, engines


def _turning(psi: NDArray) -> NDArray:
    """Heading without jumps, within half a turn of north at first."""
    return np.asarray(np.unwrap(psi) - 2.0 * math.pi * round(float(psi[0]) / (2.0 * math.pi)))
