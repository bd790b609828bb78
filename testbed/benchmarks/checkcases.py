"""NASA's atmospheric check cases, flown through the compiled plant.

NASA/TM-2015-218675 (Murri, Jackson, Shelton: "Check-cases for verification of 6-degree-of-freedom flight vehicle
simulations", 2015) lets simulations of simple bodies be compared, figure by figure, before anyone trusts them with an
aircraft. Each case below states what it verifies and how near a flat Earth can come: the plant has no rotating round
Earth, so a case is judged on the quantities that its Earth leaves alone. `gravity` below gives the plant the gravity
of that Earth at the equator; what is missing then is the eastward Coriolis drift and the turn of the local horizon.

Left out, because they need a rotating round Earth or another aircraft: 09 and 10 (shots at 300 m/s, metres of Coriolis
drift), 11 to 16 (an F-16 whose trim and track carry the centripetal relief of flying around the Earth).

Run `python -m testbed.benchmarks.checkcases FOLDER`; the folder holds NASA's trajectories, `Atmos_NN_sim_MM.csv`.
"""

from __future__ import annotations

import csv
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from icing_env.aircraft import load
from icing_env.errors import InputError
from icing_env.parameters import GROUPS
from icing_env.simulate import Fleet

FOOT, SLUG = 0.3048, 14.593902937
SLUG_FT2 = SLUG*FOOT**2
GM, EARTH_RATE = 3.986004418e14, 7.292115e-5  # m3/s2, rad/s
START, DURATION, SAMPLE = 30000.0*FOOT, 30.0, 0.1  # m, s, s: all cases
FAR = 1e3  # angles of attack [rad] that are never reached, and a tail [m] so far back that its downwash stays away


@dataclass(frozen=True)
class Earth:
    """Equatorial radius [m], oblateness coefficient J2, rate of rotation [rad/s]."""

    radius: float
    j2: float
    rate: float


WGS84 = Earth(6378137.0, 1.08262982e-3, EARTH_RATE)
TURNING_SPHERE = Earth(20902255.199*FOOT, 0.0, EARTH_RATE)
RESTING_SPHERE = Earth(20902255.199*FOOT, 0.0, 0.0)


@dataclass(frozen=True)
class Body:
    """A sphere or a brick: mass [kg], inertias [kg m2], reference lengths [m, m2], drag and damping coefficients."""

    mass: float
    inertia: tuple[float, float, float]
    area: float = 1.0
    span: float = 1.0
    chord: float = 1.0
    drag: float = 0.0
    damping: float = 0.0


BRICK = Body(0.155404754*SLUG, (0.00189422*SLUG_FT2, 0.006211019*SLUG_FT2, 0.007194665*SLUG_FT2),
             0.22222*FOOT**2, 0.33333*FOOT, 0.66667*FOOT)
DAMPED_BRICK = Body(BRICK.mass, BRICK.inertia, BRICK.area, BRICK.span, BRICK.chord, damping=-1.0)
HEAVY_SPHERE = Body(SLUG, (3.6*SLUG_FT2,)*3)
DRAGGED_SPHERE = Body(SLUG, (3.6*SLUG_FT2,)*3, 0.1963495*FOOT**2, drag=0.1)
TUMBLING = (10.0, 20.0, 30.0)  # deg/s


@dataclass(frozen=True)
class Case:
    """One check case.

    Attributes:
        verifies, earth, atmosphere, vehicle, notes: for people.
        body, rates: what falls, and its first rotation [deg/s]; dropped at rest from 30,000 ft, level, heading north.
        wind: eastward wind at the ground [m/s] and its growth with altitude [1/s].
        planet: what it falls to, at the equator.
        tolerance: largest difference allowed, by quantity; quantities without one are told, not judged.
    """

    verifies: str
    earth: str
    atmosphere: str
    vehicle: str
    notes: str
    body: Body
    rates: tuple[float, float, float] = (0.0, 0.0, 0.0)
    wind: tuple[float, float] = (0.0, 0.0)
    planet: Earth = WGS84
    tolerance: dict[str, float] = field(default_factory=dict)


