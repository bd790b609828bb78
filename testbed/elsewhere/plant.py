"""The plant: many flights side by side (columns), with the effects' hooks, advanced by RK4 at a fixed step.

State rows: 0-2 body velocity over ground m/s, 3-5 p q r rad/s, 6-9 quaternion, 10-12 north east down m,
13-14 shaft power W left and right, then the effects' own states.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from testbed.elsewhere import aerodynamics, propulsion
from testbed.elsewhere.aircraft import AREA, CHORD, ENGINE_ARM, SPAN
from testbed.elsewhere.atmosphere import atmosphere
from testbed.elsewhere.hooks import Flow, Hooks
from testbed.elsewhere.rigid_body import angular_acceleration, cross, motion, rotation

BASE = 15
Held = tuple[NDArray, NDArray, NDArray, NDArray]  # position, throttle, gust, wind
ARMS = np.array([SPAN, CHORD, SPAN])[:, None]


class Plant:
    """Aircraft (derivatives, loading, thrust factor) in an air mass (temperature offset) with effects."""

    def __init__(self, derivatives: Mapping[str, Any], mass: NDArray, inertia: NDArray, on: NDArray,
                 hooks: Sequence[Hooks] = (), thrust_factor: float | NDArray = 1.0, offset: float = 0.0) -> None:
        """`mass` (n,), `inertia` (4, n), `on` (n,) 0 or 1; `offset` K from the standard atmosphere."""
        self.d, self.mass, self.inertia, self.on = derivatives, mass, inertia, on
        self.hooks, self.thrust_factor, self.offset = list(hooks), thrust_factor, offset
        self.size = BASE
        for hook in self.hooks:
            hook.slot = slice(self.size, self.size + hook.states)
            self.size += hook.states

    def _call(self, place: str, flow: Flow) -> None:
        for hook in self.hooks:
            function = getattr(hook, place)
            if function is not None:
                function(flow)

    def _air(self, flow: Flow, gust: NDArray, wind: NDArray) -> None:
        """Relative wind: speed, flow angles, dynamic pressure, rates relative to the air."""
        flow.wind = gust[:3] + np.einsum("jin,jn->in", flow.matrix, wind)
        flow.spin = gust[3:].copy()
        self._call("wind", flow)
        flow.air = flow.x[:3] - flow.wind
        flow.speed = np.sqrt((flow.air**2).sum(0))
        flow.alpha = np.arctan2(flow.air[2], flow.air[0])
        flow.beta = np.arcsin(flow.air[1] / flow.speed)
        flow.temperature, flow.pressure, flow.density = atmosphere(-flow.x[12], self.offset)
        flow.qbar = 0.5 * flow.density * flow.speed**2
        flow.relative = flow.rates - flow.spin

    def _loads(self, flow: Flow) -> None:
        """Force and moment about the c.g., then mass properties and the effects' extra loads."""
        flow.power = flow.x[13:15]
        flow.deck = propulsion.thrust(flow.power, flow.speed)
        flow.thrust = flow.deck * self.thrust_factor
        self._call("thrust", flow)
        flow.CT = flow.thrust.sum(0) / (flow.qbar * AREA)
        flow.C = aerodynamics.coefficients(self.d, flow.alpha, flow.beta, flow.speed, flow.relative, flow.surfaces)
        self._call("coefficients", flow)
        flow.force = flow.qbar * AREA * flow.C[:3]
        flow.force[0] += flow.thrust.sum(0)
        flow.moment = flow.qbar * AREA * ARMS * flow.C[3:]
        flow.moment[2] += ENGINE_ARM * (flow.thrust[0] - flow.thrust[1])
        flow.mass, flow.inertia, flow.cg_move = self.mass.copy(), self.inertia.copy(), np.zeros_like(flow.rates)
        self._call("mass", flow)
        self._call("loads", flow)
        flow.moment -= cross(flow.cg_move, flow.force)

    def rates(self, t: float, x: NDArray, position: NDArray, throttle: NDArray, gust: NDArray,
              wind: NDArray) -> tuple[NDArray, Flow]:
        """Time derivative of the state (size, n) and the `Flow` it came from. `wind` is north-east-down in m/s."""
        flow = Flow(t=t, x=x, on=self.on, d=self.d, rates=x[3:6], matrix=rotation(x[6:10]), throttle=throttle)
        self._air(flow, gust, wind)
        flow.surfaces = position.copy()
        self._call("surface", flow)
        self._loads(flow)
        flow.turn = angular_acceleration(flow.moment, flow.rates, flow.inertia)
        flow.specific = flow.force / flow.mass
        body = motion(x[:3], flow.rates, x[6:10], flow.specific, flow.turn, flow.matrix)
        spool = (propulsion.power_demand(throttle, flow.pressure) - flow.power) / propulsion.LAG
        memory = [h.memory(flow, x[h.slot]) for h in self.hooks if h.memory is not None]
        return np.concatenate([body, spool, *memory]), flow

    def step(self, t: float, x: NDArray, dt: float, now: Held, then: Held) -> tuple[NDArray, Flow]:
        """One RK4 step; `now` and `then` are (position, throttle, gust, wind) at its ends, linear in between."""
        half = [0.5 * (a + b) for a, b in zip(now, then, strict=True)]
        k1, flow = self.rates(t, x, *now)
        k2, _ = self.rates(t + dt / 2, x + dt / 2 * k1, *half)
        k3, _ = self.rates(t + dt / 2, x + dt / 2 * k2, *half)
        k4, _ = self.rates(t + dt, x + dt * k3, *then)
        new = x + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        new[6:10] /= np.sqrt((new[6:10] ** 2).sum(0))
        return new, flow
