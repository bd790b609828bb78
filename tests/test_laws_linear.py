"""The laws that are linear systems: as designed, as published, stable and robust, and flown."""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest
from controlled import cruise, free, steer
from safetensors.numpy import save_file

from controllers.choice import law
from controllers.design import h_infinity, robustness
from controllers.design import lqr as lqr_design
from controllers.design.__main__ import main
from controllers.design.mixed_sensitivity import generalised
from controllers.design.models import DT, FLAPS, SHORT, SPEEDS, clean, side_force, steady
from controllers.laws import sis
from controllers.schedule import at, place, read_tables
from icing_env.atmosphere import density
from icing_env.errors import InputError
from icing_env.linearise import LATERAL
from icing_env.scenario import load
from icing_env.types import COMMAND, TARGET
from testbed.flight import make_world

DESIGNED = ("lqr", "lqg", "h_infinity")
EVERY = pytest.mark.parametrize("name", DESIGNED)


def shipped(name):
    """Tables of a law, as they come with it."""
    module = law(name)
    if name == "h_infinity":
        return read_tables(name, module.SHAPES)
    shapes = {key: (len(SPEEDS), len(FLAPS), *size) for key, size in module.SIZES.items()}
    return read_tables(name, {"grid": (6,), **shapes})


@pytest.mark.parametrize("name", ["lqr", "lqg"])
def test_the_shipped_gains_are_those_of_the_design(name):
    made, _ = import_module(f"controllers.design.{name}").design()
    tables = shipped(name)
    assert made.keys() == tables.keys()
    for key, table in tables.items():
        np.testing.assert_allclose(table, made[key], rtol=1e-5, atol=1e-7, err_msg=key)


