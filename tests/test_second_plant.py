"""The compiled plant against second_plant.py, which was written from the documents alone."""

from __future__ import annotations

import numpy as np
import pytest
import second_plant
from numpy.typing import NDArray
from second_discrepancy import NAMES
from second_plant import STATES, SURFACES, Record

from icing_env.aircraft import broadcast, changed, load
from icing_env.crosstalk import CROSSTALK_PARAMETERS
from icing_env.linearise import rates
from icing_env.simulate import Fleet
from icing_env.trim import trim
from icing_env.types import COMMAND, CONTINUOUS, STATE

AIRCRAFT = ("twin_otter", "twin_otter_flight")
SIGNED = {"_cube": 3.0, "_side": 0.02, "_magnitude": 0.2, "_direction": 0.03, "_of_": 0.2, "_q": 0.3, "Cm_p": 0.3,
          "Cm_r": 0.3, "_aileron": 0.2, "Cn_alpha": 0.1, "_alpha_": 0.3, "alpha_q": 5.0,
          "_CT": 0.1, "CZ_alphadot": 5.0, "_betadot": 0.1, "_phi": 0.01, "_theta": 0.1, "beta2": 0.5, "rudder2": 0.5,
          "wind_": 15.0, "_shear": 0.02, "cg_shift_": 0.3, "CY_0": 0.02, "Cl_0": 0.02, "Cn_0": 0.02, "Cl_alpha": 0.1,
          "CY_p": 0.3, "Cm_CT": 0.1, "_offset": 0.05, "temperature_offset": 20.0, "hinge_aileron_alpha": 0.1, "k_": 0.5,
          "ground_altitude": 1000.0, "CD_parasite": 0.03, "wind_reference_altitude": 2000.0,
          "CX_elevator": 0.2, "_airspeed": 1e-3, "_airspeed2": 1e-5, "CZ_alpha2": 2.0, "Cm_alpha2": 2.0,
          "_alpha_elevator": 2.0, "Cm_elevator2": 2.0, "_alpha_beta": 0.3, "alpha3": 5.0, "elevator3": 5.0, "q3": 300.0,
          "beta3": 1.0, "_p3": 3.0, "_r3": 3.0, "aileron3": 0.5, "rudder3": 0.5, "_time": 1e-3,
          "_lapse": 1e-5, "CD_alpha2": 2.0}  # fmt: skip
GUSTS = {"gust_u": 8.0, "gust_v": 8.0, "gust_w": 8.0, "gust_w_tail": 8.0, "gust_p": 0.3, "gust_q": 0.3, "gust_r": 0.3}
# Sizes that errors of a flight are measured by: distance flown, 50 m/s, 1, 0.5 rad/s, travel of each surface, 200 kW.
SCALES = np.array([4e3] * 3 + [50.0] * 3 + [1.0] * 4 + [0.5] * 3 + [0.698, 0.58, 0.56, 0.654] + [2e5] * 2 + [0.2])


def columns(array: NDArray) -> Record:
    return Record(**{name: array[name] for name in array.dtype.names})


def altered(aircraft: str, n: int, rng: np.random.Generator) -> dict[str, NDArray]:
    """Every number that the rates may use, changed by a fifth; what is zero by a size of its own (last match)."""
    numbers = second_plant.parameters(aircraft=aircraft)
    used = [*second_plant.read("aircraft", aircraft), *NAMES, "CD_alpha2", "density_lapse",
            "ice_factor_floor", "temperature_offset",
            *(name for name in numbers if name.startswith(("wind_", "k_")))]  # fmt: skip
    values = {}
    for name in used:
        size = [size for part, size in SIGNED.items() if part in name]
        values[name] = numbers[name] * rng.uniform(0.8, 1.2, n)
        if numbers[name] == 0.0:
            values[name] = rng.uniform(-1, 1, n) * size[-1]
    for side in ("left", "right"):
        values[f"thrust_factor_{side}"] *= rng.random(n) < 0.8
    return values


