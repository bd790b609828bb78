"""Flow angles, airspeed, side force and control surfaces that the motion contradicts: named, and the record refused.

In a sound record alpha and beta change as rates and accelerations make them (Klein & Morelli, Aircraft System
Identification, AIAA 2006, section 3.3), lift grows with alpha, the side force opposes beta, and a surface turns the
aircraft the way of the record's signs. Thresholds are assumed; gusts and noise leave sound records untouched.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from estimators.signals.consistency import factors, line, nearest_unit
from estimators.signals.differentiate import half_width, slope, smooth
from estimators.signals.resample import Grid
from icing_env.atmosphere import G0
from icing_env.errors import InputError
from icing_env.record import FloatArray

REACH = 0.3  # s either side over which flow angles are differentiated: the motion is slower, gusts and noise are not
LIVELY = 0.2  # m/s2: rms of V alpha' or V beta' below which the flow angles say nothing
EXPLAINED = 0.3  # R2
SPEEDS = {"knots": 1.9438, "ft/s": 3.2808, "mph": 2.2369, "km/h": 3.6}
DEGREES = 180.0 / np.pi
CONTROLS = {"elevator": ("q", ("alpha", "q")), "aileron": ("p", ("beta", "p", "r", "rudder")),
            "rudder": ("r", ("beta", "p", "r", "aileron"))}  # fmt: skip
MOVED, FELT = np.radians(0.3), 0.6  # rms of a surface, and R2 of the response, from which its sign is judged


def check_flow(where: str, grid: Grid, v: Mapping[str, FloatArray]) -> None:
    """Refuse what contradicts the flow.

    Args:
        where: begins the message.
        grid: all channels.
        v: phi, theta, p, q, r, zero where they were not recorded.

    Raises:
        InputError: names the channel and what it looks like.
    """
    _check_ground_speed(where, grid)
    _check_lift(where, grid)
    _check_alpha(where, grid, v)
    _check_beta(where, grid, v)
    _check_controls(where, grid)


def _check_lift(where: str, grid: Grid) -> None:
    """Lift grows with alpha, by 10 to 20 times itself per radian below the stall."""
    values = grid.values
    if not all(name in values for name in ("alpha", "az", "airspeed")) or np.max(values["alpha"]) >= 0.2:
        return
    lift, good = values["az"] / values["airspeed"] ** 2, grid.good(("alpha", "az", "airspeed"))
    gain, match = line(values["alpha"][good], lift[good] / np.mean(lift[good]))
    if match < -0.7:
        raise InputError(f"{where}: column 'alpha' has its sign reversed: lift falls as alpha rises")
    if match > 0.7 and gain < 1.5 and np.std(values["alpha"]) > 0.01:
        raise InputError(f"{where}: column 'alpha' looks like degrees: lift grows by {gain:.2g} of itself per unit")


def _check_alpha(where: str, grid: Grid, v: Mapping[str, FloatArray]) -> None:
    """V alpha' = q V + (az + g cos(theta) cos(phi)): airspeed's unit, alpha's sign."""
    names = ("airspeed", "alpha", "q", "theta", "az")
    if not all(name in grid.values for name in names):
        return
    speed, half = grid.values["airspeed"], round(REACH / grid.dt)
    force = grid.values["az"] + G0 * np.cos(v["theta"]) * np.cos(v["phi"])
    change = smooth(speed, half) * slope(grid.values["alpha"], grid.dt, half)
    found = factors(change, [smooth(v["q"] * speed, half), smooth(force, half)], grid.good(names), LIVELY, EXPLAINED)
    if found is None:
        return
    (turn, clear_turn), (push, clear_push) = found
    if turn < 0.0 and push < 0.0 and (clear_turn or clear_push):
        raise InputError(f"{where}: column 'alpha' has its sign reversed: it falls where q and az make it rise")
    unit = nearest_unit(push, SPEEDS)
    if unit and clear_push and abs(turn - 1.0) < 0.3:
        raise InputError(f"{where}: column 'airspeed' looks like {unit}: az turns the flow {push:.2f} times too little")