ROUND = "WGS-84 with J2, rotating; flat here, gravity of the equator less centrifugal"
VERTICAL = {"altitude": 0.01, "velocity_down": 1.2e-3, "rates": 1e-6}
CASES: dict[str, Case] = {
    "01": Case(
        "gravitation, translational equations", ROUND, "none felt", "sphere of one slug, no drag",
        "the vertical channel; 0.64 m/s of eastward drift is the Earth's rotation",
        HEAVY_SPHERE, tolerance=VERTICAL),
    "02": Case(
        "rotational equations, coupling of inertias", ROUND, "none felt", "brick, three unequal inertias, no damping",
        "body rates know nothing of the Earth; attitude differs by up to 0.13 deg of Earth rotation",
        BRICK, TUMBLING, tolerance=VERTICAL | {"attitude": 0.15}),
    "03": Case(
        "rotary damping", ROUND, "US 1976, still", "the brick, Cl_p = Cm_q = Cn_r = -1",
        "rates; the drift east adds a little to airspeed, and NASA's own tools spread by 0.004 deg/s and 0.1 deg",
        DAMPED_BRICK, TUMBLING, tolerance=VERTICAL | {"rates": 7e-3, "attitude": 0.2}),
    "04": Case(
        "drag, density, quaternion, integration", "resting sphere, 1/r^2", "US 1976, still",
        "sphere with drag, turning", "complete: a flat Earth with g(h) is this Earth",
        DRAGGED_SPHERE, TUMBLING, planet=RESTING_SPHERE,
        tolerance={"altitude": 1e-3, "velocity_north": 1e-4, "velocity_east": 1e-4, "velocity_down": 1e-4,
                   "attitude": 1e-4, "rates": 1e-9}),
    "05": Case(
        "Earth rotation", "rotating sphere, 1/r^2; flat here, gravity less centrifugal", "US 1976, still",
        "sphere with drag, turning", "the vertical channel and the rates",
        DRAGGED_SPHERE, TUMBLING, planet=TURNING_SPHERE, tolerance=VERTICAL | {"attitude": 0.2}),
    "06": Case(
        "drag over an ellipsoidal Earth", ROUND, "US 1976, still", "sphere with drag", "the vertical channel",
        DRAGGED_SPHERE, tolerance=VERTICAL),
    "07": Case(
        "entry of a steady wind", ROUND, "US 1976, 20 ft/s from the west", "sphere with drag",
        "the vertical channel; blown east as well as drifting", DRAGGED_SPHERE, wind=(20.0*FOOT, 0.0),
        tolerance=VERTICAL),
    "08": Case(
        "entry of a wind shear", ROUND, "US 1976, east wind from -20 ft/s at 0 to 70 ft/s at 30,000 ft",
        "sphere with drag", "the vertical channel", DRAGGED_SPHERE, wind=(-20.0*FOOT, 90.0/30000.0),
        tolerance=VERTICAL | {"altitude": 0.015, "velocity_down": 2e-3}),
}  # fmt: skip


def gravity(earth: Earth) -> tuple[float, float]:
    """Sea-level gravity [m/s2] and radius [m] that give g0 (R/(R + h))^2 the gravity at the equator of an Earth.

    Gravitation with J2 less the centrifugal acceleration, exact at 0 and at 30,000 ft.
    """

    def at(h: float) -> float:
        r = earth.radius + h
        return GM/r**2*(1.0 + 1.5*earth.j2*(earth.radius/r)**2) - earth.rate**2*r

    ratio = float(np.sqrt(at(START)/at(0.0)))
    return at(0.0), START*ratio/(1.0 - ratio)


def aircraft_of(case: Case) -> NDArray:
    """PARAMETERS of one row: the case's body, with every aerodynamic and propulsive term it does not have at zero."""
    p = load(instruments="perfect")
    for name, _, _ in GROUPS["aerodynamics"]:
        p[name] = 0.0
    p["alpha_stall"] = p["alpha_stall_negative"] = p["alpha_tail_stall"] = FAR
    p["stall_width"] = p["tail_stall_width"] = p["tail_arm"] = FAR
    p["power_rated"], p["inertia_xz"] = 0.0, 0.0
    body = case.body
    p["mass"], (p["inertia_xx"], p["inertia_yy"], p["inertia_zz"]) = body.mass, body.inertia
    p["wing_area"], p["span"], p["chord"], p["CD_parasite"] = body.area, body.span, body.chord, body.drag
    p["Cl_p"] = p["Cm_q"] = p["Cn_r"] = body.damping
    p["gravity_sea_level"], p["earth_radius"] = gravity(case.planet)
    p["wind_east"], p["wind_east_shear"] = case.wind
    return p


@dataclass(frozen=True)
class Trajectory:
    """A fall, sampled: n instants.

    Attributes:
        time: s, n.
        altitude: m, n.
        velocity: north, east, down over the ground, m/s, n x 3.
        attitude: roll, pitch, yaw, deg, n x 3.
        rates: of the body, inertial, deg/s, n x 3.
    """

    time: NDArray
    altitude: NDArray
    velocity: NDArray
    attitude: NDArray
    rates: NDArray


