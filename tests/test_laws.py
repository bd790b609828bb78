"""What every control law must do: engage without a jump, stay finite and within travel, treat rows alone, mirror."""

from __future__ import annotations

import numpy as np
import pytest
from controlled import believed, cruise, free, requested, scattered, steer, targets
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.choice import LAWS, law
from icing_env.errors import InputError
from icing_env.types import COMMAND, TARGET

DT = 0.02
EVERY = pytest.mark.parametrize("name", list(LAWS))


def level(n: int = 1):
    """Targets of the cruise that `cruise` flies."""
    t = np.zeros(n, TARGET)
    t["pitch_mode"] = t["speed_mode"] = t["roll_mode"] = 1
    t["altitude"], t["airspeed"] = 2200.0, 72.0
    return t


@EVERY
def test_engages_without_a_jump(name):
    module = law(name)
    m, c = cruise(), np.zeros(1, COMMAND)
    for surface in ("elevator", "aileron", "rudder", "throttle_left", "throttle_right"):
        c[surface] = m[surface]
    before = c.copy()
    steer(module, module.init(1), c, m, level(), free(), module.default_gains(), DT)
    for surface in ("elevator", "aileron", "rudder"):
        assert abs(float(c[surface][0] - before[surface][0])) < 0.01, surface
    assert abs(float(c["throttle_left"][0] - before["throttle_left"][0])) < 0.05


@EVERY
@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1))
def test_finite_in_finite_and_within_travel_out(name, seed):
    module, n = law(name), 8
    a, c, gains = module.init(n), requested(n, seed), module.default_gains()
    for k in range(4):
        steer(module, a, c, scattered(n, seed + k), targets(n, seed), free(n), gains, DT, believed(n))
    for row in (a, c):
        assert all(np.isfinite(row[field]).all() for field in row.dtype.names)
    assert (c["elevator"] >= -0.454 - 1e-12).all() and (c["elevator"] <= 0.244 + 1e-12).all()
    for surface in ("aileron", "rudder"):
        assert (np.abs(c[surface]) <= 0.28 + 1e-12).all()
    assert (c["throttle_left"] >= 0).all() and (c["throttle_left"] <= 1).all()


@EVERY
def test_single_equals_batch_bit_for_bit(name):
    module, n = law(name), 5
    gains, t = module.default_gains(), targets(n, 1)
    batch, c, alone, single = module.init(n), requested(n, 1), module.init(n), requested(n, 1)
    for k in range(20):
        m = scattered(n, k)
        steer(module, batch, c, m, t, free(n), gains, DT)
        for i in range(n):
            j = slice(i, i + 1)
            steer(module, alone[j], single[j], m[j], t[j], free(1), gains, DT)
    assert batch.tobytes() == alone.tobytes() and c.tobytes() == single.tobytes()


@EVERY
def test_mirrored_flight_is_flown_mirrored(name):
    module = law(name)
    m, t, gains = cruise(), level(), module.default_gains()
    for field, value in {"phi": 0.1, "p": 0.02, "r": -0.01, "beta": 0.02, "ay": 0.3, "aileron": 0.01}.items():
        m[field] = value
    t["heading"] = 0.2
    mirrored, mt = m.copy(), t.copy()
    for field in ("phi", "p", "r", "beta", "ay", "aileron", "rudder", "psi"):
        mirrored[field] *= -1.0
    mt["heading"] *= -1.0
    out = []
    for seen, asked in ((m, t), (mirrored, mt)):
        a, c = module.init(1), requested(1, 3)
        c["aileron"] = seen["aileron"]
        c["rudder"] = seen["rudder"]
        for _ in range(10):
            steer(module, a, c, seen, asked, free(), gains, DT)
        out.append(c)
    assert out[0]["elevator"][0] == pytest.approx(out[1]["elevator"][0], abs=1e-12)
    for surface in ("aileron", "rudder"):
        assert out[0][surface][0] == pytest.approx(-out[1][surface][0], abs=1e-12)


def test_unknown_law_names_the_nearest():
    with pytest.raises(InputError, match="autopilot"):
        law("autopliot")
