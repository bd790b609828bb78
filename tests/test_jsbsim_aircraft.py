"""JSBSim as the aircraft: signs and units of its records, changes where they should be, what references make of it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from icing_env.aircraft import load
from icing_env.record import read
from sim2real.baseline.references import Baseline, fit_baseline
from sim2real.closing import gap
from sim2real.closing.remedy import Remedy
from sim2real.library.candidates import bank
from sim2real.prediction.gusts import Gusts
from sim2real.records.powers import spin_inertia, thrust_per_power
from sim2real.records.reconstruct import Reconstruction, reconstruct
from sim2real.signatures.gust_intensity import SIGMAS, choose_gain
from testbed import cli
from testbed.withheld import gusts, instruments
from testbed.withheld import plant as pl
from testbed.withheld.files import record_text
from testbed.withheld.jsbsim_cases import aircraft, designs, side_text, without_levers
from testbed.withheld.jsbsim_changes import BY_NAME
from testbed.withheld.jsbsim_edit import AERO, data_root
from testbed.withheld.jsbsim_flight import Aircraft, Flight, fly
from testbed.withheld.jsbsim_score import figures, flat
from testbed.withheld.manoeuvres import DEG, PLANS, Manoeuvre, inputs

ROOT = data_root()
needs_jsbsim = pytest.mark.skipif(ROOT is None, reason="JSBSim's DHC6 is not installed: pip install jsbsim")
PULSES = Manoeuvre(65.0, ((0, "step", 2.0, 2.0 * DEG, 1.0), (1, "step", 12.0, 4.0 * DEG, 1.0),
                          (2, "step", 24.0, 4.0 * DEG, 1.0), (3, "step", 34.0, 0.15, 5.0)))  # fmt: skip


@pytest.fixture(scope="module")
def pulses() -> Flight:
    """A step of each control, in still air."""
    assert ROOT is not None
    return fly(aircraft(ROOT), PULSES)


def _moved(flight: Flight, column: int, start: float) -> float:
    """Change of a state over the 0.3 s after `start`."""
    k = round(start / pl.DT)
    return float(flight.states[k + 15, column] - flight.states[k, column])


@needs_jsbsim
def test_positive_surfaces_pitch_down_roll_left_and_yaw_left(pulses: Flight) -> None:
    assert [_moved(pulses, c, t) > 0.01 for c, t in ((pl.DE, 2.0), (pl.DA, 12.0), (pl.DR, 24.0))] == [True] * 3
    assert _moved(pulses, pl.Q, 2.0) < -0.01
    assert _moved(pulses, pl.P, 12.0) < -0.02
    assert _moved(pulses, pl.R, 24.0) < -0.01


@needs_jsbsim
def test_more_lever_is_more_thrust_and_torque_on_both_sides(pulses: Flight) -> None:
    before, after = round(33.5 / pl.DT), round(38.5 / pl.DT)
    for name in ("thrust_left", "thrust_right", "torque_left", "torque_right"):
        assert pulses.channels[name][after] > 1.1 * pulses.channels[name][before], name
    power = pulses.channels["torque_left"] * pulses.channels["rpm_left"] * np.pi / 30.0
    efficiency = pulses.channels["thrust_left"] * pulses.channels["airspeed"] / power
    assert 0.7 < efficiency[before] < 0.9 and 0.7 < efficiency[after] < 0.9  # of a propeller at 65 m/s


@needs_jsbsim
def test_accelerations_rates_and_flow_angles_agree(pulses: Flight) -> None:
    """Rigid-body kinematics over a flat Earth from the record's own numbers; JSBSim's turns, 0.007 m/s2 of Coriolis."""
    Y, o = pulses.states, pulses.outputs
    u = o[:, pl.VT] * np.cos(o[:, pl.BETA]) * np.cos(o[:, pl.ALPHA])
    v = o[:, pl.VT] * np.sin(o[:, pl.BETA])
    w = o[:, pl.VT] * np.cos(o[:, pl.BETA]) * np.sin(o[:, pl.ALPHA])
    p, q, r = Y[:, pl.P], Y[:, pl.Q], Y[:, pl.R]
    phi, theta = Y[:, pl.PHI], Y[:, pl.THETA]
    g = 9.8
    rates = np.column_stack([r * v - q * w - g * np.sin(theta) + o[:, pl.FX],
                             p * w - r * u + g * np.sin(phi) * np.cos(theta) + o[:, pl.FY],
                             q * u - p * v + g * np.cos(phi) * np.cos(theta) + o[:, pl.FZ]])  # fmt: skip
    left = rates - np.gradient(np.column_stack([u, v, w]), pl.DT, axis=0)
    assert np.sqrt(np.mean(left**2, axis=0)).max() < 0.03
    turning = np.gradient(theta, pl.DT) - (q * np.cos(phi) - r * np.sin(phi))
    assert np.sqrt(np.mean(turning**2)) < 1e-3


@needs_jsbsim
def test_product_of_inertia_has_the_sign_of_the_interface() -> None:
    """An aileron's kick from rest turns the aircraft as the papers' inertia says."""
    assert ROOT is not None
    plane = aircraft(ROOT)
    fly(plane, PULSES)
    f, papers = plane.fdm, plane.papers()
    plane.command(np.array([0.0, -0.2, 0.1]), np.array([0.7, 0.7]))
    f.run()
    roll, yaw = (f[f"moments/{a}-total-lbsft"] * 1.3558179 for a in "ln")
    i = papers.inertia
    assert i["xz"] > 0.0
    D = i["xx"] * i["zz"] - i["xz"] ** 2
    assert f["accelerations/pdot-rad_sec2"] == pytest.approx((i["zz"] * roll + i["xz"] * yaw) / D, abs=0.02)
    assert f["accelerations/rdot-rad_sec2"] == pytest.approx((i["xx"] * yaw + i["xz"] * roll) / D, abs=0.01)


def _coefficients(plane: Aircraft, beta: float = 3.0) -> dict[str, float]:
    """Every aerodynamic function [lbf, lbf ft] at one state, all controls and rates away from zero."""
    f = plane.fdm
    for name, value in {"ic/h-sl-ft": 7000.0, "ic/vt-fps": 210.0, "ic/alpha-deg": 3.0, "ic/beta-deg": beta,
                        "ic/p-rad_sec": 0.1, "ic/q-rad_sec": 0.05, "ic/r-rad_sec": 0.04}.items():  # fmt: skip
        f[name] = value
    plane.command(np.array([-0.05, 0.1, 0.06]), np.array([0.7, 0.7]))
    f.run_ic()
    names = [line.split(" ")[0] for line in f.query_property_catalog(AERO).split("\n") if line]
    return {n.removeprefix(AERO): f[n] for n in names}


@needs_jsbsim
@pytest.mark.parametrize(("effect", "touched"), [
    ("elevator_power", {"CmDe", "CLde"}), ("roll_damping", {"Clp"}), ("directional_stability", {"Cnb"}),
    ("lift_slope", {"CLalpha"}), ("pitch_trim", {"added_pitch"}), ("alpha_bias", set())])  # fmt: skip
def test_a_change_touches_its_own_coefficient_alone(effect: str, touched: set[str]) -> None:
    assert ROOT is not None
    size = BY_NAME[effect].typical
    clean, changed = _coefficients(aircraft(ROOT)), _coefficients(aircraft(ROOT, effect, size))
    differing = {n for n in changed if not np.isclose(changed[n], clean.get(n, 0.0), rtol=1e-9, atol=1e-9)}
    assert differing - {"CDi", "Cmadot"} == touched  # these two follow lift and the rate of alpha within JSBSim
    for name in touched & {"CmDe", "CLde", "Clp", "Cnb"}:
        assert changed[name] == pytest.approx((1.0 + size) * clean[name], rel=1e-6)


@needs_jsbsim
def test_masses_move_and_the_repaired_dihedral_is_odd() -> None:
    assert ROOT is not None
    clean, heavy, aft = (aircraft(ROOT, *c) for c in ((), ("mass_error", 0.05), ("cg_shift", -0.1)))
    for plane in (clean, heavy, aft):
        _coefficients(plane)
    assert heavy.papers().mass == pytest.approx(1.05 * clean.papers().mass, rel=1e-6)
    assert heavy.papers().inertia["yy"] == pytest.approx(clean.papers().inertia["yy"], rel=2e-3)
    assert aft.fdm["inertia/cg-x-in"] - clean.fdm["inertia/cg-x-in"] == pytest.approx(0.1 / 0.0254, rel=1e-6)
    assert _coefficients(clean, 3.0)["Clb"] < 0.0 < _coefficients(clean, -3.0)["Clb"]
    as_it_is = aircraft(ROOT, as_it_is=True)
    assert _coefficients(as_it_is, 3.0)["Clb"] > 0.0 < _coefficients(as_it_is, -3.0)["Clb"]


@needs_jsbsim
def test_a_propellers_inertia_is_that_of_its_file(pulses: Flight) -> None:
    """Levers move and a propeller's speed with them: that does not pull. The file has 25.1034 slug ft2."""
    c = pulses.channels
    omega = c["rpm_left"] * np.pi / 30.0
    found = spin_inertia(c["thrust_left"], c["torque_left"] * omega, omega * np.gradient(omega, pl.DT),
                         thrust_per_power(load()[0], c["airspeed"], c["alpha"]))  # fmt: skip
    assert found == pytest.approx(25.1034 * 1.35582, rel=0.1)


