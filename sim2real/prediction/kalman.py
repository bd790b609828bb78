"""The gain that corrects the predictor: Kalman's, for the plant linearised about a record and one gust intensity.

The plant is linearised by differences of its own one-step map, gust filters and instruments included. Gusts act within
the step whose end is measured, so that process and measurement noise are correlated (Anderson & Moore, Optimal
Filtering, section 5.4). The first seconds have gains of their own, from the uncertainty of the start.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from icing_env.jit import entry
from icing_env.record import FloatArray
from sim2real.prediction.correction import ROTATION
from sim2real.prediction.gusts import LATER, Gusts, Kind, met
from sim2real.prediction.predictor import TANGENT, Predictor, stretch
from sim2real.prediction.readings import ALTITUDE, apart, read_share, unread
from sim2real.prediction.within_steps import as_met, within_steps
from sim2real.records.channels import FED_BACK, MEASURED, NOISE_FLOOR, SURFACES
from sim2real.records.reconstruct import Reconstruction

# What disturbs the states beside gusts, per square root of second: little, since what is disturbed is forgotten, steady
# moments first; and per m/s of gusts beside `within_steps`. Both are set where innovations of aircraft that the model
# knows are white, means over 100 samples and over whole records included (`tests/test_whiteness.py`).
WALK = {"u": 3e-3, "v": 3e-3, "w": 3e-3, "p": 3e-5, "q": 3e-5, "r": 3e-5, "altitude": 5e-3, "phi": 4e-5, "theta": 4e-5}
WALK_OF_GUST = {"q": 2.5e-4, "phi": 5e-5, "theta": 5e-5}
# The same of air that turns. Gusts carried along at a speed 6 % from the aircraft's leave twice the variance in r
WALK_OF_TURNING = {"r": 1.5e-4}
DRYDEN = [i for i, name in enumerate(TANGENT) if name.startswith("dryden")]
INPUTS = dict.fromkeys(SURFACES, 1e-3) | {"power_left": 1e3, "power_right": 1e3}  # steps for slopes, rad and W
TRANSIENT = 10.0  # s with gains of their own after the start
SPAN = 1.0  # s along a record that are flown as if at one condition
ROUGH = 60  # steps after which a gust no longer shows in third differences
DOUBLINGS = 16  # 65536 steps
SURE = 0.25  # share of a slow channel's variance in third differences that counts as its noise at the least (assumed)
ABSENT = 1e6  # variance of a reading that is not there


@dataclass(frozen=True)
class Gain:
    """Gain and innovation covariance for one gust intensity.

    Attributes:
        gusts: intensity and kind.
        K: of the steps, the last one's for good [steps, states, fed-back channels].
        S: covariance of the steady innovations, or of each step's [steps, ...].
        model: A, C, and the covariances of the states' noise, the readings' noise and between them.
        start: covariance of the states at the start.
        duration: steps of the start that have gains of their own.
    """

    gusts: Gusts
    K: FloatArray
    S: FloatArray
    model: tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]
    start: FloatArray
    duration: int

    @property
    def sigma(self) -> float:
        """Gust intensity, m/s."""
        return self.gusts.sigma

    @property
    def along(self) -> bool:
        """Whether it is that of every step of a record (`follow`)."""
        return self.S.ndim == 3

    def with_start(self) -> Gain:
        """The same with gains of their own for the first steps, from the uncertainty of the start."""
        always = np.zeros((self.duration, len(self.model[1])))
        first, _, _ = _recursion(*self.model, self.start, always)
        return replace(self, K=np.concatenate([first, self.K[-1:]]))


def linearise(flight: Reconstruction, spans: Sequence[slice] = (slice(None),), kind: Kind = LATER
              ) -> tuple[FloatArray, FloatArray, FloatArray]:  # fmt: skip
    """A, C of the one-step map about the record's typical state in each span, and B for a step of each of INPUTS.

    z' = A z, y' = C z with y' all readings at the end of the step; the first axis goes over the spans.
    """
    size = np.full(len(TANGENT), 1e-4)
    size[[TANGENT.index(n) for n in ("u", "v", "w", "altitude", "pitot")]] = 1e-2
    size[[i for i, n in enumerate(TANGENT) if n.startswith(("dryden", "gust"))]] = 1e-2
    n, m = len(TANGENT), len(spans)
    each = 2 * n + 2 * len(INPUTS) + 1
    flown = Predictor(flight, flight.parameters, m * each, kind)
    flown.place_in(spans, each)
    change = np.zeros((each, n))
    change[:n], change[n : 2 * n] = np.diag(size), -np.diag(size)
    flown.correct(np.tile(change, (m, 1)))
    for j, (name, step) in enumerate(INPUTS.items()):
        flown.fleet.state[name][2 * n + 2 * j :: each] += step
        flown.fleet.state[name][2 * n + 2 * j + 1 :: each] -= step
    for surface in SURFACES:
        flown.fleet.command[surface] = flown.fleet.state[surface]
    if kind.rotation:
        flown.fleet.outcome["airspeed"] = met(flight)
    flown.fleet.step()
    y, z = flown.read().reshape(m, each, -1), flown.tangent().reshape(m, each, -1)
    A = np.swapaxes((z[:, :n] - z[:, n : 2 * n]) / (2.0 * size[:, None]), 1, 2)
    C = np.swapaxes((y[:, :n] - y[:, n : 2 * n]) / (2.0 * size[:, None]), 1, 2)
    B = np.stack([(z[:, 2 * n + 2 * j] - z[:, 2 * n + 2 * j + 1]) / (2.0 * step)
                  for j, step in enumerate(INPUTS.values())], axis=2)  # fmt: skip
    return as_met(A, A, kind), as_met(C, A, kind), B


def gains(flight: Reconstruction, sigmas: Sequence[float], kind: Kind = LATER) -> list[Gain]:
    """Steady gain and innovation covariance for each gust intensity."""
    A, C, B = (matrix[0] for matrix in linearise(flight, kind=kind))
    C, out, every = C[:FED_BACK], list[Gain](), apart(flight)
    seen = flight.noise[:FED_BACK] ** 2
    # far apart, samples differ by gusts most of all: what is left of that says little, and too much harms less
    least = np.where(np.array(every) > 1, SURE * seen, 0.0)
    for sigma in sigmas:
        gusts = Gusts(sigma, kind)
        Qw = gusts.noise(flight)
        noise = np.maximum(seen - roughness(A, C, A[:, DRYDEN], C[:, DRYDEN], Qw, every), least)
        model = _noisy(flight, A, C, B, gusts, Qw, noise, read_share(flight))
        steady, S = _steady(*model)
        out.append(Gain(gusts, steady[None], S, model, _start_covariance(flight, gusts), round(TRANSIENT / flight.dt)))
    return out


def follow(flight: Reconstruction, gain: Gain) -> Gain:
    """The same gust intensity with gains along the record, linearised anew every second.

    In a bank a gust moves other channels than in level flight; a gain that does not know it leaves innovations
    coloured just where manoeuvres are, and constant errors of attitude and rates seem to be found there. Where a
    channel is absent for a while, the others tell what it would: without beta, ay tells the gusts from the side.
    """
    steps, each = len(flight.time) - 1, max(round(SPAN / flight.dt), 1)
    spans = [slice(k, min(k + each, steps + 1)) for k in range(0, steps, each)]
    P, Qw = gain.start, gain.gusts.noise(flight)
    lost = unread(flight)[1:].astype(float)
    D = gain.model[1][:, DRYDEN]
    share, steadily = read_share(flight), np.arange(FED_BACK) == ALTITUDE
    noise = np.diag(gain.model[3] - D @ Qw @ D.T) * np.maximum(share, 1e-3)
    share = np.where(steadily, share, share > 0.0)
    K, S = [], []
    linear = flight.once(f"linear along {gain.gusts.kind}", lambda: linearise(flight, spans, gain.gusts.kind))
    for span, A, C, B in zip(spans, *linear, strict=True):
        model = _noisy(flight, A, C[:FED_BACK], B, gain.gusts, Qw, noise, share)
        here, covariance, P = _recursion(*model, P, lost[span.start : span.start + each])
        K.append(np.swapaxes(here, 1, 2))
        S.append(covariance)
    by_channel = np.ascontiguousarray(np.concatenate(K))  # in memory as the loop of the predictor reads them
    by_channel /= np.where(steadily, 1.0, stretch(flight))[:, None]  # their gains are those of readings as it is
    return replace(gain, K=np.swapaxes(by_channel, 1, 2), S=np.concatenate(S))


def _noisy(flight: Reconstruction, A: FloatArray, C: FloatArray, B: FloatArray, gusts: Gusts, Qw: FloatArray,
           noise: FloatArray, read: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """A, C, and the covariances of the states' noise, the readings' noise and between them.

    Args:
        gusts: intensity and kind.
        Qw: covariance of what drives the gusts.
        noise: variance of every fed-back channel's own noise.
        read: share of the steps at which each is read, where every step is to count as so much of a reading.
    """
    worse = flight.inadequacy.walk
    of_gust = WALK_OF_GUST | (WALK_OF_TURNING if gusts.kind.rotation else {})
    walk = np.array([np.hypot(worse * WALK.get(n, 1e-6), of_gust.get(n, 0.0) * gusts.sigma) for n in TANGENT])
    least = np.array([NOISE_FLOOR[name] for name in MEASURED[:FED_BACK]])
    G, D = A[:, DRYDEN], C[:, DRYDEN]
    driven = np.concatenate([flight.surface_noise, flight.power_noise])
    Q = G @ Qw @ G.T + np.diag(walk**2 * flight.dt) + (B * driven**2) @ B.T
    Q = Q + within_steps(A, Qw, gusts.kind, gusts.span(flight))
    R = np.diag(np.where(read == 0.0, ABSENT, np.maximum(noise, least**2) / np.maximum(read, 1e-3)))
    return A, C, Q, D @ Qw @ D.T + R, G @ Qw @ D.T


def roughness(A: FloatArray, C: FloatArray, G: FloatArray, D: FloatArray, Qw: FloatArray,
              every: Sequence[int]) -> FloatArray:  # fmt: skip
    """What gusts add to each channel's noise variance as third differences tell it [channels].

    At sigma_w = 1.5 m/s they double the apparent noise of az; believed, it makes the gain too small, the innovations
    coloured, and the colour looks like a vane's scale and a downwash lag.

    Args:
        every: steps from one reading of each channel to the next.
    """
    response, state = [D], G
    for _ in range(ROUGH):
        response.append(C @ state)
        state = A @ state
    series = np.array(response)  # [steps, channels, draws]
    out = np.empty(len(C))
    for m in sorted(set(every)):
        third = np.concatenate([np.zeros((3 * m, *D.shape)), series])
        for _ in range(3):
            third = third[m:] - third[:-m]
        own = np.array(every) == m
        out[own] = np.einsum("nci,ij,ncj->c", third, Qw, third)[own] / 20.0
    return out


def _steady(
    A: FloatArray, C: FloatArray, Q: FloatArray, R: FloatArray, cross: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Gain and innovation covariance: the Riccati equation by doubling (Chu, Fan, Lin & Wang, IJC 77, 2004)."""
    Rinv = np.linalg.inv(R)
    a, H, G = (A - cross @ Rinv @ C).T, Q - cross @ Rinv @ cross.T, C.T @ Rinv @ C
    for _ in range(DOUBLINGS):
        middle = np.linalg.solve(np.eye(len(A)) + G @ H, np.hstack([a, G]))
        aw, gw = middle[:, : len(A)], middle[:, len(A) :]
        a, G, H = a @ aw, G + a @ gw @ a.T, H + a.T @ H @ aw
        G, H = 0.5 * (G + G.T), 0.5 * (H + H.T)
    S = C @ H @ C.T + R
    return np.asarray(np.linalg.solve(S, (A @ H @ C.T + cross).T).T, np.float64), S


