"""Linear view of the plant about any trim, as python-control systems with named signals, and its modes.

States for the linear view are the book's: airspeed and flow angles instead of body velocities, Euler angles instead of
the quaternion (Stevens, Lewis & Johnson, Aircraft Control and Simulation, 3rd ed., section 3.7). Derivatives are
central differences of the compiled plant, 1e-9 relative.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from icing_env.dynamics import air_data, derivative
from icing_env.errors import InputError, nearest
from icing_env.frames import direction_cosines, euler_angles, quaternion
from icing_env.jit import entry
from icing_env.trim import Trim
from icing_env.types import CONTINUOUS, CONTINUOUS_FIELDS

if TYPE_CHECKING:
    from control import StateSpace

BODY = ("airspeed", "alpha", "beta", "p", "q", "r", "phi", "theta", "psi", "altitude")
LAGS = ("alpha_downwash", "power_left", "power_right")
SURFACES = ("elevator", "aileron", "rudder")
INPUTS = (*SURFACES, "throttle_left", "throttle_right")
LONGITUDINAL = ("airspeed", "alpha", "q", "theta", "alpha_downwash")
LATERAL = ("beta", "p", "r", "phi")


@entry
def rates(stage: Any, s: Any, c: Any, p: Any, u: Any) -> None:
    """Rates of the continuous state in row 0 into row 1 (from Python)."""
    derivative(stage[0], stage[1], s[0], c[0], p[0], u[0])


@entry
def flow(stage: Any, s: Any, p: Any) -> tuple:
    """Airspeed, alpha, beta of row 0."""
    return air_data(stage[0], direction_cosines(stage[0].e0, stage[0].e1, stage[0].e2, stage[0].e3), s[0], p[0])[:3]


class Plant:
    """The compiled plant as x_dot = f(x, u) in the book's states, around one trim; wind and gusts as in the trim."""

    def __init__(self, trim: Trim, parameters: NDArray) -> None:
        self.trim, self.parameters = trim, parameters
        self.state, self.current, self.command = trim.state.copy(), trim.current.copy(), trim.command.copy()
        self.stage = np.zeros(2, CONTINUOUS)
        self.names = BODY + LAGS
        self.continuous = [name for name, _, _ in CONTINUOUS_FIELDS]

    def reference(self) -> tuple[NDArray, NDArray]:
        """States and inputs of the trim, in the order of `names` and INPUTS."""
        self._load(self.trim.state)
        u = [float(self.trim.state[s][0]) for s in SURFACES]
        return self._book(), np.array([*u, *(float(self.trim.command[t][0]) for t in INPUTS[3:])])

    def _load(self, state: NDArray) -> None:
        for name in self.continuous:
            self.stage[name][0] = state[name][0]

    def _book(self) -> NDArray:
        x = self.stage[0]
        airspeed, alpha, beta = flow(self.stage, self.state, self.parameters)
        angles = euler_angles(x["e0"], x["e1"], x["e2"], x["e3"])
        return np.array([airspeed, alpha, beta, x["p"], x["q"], x["r"], *angles, x["altitude"], *(x[n] for n in LAGS)])

    def _place(self, z: NDArray, u: NDArray) -> None:
        """Continuous state with the book's states `z` and inputs `u`, in the wind of the trim."""
        self._load(self.trim.state)
        v = dict(zip(self.names, z, strict=True))
        before = flow(self.stage, self.state, self.parameters)
        old = self.stage[0].copy()
        angles = direction_cosines(old["e0"], old["e1"], old["e2"], old["e3"])
        wind = _velocity(*before) - np.array([old["u"], old["v"], old["w"]])
        local = np.array(angles).reshape(3, 3).T @ wind
        x = self.stage[0]
        x["e0"], x["e1"], x["e2"], x["e3"] = quaternion(v["phi"], v["theta"], v["psi"])
        body = np.array(direction_cosines(x["e0"], x["e1"], x["e2"], x["e3"])).reshape(3, 3) @ local
        x["u"], x["v"], x["w"] = _velocity(v["airspeed"], v["alpha"], v["beta"]) - body
        for name in ("p", "q", "r", "altitude", *LAGS):
            x[name] = v[name]
        for name, value in zip(SURFACES, u, strict=False):
            x[name] = value
        self.command["throttle_left"], self.command["throttle_right"] = u[3], u[4]

    def rates(self, z: NDArray, u: NDArray) -> NDArray:
        """Rates of the book's states, by moving along the compiled rates a short way both ways."""
        self._place(z, u)
        rates(self.stage, self.state, self.current, self.parameters, self.command)
        start, slope, step = _row(self.stage, 0).copy(), _row(self.stage, 1).copy(), 1e-4
        ends = []
        for sign in (1.0, -1.0):
            _row(self.stage, 0)[:] = start + sign*step*slope
            ends.append(self._book())
        return (ends[0] - ends[1])/(2.0*step)