def anywhere(rng: np.random.Generator, p: Record, V: NDArray, alpha: NDArray) -> tuple[NDArray, NDArray]:
    """STATE rows that meet the air at these speeds and angles, else anywhere, with gusts and ice; commands."""
    n = len(V)
    s, u = np.zeros(n, STATE), np.zeros(n, COMMAND)
    low = rng.random(n) < 0.2  # near the ground
    s["altitude"] = np.where(low, p.ground_altitude + rng.uniform(0, 40, n), rng.uniform(0, 14000, n))
    s["step"] = rng.integers(0, 10000, n)
    s["north"], s["east"] = rng.uniform(-1e5, 1e5, (2, n))
    attitude = rng.normal(size=(4, n))
    s["e0"], s["e1"], s["e2"], s["e3"] = attitude / np.linalg.norm(attitude, axis=0)
    for name, size in {**GUSTS, "p": 1.5, "q": 1.0, "r": 1.0, "alpha_downwash": 0.6}.items():
        s[name] = rng.uniform(-size, size, n)
    s["gust_w_tail"] = np.where(rng.random(n) < 0.3, s["gust_w"], s["gust_w_tail"])
    beta, C = np.radians(rng.uniform(-25, 25, n)), second_plant.direction_cosines(*(s[f"e{i}"] for i in range(4)))
    air = (np.cos(alpha) * np.cos(beta), np.sin(beta), np.sin(alpha) * np.cos(beta))
    wind = second_plant.wind_in_body_axes(columns(s), C, p)
    for name, share, blow in zip("uvw", air, wind, strict=True):
        s[name] = V * share + blow + s[f"gust_{name}"]
    for name, limit in {"elevator": 0.45, "aileron": 0.29, "rudder": 0.28}.items():
        s[name], u[name] = rng.uniform(-limit, limit, n), rng.uniform(-1.3 * limit, 1.3 * limit, n)
    s["flap"], u["flap"] = rng.uniform(0, 0.66, n), rng.uniform(-0.1, 0.8, n)
    for side in ("left", "right"):
        s[f"power_{side}"] = rng.uniform(0, 5e5, n) * (rng.random(n) < 0.8)  # else a failed engine
        u[f"throttle_{side}"] = rng.uniform(-0.1, 1.1, n)
    for surface in SURFACES:  # sides apart; now and then clean, or beyond the floor of the factors
        s[f"eta_{surface}"] = rng.uniform(0, 0.4, n) * rng.choice([0, 0.2, 1, 3], n)
        s[f"ice_mass_{surface}"] = rng.uniform(0, 60, n) * (s[f"eta_{surface}"] > 0)
    return s, u


def compiled_rates(s: NDArray, u: NDArray, p: NDArray) -> tuple[NDArray, NDArray]:
    """Rates (one column per state) and CURRENT rows of the compiled plant."""
    fleet = Fleet(p, len(s))
    fleet.state[:] = s
    fleet.start()  # fills `current`; it also draws gusts, so that the rates below use the given state again
    stage, out = np.zeros(2, CONTINUOUS), np.zeros((len(s), len(STATES)))
    rows = [a.view(np.recarray) for a in (s, fleet.current, p, u)]
    for i in range(len(s)):
        for name in STATES:
            stage[0][name] = s[i][name]
        rates(stage.view(np.recarray), *(a[i : i + 1] for a in rows))
        out[i] = stage[1].tolist()
    return out, fleet.current


def sizes(s: NDArray, p: Record) -> NDArray:
    """Natural size of each rate: that of the terms it is the sum of, however much these cancel."""
    x = columns(s)
    a = second_plant.air_data(x, second_plant.direction_cosines(x.e0, x.e1, x.e2, x.e3), x, p)
    speed, turn = np.sqrt(x.u**2 + x.v**2 + x.w**2 + 1e-6), np.sqrt(x.p**2 + x.q**2 + x.r**2 + 1e-6)
    force = a.qbar * p.wing_area + x.power_left / 50 + x.power_right / 50
    linear = 9.8 + speed * turn + 0.5 * force / p.mass
    swing = [0.1 * force * arm / inertia + turn**2 for arm, inertia in
             ((p.span, p.inertia_xx), (p.chord, p.inertia_yy), (p.span, p.inertia_zz))]  # fmt: skip
    engine = p.power_rated / p.spool_time
    return np.transpose([*[speed] * 3, *[linear] * 3, *[turn] * 4, *swing, p.elevator_rate, p.aileron_rate,
                         p.rudder_rate, p.flap_rate, engine, engine, 0.1 * a.Vf / p.tail_arm])  # fmt: skip


