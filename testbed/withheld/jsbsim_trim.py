"""The steady state before a record of JSBSim: an autopilot flies to it, since engines and propellers have to run up.

JSBSim's own trim balances forces at one instant and leaves its turboprops to wander off.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.withheld import plant as pl

FT = 0.3048
SIDES = (("left", ""), ("right", "[1]"))
ALTITUDE = 2200.0  # m
SETTLING = 100.0  # s of autopilot


def settle(fdm: Any, command: Callable[[NDArray, NDArray], None], speed: float) -> NDArray:
    """Nearly steady level flight at `speed` [m/s], found by an autopilot; what is left is a climb of about 0.1 m/s.

    Args:
        fdm: JSBSim's executive, an aircraft in it, no wind.
        command: gives surface angles [3] and levers [2] to it.

    Returns:
        Commands [5] that hold it: elevator, aileron, rudder [rad], levers.
    """
    f = fdm
    start = {"ic/lat-geod-deg": 45.0, "ic/long-gc-deg": 0.0, "ic/h-sl-ft": ALTITUDE / FT, "ic/psi-true-deg": 0.0,
             "ic/vt-fps": speed / FT, "ic/alpha-deg": 3.0, "ic/beta-deg": 0.0, "ic/phi-deg": 0.0, "ic/theta-deg": 3.0,
             "propulsion/fuel_freeze": 1.0}  # fmt: skip
    for name, value in start.items():
        f[name] = value
    f.run_ic()
    f["propulsion/set-running"] = -1
    for _, index in SIDES:
        f[f"fcs/advance-cmd-norm{index}"] = 1.0
        f[f"fcs/mixture-cmd-norm{index}"] = 1.0
    u, lever, pitch, wheel, pedal = np.zeros(3), 0.7, 0.0, 0.0, 0.0
    for _ in range(round(SETTLING / pl.DT)):
        slow = speed - f["velocities/vt-fps"] * FT
        low = ALTITUDE - f["position/h-sl-meters"]
        climb = -f["velocities/v-down-fps"] * FT
        lever = min(max(lever + 0.004 * slow * pl.DT, 0.0), 1.0)
        wanted = 0.004 * low - 0.02 * climb
        pitch += 0.05 * (0.05 * low - climb) * 0.02 * pl.DT
        theta = f["attitude/theta-rad"] - pitch - wanted - 0.03
        u[0] = 0.8 * theta + 0.5 * f["velocities/q-rad_sec"]
        wheel += 0.1 * f["attitude/phi-rad"] * pl.DT
        pedal += -0.1 * f["aero/beta-rad"] * pl.DT
        u[1] = wheel + 0.5 * f["attitude/phi-rad"] + 0.2 * f["velocities/p-rad_sec"]
        u[2] = pedal
        levers = np.full(2, min(max(lever + 0.05 * slow, 0.0), 1.0))
        command(u, levers)
        for _ in range(pl.SUB):
            f.run()
    return np.array([*u, *levers])
