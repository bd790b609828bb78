"""One source, many ways to run it: compiled or plain, alone or in a batch, on threads, as a device function."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from plant import level, rates
from scipy.spatial.transform import Rotation

from icing_env.aircraft import changed, load
from icing_env.simulate import Fleet
from icing_env.types import COMMAND, CONTINUOUS, STATE, SURFACES

ROOT = Path(__file__).resolve().parents[1]
ROWS = 64
SURFACE_COMMANDS = ("elevator", "aileron", "rudder")


def world(rows: NDArray | list[int], weather: bool = True) -> tuple[NDArray, NDArray, NDArray]:
    """Parameters, states and commands of the flights numbered `rows`: each has its own, whatever else flies."""
    index = np.asarray(rows)
    names = ["stratiform", "cumuliform", "large_drops"] if weather else ["clear"]
    p = np.concatenate([load(weather=names[i % len(names)]) for i in index])
    if weather:
        p["turbulence_sigma_w"], p["turbulence_tail_delay"], p["turbulence_rotation"] = 1.5, index % 2, index % 3 < 2
        p["cloud_gap_mean"], p["shed_rate"] = 200.0, 5.0
        p["temperature_offset"] = -8.0
    p["mass"] += 3.0 * index
    s = level(len(index), 60.0 + 0.3 * index, 0.04, altitude=1500.0 + 20.0 * index)
    s["seed"], s["q"], s["power_left"], s["power_right"] = index + 2**33, 0.001 * index, 2e5, 2.1e5
    for surface in SURFACES:
        s[f"eta_{surface}"] = 0.002 * index
    u = np.zeros(len(index), COMMAND)
    u["throttle_left"], u["throttle_right"], u["elevator"] = 0.6, 0.65, -0.02
    u["aileron"], u["boots_wing"], u["prop_heat"] = 0.001 * (index % 7), index % 2, 1.0
    return p, s, u


def flown(rows: NDArray | list[int], seconds: float = 4.0, weather: bool = True, **options) -> Fleet:
    """The flights `rows` as one fleet."""
    p, s, u = world(rows, weather)
    fleet = Fleet(p, len(rows), **options)
    fleet.state[:], fleet.command[:] = s, u
    if not weather:
        fleet.command["boots_wing"] = fleet.command["prop_heat"] = 0.0  # ice is shed step by step
    fleet.start()
    for _ in range(round(seconds / fleet.dt)):
        fleet.step()
    return fleet


def rows_of(fleet: Fleet) -> list[bytes]:
    """Everything a flight left behind, one string of bytes per row."""
    arrays = (fleet.state, fleet.measurement, fleet.current, fleet.outcome)
    return [b"".join(a[i : i + 1].tobytes() for a in arrays) for i in range(fleet.n)]


@pytest.fixture(scope="module")
def together() -> list[bytes]:
    return rows_of(flown(range(ROWS)))


# ---- alone, in company, on threads


def test_something_happens_in_these_flights() -> None:
    fleet = flown(range(8))
    assert (fleet.state["lwc"] > 0.0).any() and (np.abs(fleet.state["gust_w"]) > 0.01).all()
    assert (fleet.state["eta_left_wing"][1:] != 0.002 * np.arange(1, 8)).any()


@pytest.mark.parametrize("row", [0, 1, 30, 63])
def test_one_aircraft_flies_bit_for_bit_as_in_a_batch(row: int, together: list[bytes]) -> None:
    assert rows_of(flown([row])) == [together[row]]


@pytest.mark.parametrize(("rows", "threads"), [
    ([5, 9, 2], 1), ([63, 0, 17, 3, 44, 8, 21], 1), ([63, 0, 17, 3, 44, 8, 21], 2), (list(range(ROWS))[::-1], 1),
    (list(range(ROWS)), 2), (list(range(ROWS)), 5),
])  # fmt: skip
def test_size_order_and_threads_change_no_bit(rows: list[int], threads: int, together: list[bytes]) -> None:
    assert rows_of(flown(rows, threads=threads)) == [together[row] for row in rows]


def test_one_row_of_parameters_for_all_is_the_same_as_one_each() -> None:
    p, s, u = world([4])
    results = []
    for parameters in (p, np.repeat(p, 6)):
        fleet = Fleet(parameters, 6)
        fleet.state[:], fleet.command[:] = s[0], u[0]
        fleet.start()
        for _ in range(100):
            fleet.step()
        results.append(rows_of(fleet))
    assert results[0] == results[1]
    assert len(set(results[0])) == 1


def test_starting_some_rows_anew_leaves_the_others_alone() -> None:
    fleet, twin = flown(range(6), 1.0), flown(range(6), 1.0)
    rows = np.array([1, 4])
    fleet.state[rows] = world([1, 4])[1]
    fleet.start(rows)
    for _ in range(100):
        fleet.step()
        twin.step()
    new, old = rows_of(fleet), rows_of(twin)
    assert [i for i in range(6) if new[i] != old[i]] == [1, 4]
    assert new[1] == rows_of(flown([1], 2.0))[0]


def test_turbulence_moves_no_draw_of_ice_or_instruments() -> None:
    """Same seed, gusts on and off: cloud, shedding and sensor noise draw the same numbers."""
    p, s, u = world([3])
    p["mass"], p["inertia_xx"], p["inertia_yy"], p["inertia_zz"] = 1e9, 1e12, 1e12, 1e12  # gusts cannot bend its flight
    found = []
    for sigma in (0.0, 2.0):
        fleet = Fleet(changed(p, turbulence_sigma_w=sigma, temperature_offset=-8.0))
        fleet.state[:], fleet.command[:] = s, u
        fleet.start()
        clouds = []
        for _ in range(500):
            fleet.step()
            clouds.append([float(fleet.state[k][0]) for k in ("cloud_lwc_mean", "cloud_lwc_noise", "mvd")])
        found.append((np.array(clouds), fleet.measurement["phi"] - _bank(fleet.state)))
    assert found[0][0].any()
    np.testing.assert_array_equal(found[0][0][:, [0, 2]], found[1][0][:, [0, 2]])
    np.testing.assert_allclose(found[0][0], found[1][0], rtol=0, atol=5e-3)  # along a path that gusts stretch
    np.testing.assert_allclose(found[0][1], found[1][1], rtol=0, atol=1e-9)  # the noise of the attitude gyro


def _bank(s: NDArray) -> NDArray:
    return Rotation.from_quat(np.stack([s["e1"], s["e2"], s["e3"], s["e0"]], axis=1)).as_euler("ZYX")[:, 2]


# ---- clocks


@pytest.mark.parametrize(("dt", "substeps", "tolerance"), [(0.02, 1, 1e-5), (0.01, 1, 1e-8), (0.04, 4, 1e-8)])
def test_step_and_substeps_are_free(dt: float, substeps: int, tolerance: float) -> None:
    """In calm air the flight is the same but for the error of the integration."""
    reference = flown([0, 6], 4.0, weather=False, dt=0.02, substeps=8)
    other = flown([0, 6], 4.0, weather=False, dt=dt, substeps=substeps)
    assert other.measurement["time"][0] == pytest.approx(4.0)
    for name in ("altitude", "u", "w", "q", "p", "e0"):
        np.testing.assert_allclose(other.state[name], reference.state[name], tolerance, tolerance, err_msg=name)


# ---- plain Python and device code


def subprocess_output(code: str, **environment: str) -> str:
    run = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code], cwd=ROOT, capture_output=True, text=True, check=False,
        env=os.environ | {"PYTHONPATH": f"{ROOT}{os.pathsep}{ROOT / 'tests'}"} | environment)  # fmt: skip
    assert run.returncode == 0, run.stderr[-2000:]
    return run.stdout


def as_records(fleet: Fleet) -> None:
    """Let plain Python write x.u: numba knows fields as attributes, NumPy only in record arrays."""
    for name in ("state", "measurement", "current", "command", "outcome", "parameters"):
        setattr(fleet, name, getattr(fleet, name).view(np.recarray))


def numbers(rows: int, seconds: float) -> NDArray:
    """State, measurement and coefficients after a short flight, as plain numbers."""
    p, s, u = world(range(rows))
    fleet = Fleet(p, rows)
    fleet.state[:], fleet.command[:] = s, u
    as_records(fleet)
    fleet.start()
    for _ in range(round(seconds / fleet.dt)):
        fleet.step()
    arrays = (fleet.state, fleet.measurement, fleet.current)
    return np.concatenate([np.array(a[name], float) for a in arrays for name in a.dtype.names if name != "seed"])


@pytest.mark.parametrize(("rows", "seconds"), [(2, 1.0), (9, 0.1)], ids=["one after another", "side by side"])
def test_plain_python_flies_the_same(rows: int, seconds: float) -> None:
    """Not to the bit: plain Python does not fuse a product and a sum where the processor can."""
    code = f"from test_equivalence import numbers; print(numbers({rows}, {seconds}).tobytes().hex())"
    plain = np.frombuffer(bytes.fromhex(subprocess_output(code, NUMBA_DISABLE_JIT="1")), float)
    compiled = numbers(rows, seconds)
    assert plain.shape == compiled.shape and np.isfinite(plain).all()
    np.testing.assert_allclose(plain, compiled, rtol=1e-12, atol=1e-12)


DEVICE = """
import numpy as np
from numba import cuda
from icing_env.dynamics import derivative, present_aircraft
from test_equivalence import device_inputs