def _row(stage: NDArray, i: int) -> NDArray:
    return stage.view(np.float64).reshape(len(stage), -1)[i]


def _velocity(airspeed: float, alpha: float, beta: float) -> NDArray:
    return airspeed*np.array([np.cos(alpha)*np.cos(beta), np.sin(beta), np.sin(alpha)*np.cos(beta)])


def linearise(trim: Trim, parameters: NDArray, states: tuple[str, ...] | None = None) -> StateSpace:
    """Linear model about a trim.

    Args:
        trim: of `trim()`.
        parameters: the PARAMETERS row it was made with.
        states: names to keep (LONGITUDINAL, LATERAL or any of BODY and LAGS); all if omitted. States left out are held,
            except the lags, which are taken as settled: the quasi-steady model.

    Returns:
        python-control StateSpace: states and outputs by name, inputs INPUTS; deviations from the trim, SI and rad.
    """
    import control

    plant = Plant(trim, parameters)
    z0, u0 = plant.reference()
    a = _jacobian(lambda z: plant.rates(z, u0), z0)
    b = _jacobian(lambda u: plant.rates(z0, u), u0)
    keep = list(states or plant.names)
    for name in keep:
        if name not in plant.names:
            raise InputError(f"no state '{name}' to linearise: {nearest(name, list(plant.names))}")
    k = [plant.names.index(n) for n in keep]
    lags = [plant.names.index(n) for n in LAGS if n not in keep]
    settled = np.linalg.solve(a[np.ix_(lags, lags)], np.hstack([a[np.ix_(lags, k)], b[lags]]))
    reduced = np.hstack([a[np.ix_(k, k)], b[k]]) - a[np.ix_(k, lags)] @ settled
    return control.ss(reduced[:, :len(k)], reduced[:, len(k):], np.eye(len(k)), 0,
                      states=keep, inputs=list(INPUTS), outputs=keep)


def _jacobian(function: Callable[[NDArray], NDArray], at: NDArray) -> NDArray:
    """Central differences with steps of 1e-5 of each variable's size (at least 1e-5)."""
    columns = []
    for i, value in enumerate(at):
        step = 1e-5*max(1.0, abs(value))
        ahead, behind = at.copy(), at.copy()
        ahead[i] += step
        behind[i] -= step
        columns.append((function(ahead) - function(behind))/(2.0*step))
    return np.array(columns).T


@dataclass(frozen=True)
class Mode:
    """One mode: natural frequency [rad/s], damping ratio, eigenvalue, time constant [s] (real modes)."""

    name: str
    frequency: float
    damping: float
    eigenvalue: complex

    @property
    def time_constant(self) -> float:
        """-1/real part [s]; negative for an unstable mode."""
        return -1.0/self.eigenvalue.real


def modes(trim: Trim, parameters: NDArray) -> dict[str, Mode]:
    """Short period, phugoid, Dutch roll, roll and spiral about a trim.

    Longitudinal pairs are told apart by frequency; lateral real modes by speed (McRuer, Ashkenas & Graham, chapter 4).
    """
    found: dict[str, Mode] = {}
    pairs = _poles(linearise(trim, parameters, LONGITUDINAL), imaginary=True)
    if pairs:
        found["short_period"] = _mode("short_period", max(pairs, key=abs))
        if len(pairs) > 1:
            found["phugoid"] = _mode("phugoid", min(pairs, key=abs))
    lateral = linearise(trim, parameters, LATERAL)
    pairs, real = _poles(lateral, imaginary=True), _poles(lateral, imaginary=False)
    if pairs:
        found["dutch_roll"] = _mode("dutch_roll", max(pairs, key=abs))
    if real:
        found["roll"] = _mode("roll", max(real, key=abs))
        found["spiral"] = _mode("spiral", min(real, key=abs))
    return found


def _poles(system: StateSpace, imaginary: bool) -> list[complex]:
    return [complex(p) for p in np.linalg.eigvals(system.A) if (p.imag > 1e-9 if imaginary else abs(p.imag) <= 1e-9)]


def _mode(name: str, pole: complex) -> Mode:
    return Mode(name, abs(pole), -pole.real/abs(pole), pole)
