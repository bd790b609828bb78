"""Every control law and every envelope protection, by name."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from types import ModuleType

from icing_env.errors import InputError, nearest


@dataclass(frozen=True)
class Choice:
    """One of them: its module, what it is, and of which kind."""

    module: str
    description: str
    kind: str = "classical"  # classical, adaptive
    episodes: int = 1_000_000  # most that a comparison flies; fewer for one that takes long

    def load(self) -> ModuleType:
        """The module: `init(n)`; a law has `default_gains` and `step`, a protection `load_tuning` and `protect`."""
        return import_module(self.module)


LAWS: dict[str, Choice] = {
    "autopilot": Choice("controllers.laws.autopilot", "cascaded PID: attitude, altitude, speed and heading holds"),
    "l1": Choice("controllers.laws.l1", "the autopilot, and by L1 adaptation moments that the clean aircraft lacks",
                 "adaptive"),
    "scheduled": Choice("controllers.laws.scheduled", "the autopilot, its gains scheduled by the observer's estimate",
                        "adaptive"),
    "mpc": Choice("controllers.laws.mpc", "linear model-predictive control of pitch and bank under the moved limits",
                  episodes=4),
    "pilot": Choice("controllers.laws.pilot", "a pilot flying attitude: delay, lead, lag, muscles and remnant"),
    "indi": Choice("controllers.laws.indi", "incremental nonlinear dynamic inversion of pitch and roll", "adaptive"),
    "sis": Choice("controllers.laws.sis", "the Smart Icing System's published attitude and heading holds"),
    "lqr": Choice("controllers.laws.lqr", "linear-quadratic regulator with integral action, scheduled"),
    "lqg": Choice("controllers.laws.lqg", "the same regulator on a Kalman filter that keeps gusts apart"),
    "h_infinity": Choice("controllers.laws.h_infinity", "H-infinity attitude loops by mixed sensitivity"),
}
PROTECTIONS: dict[str, Choice] = {
    "surfaces": Choice("controllers.protection.surfaces", "surfaces kept within what the limits allow"),
    "predictive": Choice("controllers.protection.predictive", "the response run forward, held controls limited"),
    "barrier": Choice("controllers.protection.barrier", "control-barrier functions, by a quadratic programme"),
}


def law(name: str) -> ModuleType:
    """The module of a law; InputError names the nearest."""
    if name not in LAWS:
        raise InputError(f"no control law '{name}': {nearest(name, list(LAWS))}")
    return LAWS[name].load()


def protection(name: str) -> ModuleType:
    """The module of a protection; InputError names the nearest."""
    if name not in PROTECTIONS:
        raise InputError(f"no envelope protection '{name}': {nearest(name, list(PROTECTIONS))}")
    return PROTECTIONS[name].load()