def worst(error: NDArray) -> dict[str, float]:
    return {name: float(value) for name, value in zip(STATES, error.max(axis=0), strict=True)}


def errors(aircraft: str, values: dict[str, NDArray], s: NDArray, u: NDArray) -> NDArray:
    """Differences of the rates over max(|rate|, size of its terms), one column per state; coefficients on the way."""
    p = Record(**(second_plant.parameters(aircraft=aircraft) | values))
    compiled, current = compiled_rates(s, u, changed(broadcast(load(aircraft), len(s)), **values))
    c = second_plant.iced_aircraft(columns(s), p)
    for name, value in vars(c).items():
        assert current[name] == pytest.approx(value, rel=1e-14, abs=1e-16), name
    plain = np.transpose(second_plant.rates(columns(s), columns(s), c, p, columns(u)))
    return np.abs(compiled - plain) / np.maximum(np.abs(plain), sizes(s, p))


# ---- numbers and rates


@pytest.mark.parametrize("aircraft", AIRCRAFT)
def test_files_are_read_alike(aircraft: str) -> None:
    row, numbers = load(aircraft), second_plant.parameters(aircraft=aircraft)
    assert set(row.dtype.names) - {name for name, _, _ in CROSSTALK_PARAMETERS} == set(numbers)
    assert {name: float(row[name][0]) for name in numbers} == numbers


@pytest.mark.parametrize("aircraft", AIRCRAFT)
def test_rates_and_iced_coefficients_are_those_of_the_documents(aircraft: str) -> None:
    rng, n = np.random.default_rng(20020213), 5000
    values = altered(aircraft, n, rng)
    p = Record(**(second_plant.parameters(aircraft=aircraft) | values))
    s, u = anywhere(rng, p, rng.uniform(5, 110, n), np.radians(rng.uniform(-30, 40, n)))
    error = errors(aircraft, values, s, u)
    assert error.max() < 1e-12, worst(error)


def test_rates_agree_backwards_at_rest_and_below_the_ground() -> None:
    rng, n = np.random.default_rng(5), 1000
    values = altered("twin_otter", n, rng)
    p = Record(**(second_plant.parameters() | values))
    s, u = anywhere(rng, p, 10 ** rng.uniform(-1.5, 2, n), rng.uniform(-3.1, 3.1, n))
    s["altitude"] -= np.where(rng.random(n) < 0.2, 2 * s["altitude"], 0)
    error = errors("twin_otter", values, s, u)
    assert error.max() < 1e-12, worst(error)
    still = {name: np.zeros(n) for name in values if name.startswith("wind_")}
    for name in ("u", "v", "w", *GUSTS):
        s[name] = 0.0
    error = errors("twin_otter", values | still, s, u)
    assert error.max() < 1e-12, worst(error)


def test_comparison_notices_every_number() -> None:
    """A change of 1e-4 in any one number is far above the tolerance in some state, but in those that act on no rate."""
    rng, n = np.random.default_rng(6), 2000
    values = altered("twin_otter", n, rng)
    p = Record(**(second_plant.parameters() | values))
    s, u = anywhere(rng, p, rng.uniform(5, 110, n), np.radians(rng.uniform(-30, 40, n)))
    x, unit = columns(s), sizes(s, p)

    def plain(now: Record) -> NDArray:
        return np.transpose(second_plant.rates(x, x, second_plant.iced_aircraft(x, now), now, columns(u)))

    before, silent = plain(p), set()
    for name, value in values.items():
        after = plain(Record(**(vars(p) | {name: value * 1.0001})))
        if np.max(np.abs(after - before) / unit) < 1e-8:
            silent.add(name)
    assert silent == {"propeller_rpm", "hinge_aileron_alpha"}  # an instrument's number; docs/model.md section 12


# ---- flights