def test_the_shipped_h_infinity_controllers_are_those_of_the_design():
    pytest.importorskip("slycot", reason="slycot is not installed: the synthesis cannot be repeated")
    made, _ = import_module("controllers.design.h_infinity").design()
    tables, omega = shipped("h_infinity"), np.geomspace(0.01, 100.0, 50)
    np.testing.assert_allclose(tables["integral"], made["integral"], rtol=1e-4)
    for axis in ("pitch", "roll"):  # their states may come in another basis
        one, other = (robustness.response(parts(t[axis]), omega) for t in (tables, made))
        np.testing.assert_allclose(one, other, rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize(("axis", "process"), [("pitch", h_infinity.pitching), ("roll", h_infinity.rolling)])
def test_the_shipped_h_infinity_controllers_keep_their_bounds(axis, process):
    """Without slycot: the weighted loop of the reduced, discrete controller has nearly the gamma it was made for."""
    k, omega = h_infinity.weights(), np.geomspace(0.01, 60.0, 200)
    plant = generalised(process(steady(clean(), k["airspeed"], 0.0), k), axis, k)
    tables = read_tables("h_infinity", {**law("h_infinity").SHAPES, "gamma": (2,)})
    which = ("pitch", "roll").index(axis)
    controller = robustness.response(parts(tables[axis]), omega)
    controller[:, 0, 0] += tables["integral"][which]/(1j*omega)
    p = np.moveaxis(plant(1j*omega), -1, 0)
    inner = controller @ p[:, 3:, :3]/(1.0 - controller @ p[:, 3:, 3:])
    largest = np.linalg.norm(p[:, :3, :3] + p[:, :3, 3:] @ inner, 2, axis=(1, 2)).max()
    assert 0.8 < largest/tables["gamma"][which] < 1.1


def parts(matrix):
    """A, B, C, D of a controller of one surface and two readings."""
    return matrix[:-1, :-2], matrix[:-1, -2:], matrix[-1:, :-2], matrix[-1:, -2:]


@EVERY
@pytest.mark.parametrize("axis", list(robustness.AXES))
def test_stable_over_the_grid_and_with_changed_derivatives(name, axis):
    tables = shipped(name)
    assert robustness.slowest(name, tables, axis) > 0.02  # 1/s
    for factors in robustness.changed(axis):
        assert robustness.slowest(name, tables, axis, factors) > 0.0, factors


@EVERY
def test_margins(name):
    tables = shipped(name)
    for axis, surfaces in robustness.AXES.items():
        pairs = list(zip(robustness.plants(axis), robustness.laws(name, tables, axis), strict=True))[::5]
        for k in range(len(surfaces)):
            for process, system in pairs:
                found = robustness.margins(process, system, k)
                assert found.gain > 10.0 and found.phase > 35.0 and found.peak < 2.0, found


def test_a_loop_too_tight_is_seen_to_be_unstable():
    tables = shipped("lqr")
    tables["longitudinal"] = 10.0*tables["longitudinal"]
    assert robustness.slowest("lqr", tables, "longitudinal") < 0.0


def test_margins_are_those_of_a_loop_known_in_closed_form():
    # 1/(z - 1) and a proportional gain k: L = k/(z - 1); |z - 1| = 2 sin(w T/2); unstable from k = 2 on
    process = (np.eye(1), np.eye(1), np.eye(1))
    found = robustness.margins(process, (np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.array([[-0.2]])), 0)
    half = np.arcsin(0.1)
    assert found.crossover == pytest.approx(2.0*half/DT, rel=1e-3)
    assert found.phase == pytest.approx(90.0 - np.degrees(half), abs=0.1)
    assert robustness.decay(process, (np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.array([[-2.1]]))) < 0.0


def test_the_regulator_satisfies_the_return_difference_of_kalman():
    point, accepted = steady(clean(), 64.0, 0.0), lqr_design.limits()
    a, b = point.model(SHORT, ("elevator",))
    full, drive = np.zeros((5, 5)), np.zeros((5, 1))
    full[:4, :4], full[4, 3], drive[:4] = a, 1.0, b
    k = lqr_design.longitudinal(point, accepted)
    for omega in (0.1, 1.0, 10.0):  # |1 + K (jw - A)^-1 B| >= 1: Anderson & Moore, Optimal Control, section 5.3
        assert abs(1.0 + (k @ np.linalg.solve(1j*omega*np.eye(5) - full, drive))[0, 0]) >= 1.0


def test_the_lateral_force_is_that_of_the_side_force_derivatives():
    point = steady(clean(), 64.0, 0.0)
    row, direct = side_force(point)
    p = point.parameters[0]
    slope = 0.5*density(2200.0)*point.airspeed**2*float(p["wing_area"])/float(p["mass"])
    assert row[LATERAL.index("beta")] == pytest.approx(slope*float(p["CY_beta"]), rel=0.02)
    assert direct[1] == pytest.approx(slope*float(p["CY_rudder"]), rel=0.02)
    assert row[LATERAL.index("phi")] == pytest.approx(0.0, abs=0.01)  # gravity is not felt


def level(m):
    """Targets that ask for the pitch and bank that `m` has."""
    t = np.zeros(1, TARGET)
    t["theta"], t["phi"], t["throttle"] = m["theta"], m["phi"], m["throttle_left"]
    return t


@EVERY
@pytest.mark.parametrize("axis", list(robustness.AXES))
def test_the_law_that_flies_is_the_one_that_was_analysed(name, axis):
    """Small random readings at a place of the grid: the kernel against the design's A, B, C, D."""
    i, j, point = robustness.places()[4]
    a, b, c, d = import_module(f"controllers.design.{name}").compensator(shipped(name), i, j, point, axis)
    module, rng, m = law(name), np.random.default_rng(4), cruise()
    m["airspeed"], m["theta"], m["alpha"], m["flap"] = point.airspeed, 0.0, 0.0, point.flap
    m["temperature"], m["pressure"], m["ax"] = 273.85, density(2200.0)*287.05287*273.85, 0.0
    m["az"] = -9.80665
    readings = ("alpha", "q", "theta", "elevator") if axis == "longitudinal" else ("beta", "p", "r", "phi", "ay")
    start, memory, command, x = m.copy(), module.init(1), np.zeros(1, COMMAND), np.zeros(len(a))
    gains, t = module.default_gains(), level(m)
    steer(module, memory, command, m, t, free(), gains, DT)
    surfaces = robustness.AXES[axis]
    y = np.zeros(b.shape[1])
    for _ in range(50):
        for k, reading in enumerate(readings):
            m[reading] = start[reading] + rng.normal(0.0, 1e-4)
            y[k + (axis == "longitudinal")] = m[reading][0] - start[reading][0]
        m["ax"], m["az"] = 9.80665*np.sin(m["theta"]), -9.80665*np.cos(m["theta"])  # no acceleration along the path
        steer(module, memory, command, m, t, free(), gains, DT)
        u = c @ x + d @ y
        x = a @ x + b @ y
        for k, surface in enumerate(surfaces):
            assert command[surface][0] - start[surface][0] == pytest.approx(u[k], abs=1e-7), surface


def test_tables_are_linear_between_their_nodes_and_held_outside():
    module = law("lqr")
    gains, m = module.default_gains(), cruise()
    table = gains[0]["longitudinal"]
    m["temperature"], m["pressure"] = 288.15, 1.225*287.05287*288.15  # sea level: equivalent airspeed is airspeed
    for speed, flap, expected in (
        (SPEEDS[2], 0.0, table[2, 0, 0, 3]),
        (0.5*(SPEEDS[2] + SPEEDS[3]), 0.0, 0.5*(table[2, 0, 0, 3] + table[3, 0, 0, 3])),
        (SPEEDS[1], 0.5*FLAPS[1], 0.5*(table[1, 0, 0, 3] + table[1, 1, 0, 3])),
        (15.0, 0.0, table[0, 0, 0, 3]),
        (120.0, FLAPS[-1], table[-1, -1, 0, 3]),
    ):
        m["airspeed"], m["flap"] = speed, flap
        assert at(table, place(m[0], gains[0]), 0, 3) == pytest.approx(expected, rel=1e-12)


def test_a_gust_that_only_the_vane_reads_moves_the_filtered_elevator_less():
    """Elevator per reading of the vane over the frequencies of gusts, at 72 m/s."""
    i, j, point = robustness.places()[4]
    omega, gain = np.geomspace(0.3, 30.0, 20), {}
    for name in ("lqr", "lqg"):
        system = import_module(f"controllers.design.{name}").compensator(shipped(name), i, j, point, "longitudinal")
        gain[name] = np.abs(robustness.response(system, omega)[:, 0, 1])
    assert np.all(gain["lqg"] < 0.6*gain["lqr"])


def test_sis_flies_the_published_gains():
    module, m = sis, cruise()
    m["airspeed"] = 60.0
    memory, command, t = module.init(1), np.zeros(1, COMMAND), level(m)
    steer(module, memory, command, m, t, free(), module.default_gains(), DT)
    m["theta"], m["phi"] = m["theta"] + 0.01, 0.01  # read from the published curves at 60 m/s: -0.975 and -0.634
    steer(module, memory, command, m, t, free(), module.default_gains(), DT)
    assert command["elevator"][0] - m["elevator"][0] == pytest.approx(1.963*0.975*0.01, rel=0.01)
    assert command["aileron"][0] == pytest.approx(0.599*0.634*0.01, rel=0.01)


def test_the_published_roll_gain_keeps_its_sign_over_the_schedule():
    g = sis.default_gains()[0]
    speeds = np.linspace(g["speed_min"], g["speed_max"], 50)
    assert np.all(g["K_phi_0"] + speeds*(g["K_phi_1"] + speeds*g["K_phi_2"]) < -0.3)


@pytest.mark.parametrize("name", ["sis", *DESIGNED])
def test_flies_clean_and_iced_in_turbulence(name):
    speeds = (55.0, 72.0, 82.0, 62.0, 72.0, 82.0)
    ice = dict.fromkeys(("left_wing", "right_wing", "htail", "other"), 0.05)
    scenario = load("steps_clean", duration=45.0, parameters={"turbulence_sigma_w": 1.5}, ice_protection="off")
    world = make_world(scenario, 6, name)
    for row in range(6):
        initial = {"airspeed": speeds[row], "eta": ice if row >= 3 else {}}
        world.reset(rows=np.array([row]), seeds=[50 + row], initial=initial)
    errors = []
    for _ in range(world.limit):
        world.step()
        errors.append([world.task[f"{kind}_error"].copy() for kind in ("altitude", "heading")])
    altitude, heading = np.sqrt(np.mean(np.array(errors)[1250:]**2, axis=0))
    assert not world.terminated.any()
    assert np.all(altitude < 12.0), altitude
    assert np.all(np.degrees(heading) < 3.0), heading


def test_wrong_tables_are_refused(tmp_path):
    path = tmp_path / "gains.safetensors"
    with pytest.raises(InputError, match=r"python -m controllers\.design"):
        law("lqr").default_gains(path)
    for table in (np.zeros(3), np.full(6, np.nan)):
        save_file({"grid": table}, path)
        with pytest.raises(InputError, match="'grid' must be finite and"):
            law("lqr").default_gains(path)


def test_the_command_names_what_can_be_designed(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["lqx"])
    assert ended.value.code == 2
    assert "lqg" in capsys.readouterr().err