@cuda.jit
def kernel(x, dx, s, c, p, u):
    i = cuda.grid(1)
    if i < x.shape[0]:
        present_aircraft(s[i], p[0], c[i])
        derivative(x[i], dx[i], s[i], c[i], p[0], u[i])

x, dx, s, c, p, u = device_inputs()
kernel[3, 8](x, dx, s, c, p, u)
print(np.array([dx[name] for name in dx.dtype.names]).tobytes().hex())
"""


def device_inputs(n: int = 20) -> tuple[NDArray, ...]:
    """Rows for the derivative on a device: state, room for the rates, held state, coefficients, parameters, command."""
    from plant import continuous

    from icing_env.types import CURRENT

    p, s, u = world(range(n))
    s["gust_w"], s["gust_p"], s["flap"] = 1.0, 0.05, 0.02 * np.arange(n)
    s["w"] += 2.0 * np.arange(n) - 15.0
    x = continuous(s)
    rows = (x, np.zeros(n, CONTINUOUS), s, np.zeros(n, CURRENT), p[:1].copy(), u)
    return tuple(r.view(np.recarray) for r in rows)


def test_the_same_kernels_run_as_device_code() -> None:
    """numba.cuda under its simulator: the rates of the whole state, from the same scalar functions."""
    output = subprocess_output(DEVICE, NUMBA_ENABLE_CUDASIM="1", NUMBA_DISABLE_JIT="1")
    device = np.frombuffer(bytes.fromhex(output), float).reshape(len(CONTINUOUS.names), -1)
    _, _, s, _, p, u = device_inputs()
    expected = rates(np.asarray(s), np.asarray(p), np.asarray(u))
    for row, name in zip(device, CONTINUOUS.names, strict=True):
        np.testing.assert_allclose(row, expected[name], rtol=1e-12, atol=1e-12, err_msg=name)
    assert np.ptp(device[CONTINUOUS.names.index("q")]) > 0.01


# ---- no stale machine code


def test_a_changed_source_file_moves_the_cache(tmp_path: Path) -> None:
    """A copy of the package flies, is changed in a kernel far from the entry, and flies by the new equations."""
    for package in ("icing_env", "estimators", "controllers", "sim2real", "configs"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    code = (
        "import icing_env; from icing_env import jit; from icing_env.linearise import flow;"
        "import numpy as np; from icing_env.types import CONTINUOUS, STATE; from icing_env.aircraft import load;"
        "s, x = np.zeros(1, STATE), np.zeros(1, CONTINUOUS); x['u'], x['e0'] = 50.0, 1.0;"
        "print(icing_env.__file__, jit.source_hash('icing_env'), flow(x, s, load())[0])"
    )

    def fly() -> tuple[str, str, float]:
        run = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True,
            env=os.environ | {"PYTHONPATH": str(tmp_path), "ICING_CACHE": str(tmp_path / "cache")})  # fmt: skip
        where, digest, airspeed = run.stdout.split()
        return where, digest, float(airspeed)

    first, again = fly(), fly()
    assert first[0].startswith(str(tmp_path)) and first == again
    assert first[2] == 50.0
    wind = tmp_path / "icing_env" / "wind.py"
    text = wind.read_text(encoding="utf-8")
    assert "return p.wind_north + " in text
    wind.write_text(text.replace("return p.wind_north + ", "return 3.0 + p.wind_north + "), encoding="utf-8")
    changed_source = fly()
    assert changed_source[1] != first[1]
    assert changed_source[2] == 47.0


def test_a_fleet_takes_numbers_only() -> None:
    """Effects act on PARAMETERS before the flight: sixty of them change nothing of what a step executes."""
    with pytest.raises(ValueError, match="PARAMETERS"):
        Fleet(np.zeros(1, STATE))
    with pytest.raises(ValueError, match="1 or 3 rows"):
        Fleet(np.repeat(load(), 2), 3)
