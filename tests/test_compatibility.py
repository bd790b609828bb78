"""Data compatibility: kinematics, injected errors of instruments found again, and what turbulence does to them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from flights import META, flight_data, lateral
from scipy.integrate import solve_ivp

from estimators.compatibility.flow_angles import at_centre_of_gravity
from estimators.compatibility.gusts import measure, whitening
from estimators.compatibility.kinematics import COUNT, PARAMETERS, simulate
from estimators.compatibility.record import check_compatibility, corrected, made_compatible
from estimators.regression.equation_error import identify
from estimators.signals.gust_level import LENGTH
from estimators.signals.instruments import calibrated
from icing_env import scenario as scenarios
from icing_env.errors import InputError
from icing_env.record import FlightRecord, read
from testbed.flight import fly

G, DT = 9.80665, 0.02
NOISE = {"airspeed": 0.2, "alpha": 0.001, "beta": 0.001, "phi": 0.001, "theta": 0.001, "p": 0.001, "q": 0.001,
         "r": 0.001, "ax": 0.03, "ay": 0.03, "az": 0.05}  # fmt: skip


def pulse(t: np.ndarray | float, at: float, width: float = 0.4) -> np.ndarray | float:
    """A smooth doublet of unit size."""
    s = (t - at) / width
    return -1.65 * s * np.exp(-0.5 * s * s)


def drive(t: float) -> np.ndarray:
    """Rates (rad/s) and specific forces (m/s2) of a lively but imaginary motion: ax, ay, az, p, q, r."""
    lift = 3.5 * pulse(t, 3.0, 0.6) - 3.0 * pulse(t, 8.0) + 2.5 * pulse(t, 15.0, 0.8)
    return np.array([
        0.35 + 0.4 * pulse(t, 5.0, 1.0), 1.0 * pulse(t, 11.0, 0.8), -9.78 + lift,
        0.10 * pulse(t, 11.0) + 0.06 * pulse(t, 17.0), 0.10 * pulse(t, 3.1, 0.6) - 0.09 * pulse(t, 8.1),
        0.07 * pulse(t, 10.0, 0.8) - 0.06 * pulse(t, 14.0),
    ])  # fmt: skip


@cache
def motion(duration: float = 20.0) -> dict[str, np.ndarray]:
    """The motion that `drive` makes, from its equations written out in inertial vectors (not in u', v', w')."""
    def rhs(t: float, x: np.ndarray) -> np.ndarray:
        ax, ay, az, p, q, r = drive(t)
        c = attitude(*x[3:])
        phi, theta, _ = x[3:]
        angles = [p + np.tan(theta) * (q * np.sin(phi) + r * np.cos(phi)), q * np.cos(phi) - r * np.sin(phi),
                  (q * np.sin(phi) + r * np.cos(phi)) / np.cos(theta)]  # fmt: skip
        return np.concatenate([c @ np.array([ax, ay, az]) + np.array([0, 0, G]), angles])

    time = np.arange(round(duration / DT) + 1) * DT
    start = attitude(0.0, 0.04, 0.3) @ np.array([72 * np.cos(0.04), 0.0, 72 * np.sin(0.04)])
    x = solve_ivp(rhs, (0, duration), [*start, 0.0, 0.04, 0.3], t_eval=time, max_step=0.1, rtol=1e-9, atol=1e-11).y
    body = np.array([attitude(*x[3:, i]).T @ x[:3, i] for i in range(len(time))]).T
    speed = np.linalg.norm(body, axis=0)
    felt = np.array([drive(t) for t in time]).T
    flow = {"airspeed": speed, "alpha": np.arctan2(body[2], body[0]), "beta": np.arcsin(body[1] / speed)}
    channels = {"time": time, **flow, "phi": x[3], "theta": x[4], "psi": x[5]}
    return channels | dict(zip(("ax", "ay", "az", "p", "q", "r"), felt, strict=True))


def attitude(phi: float, theta: float, psi: float) -> np.ndarray:
    """Body to earth, by three turns."""
    (sp, st_, sy), (cp, ct, cy) = np.sin([phi, theta, psi]), np.cos([phi, theta, psi])
    roll = np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]])
    pitch = np.array([[ct, 0, st_], [0, 1, 0], [-st_, 0, ct]])
    return np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ pitch @ roll