def _check_beta(where: str, grid: Grid, v: Mapping[str, FloatArray]) -> None:
    """V beta' = p alpha V - r V + ay + g cos(theta) sin(phi), and a side force against beta: signs of beta, r and ay.

    The factor of ay is not judged: gusts from the side make it with beta, and bend it.
    """
    names = ("airspeed", "beta", "r", "p", "ay", "phi")
    if not all(name in grid.values for name in names):
        return
    good, speed, half = grid.good(names), grid.values["airspeed"], round(REACH / grid.dt)
    roll = smooth(v["p"] * grid.values.get("alpha", np.zeros(len(speed))) * speed, half)
    gravity = smooth(G0 * np.cos(v["theta"]) * np.sin(v["phi"]), half)
    change = smooth(speed, half) * slope(grid.values["beta"], grid.dt, half) - roll
    terms = [smooth(-v["r"] * speed, half), smooth(grid.values["ay"], half), gravity]
    found = factors(change, terms, good, LIVELY, EXPLAINED)
    turn, clear = found[0] if found is not None else (1.0, False)
    force, match = line(grid.values["beta"][good], grid.values["ay"][good] / speed[good] ** 2)
    if clear and turn < -0.5:
        name = "beta" if match > 0.0 else "r"
        raise InputError(f"{where}: column '{name}' has its sign reversed: beta changes at {turn:.2f} of r")
    if clear and nearest_unit(turn, {"deg/s": 1.0 / DEGREES}):
        raise InputError(f"{where}: column 'r' looks like degrees per second: beta changes at {turn:.3f} of it")
    if match > 0.7:
        name = "'ay'" if clear or (found is not None and abs(turn - 1.0) < 0.3) else "'ay' (or 'beta')"
        raise InputError(f"{where}: column {name} has its sign reversed: the side force goes with beta, not against it")
    _check_ay_unit(where, grid, force, match)


def _check_ay_unit(where: str, grid: Grid, force: float, match: float) -> None:
    """The side force per beta is 5 to 50 % of the lift per alpha on an aircraft with a fin; in g it is a tenth of that.

    Args:
        where: the record.
        grid: its channels.
        force: ay / V^2 per beta, with its correlation `match`.
        match: as above.
    """
    if match > -0.7 or not all(name in grid.values for name in ("alpha", "az")):
        return
    good = grid.good(("alpha", "az", "airspeed"))
    lift, known = line(grid.values["alpha"][good], grid.values["az"][good] / grid.values["airspeed"][good] ** 2)
    if known < -0.7 and force / lift < 0.03:
        raise InputError(f"{where}: column 'ay' looks like g: {force / lift:.3f} of the lift's change with its angle")


def _check_ground_speed(where: str, grid: Grid) -> None:
    """Airspeed and ground speed differ by the wind, not by a ratio of units."""
    if not all(name in grid.values for name in ("airspeed", "ground_speed")):
        return
    ratio = float(np.median(grid.values["airspeed"]) / max(float(np.median(grid.values["ground_speed"])), 1.0))
    unit = nearest_unit(ratio, SPEEDS)
    if unit:
        raise InputError(f"{where}: column 'airspeed' looks like {unit}: it is {ratio:.2f} times the ground speed")


def _check_controls(where: str, grid: Grid) -> None:
    """A positive elevator pitches down, a positive aileron rolls left, a positive rudder yaws left."""
    half = half_width(grid.dt)
    for surface, (rate, others) in CONTROLS.items():
        names = [n for n in (surface, *others) if n in grid.values]
        if surface not in names or rate not in names:
            continue
        good = grid.good(names)
        if np.std(grid.values[surface][good]) < MOVED:
            continue
        found = factors(
            slope(grid.values[rate], grid.dt, half), [smooth(grid.values[n], half) for n in names], good, 0.01, FELT
        )
        if found is not None and found[0][0] > 0.0 and found[0][1]:
            raise InputError(f"{where}: column '{surface}' has its sign reversed: a positive one raises {rate}")
