"""Protection by prediction and by barriers: the mathematics against libraries, and what happens when it fails."""

from __future__ import annotations

import numpy as np
import pytest
from controlled import airframe, believed, cruise, requested
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import minimize
from test_envelope_protection import advised, protected

from controllers.protection import barrier, predictive, surfaces

DT = 0.02
SHORT_PERIOD = np.array([[-1.4, 0.97], [-8.0, -3.2]])  # of the size of the Twin Otter's at 70 m/s


@pytest.mark.parametrize("matrix", [SHORT_PERIOD, [[-1.0, 1.0], [2.0, -1.0]], [[0.0, 1.0], [0.0, -4.0]],
                                    [[-1.0, 0.0], [0.0, -1.0]]])
def test_transition_is_the_matrix_exponential(matrix):
    (a, b), (c, d) = matrix
    found = np.reshape(predictive.transition(a, b, c, d, 0.1), (2, 2))
    assert found == pytest.approx(expm(np.array(matrix)*0.1), abs=1e-12)


def test_the_permitted_control_brings_the_peak_to_the_limit():
    g = predictive.load_tuning()[0]
    gain, start, limit, horizon = np.array([-0.1, -10.0]), np.array([0.05, 0.04]), 0.15, 2.0
    (a, b), (c, d) = SHORT_PERIOD
    least, _most = predictive.bounds(*start, a, b, c, d, 0.06, 0.002, -0.1, *gain, -np.inf, limit, horizon, g)
    flown = solve_ivp(lambda t, x: SHORT_PERIOD @ x + [0.06 + 0.002*t, -0.1] + gain*least, (0.0, horizon), start,
                      rtol=1e-9, max_step=0.02)
    assert flown.y[0].max() == pytest.approx(limit, abs=0.002)
    assert -0.3 < least < 0.0


def test_prediction_lets_less_elevator_up_when_pitching_up_slowing_or_destabilised():
    m, c, e = cruise(), requested(1, 0), believed()
    c["elevator"] = -0.4
    a = advised(m=m)
    calm = protected(c, a, m, e, predictive)[0]["elevator"]
    assert -0.4 < calm < 0.0
    m["q"] = 0.2
    assert protected(c, a, m, e, predictive)[0]["elevator"] > calm + 0.01
    m["q"], m["ax"] = 0.0, -3.0
    assert protected(c, a, m, e, predictive)[0]["elevator"] > calm + 0.001
    m["ax"] = cruise()["ax"]
    e["Cm_alpha"] = 0.5*e["Cm_alpha"]
    assert protected(c, a, m, e, predictive)[0]["elevator"] > calm + 0.01


def test_derivatives_that_no_ice_can_make_are_not_believed():
    m, c, e = cruise(), requested(1, 0), believed()
    c["elevator"] = -0.4
    a = advised(m=m)
    clean = protected(c, a, m, e, predictive)[0]["elevator"]
    e["Cm_alpha"], e["Cm_elevator"] = 2.0, -5.0
    assert protected(c, a, m, e, predictive)[0]["elevator"] == pytest.approx(clean, abs=0.02)


def test_the_programme_is_solved_as_a_general_optimiser_solves_it():
    rng = np.random.default_rng(4)
    for _ in range(20):
        lower, upper = np.full(13, -1.0), np.full(13, barrier.ENDLESS)
        upper[:3], lower[2:7], lower[7:] = 1.0, 0.0, rng.uniform(-0.5, 0.7, 6)
        lower[11:] = -np.abs(lower[11:])
        cost = np.diag([1.0]*3 + [100.0]*4)
        x = barrier.solve(cost, lower, upper)
        assert x is not None
        best = minimize(lambda x, cost=cost: 0.5*x @ cost @ x, np.zeros(7), jac=lambda x, cost=cost: cost @ x,
                        bounds=list(zip(lower[:7], np.minimum(upper[:7], 1e3), strict=True)), method="SLSQP",
                        constraints={"type": "ineq", "fun": lambda x, lower=lower: barrier.BARRIERS @ x - lower[7:]})
        assert x == pytest.approx(best.x, abs=1e-4)


def test_a_programme_without_solution_or_with_nan_has_none():
    lower, upper = np.full(13, -1.0), np.full(13, barrier.ENDLESS)
    upper[:3], lower[3:7] = 1.0, 0.0
    lower[11] = 3.0  # more aileron than there is
    assert barrier.solve(np.eye(7), lower, upper) is None
    lower[11] = np.nan
    assert barrier.solve(np.eye(7), lower, upper) is None


@pytest.mark.parametrize(("channel", "value"), [("alpha", np.nan), ("p", np.nan), ("airspeed", np.inf)])
def test_a_broken_measurement_falls_back_on_the_law_of_the_surfaces(channel, value):
    m, a = cruise(), advised(severity=0.5)
    m["phi"] = 0.9
    m[channel] = value
    c, e, tuning, memory = requested(1, 2), believed(), barrier.load_tuning(), barrier.init(1)
    out, other = c.copy(), c.copy()
    barrier.protect(memory, out, a, m, e, airframe(), tuning, DT)
    surfaces.protect(surfaces.init(1), other, advised(severity=0.5), m, e, airframe(), surfaces.load_tuning(), DT)
    assert memory["fallbacks"] == 1 and memory["solved"] == 0
    assert out.tobytes() == other.tobytes() and np.isfinite(out["elevator"]).all()


def test_barriers_that_cross_fall_back_too():
    m, a = cruise(), advised()
    a["bank_limit"] = -5.0  # no bank satisfies this
    c, memory = requested(1, 2), barrier.init(1)
    barrier.protect(memory, c, a, m, believed(), airframe(), barrier.load_tuning(), DT)
    assert memory["fallbacks"] == 1 and np.isfinite(c["aileron"]).all()


def test_the_solution_keeps_the_alpha_barrier_where_the_elevator_can():
    n = 40
    m = cruise(n)
    m["alpha"], m["q"], m["airspeed"] = 0.1, 0.05, 65.0
    c = requested(n, 1)
    c["elevator"] = np.linspace(-0.4, 0.2, n)
    a, memory, g = advised(n, m=m), barrier.init(n), barrier.load_tuning()
    out = c.copy()
    barrier.protect(memory, out, a, m, believed(n), airframe(), g, DT)
    assert memory["fallbacks"].sum() == 0 and memory["solved"].sum() > 5
    held = out["elevator"][memory["solved"] > 0]
    assert np.ptp(held[c["elevator"][memory["solved"] > 0] < -0.2]) < 0.02  # the same bound, whatever was asked for