Errors = dict[str, float]


def flown(seed: int | None = None, scale: Errors | None = None, bias: Errors | None = None) -> FlightRecord:
    """`motion` as instruments with errors and, where a seed is given, noise read it."""
    rng = np.random.default_rng(seed)
    out = {}
    for name, truth in motion().items():
        read = (1 + (scale or {}).get(name, 0.0)) * truth + (bias or {}).get(name, 0.0)
        out[name] = read + NOISE[name] * rng.standard_normal(len(truth)) if seed is not None and name in NOISE else read
    return FlightRecord(out, META)


def test_kinematics_follow_a_motion_integrated_in_inertial_axes() -> None:
    truth = motion()
    row = np.zeros((1, COUNT))
    for name in ("airspeed", "alpha", "beta", "phi", "theta", "psi"):
        row[0, PARAMETERS.index(f"{name}_start")] = truth[name][0]
    inputs = np.column_stack([truth[n] for n in ("ax", "ay", "az", "p", "q", "r")])
    found = simulate(row, inputs, DT)[0]
    for j, name in enumerate(("airspeed", "alpha", "beta", "phi", "theta", "psi")):
        assert np.max(np.abs(found[:, j] - truth[name])) < (2e-3 if name == "airspeed" else 5e-5), name


def test_a_set_that_cannot_be_flown_leaves_the_others_alone() -> None:
    row = np.zeros((3, COUNT))
    row[:, 0], row[1, PARAMETERS.index("bias_q")] = 72.0, np.nan
    inputs = np.tile([0.0, 0.0, -G, 0.0, 0.0, 0.0], (50, 1))
    found = simulate(row, inputs, DT)
    assert not np.isfinite(found[1, -1]).all()
    np.testing.assert_array_equal(found[0], found[2])


@pytest.mark.parametrize("wind", [False, True])
def test_perfect_data_has_no_errors(wind: bool) -> None:
    found = check_compatibility(flown(), wind)
    for name, e in found.parameters.items():
        assert abs(e.estimate) < (2e-4 if e.unit in ("1", "m/s2") else 1e-5), name
    assert max(found.sigma.values()) < 0.02


SCALE, BIAS = {"alpha": 0.15, "beta": -0.12}, {"q": 0.002, "p": -0.003, "r": 0.0015, "ax": 0.12, "az": -0.15}


@pytest.mark.parametrize("wind", [False, True])
def test_injected_errors_are_found_within_their_intervals(wind: bool) -> None:
    truth = {f"scale_{n}": v for n, v in SCALE.items()} | {f"bias_{n}": v for n, v in BIAS.items()}
    scores = {name: [] for name in truth}
    for seed in range(12):
        found = check_compatibility(flown(seed, SCALE, BIAS), wind).found
        for name in truth:
            assert name in found, name
            scores[name].append((found[name].estimate - truth[name]) / found[name].std_error)
    every = np.concatenate(list(scores.values()))
    assert np.mean(np.abs(every) < 1.96) > 0.88
    for name, z in scores.items():
        assert 0.4 < np.sqrt(np.mean(np.square(z))) < 1.9, name


def test_the_corrected_record_is_the_motion_and_says_what_was_taken_out() -> None:
    found = check_compatibility(flown(3, SCALE, BIAS))
    truth, dirty = motion(), flown(3, SCALE, BIAS)
    for name in (*SCALE, *BIAS):
        left, before = found.record[name] - truth[name], dirty[name] - truth[name]
        assert abs(np.mean(left)) < 0.25 * abs(np.mean(before)) + 0.1 * NOISE[name], name
        assert any(p.channel == name and "taken out" in p.kind and p.repaired for p in found.record.problems)
    np.testing.assert_array_equal(corrected(dirty)["alpha"], found.record["alpha"])
    np.testing.assert_array_equal(made_compatible(dirty, "kinematic")["q"], found.record["q"])
    assert made_compatible(dirty, "none") is dirty
    with pytest.raises(InputError, match="valid are: none, kinematic, wind"):
        made_compatible(dirty, "wnd")
    assert found.record.meta.corrected and not dirty.meta.corrected


