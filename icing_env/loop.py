"""What closes the loop around the aircraft, seen from the environment: it receives it and knows no more of it.

The environment hands over measurements and receives commands; who observes, manages ice and protects is decided in the
composition root (`testbed.closed_loop`). All arrays have a row per aircraft.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from icing_env.types import ADVISORY, ESTIMATE, TARGET


class Loop(Protocol):
    """Observer, ice management, autopilot and protection as one."""

    estimate: NDArray  # ESTIMATE [n]
    advisory: NDArray  # ADVISORY [n]
    target: NDArray  # TARGET [n], what the autopilot holds

    def attach(self, measurement: NDArray, command: NDArray) -> None:
        """Learn where measurements will be found and commands be written: the same arrays in every step."""

    def reset(self, rows: NDArray) -> None:
        """Begin anew in the given rows."""

    def observe(self) -> None:
        """Take the measurement: estimates and advisory."""

    def steer(self) -> None:
        """Let the autopilot write every row of the command (surfaces, throttles, flap)."""

    def protect(self) -> None:
        """Operate ice protection and limit the command."""

    def memory(self) -> dict[str, NDArray]:
        """Every array that must be kept to go on later (views, not copies)."""


LoopFactory = Callable[[int, NDArray, float], Loop]  # (n, PARAMETERS of the clean aircraft, dt)


class NoLoop:
    """Nobody observes, manages or protects; an autopilot would leave the command as it is."""

    def __init__(self, n: int, clean: NDArray, dt: float) -> None:
        del clean, dt
        self.estimate = np.zeros(n, ESTIMATE)
        self.advisory = np.zeros(n, ADVISORY)
        self.target = np.zeros(n, TARGET)

    def attach(self, measurement: NDArray, command: NDArray) -> None:
        """Nothing is read or written."""

    def reset(self, rows: NDArray) -> None:
        """Nothing to begin."""

    def observe(self) -> None:
        """Nothing to estimate."""

    def steer(self) -> None:
        """Controls stay where they are."""

    def protect(self) -> None:
        """Nothing is limited."""

    def memory(self) -> dict[str, NDArray]:
        """The arrays of the interface."""
        return {"estimate": self.estimate, "advisory": self.advisory, "target": self.target}