def reconstructed(folder: Path, plans: Sequence[int], sigma: float) -> list[Reconstruction]:
    """Flights of the clean aircraft by some manoeuvres of the first plan, in gusts of `sigma` m/s."""
    assert ROOT is not None
    plane, flights = aircraft(ROOT), []
    for i in plans:
        manoeuvre, rng = PLANS[0][i], np.random.default_rng(i)
        gust = gusts.draw(len(inputs(manoeuvre)) - 1, sigma, 1.0, manoeuvre.speed, rng)
        flight = fly(plane, manoeuvre, 1.0, gust)
        channels = instruments.read(flight.channels, 1.0, rng)
        (folder / f"{i}.csv").write_text(without_levers(record_text(channels, flight.commands)))
        (folder / f"{i}.toml").write_text(side_text("x", "reference", flight.papers))
        flights.append(reconstruct(read(folder / f"{i}.csv")))
    return flights


@pytest.fixture(scope="module")
def clean(tmp_path_factory) -> list[Reconstruction]:
    """Two flights in still air, slow and fast."""
    return reconstructed(tmp_path_factory.mktemp("clean"), (0, 1), 0.0)


@pytest.fixture(scope="module")
def corrected(clean: list[Reconstruction]) -> Baseline:
    """The model as these two correct it."""
    return fit_baseline(clean, bank())