def test_scale_factors_of_angles_that_did_not_move_are_not_asked_for() -> None:
    rng = np.random.default_rng(1)
    level = {"airspeed": 72.0, "alpha": 0.04, "q": 0.0, "theta": 0.04, "ax": 0.39, "az": -9.8}
    quiet = {n: np.full(1001, v) + 1e-4 * rng.standard_normal(1001) for n, v in level.items()}
    found = check_compatibility(FlightRecord({"time": motion()["time"], **quiet}, META)).parameters
    assert not found["scale_alpha"].identifiable and "alpha moved" in found["scale_alpha"].why
    assert "bias_p" not in found and "scale_beta" not in found


def test_what_a_motion_cannot_tell_apart_is_left_out_with_the_reason() -> None:
    found = check_compatibility(flown(4)).parameters
    assert not found["bias_theta"].identifiable and found["bias_theta"].estimate == 0.0
    assert "goes with" in found["bias_theta"].why or "would not show" in found["bias_theta"].why
    with pytest.raises(InputError, match="lacks alpha, q, theta, ax, az"):
        check_compatibility(lateral())


@cache
def gusty(sigma: float, seed: int) -> tuple[FlightRecord, float]:
    """20 s with the elevator's doublets in turbulence, and the vertical gusts' standard deviation in them."""
    scenario = scenarios.load("clear_air", aircraft="twin_otter_flight", duration=29.0, initial={"airspeed": 72.0},
                              parameters={"turbulence_sigma_w": sigma}, doublet_scale=0.78)  # fmt: skip
    flight = fly(scenario, seed=seed, observer=False, protection=False)
    rows = flight.record.time >= 8.0
    return flight.record.take(rows), float(np.std(flight.truth["gust_w"][rows]))


def scales(sigma: float, wind: bool) -> tuple[np.ndarray, np.ndarray]:
    """Scale factors of alpha found in some flights, and their standard errors."""
    found = [check_compatibility(gusty(sigma, seed)[0], wind).parameters["scale_alpha"] for seed in range(6)]
    return np.array([e.estimate for e in found]), np.array([e.std_error for e in found])


def test_turbulence_lands_in_the_scale_factor_without_wind_states_and_not_with_them() -> None:
    calm, rough = scales(0.0, False)[0], scales(1.0, False)[0]
    assert np.max(np.abs(calm)) < 0.1  # boom and vane lag are there
    assert np.mean(rough) < -0.3 and np.std(rough) > 3 * np.std(calm)
    carried, errors = scales(1.0, True)
    assert np.mean(np.abs(carried)) < 0.15 * np.mean(np.abs(rough))
    shown = np.isfinite(errors)
    assert (np.abs(carried[shown]) < 5 * errors[shown]).all()


def test_what_no_instrument_can_be_wrong_by_is_told_and_not_taken_out() -> None:
    record = gusty(2.0, 1)[0]
    found = check_compatibility(record)
    wild = [n for n, e in found.parameters.items() if n.startswith("scale") and not e.identifiable and e.estimate]
    assert wild and all("more than an instrument" in found.parameters[n].why for n in wild)
    for name in wild:
        channel = name.removeprefix("scale_")
        # what the instruments' calibration declares is taken out in any case
        assert np.std(found.record[channel]) == pytest.approx(np.std(calibrated(record)[channel]), rel=1e-6)
    assert identify(found.record)


def test_the_gusts_themselves_are_measured() -> None:
    for seed in range(2):
        record, truth = gusty(1.0, seed)
        found = check_compatibility(record, True)
        assert found.sigma["w"] == pytest.approx(1.0, rel=0.3) and set(found.gust) == {"u", "v", "w"}
        assert np.std(found.gust["w"]) == pytest.approx(truth, rel=0.4)
        plain = check_compatibility(record)
        assert any("turbulence" in note for note in plain.notes) and not plain.gust
    assert not check_compatibility(gusty(0.0, 0)[0]).notes


