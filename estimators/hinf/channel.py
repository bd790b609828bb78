"""One channel of the recursive H-infinity identifier: a scalar state, m parameters, an accelerometer if there is one.

    xdot = a(t)' theta + b(t) + d w        y = x + n v        y_a = a_a(t)' theta + n_a v_a

Sources: Didinsky, Pan, Basar, Automatica 31(9), 1995 (noise-perturbed full-state information, NPFSI); Basar and
Bernhard, H-infinity-Optimal Control. The estimator that keeps
int |theta - thetahat|^2_Q <= gamma^2 (int w^2 + v^2 + v_a^2 + |theta(0) - thetahat(0)|^2_Q0) carries, with
Sigma = [[S1, S2], [S2', S3]] > 0 and B = Sigma^-1,

    S1dot = -d^2 S1^2 + 1/n^2             S2dot = -S1 a' - d^2 S1 S2
    S3dot = -a S2 - S2' a' - d^2 S2' S2 + a_a a_a'/n_a^2 - Q/gamma^2
    xhatdot = a' thetahat + b + B1 (y - xhat)/n^2
    thetahatdot = B2' (y - xhat)/n^2 + B3 a_a (y_a - a_a' thetahat)/n_a^2.

S1 starts at rest, 1/(d n), and stays there. Change the variables, without approximation, to
f = -S2'/S1, Pi = S3 - S2' S2/S1 = B3^-1 and zeta = xhat - f' thetahat; then Sigma is block-diagonalised:

    fdot    = a - (d/n) f                        the regressors behind the observer's own filter
    zetadot = b + (d/n) (y - zeta)               and everything else behind the same filter
    Pidot   = (1 - gamma^-2) Q,                  Q = f f'/n^2 + a_a a_a'/n_a^2 (so that gamma* = 1)
    thetahatdot = Pi^-1 [f (y - zeta - f' thetahat)/n^2 + a_a (y_a - a_a' thetahat)/n_a^2].

The accelerometer's row is put behind the same filter, both sides of it, before it is learned from: with a_a = F a,
    y_a = F a' theta + n_a v   ->   F (d/n) f' theta = F (d/n) phi,   phidot = y_a/F - (d/n) phi,
which keeps its information where the aircraft moves and leaves the vanes' noise out of the regressors (unfiltered,
0.1 deg of noise in alpha lowers CL_alpha by 4 %). So one f serves both rows of a channel.

The filters advance by RK4 with inputs interpolated to the half step (estimators.observer.filters). The equations of
Pi and
thetahat are stiff (rates of 1e5/s in a rudder doublet, where RK4 needs less than 2.8/h), but with f held over the
sample they have a solution in closed form, which `learn` applies: positive definite for every step size exactly
when gamma >= 1, with a finite escape when gamma < 1 that is caught as such. Each row of data enters by itself,
in turn, the accelerometer's as the state's.

Wandering parameters (the time-varying form): B3dot = K0 - (1 - gamma^-2) B3 Q B3, capped at B3(0) (`forget`).
The state is taken to move with the parameter through the filter's memory n/d, so that f is left as it is.
"""

from __future__ import annotations

import math
from typing import Any

from icing_env.jit import block, kernel


@kernel
def shrink(strength: float, kappa: float) -> float:
    """(1 + kappa s)^(-1/kappa): what a sample of information s leaves of a residual, s = dt f'B f/n^2.

    kappa = 1 - gamma^-2. It is 1/(1 + s) for the Kalman filter (gamma infinite) and exp(-s) at gamma = 1.
    The caller has checked that 1 + kappa s > 0.
    """
    if abs(kappa) < 1e-9:
        return math.exp(-strength)
    if kappa == 1.0:
        return 1.0 / (1.0 + strength)
    return math.exp(-math.log1p(kappa * strength) / kappa)


@block
def learn(
    theta: Any,
    b3: Any,
    gain: Any,
    first: int,
    packed: int,
    m: int,
    row: Any,
    factor: float,
    target: float,
    information: float,
    kappa: float,
) -> bool:
    """Advance thetahat and B3 over one sample of one row of data, r = factor row[first:first + m], in place.

    With r held and `information` = dt/n^2, the equations Bdot = -kappa B r r'B/n^2 and
    thetahatdot = B r (target - r'thetahat)/n^2 keep the direction g = B r and give, with s = information r'g,
        B <- B - kappa information/(1 + kappa s) g g',    thetahat <- thetahat + g e/(r'g) (1 - shrink(s)).
    theta, row: (26,); b3: (78,) lower triangles; gain: (6,) scratch. Returns False at a finite escape
    (1 + kappa s <= 0, only for gamma < 1) or when B3 is no longer positive, leaving theta and B3 as they were.
    """
    along, residual = 0.0, target
    for i in range(m):
        total = 0.0
        for j in range(m):
            k = packed + (i * (i + 1) // 2 + j if j <= i else j * (j + 1) // 2 + i)
            total += b3[k] * row[first + j]
        gain[i] = factor * total
        along += factor * row[first + i] * gain[i]
        residual -= factor * row[first + i] * theta[first + i]
    strength = information * along
    if not (strength >= 0.0 and 1.0 + kappa * strength > 0.0):
        return False
    if strength == 0.0:
        return True
    step = residual * (1.0 - shrink(strength, kappa)) / along
    down = kappa * information / (1.0 + kappa * strength)
    for i in range(m):
        theta[first + i] += gain[i] * step
        for j in range(i + 1):
            b3[packed + i * (i + 1) // 2 + j] -= down * gain[i] * gain[j]
    return True


@kernel
def forget(b3: Any, scale: Any, first: int, packed: int, m: int, wander: float, q0: float) -> None:
    """Add K0 dt to the diagonal of B3, never beyond its starting value scale^2/q0 (no wind-up in calm air).

    wander: K0 dt per scale^2.
    """
    for i in range(m):
        k = packed + i * (i + 1) // 2 + i
        unit = scale[first + i] * scale[first + i]
        b3[k] += max(0.0, min(wander * unit, unit / q0 - b3[k]))