@pytest.mark.slow
@needs_jsbsim
def test_gusts_that_references_met_are_told_beside_what_the_model_lacks(tmp_path) -> None:
    """More process noise than the model needs would take them: 0.5 m/s was told as 0.08 to 0.36."""
    flights = reconstructed(tmp_path, (0, 1), 0.5)
    found = fit_baseline(flights, bank())
    for flight in flights:
        over = replace(reconstruct(flight.record, found.near(flight.record)), inadequacy=found.inadequacy)
        assert 0.35 < choose_gain(over, SIGMAS).sigma < 0.75


@needs_jsbsim
def test_reference_flights_find_the_derivatives_of_another_aircraft(clean: list[Reconstruction],
                                                                    corrected: Baseline) -> None:  # fmt: skip
    """Rates' derivatives stand in JSBSim's file as numbers; its Cn_beta table is five times the published value."""
    row = corrected.near(clean[1].record)[0]
    for name, value, within in (("Cl_p", -0.5, 0.05), ("CY_beta", -0.6, 0.1), ("Cl_aileron", -0.14, 0.012)):
        assert row[name] == pytest.approx(value, abs=within), name
    assert 0.35 < row["Cn_beta"] < 0.6
    assert -0.55 < row["Cl_beta"] < -0.3
    assert np.linalg.eigvalsh(corrected.precision).min() > 0.0