@pytest.mark.parametrize("transverse", [True, False])
def test_whitening_makes_a_dryden_gust_and_noise_white(transverse: bool) -> None:
    rng, step, n, ratio = np.random.default_rng(0), 72.0 * DT / LENGTH, 200_000, 5.0
    x, gust, noise = np.zeros(2), np.empty(n), rng.standard_normal(n)
    decay, kick = np.exp(-step), np.sqrt(1 - np.exp(-2 * step))
    for i, shock in enumerate(rng.standard_normal(n)):  # x2 by the trapezoidal rule, unlike the filter
        old = x[0]
        x[0] = decay * x[0] + kick * shock
        x[1] += step * (0.5 * (old + x[0]) - x[1])
        gust[i] = (np.sqrt(3) * x[0] + (1 - np.sqrt(3)) * x[1]) / np.sqrt(2) if transverse else x[0]
    filtered = whitening(ratio, transverse, step)
    e = filtered(ratio * gust + noise)[1000:]
    assert np.var(e) == pytest.approx(filtered.variance, rel=0.02)
    assert max(abs(np.mean(e[k:] * e[:-k])) for k in (1, 2, 5, 50)) < 0.02 * np.var(e)
    assert np.std(filtered.gust(ratio * gust + noise) - ratio * gust) < 0.8
    part = slice(0, 20_000)
    found, level = measure((0.3 * (ratio * gust + noise))[part], transverse, step)
    assert level == pytest.approx(0.3, rel=0.1) and found.ratio == pytest.approx(ratio, rel=0.35)


def test_vane_and_accelerometer_away_from_the_centre_of_gravity() -> None:
    truth = motion()
    x, omega = np.array([4.0, 0.5, 0.3]), np.array([truth[n] for n in "pqr"]).T
    body = np.array([np.cos(truth["alpha"]) * np.cos(truth["beta"]), np.sin(truth["beta"]),
                     np.sin(truth["alpha"]) * np.cos(truth["beta"])]).T * truth["airspeed"][:, None]  # fmt: skip
    there = body + np.cross(omega, x)
    change = np.gradient(omega, DT, axis=0, edge_order=2)
    felt = np.column_stack([truth[n] for n in ("ax", "ay", "az")])
    felt = felt + np.cross(change, x) + np.cross(omega, np.cross(omega, x))
    flow = {"alpha": np.arctan2(there[:, 2], there[:, 0]), "beta": np.arcsin(there[:, 1] / truth["airspeed"])}
    values = {**truth, **flow, "ax": felt[:, 0], "ay": felt[:, 1], "az": felt[:, 2]}
    place = {"position": list(x), "corrected": False}
    found, told = at_centre_of_gravity(values, {"alpha": place, "beta": place, "accelerometers": place}, DT)
    for name in ("alpha", "beta", "az"):
        before, after = (np.max(np.abs(v[name] - truth[name])[10:-10]) for v in (values, found))
        assert after < 0.07 * before + 1e-4, name
    assert len(told) == 3
    same, told = at_centre_of_gravity(values, {"alpha": {**place, "corrected": True}}, DT)
    assert same["alpha"] is values["alpha"] and not told
    with pytest.raises(InputError, match="must be \\[x, y, z\\]"):
        at_centre_of_gravity(values, {"alpha": {"position": [1.0]}}, DT)


@pytest.mark.parametrize("name", ["totter_demo_data.mat", "totter_f1_017_data.mat"])
def test_recorded_flights_are_nearly_compatible_and_their_derivatives_move_little(name: str) -> None:
    """The owner corrected these records before; what is left must be small, and identify must take them."""
    record = read(flight_data(name))
    found = check_compatibility(record, wind=True)
    for parameter, e in found.found.items():
        limit = {"rad/s": 0.005, "m/s2": 0.5, "1": 0.2}.get(e.unit, 0.02)
        assert abs(e.estimate) < limit, parameter
    before, after = identify(record), identify(found.record)
    for key in ("Cm_elevator", "Cm_q") if "demo" in name else ("Cl_p", "Cn_rudder"):
        assert after[key].estimate == pytest.approx(before[key].estimate, rel=0.05), key


def test_a_corrected_record_is_not_moved_to_the_centre_of_gravity_twice() -> None:
    place = {"position": [4.0, 0.0, 0.0], "corrected": False}
    record = flown(5)
    far = replace(record, meta=replace(META, sensors={"alpha": place, "source of airspeed": "boom"}))
    once = check_compatibility(far).record
    assert once.meta.sensors["alpha"]["corrected"] and once.meta.sensors["source of airspeed"] == "boom"
    moved = check_compatibility(once).record["alpha"] - once["alpha"]
    assert np.std(moved) < 0.2 * np.std(4.0 * record["q"] / record["airspeed"]) + 1e-6
