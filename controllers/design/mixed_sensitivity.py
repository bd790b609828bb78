"""Mixed sensitivity with a disturbance at the surface: weights, synthesis, reduction, discretisation.

Skogestad & Postlethwaite, Multivariable Feedback Control, 2nd ed., sections 2.7 and 9.3. For a command r, a disturbance
d at the surface and noise n of the gyro, the controller K from (r - angle, rate) to the surface u minimises the largest
gain gamma from (r, d, n) to

    W_S (r - angle),   W_K u,   W_T angle.

W_S asks for tracking up to a bandwidth and bounds the peak of the sensitivity; W_K bounds surface movement; W_T is the
size of what the model lacks. The disturbance keeps K from merely cancelling the modes of the aircraft. Solved by
slycot's sb10ad, which `control.hinfsyn` calls too.

The integrator is split off (its pole, slow by the weight, becomes zero), so that it can be held at the limits; the rest
is reduced by balanced truncation and discretised by Tustin's rule.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import linalg

from controllers.design.models import DT, FloatArray
from icing_env.errors import InputError

if TYPE_CHECKING:
    from control import StateSpace

ORDER = 5  # states of either controller beside its integrator
BACK_OFF = 1.1  # gamma of the controller over the least there is: at the least itself it has a pole near infinity
GYRO_DRIFT = 0.01  # corner of the gyro's slow error over the bandwidth: angles, not rates, are to hold the trim
SLOW = 1e-4  # pole of W_S over its bandwidth; becomes the integrator


def behind_surface(a: FloatArray, b: FloatArray, c: FloatArray, lag: float, delay: float) -> StateSpace:
    """Angle and rate of the aircraft from surface command u and disturbance d at the surface."""
    import control

    body = control.ss(a, b, c, np.zeros((2, 1)), inputs=["moved"], outputs=["angle", "rate"])
    late = control.tf(*control.pade(delay, 1))*control.tf([1.0], [lag, 1.0])
    actuator = control.ss(late, inputs=["u"], outputs=["surface"])
    both = control.summing_junction(["surface", "d"], "moved")
    return control.interconnect([body, actuator, both], inputs=["u", "d"], outputs=["angle", "rate"])


def generalised(process: StateSpace, axis: str, k: dict[str, float]) -> StateSpace:
    """Plant of the synthesis: from (command, disturbance, noise, u) to (W_S e, W_K u, W_T angle, e, rate)."""
    import control

    tf = control.tf
    wb, peak = k[f"{axis}_bandwidth"], k[f"{axis}_peak"]
    slow, fast, corner = (k[f"{axis}_{name}"] for name in ("surface", "surface_fast", "surface_corner"))
    blocks = [
        control.ss(process, inputs=["u", "d"], outputs=["angle", "rate"]),
        control.ss(tf([1.0/peak, wb], [1.0, wb*SLOW]), inputs=["e"], outputs=["z_s"], name="w_s"),
        control.ss(tf([1.0/corner, fast/slow], [fast/corner, fast]), inputs=["u"], outputs=["z_k"], name="w_k"),
        control.ss(tf([1.0, 0.2*k[f"{axis}_uncertain"]], [0.02, k[f"{axis}_uncertain"]]),
                   inputs=["angle"], outputs=["z_t"], name="w_t"),
        control.summing_junction(["r", "-angle"], "e", name="error"),
        control.ss([], [], [], [[k[f"{axis}_disturbance"]]], inputs=["w_d"], outputs=["d"], name="disturbance"),
        control.ss(k["rate_noise"]*tf([1.0, wb], [1.0, GYRO_DRIFT*wb]), inputs=["n"], outputs=["drift"], name="gyro"),
        control.summing_junction(["rate", "drift"], "rate_read", name="read"),
    ]
    return control.interconnect(blocks, inputs=["r", "w_d", "n", "u"], outputs=["z_s", "z_k", "z_t", "e", "rate_read"])


def split(system: StateSpace) -> tuple[FloatArray, StateSpace]:
    """Gain of the integrator (the slowest pole, moved to zero) per reading, and the rest of the controller."""
    import control

    values, vectors = np.linalg.eig(np.asarray(system.A))
    k = int(np.argmin(abs(values)))
    left = np.linalg.inv(vectors)
    gain = ((np.asarray(system.C) @ vectors[:, [k]]) @ (left[[k]] @ np.asarray(system.B))).real[0]
    _t, z, _n = linalg.schur(np.asarray(system.A), sort=lambda re, im: abs(complex(re, im)) < 1.01*abs(values[k]))
    return gain, control.ss(*_without_first(np.asarray(system.A), np.asarray(system.B), np.asarray(system.C), z),
                            np.asarray(system.D))


def _without_first(a: FloatArray, b: FloatArray, c: FloatArray, z: FloatArray) -> tuple[FloatArray, ...]:
    """A, B, C without the mode that comes first in the Schur basis `z`, decoupled from it (Sylvester equation)."""
    t = z.T @ a @ z
    x = linalg.solve_sylvester(t[:1, :1], -t[1:, 1:], -t[:1, 1:])
    return t[1:, 1:], (z.T @ b)[1:], (c @ z)[:, 1:] + (c @ z)[:, :1] @ x


def solve(p: StateSpace) -> tuple[StateSpace, float]:
    """H-infinity controller of two readings and one surface, a little above the least gamma; and its gamma.

    Raises:
        InputError: slycot is not installed.
    """
    import control

    try:
        from slycot import sb10ad
    except ImportError:
        raise InputError("slycot is not installed: pip install 'icing-testbed[design]'") from None
    sizes = (p.nstates, p.ninputs, p.noutputs, 1, 2)
    least = sb10ad(*sizes, 1e3, p.A, p.B, p.C, p.D)[0]
    gamma, a, b, c, d = sb10ad(*sizes, BACK_OFF*least, p.A, p.B, p.C, p.D, job=4)[:5]
    return control.ss(a, b, c, d), float(gamma)


def synthesise(process: StateSpace, axis: str, k: dict[str, float]) -> tuple[FloatArray, FloatArray, float]:
    """One controller.

    Returns:
        gain of its integrator per angle error [1]; matrix that turns (states, error, rate) into (next states, surface)
        [ORDER + 1, ORDER + 2]; gamma.
    """
    import control

    full, gamma = solve(generalised(process, axis, k))
    gain, rest = split(full)
    small = control.balred(rest, ORDER, method="truncate")
    d = control.sample_system(small, DT, method="bilinear")
    matrix = np.block([[np.asarray(d.A), np.asarray(d.B)], [np.asarray(d.C), np.asarray(d.D)]])
    return gain, matrix, gamma
