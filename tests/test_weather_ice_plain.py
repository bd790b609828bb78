"""Weather and ice compiled, and the same source as plain Python: the same bits, row by row and alone or in a batch."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from icing_env import accretion, cloud, ice_protection, severity, turbulence
from icing_env.aircraft import load
from icing_env.jit import kernel
from icing_env.types import COMMAND, CURRENT, STATE

ROOT = Path(__file__).parents[1]


@kernel
def fly(states, parameters, commands, current, steps):
    for i in range(states.shape[0]):
        s, p = states[i], parameters[i]
        turbulence.start_turbulence(s, p, 72.0)
        for _ in range(steps):
            if s.step % 5 == 0:
                cloud.advance_cloud(s, p, 72.0, 1.0)
                accretion.advance_accretion(s, p, 72.0, 1.03, 1.0)
            ice_protection.advance_protection(s, p, commands[i], 0.2)
            severity.iced_aircraft(s, p, current[i])
            turbulence.advance_turbulence(s, p, 72.0, 0.2)
            s.step += 1


def flown(rows: list[int], steps: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """States and coefficients of the flights numbered `rows`: each has its own weather, altitude and seed."""
    n = len(rows)
    states, commands, current = (np.zeros(n, kind).view(np.recarray) for kind in (STATE, COMMAND, CURRENT))
    parameters = np.concatenate([load(weather=["stratiform", "cumuliform", "large_drops"][i % 3]) for i in rows])
    parameters = parameters.view(np.recarray)
    index = np.array(rows)
    states["seed"], states["altitude"] = index + 2**40, 1300.0 + 100.0 * index
    parameters["turbulence_sigma_w"], parameters["turbulence_tail_delay"] = 1.5, index % 2
    parameters["turbulence_rotation"] = index % 4 < 3
    parameters["shed_rate"], parameters["gust_amplitude_w"] = 10.0, 3.0
    parameters["cloud_gap_mean"] = 500.0
    commands["boots_wing"], commands["prop_heat"] = index % 2, 1.0
    fly(states, parameters, commands, current, steps)
    return states, current


def fingerprint() -> str:
    states, current = flown([0, 1, 2, 3])
    return states.tobytes().hex() + current.tobytes().hex()


def test_plain_python_gives_the_same_bits() -> None:
    if os.environ.get("NUMBA_DISABLE_JIT", "0") == "1":
        pytest.skip("numba is switched off: there is nothing to compare with")
    code = "from tests.test_weather_ice_plain import fingerprint; print(fingerprint())"
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)}
    plain = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, env=environment, capture_output=True, text=True, check=True
    )
    assert plain.stdout.strip() == fingerprint()


def test_a_row_flies_the_same_alone_and_in_a_batch() -> None:
    states, current = flown([0, 1, 2, 3, 4, 5])
    assert states["eta_left_wing"].any()
    for i in range(6):
        alone, alone_current = flown([i])
        assert alone.tobytes() == states[i : i + 1].tobytes()
        assert alone_current.tobytes() == current[i : i + 1].tobytes()


def test_turbulence_moves_no_draw_of_cloud_or_shedding() -> None:
    with_gusts, _ = flown([0])
    calm = np.zeros(1, STATE).view(np.recarray)
    parameters = load(weather="stratiform").view(np.recarray)
    calm["seed"], calm["altitude"], parameters["shed_rate"], parameters["cloud_gap_mean"] = 2**40, 1300.0, 10.0, 500.0
    commands, current = np.zeros(1, COMMAND).view(np.recarray), np.zeros(1, CURRENT).view(np.recarray)
    commands["prop_heat"] = 1.0
    fly(calm, parameters, commands, current, 60)
    for name in ("lwc", "mvd", "cloud_left", "eta_left_wing", "eta_other", "ice_mass_struts"):
        assert calm[name][0] == with_gusts[name][0], name
