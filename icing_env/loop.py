"""What closes the loop around the aircraft, seen from the environment: it receives it and knows no more of it.

The environment hands over measurements and receives commands; who observes, manages ice and protects is decided in the
composition root (`testbed.closed_loop`). All arrays have a row per aircraft.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from icing_env.types import ADVISORY, ESTIMATE, TARGET


class Loop(Protocol):
    """Observer, ice management, autopilot and protection as one."""

    estimate: NDArray  # ESTIMATE [n]
    advisory: NDArray  # ADVISORY [n]
    target: NDArray  # TARGET [n], what the autopilot holds

    def reset(self, rows: NDArray, measurement: NDArray) -> None:
        """Begin anew in the given rows."""

    def observe(self, measurement: NDArray) -> None:
        """Take a measurement: estimates and advisory."""

    def steer(self, measurement: NDArray, command: NDArray) -> None:
        """Let the autopilot write every row of `command` (surfaces, throttles, flap)."""

    def protect(self, measurement: NDArray, command: NDArray) -> None:
        """Operate ice protection and limit `command`."""

    def memory(self) -> dict[str, NDArray]:
        """Every array that must be kept to go on later (views, not copies)."""


class NoLoop:
    """Nobody observes, manages or protects; the autopilot leaves the command as it is."""

    def __init__(self, n: int):
        self.estimate = np.zeros(n, ESTIMATE)
        self.advisory = np.zeros(n, ADVISORY)
        self.target = np.zeros(n, TARGET)

    def reset(self, rows: NDArray, measurement: NDArray) -> None:
        """Nothing to begin."""

    def observe(self, measurement: NDArray) -> None:
        """Nothing to estimate."""

    def steer(self, measurement: NDArray, command: NDArray) -> None:
        """Controls stay where they are."""

    def protect(self, measurement: NDArray, command: NDArray) -> None:
        """Nothing is limited."""

    def memory(self) -> dict[str, NDArray]:
        """The arrays of the interface."""
        return {"estimate": self.estimate, "advisory": self.advisory, "target": self.target}


LoopFactory = Any  # callable (n, PARAMETERS of the clean aircraft, dt) -> Loop
