"""The composition root of flight: observer, ice management, autopilot and protection around the aircraft.

Order within a step: steer (autopilot), protect (adaptation, ice protection, then limits), fly, observe (estimator, ice
management). Everyone sees measurements, estimates and the clean aircraft's numbers; nobody sees the truth but the
oracle, which the testbed alone can choose and must show its fleet.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from controllers import choice, ice_management
from controllers.ice_management import adapt
from estimators.airframe import airframe_from
from estimators.observer.choice import observer as observer_named
from estimators.observer.layout import PARAMETER_NAMES
from icing_env.errors import InputError, nearest
from icing_env.jit import bound
from icing_env.simulate import Fleet
from icing_env.types import ESTIMATE, ESTIMATED_NAMES, TARGET
from testbed.oracle import Oracle
from testbed.sensing import SENSES, Characteriser


class ClosedLoop:
    """Observer and controllers of `n` aircraft (an `icing_env.loop.Loop`).

    Args:
        n: number of aircraft.
        clean: PARAMETERS row of the clean aircraft, what everyone believes it to be.
        dt: step [s].
        observer: estimate derivatives in flight; else the estimates stay those of the clean aircraft.
        management: find ice, move the limits, and operate ice protection where `boots` says so.
        protection: limit commands to the limits.
        boots: let the ice management switch boots and propeller heat.
        estimator: which observer, by its name in `estimators.observer.choice`, or "oracle": the truth (`reveal`).
        law: who steers, by its name in `controllers.choice.LAWS`.
        shield: how limits are kept, by its name in `controllers.choice.PROTECTIONS`.
        sense: how the ice management finds ice, one of `testbed.sensing.SENSES`; the oracle knows.
        adaptation: between the law and the protection, keep the flying qualities of the clean aircraft.
        reference: features of each aircraft's own clean flight, for the characteriser.
    """

    def __init__(self, n: int, clean: NDArray, dt: float, *, observer: bool = True, management: bool = True,
                 protection: bool = True, boots: bool = True, estimator: str = "hinf", law: str = "autopilot",
                 shield: str = "surfaces", sense: str = "drag", adaptation: bool = False,
                 reference: NDArray | None = None) -> None:
        self.dt, self.clean, knows = dt, clean[:1].copy(), estimator == "oracle"
        self.observing, self.managing = observer and not knows, management
        self.protecting, self.boots, self.adapting = protection, boots, adaptation
        self.airframe = airframe_from(self.clean)
        chosen = observer_named("hinf" if knows else estimator)
        self._step, self.tuning = chosen.step, chosen.default_tuning()
        self._law, self._shield = choice.law(law), choice.protection(shield)
        self.gains, self.shield_tuning = self._law.default_gains(), self._shield.load_tuning()
        self.management_tuning, self.adaptation_tuning = ice_management.load_tuning(), adapt.load_tuning()
        self.target = np.zeros(n, TARGET)
        self._fresh_observer = chosen.init(self.airframe, self.tuning, 1)
        self._fresh_estimate = clean_estimate(self._fresh_observer)
        self.observer, self.estimate = np.repeat(self._fresh_observer, n), np.repeat(self._fresh_estimate, n)
        self.advisory, self.law, self.shield = ice_management.init(n), self._law.init(n), self._shield.init(n)
        self.adaptation = adapt.init(n)
        self.informant = self._informant(n, sense, knows, reference)

    def _informant(self, n: int, sense: str, knows: bool, reference: NDArray | None) -> Oracle | Characteriser | None:
        """Who tells the ice management the ice surface by surface, if anybody does."""
        if sense not in SENSES:
            raise InputError(f"no way to sense ice '{sense}': {nearest(sense, list(SENSES))}")
        about = (self.estimate, self.advisory)
        if knows:
            return Oracle(self.clean, self.dt, *about, self.management_tuning)
        if sense == "characterise" and (self.managing or self.adapting):
            return Characteriser(n, self.clean, self.dt, *about, reference)
        return None

    def attach(self, measurement: NDArray, command: NDArray) -> None:
        """Bind every part to the arrays it works on."""
        self.measurement = measurement
        estimate, advisory, dt = self.estimate, self.advisory, self.dt
        self._estimate = bound(self._step, self.observer, estimate, measurement, self.airframe, self.tuning, dt)
        self._manage = bound(ice_management.step, advisory, estimate, measurement, self.clean, self.management_tuning,
                             dt)
        self._judge_power = bound(ice_management.judge_power, advisory, measurement, self.target, self.clean,
                                  self.management_tuning, dt)
        self._steer: Callable[[], None] | None = None  # compiled when first wanted: surfaces alone need no autopilot
        self._command = command
        self._operate = bound(ice_management.operate, command, advisory)
        self._protect = bound(self._shield.protect, self.shield, command, advisory, measurement, estimate, self.clean,
                              self.shield_tuning, dt)
        if self.adapting:
            known = self.informant.known if isinstance(self.informant, Characteriser) else estimate
            self._adapt = bound(adapt.adapt, self.adaptation, command, measurement, known, advisory, self.clean,
                                self.adaptation_tuning, dt)
        if isinstance(self.informant, Characteriser):
            self.informant.attach(measurement, command)

    def reveal(self, fleet: Fleet) -> None:
        """Show the fleet to the oracle; to anybody else, nothing."""
        if isinstance(self.informant, Oracle):
            self.informant.reveal(fleet)

    def reset(self, rows: NDArray) -> None:
        """Begin anew: a clean aircraft is believed, nothing is limited beyond the clean limits."""
        self.observer[rows], self.estimate[rows] = self._fresh_observer, self._fresh_estimate
        self.advisory[rows], self.adaptation[rows] = ice_management.init(1), adapt.init(1)
        self.law[rows], self.shield[rows] = self._law.init(1), self._shield.init(1)
        if self.informant is not None:
            self.informant.reset(rows)
        if self.managing:
            advisory = self.advisory[rows]
            ice_management.step(advisory, self.estimate[rows], self.measurement[rows], self.clean,
                                self.management_tuning, self.dt)
            self.advisory[rows] = advisory

    def observe(self) -> None:
        """Estimate from the measurement, then judge the ice."""
        if self.observing:
            self._estimate()
        if self.informant is not None:
            self.informant.observe()
        if self.managing:
            self._manage()
            self._judge_power()

    def steer(self) -> None:
        """Fly the targets."""
        if self._steer is None:
            self._steer = bound(self._law.step, self.law, self._command, self.measurement, self.estimate, self.target,
                                self.advisory, self.clean, self.gains, self.dt)
        self._steer()

    def protect(self) -> None:
        """Adapt the command to the aircraft as it is, switch boots and heat, then limit the command."""
        if self.adapting:
            self._adapt()
        if self.managing and self.boots:
            self._operate()
        self.limit()

    def limit(self) -> None:
        """Keep the command within the limits."""
        if self.protecting:
            self._protect()

    def memory(self) -> dict[str, NDArray]:
        """Everything that must be kept to go on later."""
        told = {} if self.informant is None else self.informant.memory()
        return {"estimate": self.estimate, "advisory": self.advisory, "target": self.target,
                "observer": self.observer, "law": self.law, "shield": self.shield, "adaptation": self.adaptation,
                **told}


def clean_estimate(memory: NDArray) -> NDArray:
    """ESTIMATE row of an observer that has seen nothing yet, from its fresh memory: clean, and the prior."""
    estimate = np.zeros(1, ESTIMATE)
    for i, name in enumerate(PARAMETER_NAMES):
        if name in ESTIMATED_NAMES:
            estimate[name], estimate[f"{name}_std"] = memory["theta"][0, i], memory["deviation"][0, i]
    estimate["health"] = 1.0
    return estimate
