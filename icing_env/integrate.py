"""One classical fourth-order Runge-Kutta step of the continuous state (Press et al., Numerical Recipes, section 17.1).

The stages are records of named fields for the equations and rows of an array for the sums: two views of one memory.
"""

from __future__ import annotations

from icing_env.dynamics import derivative
from icing_env.jit import kernel
from icing_env.types import N_CONTINUOUS

STAGES = 3  # start, trial point, slope


@kernel
def rk4(stage, rows, total, s, c, p, u, dt: float) -> None:
    """Advance stage 0 by `dt`; stages 1 and 2 and `total` are scratch. Gusts, ice and commands are held."""
    derivative(stage[0], stage[2], s, c, p, u)
    for i in range(N_CONTINUOUS):
        total[i] = rows[2, i]
        rows[1, i] = rows[0, i] + 0.5*dt*rows[2, i]
    derivative(stage[1], stage[2], s, c, p, u)
    for i in range(N_CONTINUOUS):
        total[i] += 2.0*rows[2, i]
        rows[1, i] = rows[0, i] + 0.5*dt*rows[2, i]
    derivative(stage[1], stage[2], s, c, p, u)
    for i in range(N_CONTINUOUS):
        total[i] += 2.0*rows[2, i]
        rows[1, i] = rows[0, i] + dt*rows[2, i]
    derivative(stage[1], stage[2], s, c, p, u)
    for i in range(N_CONTINUOUS):
        rows[0, i] += dt/6.0*(total[i] + rows[2, i])


@kernel
def normalise(x) -> None:
    """Bring the quaternion back to unit length."""
    scale = 1.0/(x.e0*x.e0 + x.e1*x.e1 + x.e2*x.e2 + x.e3*x.e3)**0.5
    x.e0 *= scale
    x.e1 *= scale
    x.e2 *= scale
    x.e3 *= scale