def _recursion(A: FloatArray, C: FloatArray, Q: FloatArray, R: FloatArray, cross: FloatArray, P: FloatArray,
               lost: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Gains [steps, states, channels] and innovation covariances from the states' covariance `P`, and P after them.

    Args:
        lost: one where a channel is absent, else zero [steps, channels].
    """
    steps = len(lost)
    K, covariance = np.empty((steps, len(A), len(C))), np.empty((steps, len(C), len(C)))
    after = P.copy()
    _recurse(np.ascontiguousarray(A), np.ascontiguousarray(C), Q, R, np.ascontiguousarray(cross), lost, after, K,
             covariance)
    return K, covariance, after


@entry
def _recurse(A: Any, C: Any, Q: Any, R: Any, cross: Any, lost: Any, P: Any, K: Any, covariance: Any) -> None:
    """Riccati's recursion, step by step; P is changed in place."""
    At, Ct = np.ascontiguousarray(A.T), np.ascontiguousarray(C.T)
    for k in range(len(K)):
        PC = np.dot(P, Ct)
        covariance[k] = np.dot(C, PC) + R
        for c in range(len(C)):
            covariance[k, c, c] += ABSENT*lost[k, c]
        onto = np.dot(A, PC) + cross
        gain = np.ascontiguousarray(np.linalg.solve(covariance[k], np.ascontiguousarray(onto.T)).T)
        K[k] = gain
        after = np.dot(np.dot(A, P), At) - np.dot(gain, np.ascontiguousarray(onto.T)) + Q
        P[:] = 0.5*(after + after.T)


def _start_covariance(flight: Reconstruction, gusts: Gusts) -> FloatArray:
    """How well a quarter of a second of measurements gives the start: gusts pass for motion through the air."""
    sigma, gust = gusts.sigma, gusts.sigma + 0.3
    size = {"u": gust, "v": gust, "w": gust, "p": 0.02, "q": 0.02, "r": 0.02, "altitude": 1.0, "alpha_downwash": 0.02,
            "pitot": 0.3, "vane_alpha": 0.01, "vane_beta": 0.01, "phi": 0.003, "theta": 0.003}  # fmt: skip
    for name in TANGENT:
        if name.startswith(("dryden", "gust")):
            size[name] = sigma + 1e-3
        elif name.startswith("filtered"):
            size[name] = 1.0 if name[-2:] in ("ax", "ay", "az") else 0.02
    turning = gusts.rolling(flight)
    size |= {n: (sigma if turning else 0.0) if n in ("dryden_q", "dryden_r") else turning for n in ROTATION}
    return np.diag([size[name] ** 2 for name in TANGENT])
