"""How near the aircraft at an episode's end is to the clean one: modes, control sensitivity, level of flying qualities.

The true iced aircraft is linearised in steady flight at the episode's last airspeed and height, with the control-law
adaptation as it then stood if the controller has one (`testbed.flying_qualities`), and compared with the clean aircraft
there. Laws close their own loops around this; what is judged is the aircraft that they, or a pilot, are given.
"""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from icing_env.errors import InputError
from icing_env.trim import Trim, trim
from icing_env.types import SURFACES
from icing_env.world import World
from testbed.flying_qualities import level, qualities

FloatArray = NDArray[np.float64]
FIGURES = ("short_period", "short_period_damping", "pitch", "dutch_roll", "roll")
MOST = 4  # episodes of a row that are judged: 0.1 s each


def modal(world: World, flown: NDArray[np.bool_]) -> dict[str, FloatArray]:
    """Relative deviations from the clean aircraft by figure, and the level lost; NaN where not judged [n].

    Args:
        world: at the end of its episodes.
        flown: episodes that flew their whole time [n].
    """
    out = {name: np.full(world.n, np.nan) for name in (*(f"{f}_off" for f in FIGURES), "level_lost")}
    beliefs = world.loop.memory().get("adaptation")
    for i in np.flatnonzero(flown)[:MOST]:
        state, clean = world.fleet.state[i], world.clean
        true = world.fleet.parameters[i:i + 1] if world.individual else world.true
        eta = {name: float(state[f"eta_{name}"]) for name in SURFACES}
        speed, height = float(world.fleet.outcome["airspeed"][i]), float(state["altitude"])
        try:
            iced, reference = _trim(true, eta, speed, height), _trim(clean, {}, speed, height)
        except InputError:
            continue  # no steady flight there: nothing to linearise about
        belief = None if beliefs is None else beliefs[i:i + 1]
        now = qualities(iced, true, None if belief is None else clean, belief)
        before = qualities(reference, clean)
        for name in FIGURES:
            out[f"{name}_off"][i] = abs(asdict(now)[name]/asdict(before)[name] - 1.0)
        out["level_lost"][i] = float(level(before) == 1 and level(now) > 1)
    return out


def _trim(parameters: NDArray, eta: dict[str, float], airspeed: float, altitude: float) -> Trim:
    return trim(parameters, eta, airspeed=airspeed, altitude=altitude)