def fly(case: Case, dt: float = 0.02, substeps: int = 2) -> Trajectory:
    """The case through the compiled plant, at 100 Hz unless told otherwise, sampled every 0.1 s."""
    fleet = Fleet(aircraft_of(case), 1, dt, substeps)
    state = fleet.state
    state["altitude"], state["e0"] = START, 1.0
    for name, rate in zip("pqr", case.rates, strict=True):
        state[name] = np.radians(rate)
    fleet.start()
    every = round(SAMPLE/dt)
    samples = [state.copy()]
    for _ in range(round(DURATION/SAMPLE)):
        for _ in range(every):
            fleet.step()
        samples.append(state.copy())
    s = np.concatenate(samples)
    turn = Rotation.from_quat(np.stack([s["e1"], s["e2"], s["e3"], s["e0"]], axis=1))
    return Trajectory(
        np.arange(len(s))*SAMPLE, s["altitude"], turn.apply(np.stack([s["u"], s["v"], s["w"]], axis=1)),
        turn.as_euler("ZYX", degrees=True)[:, ::-1], np.degrees(np.stack([s["p"], s["q"], s["r"]], axis=1)))


def read(path: Path) -> Trajectory:
    """One of NASA's trajectories, US units, as SI at the 0.1 s grid.

    Raises:
        InputError: a column is missing.
    """
    with path.open(newline="", encoding="utf-8") as file:
        rows = csv.reader(file)
        header = next(rows)
        table = np.array([[float(cell) for cell in row] for row in rows if row])

    def columns(stem: str, ends: str) -> NDArray:
        missing = [f"{stem}{end}" for end in ends.split(",") if f"{stem}{end}" not in header]
        if missing:
            raise InputError(f"{path}: no column {', '.join(missing)}: expected a trajectory of the NASA check cases")
        return np.stack([table[:, header.index(f"{stem}{end}")] for end in ends.split(",")], axis=1)

    time = columns("time", "")[:, 0]
    grid = np.searchsorted(time, np.arange(round(DURATION/SAMPLE) + 1)*SAMPLE - 1e-6)
    table, time = table[grid], time[grid]
    return Trajectory(
        time, FOOT*columns("altitudeMsl_ft", "")[:, 0], FOOT*columns("feVelocity_ft_s_", "X,Y,Z"),
        columns("eulerAngle_deg_", "Roll,Pitch,Yaw"), columns("bodyAngularRateWrtEi_deg_s_", "Roll,Pitch,Yaw"))


def differences(a: Trajectory, b: Trajectory) -> dict[str, float]:
    """Largest difference over the flight, by quantity; angles around the shorter way."""
    velocity = np.abs(a.velocity - b.velocity).max(axis=0)
    attitude = np.abs((a.attitude - b.attitude + 180.0) % 360.0 - 180.0).max()
    return {
        "altitude": float(np.abs(a.altitude - b.altitude).max()), "velocity_north": float(velocity[0]),
        "velocity_east": float(velocity[1]), "velocity_down": float(velocity[2]),
        "attitude": float(attitude), "rates": float(np.abs(a.rates - b.rates).max())}


def find(number: str, folder: Path) -> Path | None:
    """NASA's trajectory of a case within a folder or its subfolder `nesc`: SIM 04 if there, else the first."""
    found = sorted([*folder.glob(f"Atmos_{number}_sim_*.csv"), *(folder/"nesc").glob(f"Atmos_{number}_sim_*.csv")])
    return next((path for path in found if path.stem.endswith("04")), found[0] if found else None)


def run(number: str, folder: Path) -> dict[str, float]:
    """Fly one case and compare it with NASA's trajectory.

    Raises:
        InputError: the case is not flown, or its trajectory is not in the folder.
    """
    if number not in CASES:
        raise InputError(f"no check case '{number}': flown are {', '.join(CASES)}")
    path = find(number, folder)
    if path is None:
        raise InputError(f"{folder}: no Atmos_{number}_sim_*.csv: give the folder of NASA's trajectories")
    return differences(fly(CASES[number]), read(path))


def main(folder: Path) -> int:
    """Print every case beside its tolerances; 1 if one is missed."""
    missed = 0
    for number, case in CASES.items():
        path = find(number, folder)
        if path is None:
            print(f"{number}  {case.verifies}: no trajectory in {folder}")
            continue
        print(f"{number}  {case.verifies}  ({case.vehicle}; {path.name})")
        for name, value in run(number, folder).items():
            limit = case.tolerance.get(name)
            verdict = "not judged" if limit is None else f"{'within' if value <= limit else 'BEYOND'} {limit:g}"
            missed += limit is not None and value > limit
            print(f"    {name:15s} {value:10.3g}  {verdict}")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
