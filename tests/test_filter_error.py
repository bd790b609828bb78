"""Filter error: the gust and the derivatives together, on a gusty plant of the tests' own and on the simulator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from flights import LATERAL, META, RHO, G, V, doublet, flight_data, lateral
from scipy.integrate import solve_ivp

from estimators.likelihood import filter_error, output_error
from estimators.likelihood.inputs import scale_lengths
from icing_env.record import FlightRecord, read
from icing_env.turbulence import scales
from testbed.benchmarks.coverage import DEVELOPMENT, study

NOISE = {"beta": 0.0017, "p": 0.0017, "r": 0.0017, "phi": 0.0017, "ay": 0.05}


def gusty(sigma: float, seed: int, duration: float = 30.0, dt: float = 0.02) -> FlightRecord:
    """The lateral plant of tests/flights.py in side gusts of Dryden's form, flown by SciPy through a frozen gust."""
    rng, force, b = np.random.default_rng(seed), 0.5 * RHO * V**2 * META.geometry.wing_area, META.geometry.span
    xx, _, zz, xz = META.inertia
    inverse, lag = np.linalg.inv([[xx, -xz], [-xz, zz]]), 533.0 / V
    time = np.arange(round(duration / dt) + 1) * dt
    one, two = sigma * rng.standard_normal(), 0.0
    gust = np.zeros(len(time))
    for k in range(len(time)):
        gust[k] = np.sqrt(0.5) * (np.sqrt(3.0) * one + (1.0 - np.sqrt(3.0)) * two)
        one, two = (one * (1.0 - dt / lag) + sigma * np.sqrt(2.0 * dt / lag) * rng.standard_normal(),
                    two + dt / lag * (one - two))  # fmt: skip

    def controls(t: float) -> tuple[float, float]:
        return doublet(t, 8.0, 1.0, 0.09) + doublet(t, 20.0, 0.7, 0.06), doublet(t, 1.0, 1.4, 0.05)

    def coefficient(name: str, x: np.ndarray, beta: float, t: float) -> float:
        aileron, rudder = controls(t)
        terms = {"beta": beta, "p": x[1] * b / (2 * V), "r": x[2] * b / (2 * V), "aileron": aileron, "rudder": rudder}
        return sum(LATERAL.get(f"{name}_{key}", 0.0) * value for key, value in terms.items())

    def rhs(t: float, x: np.ndarray) -> list[float]:
        beta = (x[0] - np.interp(t, time, gust)) / V
        p_dot, r_dot = inverse @ [force * b * coefficient("Cl", x, beta, t), force * b * coefficient("Cn", x, beta, t)]
        side = force * coefficient("CY", x, beta, t) / META.mass
        return [side + G * np.sin(x[3]) - V * x[2], p_dot, r_dot, x[1]]

    x = solve_ivp(rhs, (0, time[-1]), [0.0] * 4, t_eval=time, max_step=0.02, rtol=1e-7, atol=1e-9).y
    beta = (x[0] - gust) / V
    side = np.array([coefficient("CY", x[:, i], beta[i], t) for i, t in enumerate(time)])
    moved = np.array([controls(t) for t in time]).T
    channels = {
        "time": time, "airspeed": np.full(len(time), V), "beta": beta, "p": x[1], "r": x[2], "phi": x[3],
        "ay": force * side / META.mass, "aileron": moved[0], "rudder": moved[1],
        "pressure": np.full(len(time), RHO * 287.05287 * 280.0), "temperature": np.full(len(time), 280.0),
    }  # fmt: skip
    noisy = {k: v + NOISE[k] * rng.standard_normal(len(v)) if k in NOISE else v for k, v in channels.items()}
    return FlightRecord(noisy, META)


def test_derivatives_and_gust_of_another_plant_are_recovered() -> None:
    scores, gusts = [], []
    for seed in range(3):
        found = filter_error.identify(gusty(1.0, seed))
        names = [n for n in LATERAL if found[n].identifiable]
        assert {"Cl_p", "Cl_aileron", "Cn_beta", "Cn_r", "Cn_rudder", "CY_beta"} <= set(names)
        scores += [(found[n].estimate - LATERAL[n]) / found[n].std_error for n in names]
        gusts.append(found["sigma_gust_v"].estimate)
    assert np.mean(np.abs(scores) < 2.0) > 0.85 and np.max(np.abs(scores)) < 5.0
    assert 0.7 < np.mean(gusts) < 1.3


def test_filter_error_is_nearer_than_output_error_in_turbulence_and_output_error_says_so() -> None:
    off: dict[str, list[float]] = {"filter": [], "output": []}
    for seed in range(2):
        record = gusty(1.5, 10 + seed)
        for name, method in (("filter", filter_error), ("output", output_error)):
            found = method.identify(record)
            off[name] += [abs(found[n].estimate / LATERAL[n] - 1.0) for n in ("Cn_beta", "Cn_r", "Cl_p", "Cn_rudder")]
            assert bool(found["Cn_beta"].warning) == (name == "output")
    assert np.mean(off["filter"]) < 0.5 * np.mean(off["output"])


def test_in_calm_air_it_is_output_error() -> None:
    record = lateral(3, 20.0)
    filtered, flown = filter_error.identify(record), output_error.identify(record)
    for name in ("Cl_p", "Cl_aileron", "Cn_beta", "Cn_rudder", "CY_beta"):
        assert abs(filtered[name].estimate - flown[name].estimate) < 3.0 * flown[name].std_error, name
    assert filtered["sigma_gust_v"].estimate < 0.1


def test_on_the_flight_record_it_agrees_with_output_error() -> None:
    record = read(flight_data("totter_demo_data.mat"))
    filtered, flown = filter_error.identify(record), output_error.identify(record)
    for name in ("Cm_alpha", "Cm_q", "Cm_elevator"):
        assert filtered[name].identifiable, filtered[name].why
        assert filtered[name].estimate == pytest.approx(flown[name].estimate, rel=0.15), name


def test_gaps_are_flown_through() -> None:
    record = gusty(0.5, 5)
    r = record["r"].copy()
    r[400:460] = np.nan
    found = filter_error.identify(replace(record, channels={**record.channels, "r": r}))
    assert found["Cn_r"].identifiable
    assert abs(found["Cn_r"].estimate - LATERAL["Cn_r"]) < 4.0 * found["Cn_r"].std_error


@pytest.mark.parametrize("altitude", [2.0, 50.0, 304.8, 450.0, 700.0, 2200.0])
def test_scale_lengths_are_those_of_the_standard(altitude: float) -> None:
    assert scale_lengths(altitude) == pytest.approx(scales(altitude)[:2])


@pytest.mark.slow
def test_intervals_hold_the_truth_over_simulated_flights() -> None:
    """200 doublet sets of the development stream: calm by output error, in turbulence by filter error."""
    rows = study(["output_error", "frequency_domain"], [0.0], 200, DEVELOPMENT)
    rows += study(["filter_error"], [0.5, 1.0, 1.5], 200, DEVELOPMENT)
    lateral_rows = [row for row in rows if row.name[:2] in ("CY", "Cl", "Cn")]
    assert np.mean([row.coverage for row in rows if row.sigma_w == 0.0]) > 0.9
    assert np.mean([row.coverage for row in lateral_rows]) > 0.9
