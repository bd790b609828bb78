"""Which effects tell of one another: faults of one device, and paths that no flight knows of."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from icing_env import effects
from icing_env.effects import Effect
from sim2real.actuators.paths import PATHS
from sim2real.library.bends import changed, plain
from sim2real.prediction.predictor import held

STEP = 0.02  # s, any


@cache
def apart(effect: Effect) -> bool:
    """Whether flights along recorded positions and powers do not know of an effect: its path alone tells of it."""
    return held(changed(effect), STEP).tobytes() == held(plain(), STEP).tobytes()


def together(names: Sequence[str]) -> int:
    """How many members of a set tell of one another, at most: those in flight, or those on one path."""
    places = [effects.LIBRARY[name].enters_at[0] if apart(effects.LIBRARY[name]) else "" for name in names]
    return max((places.count(place) for place in places), default=1)


def within(name: str, others: Sequence[str]) -> bool:
    """Whether an effect enters at one device alone (an actuator, an engine, an instrument) where another one does.

    Two faults of one device at once are rarer than one of another form; along an axis of the air's forces they are not.
    The load is such a device: one that is not as stated changes mass, its centre and inertia together.
    """
    places = effects.LIBRARY[name].enters_at
    device = len(places) == 1 and (places[0].startswith("sensor:") or places[0] in (*PATHS, "mass"))
    return device and any(places[0] in effects.LIBRARY[other].enters_at for other in others)