def flown(row: NDArray, eta: dict[str, float], substeps: int) -> tuple[Fleet, NDArray]:
    """One aircraft in its clean trim at 65 m/s and 2200 m, its ice just given to it; and the trim's command."""
    start = trim(row, airspeed=65.0, altitude=2200.0)
    fleet = Fleet(row, 1, dt=0.02, substeps=substeps)
    fleet.state[:], fleet.command[:], fleet.state["seed"] = start.state[0], start.command[0], 7
    for surface, value in eta.items():
        fleet.state[f"eta_{surface}"] = value
    fleet.start()
    return fleet, fleet.command.copy()


def manoeuvre(t: float, u: NDArray, trimmed: NDArray, fail: float, pull: float) -> None:
    """From the trim: doublets up to the rate limits, throttle steps, flap out and in; a failing engine, a pull."""

    def on(begin: float, end: float) -> float:
        return float(begin <= t < end)

    u[:] = trimmed
    u["elevator"] += 0.06 * (on(5, 6) - on(6, 7) + on(35, 36) - on(36, 37)) - pull * on(40, 46)
    u["aileron"] += 0.05 * (on(10, 11) - on(11, 12) + on(50, 51) - on(51, 52))
    u["rudder"] += 0.05 * (on(15, 16) - on(16, 17))
    u["throttle_left"] += 0.2 * on(20, 25) - fail * on(30, 61)
    u["throttle_right"] += 0.2 * on(20, 24)
    u["flap"] += 0.15 * on(28, 45)


def held(record: NDArray) -> Record:
    return Record(**{name: float(record[name][0]) for name in record.dtype.names})


def states(fleet: Fleet) -> NDArray:
    return np.array([fleet.state[name][0] for name in STATES])


FLIGHTS = {  # aircraft, changed numbers, power lost on the left, elevator pulled
    "iced": ("twin_otter", {"turbulence_sigma_w": 1.5, "wind_north": 8.0, "wind_north_shear": 0.004, "cg_shift_x": 0.05,
                            "cg_shift_y": 0.03}, 0.0, 0.0),
    "one engine": ("twin_otter_flight", {"turbulence_sigma_w": 2.0, "turbulence_tail_delay": 0.0, "wind_east": 10.0,
                                         "turbulence_rotation": 1.0, "wind_down": -1.0}, 0.4, 0.0),
    "stall": ("twin_otter", {"turbulence_sigma_w": 1.0}, 0.0, 0.25),
}  # fmt: skip
SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("one engine", "stall")]


@pytest.mark.parametrize("flight", ["iced", *SLOW])
def test_flights_are_those_of_the_documents(flight: str) -> None:
    """60 s through the same gusts, held commands and ice: Runge-Kutta at 100 Hz and 1 kHz against DOP853 at 1e-11.

    Most of the difference arises in the one step within which a control leaves its rate limit. The stall, with rolls at
    2 rad/s and ailerons torn to that limit, is allowed three times as much.
    """
    aircraft, changes, fail, pull = FLIGHTS[flight]
    row, eta = changed(load(aircraft), **changes), {"left_wing": 0.06, "right_wing": 0.03, "htail": 0.05, "other": 0.04}
    p = Record(**(second_plant.parameters(aircraft=aircraft) | changes))
    (coarse, trimmed), (fine, _) = flown(row, eta, 2), flown(row, eta, 20)
    x, error = states(coarse), np.zeros((2, len(STATES)))
    for step in range(3000):
        for fleet in (coarse, fine):
            manoeuvre(step * fleet.dt, fleet.command, trimmed, fail, pull)
        fine.outcome["airspeed"] = coarse.outcome["airspeed"]  # gusts are drawn with it: the same for both
        before = held(coarse.state)
        coarse.step()
        fine.step()
        assert all(coarse.state[name] == fine.state[name] for name in GUSTS)
        s = held(coarse.state)
        c = Record(**{name: float(value) for name, value in vars(second_plant.iced_aircraft(s, p)).items()})
        x = second_plant.fly(x, coarse.dt, before, s, c, p, held(coarse.command))
        error = np.maximum(error, [np.abs(states(fleet) - x) / SCALES for fleet in (coarse, fine)])
    allowed = 3.0 if flight == "stall" else 1.0
    assert error[0].max() < 1e-4 * allowed, worst(error[:1])
    assert error[1].max() < 1e-6 * allowed, worst(error[1:])
