"""Model-predictive control: the programme is solved, limits are kept, and what cannot be solved is not flown."""

from __future__ import annotations

import numpy as np
import pytest
from answers import answer, apart
from controlled import airframe, cruise, free, requested
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.optimize import nnls

from controllers.laws import mpc, prediction
from icing_env.types import ESTIMATE, TARGET

DT = 0.02
CLEAN = airframe()
BANK_MODEL = (-4.8, 0.0, -40.0, 1.0, 0.0, 0.0, 0.0, 0.0, -10.0, 0.0, 0.0, 10.0)
WEIGHTS = (1.0, 0.3, 2.0, 1000.0)
PLAN = prediction.plan(BANK_MODEL, WEIGHTS, (1, 0, 1))


def steer(a, c, m, advisory=None, **target):
    t = np.zeros(1, TARGET)
    for name, value in {"pitch_mode": 1, "altitude": 2200.0, "speed_mode": 1, "airspeed": 72.0, **target}.items():
        t[name] = value
    mpc.step(a, c, m, np.zeros(1, ESTIMATE), t, free() if advisory is None else advisory, CLEAN, mpc.default_gains(),
             DT)


def test_the_prediction_is_the_model_run_forward():
    a, b = np.reshape(BANK_MODEL[:9], (3, 3)), np.array(BANK_MODEL[9:])
    per_rate, per_move = prediction.predicted(a, b)
    rng = np.random.default_rng(0)
    rates, moves = rng.normal(size=3), rng.normal(size=len(prediction.BLOCKS))
    z, step = np.zeros(3), prediction.SAMPLE
    for k, move in enumerate(np.repeat(moves, prediction.BLOCKS)):
        augmented = np.zeros((4, 4))
        augmented[:3, :3], augmented[:3, 3] = a, b*move + rates
        z = (expm(augmented*step) @ np.append(z, 1.0))[:3]
        np.testing.assert_allclose(per_rate[k] @ rates + per_move[k] @ moves, z, atol=1e-10)


def least(h, f, rows, most):
    """The x of least x'hx/2 + f'x with rows x <= most: its dual is non-negative least squares, which ends exactly
    (Lawson & Hanson, Solving Least Squares Problems, ch. 23). None where no x keeps the rows."""
    back = np.linalg.inv(np.linalg.cholesky(h)).T  # x = back (y - back' f), of least |y|
    g, low = -rows @ back, -most - rows @ back @ back.T @ f
    dual, _ = nnls(np.vstack([g.T, low]), np.append(np.zeros(len(f)), 1.0))
    left = np.vstack([g.T, low]) @ dual - np.append(np.zeros(len(f)), 1.0)
    return None if np.linalg.norm(left) < 1e-9 else back @ (-left[:-1]/left[-1] - back.T @ f)


@settings(max_examples=200)
@given(seed=st.integers(0, 2**32 - 1), above=st.floats(-0.05, 0.2))
def test_the_solution_is_that_of_another_minimiser(seed, above):
    q = np.random.default_rng(seed).normal(size=6)*np.array([0.5, 0.1, 0.0, 0.2, 0.1, 0.05])
    low, high, first, later, slack = -0.28, 0.28, 0.02, 0.09, 10.0
    f = PLAN.linear @ q
    f[-1] = slack
    moves, at = len(prediction.BLOCKS), PLAN.carried @ q
    bound = np.append(first, np.full(moves - 1, later))
    limits = slice(moves, moves + len(prediction.LOOKS))
    eye = np.eye(moves + 1)
    rows = np.vstack([PLAN.rows[:moves], -PLAN.rows[:moves], PLAN.rows[limits], eye[:-1], -eye])
    most = np.concatenate([bound - at[:moves], bound + at[:moves], above - at[limits], np.full(moves, high),
                           np.full(moves, -low), [0.0]])
    x = least(PLAN.hessian, f, rows, most)
    if x is None:
        assert abs(q[5]) > high  # no first move is left
        return
    assert (rows @ x - most).max() < 1e-9
    assert prediction.solve(PLAN, q, low, high, first, later, np.inf, above, slack) == pytest.approx(x[0], abs=2e-4)


def test_angle_of_attack_stays_below_the_advised_one():
    limit = 0.08
    asked = {"axis": "pitch", "asked": np.radians(12.0), "seconds": 5.0}
    assert answer("mpc", **asked)["alpha"].max() > limit + 0.02
    assert answer("mpc", **asked, limits={"alpha_limit": limit})["alpha"].max() < limit


def test_bank_stays_below_the_advised_one_and_answers_are_as_quick_without():
    kept = answer("mpc", "bank", limits={"bank_limit": 0.2})["phi"].max()
    assert 0.95*(0.2 - mpc.default_gains()["bank_margin"][0]) < kept < 0.2  # what is asked for keeps a margin


def test_ice_is_made_good_by_what_the_model_lacks():
    iced = {"Cl_aileron": 0.7*float(CLEAN["Cl_aileron"][0])}
    left, without = (apart(answer(name, "bank", iced), answer(name, "bank")) for name in ("mpc", "autopilot"))
    assert left < 0.5*without


@pytest.mark.parametrize("channel", ["q", "phi", "alpha", "pressure", "elevator"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_measurement_that_is_no_number_leaves_the_last_good_command(channel, bad):
    a, c, m = mpc.init(1), requested(1, 0), cruise()
    for _ in range(5):
        steer(a, c, m)
    good, broken = c.copy(), m.copy()
    broken[channel] = bad
    for _ in range(7):
        c["elevator"] = np.nan  # not even what stands in the command is trusted
        steer(a, c, broken)
        assert c.tobytes() == good.tobytes()
    assert a["fallbacks"][0] == 7.0
    steer(a, c, m)
    assert a["fallbacks"][0] == 7.0
    assert all(np.isfinite(a[name]).all() for name in a.dtype.names)
    assert c["elevator"][0] == pytest.approx(good["elevator"][0], abs=0.02)


@pytest.mark.parametrize("verdict", [(np.full(7, np.nan), 0.0, 1, {}), (np.zeros(7), 0.0, -1, {})])
def test_without_a_solution_the_last_good_command_then_the_pid(verdict, monkeypatch):
    a, c, m = mpc.init(1), requested(1, 0), cruise()
    for _ in range(5):
        steer(a, c, m)
    good = float(c["aileron"][0])
    monkeypatch.setattr(prediction.daqp, "solve", lambda *_: verdict)
    m["phi"] = 1.0  # so far from level that the rate limit binds
    seen = []
    for _ in range(20):
        steer(a, c, m)
        seen.append(float(c["aileron"][0]))
    assert all(value == good for value in seen[:10])  # 0.2 s
    assert seen[-1] > good + 0.1  # the PID rolls left
    assert a["fallbacks"][0] == 20.0
    monkeypatch.undo()
    steer(a, c, m)
    assert a["failed_bank"][0] == 0.0 and a["fallbacks"][0] == 20.0


def test_surfaces_keep_their_rates():
    flown = answer("mpc", "bank", asked=0.7, seconds=4.0)
    assert np.abs(np.diff(flown["aileron"])).max() <= 0.9*DT + 1e-9
    assert np.abs(np.diff(flown["elevator"])).max() <= 0.7*DT + 1e-9
