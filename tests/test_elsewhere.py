"""The plant made elsewhere, alone: trim, conservation, symmetry, signs; and what its command and its imports do."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from numpy.typing import NDArray

from testbed.elsewhere.__main__ import main
from testbed.elsewhere.aircraft import GRAVITY, Loading, derivatives
from testbed.elsewhere.draw import KINDS, order
from testbed.elsewhere.flight import DT, initial
from testbed.elsewhere.plant import BASE, Plant
from testbed.elsewhere.rigid_body import euler, quaternion, rotation

ZERO = dict.fromkeys(derivatives(), 0.0)
STILL = (np.zeros((6, 1)), np.zeros((3, 1)))


def make(d: dict[str, float], n: int = 1, **more) -> Plant:
    """A plant of n equal columns without effects."""
    load = Loading.with_fuel(0.7)
    return Plant(d, np.full(n, load.mass), np.tile(load.inertia[:, None], n), np.zeros(n), **more)


def run(plant: Plant, x: NDArray, position: NDArray, throttle: NDArray, seconds: float):
    """The final state, and the flow at the last step, with everything held."""
    flow, held = None, (position, throttle, np.zeros((6, x.shape[1])), np.zeros((3, x.shape[1])))
    for k in range(round(seconds / DT)):
        x, flow = plant.step(k * DT, x, DT, held, held)
    return x, flow


def trimmed(speed: float = 65.0):
    """The published aircraft and its trim."""
    plant = make(derivatives())
    x, surfaces, throttle = initial(plant, [speed], [2000.0], [0.4])
    return plant, x, surfaces, np.tile(throttle, (2, 1))


@pytest.mark.parametrize("speed", [50.0, 65.0, 78.0])
def test_trim_holds(speed):
    plant, x, surfaces, throttle = trimmed(speed)
    end, flow = run(plant, x.copy(), surfaces, throttle, 20.0)
    assert abs(flow.speed[0] - speed) < 1e-3
    assert abs(end[12, 0] + 2000.0) < 0.02
    assert np.abs(end[3:6]).max() < 1e-6


def test_specific_force_in_level_flight_balances_gravity():
    plant, x, surfaces, throttle = trimmed()
    _, flow = plant.rates(0.0, x, surfaces, throttle, *STILL)
    up = np.einsum("ijn,jn->in", rotation(x[6:10]), flow.specific)
    assert np.allclose(up[:, 0], [0.0, 0.0, -GRAVITY], atol=1e-6)


def test_momentum_and_energy_are_kept_without_air():
    plant = make(ZERO, thrust_factor=0.0)
    x = np.zeros((BASE, 1))
    x[:6, 0] = [60.0, 5.0, -3.0, 0.8, 0.5, -0.6]
    x[6:10] = quaternion(np.full(1, 0.3), np.full(1, 0.1), np.full(1, 0.2))
    x[12] = -2000.0

    def conserved(x):
        xx, yy, zz, xz = plant.inertia[:, 0]
        tensor = np.array([[xx, 0, -xz], [0, yy, 0], [-xz, 0, zz]])
        turn, matrix = x[3:6, 0], rotation(x[6:10])[:, :, 0]
        energy = 0.5 * plant.mass[0] * (x[:3, 0] ** 2).sum() - plant.mass[0] * GRAVITY * x[12, 0]
        return np.r_[matrix @ tensor @ turn, 0.5 * turn @ tensor @ turn, energy, (matrix @ x[:3, 0])[:2]]

    end, _ = run(plant, x.copy(), np.zeros((3, 1)), np.zeros((2, 1)), 5.0)
    assert np.allclose(conserved(end), conserved(x), rtol=2e-6, atol=1e-4)
    before, after = ((rotation(s[6:10])[:, :, 0] @ s[:3, 0])[2] for s in (x, end))
    assert np.isclose(after, before + 5.0 * GRAVITY, atol=1e-6)


def test_left_and_right_are_mirrored():
    _, x, surfaces, _ = trimmed()
    plant = make(derivatives(), 2)
    pair, flip = np.tile(x, 2), np.array([[1.0, -1.0]])
    pair[1], pair[3:4], pair[5:6] = [2.0, -2.0], 0.1 * flip, -0.05 * flip
    phi, theta, psi = euler(pair[6:10])
    pair[6:10] = quaternion(phi + 0.2 * flip[0], theta, 0 * psi)
    position = np.tile(surfaces, 2)
    position[1], position[2] = 0.05 * flip, -0.03 * flip
    end, flow = run(plant, pair, position, np.array([[0.6, 0.3], [0.3, 0.6]]), 6.0)
    odd = np.concatenate([end[[1, 3, 5, 11]], [euler(end[6:10])[0], euler(end[6:10])[2]]])
    even = np.concatenate([end[[0, 2, 4, 10, 12]], [euler(end[6:10])[1], flow.qbar]])
    assert np.allclose(odd.sum(1), 0.0, atol=1e-9)
    assert np.allclose(even[:, 0], even[:, 1], rtol=1e-10)


@pytest.mark.parametrize(("surface", "axis"), [(0, 1), (1, 0), (2, 2)])
def test_positive_controls_pitch_down_roll_left_yaw_left(surface, axis):
    plant, x, surfaces, throttle = trimmed()
    position = surfaces.copy()
    position[surface] += 0.05
    _, flow = plant.rates(0.0, x, position, throttle, *STILL)
    assert flow.turn[axis, 0] < -0.01


@pytest.mark.parametrize(("row", "value", "name", "sign"), [
    (2, 3.0, "force_z", -1), (2, 3.0, "pitch", -1), (1, 3.0, "side", -1), (1, 3.0, "roll", -1), (1, 3.0, "yaw", 1),
    (3, 0.1, "roll", -1), (4, 0.1, "pitch", -1), (5, 0.1, "yaw", -1), (5, 0.1, "roll", 1), (3, 0.1, "yaw", -1),
])  # fmt: skip
def test_signs_of_stability_derivatives(row, value, name, sign):
    plant, x, surfaces, throttle = trimmed()
    moved = x.copy()
    moved[row] += value
    before, after = (plant.rates(0.0, s, surfaces, throttle, *STILL)[1].C[:, 0] for s in (x, moved))
    index = {"side": 1, "force_z": 2, "roll": 3, "pitch": 4, "yaw": 5}[name]
    assert sign * (after - before)[index] > 0.0


def test_more_left_thrust_yaws_right():
    plant, x, surfaces, throttle = trimmed()
    uneven = x.copy()
    uneven[13] *= 1.2
    assert plant.rates(0.0, uneven, surfaces, throttle, *STILL)[1].turn[2, 0] > 0.0


def test_a_case_is_the_same_however_many_are_drawn():
    assert order(6, 3) == order(36, 3)[:6] and order(36, 3) != order(36, 4)
    assert [turn.kind for turn in order(6, 3)] == list(KINDS)
    for kind in set(KINDS):
        assert {turn.references for turn in order(12, 3) if turn.kind == kind} == {False, True}


@pytest.mark.parametrize(("wrong", "said"), [(["--cases", "-1"], "'-1'"), (["--centre", "here"], "'here'"),
                                             (["--cases", "1", "--keys", "FILE"], "FILE")])  # fmt: skip
def test_bad_input_costs_one_line(wrong, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "FILE").write_text("")
    monkeypatch.setattr(sys, "argv", ["elsewhere", "--out", "records", "--keys", "keys", *wrong])
    with pytest.raises(SystemExit) as stop:
        main()
    told = capsys.readouterr().err
    assert stop.value.code == 2 and said in told and len(told.splitlines()) == 1, told


def test_it_loads_nothing_of_the_project():
    code = ("import sys, testbed.elsewhere.draw; "
            "own = ('icing_env', 'sim2real', 'estimators', 'controllers', 'testbed'); "
            "print([m for m in sys.modules if m.split('.')[0] in own and not m.startswith('testbed.elsewhere')])")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['testbed']"
