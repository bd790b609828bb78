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
SIGMAS, LEFT_BEHIND, TRIALS = 2.0, 0.05, 2  # of the more iced half wing; eta; inflations (all assumed)
FAILED = 0.95  # probability of failure above which the crew is told; ice that grows before the look counts against


class Characteriser:
    """Severity per surface, detection at its stated rate of false alarms, and health of the ice protection.

    Args:
        n: number of aircraft.
        clean: PARAMETERS row of the clean aircraft.
        dt: step [s].
        estimate, advisory: ESTIMATE rows that it reads and ADVISORY rows that it writes.
        reference: features of each aircraft's own clean flight [n or 1, features]; the type's numbers if omitted.
    """

    def __init__(self, n: int, clean: NDArray, dt: float, estimate: NDArray, advisory: NDArray,
                 reference: NDArray[np.float64] | None = None) -> None:
        self.dt, self.estimate, self.advisory = dt, estimate, advisory
        self.clean, self.character, self.reference = clean_from(clean), online.load(RIVAL), reference
        self.kept, self.severity = online.init(n)
        self.known = estimate.copy()  # of the last judgement, lift and pitch from the evidence where that is good
        self.measurement: NDArray[Any] = np.zeros(0)
        self.command: NDArray[Any] = np.zeros(0)
        self.reset(np.arange(n))

    def attach(self, measurement: NDArray, command: NDArray) -> None:
        """Bind it to the arrays it reads."""
        self.measurement, self.command = measurement, command

    def reset(self, rows: NDArray) -> None:
        """Begin anew in the given rows; an aircraft's own clean reference stays."""
        online.reset(self.kept, self.severity, rows)
        self.known[rows] = self.estimate[rows]
        if self.reference is not None:
            own = np.broadcast_to(self.reference, (len(self.severity), self.reference.shape[-1]))
            online.refer(self.kept, own[rows], rows)

    def observe(self) -> None:
        """Gather a sample; judge and tell once a second."""
        online.step(self.kept, self.severity, self.estimate, self.measurement, self.command, self.clean,
                    self.character, self.dt)
        if self.kept.clock[0] >= self.dt:
            return
        self._tell()
        self.known[:] = self.estimate
        values, std, good = derivatives(self.kept.evidence, self.measurement, self.clean)
        for name in TOLD:
            self.known[name][good], self.known[f"{name}_std"][good] = values[name][good], std[name][good]
        self.known["excitation_longitudinal"][good] = 1.0

    def memory(self) -> dict[str, NDArray]:
        """What must be kept to go on later."""
        return {f"sense_{name}": array for name, array in online.arrays(self.kept).items()} | {
            "sense_severity": self.severity, "sense_known": self.known}

    def _tell(self) -> None:
        """What is judged goes into the advisory; before the first judgement the drag speaks."""
        rows = np.flatnonzero(self.severity["judged"] > 0.0)
        seen, told = self.severity[rows], self.advisory[rows]
        eta = np.stack([seen[f"eta_{part}"] for part in PARTS], axis=1)
        failed = np.stack([(seen[f"p_failed_{part}"] > FAILED) & (seen[f"tested_{part}"] >= TRIALS)
                           for part in PARTS], axis=1)
        std = np.stack([seen[f"eta_{part}_std"] for part in PARTS], axis=1)
        failed[:, :2] |= unlike(eta[:, :2], std[:, :2], seen["tested_left_wing"])
        tell(told, eta, seen["p_iced"], seen["ice_detected"] > 0.5, failed)
        self.advisory[rows] = told


def unlike(eta: NDArray[np.float64], std: NDArray[np.float64], tested: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Half wings [n, 2] that keep their ice over inflations which clear the other: one boot of the pair has failed."""
    more = eta - eta[:, ::-1]
    return np.asarray((more > SIGMAS*std) & (eta > LEFT_BEHIND) & (tested[:, None] >= TRIALS))