@needs_jsbsim
def test_what_references_leave_of_another_aircraft_is_small(clean: list[Reconstruction], corrected: Baseline) -> None:
    """In flights like them; the published model is off by tolerances. Without terms across axes it is twice that."""
    for flight in clean:
        before, after = (gap.energies(reconstruct(flight.record, row), Remedy(), Gusts(0.003), 0) for row in (
            None, corrected.near(flight.record)))  # fmt: skip
        left = gap.g(after.before, after.alone)
        assert left < 0.06 and gap.g(before.before, before.alone) > 25.0 * left


def _answer(effects: list[str], probability: float, closure: float) -> dict:
    rest = {"effects": [], "unknown": False, "probability": 1.0 - probability}
    return {"verdict": "explained", "hypotheses": [{"effects": effects, "unknown": False, "probability": probability},
                                                   rest],
            "where": {"components": {"pitching_moment": 0.9, "wind": 0.1}}, "seconds": 1.0,
            "effects": [{"name": e, "parameters": {"change": {"estimate": -0.11}}} for e in effects],
            "gap": {"held_out": {"closure": closure, "before": 1.0}}}  # fmt: skip


def test_the_score_counts_the_true_effect_and_puts_the_worst_first() -> None:
    key = {"case": "a", "tier": "jsbsim", "sigma_w": 0.5, "effects": ["elevator_power"],
           "parameters": {"elevator_power": {"change": -0.1}}, "where": ["pitching_moment", "z_force"]}  # fmt: skip
    right = flat(_answer(["elevator_power"], 0.9, 0.8), key)
    wrong = flat(_answer(["pitch_trim"], 0.9, 0.2), {**key, "case": "b"})
    beside = flat(_answer(["elevator_power", "pitch_trim"], 0.9, 0.4), {**key, "case": "c"})
    failed = flat({"error": "no"}, {**key, "case": "d"})
    found = figures([right, wrong, beside, failed])
    assert found["named"] == 0.5 and found["exact"] == 0.25 and found["failed"] == 1
    assert found["closure_median"] == pytest.approx(0.4)
    assert found["size_error_median"] == pytest.approx(0.1)
    assert found["where_f1"] == pytest.approx(2.0 * 3 / (3 + 8))
    assert [r["case"] for r in found["rows"]][-1] == "a"


def test_designs_are_drawn_alike_and_name_effects_of_the_table() -> None:
    first, again = designs(14, 3), designs(14, 3)
    assert first == again and first != designs(14, 4)
    assert len({d.name for d in first}) == len(first) == 20
    assert {d.effect for d in first if d.effect} <= set(BY_NAME)
    assert sum(not d.effect for d in first if d.tier == "jsbsim") == 2


def test_a_missing_tree_is_one_line_and_exit_code_2(capsys, tmp_path) -> None:
    with pytest.raises(SystemExit) as end:
        cli.main(["benchmark", "diagnosis", "--jsbsim-root", str(tmp_path / "none"), "--json"])
    told = capsys.readouterr()
    assert end.value.code == 2 and told.out == ""
    assert "DHC6" in told.err and len(told.err.strip().splitlines()) == 1


@needs_jsbsim
def test_library_names_are_the_librarys() -> None:
    from icing_env.effects import LIBRARY

    for change in BY_NAME.values():
        effect = LIBRARY[change.effect]
        parameter = next(p for p in effect.parameters if p.name == change.parameter)
        assert parameter.low <= 2.0 * change.typical <= parameter.high
        assert set(change.where) == set(effect.enters_at), change.effect
