"""The characteriser in the loop: once a second it tells the ice management the ice surface by surface."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.ice_management.sense import tell
from estimators.characterise import online
from estimators.characterise.clean import clean_from
from estimators.characterise.derivatives import TOLD, derivatives
from estimators.characterise.model import PARTS

SENSES = ("drag", "characterise")  # by excess drag first, in the ice management itself; or by the characteriser
RIVAL = "network"
FAILED = 0.5  # probability of failure above which the crew is told, after at least one inflation


class Characteriser:
    """Severity per surface, detection at its stated rate of false alarms, and health of the ice protection.

    Args:
        n: number of aircraft.
        clean: PARAMETERS row of the clean aircraft.
        dt: step [s].
        estimate, advisory: ESTIMATE rows that it reads and ADVISORY rows that it writes.
        tuning: IMS_TUNING row.
        reference: features of each aircraft's own clean flight [n or 1, features]; the type's numbers if omitted.
    """

    def __init__(self, n: int, clean: NDArray, dt: float, estimate: NDArray, advisory: NDArray, tuning: NDArray,
                 reference: NDArray[np.float64] | None = None) -> None:
        self.dt, self.estimate, self.advisory, self.tuning = dt, estimate, advisory, tuning
        self.clean, self.character, self.reference = clean_from(clean), online.load(RIVAL), reference
        self.kept, self.severity = online.init(n)
        self.known = estimate.copy()  # the estimate, with lift and pitch derivatives from the evidence where it is good
        self.held = np.zeros((n, 2*len(TOLD) + 1))
        self.measurement: NDArray[Any] = np.zeros(0)
        self.command: NDArray[Any] = np.zeros(0)
        self.reset(np.arange(n))

    def attach(self, measurement: NDArray, command: NDArray) -> None:
        """Bind it to the arrays it reads."""
        self.measurement, self.command = measurement, command

    def reset(self, rows: NDArray) -> None:
        """Begin anew in the given rows; an aircraft's own clean reference stays."""
        online.reset(self.kept, self.severity, rows)
        self.held[rows], self.known[rows] = 0.0, self.estimate[rows]
        if self.reference is not None:
            own = np.broadcast_to(self.reference, (len(self.severity), self.reference.shape[-1]))
            online.refer(self.kept, own[rows], rows)

    def observe(self) -> None:
        """Gather a sample; judge and tell once a second."""
        online.step(self.kept, self.severity, self.estimate, self.measurement, self.command, self.clean,
                    self.character, self.dt)
        if self.kept.clock[0] < self.dt:
            self._tell()
            values, std, good = derivatives(self.kept.evidence, self.measurement, self.clean)
            self.held = np.stack([*values.values(), *std.values(), good], axis=1)
        self.known[:] = self.estimate
        good = self.held[:, -1] > 0.0
        for i, name in enumerate(TOLD):
            self.known[name][good], self.known[f"{name}_std"][good] = self.held[good, i], self.held[good, len(TOLD) + i]
        self.known["excitation_longitudinal"][good] = 1.0

    def memory(self) -> dict[str, NDArray]:
        """What must be kept to go on later."""
        return {f"sense_{name}": array for name, array in online.arrays(self.kept).items()} | {
            "sense_severity": self.severity, "sense_held": self.held, "sense_known": self.known}

    def _tell(self) -> None:
        """What is judged goes into the advisory; before the first judgement the drag speaks."""
        rows = np.flatnonzero(self.severity["judged"] > 0.0)
        seen, told = self.severity[rows], self.advisory[rows]
        eta = np.stack([seen[f"eta_{part}"] for part in PARTS], axis=1)
        failed = np.stack([(seen[f"p_failed_{part}"] > FAILED) & (seen[f"tested_{part}"] > 0.0)
                           for part in PARTS], axis=1)
        std = np.stack([seen[f"eta_{part}_std"] for part in PARTS], axis=1)
        tell(told, eta, std, seen["p_iced"], seen["ice_detected"] > 0.5, failed, self.tuning)
        self.advisory[rows] = told
