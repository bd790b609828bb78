"""Flow angles, airspeed, side force and control surfaces that the motion contradicts: named, and the record refused.

In a sound record alpha and beta change as rates and accelerations make them (Klein & Morelli, Aircraft System
Identification, AIAA 2006, section 3.3), lift grows with alpha, the side force opposes beta, and a surface turns the
aircraft the way of the record's signs. Thresholds are assumed; gusts and noise leave sound records untouched.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d

from estimators.signals.consistency import factors, line, nearest_unit
from estimators.signals.differentiate import half_width, slope, smooth
from estimators.signals.magnitudes import SPEEDS
from estimators.signals.resample import Grid
from icing_env.atmosphere import G0
from icing_env.errors import InputError
from icing_env.record import FloatArray

REACH = 0.3  # s either side over which flow angles are differentiated: the motion is slower, gusts and noise are not
LIVELY = 0.2  # m/s2: rms of V alpha' or V beta' below which the flow angles say nothing
EXPLAINED, CALM = 0.3, 0.93  # R2 from which the motion makes the flow's change, and from which nothing else does
SIDE = 0.35  # of a unit's ratio: beyond it an attitude that errs explains the factor of ay as well
IN_DEGREES = 0.4  # growth of lift by itself per unit of alpha
FEET = 0.4  # side force per beta over lift per alpha: 0.07 (light aircraft) to 0.34 (fighters), 0.14 to 0.2 here
IN_G, WEAK = 0.022, 0.03  # the same in g (0.014 to 0.02 here), and what a force that lost four fifths may still be
FEEBLE = 0.25  # rad/s2 per rad of a surface: 4 to 16 on these aircraft
DEGREES = 180.0 / np.pi
CONTROLS = {"elevator": ("q", ("alpha", "q")), "aileron": ("p", ("beta", "p", "r", "rudder")),
            "rudder": ("r", ("beta", "p", "r", "aileron"))}  # fmt: skip
MOVED, FELT = np.radians(0.3), 0.6  # rms of a surface, and R2 of the response, from which its sign is judged


def check_flow(where: str, grid: Grid, v: Mapping[str, FloatArray]) -> set[str]:
    """The channels whose sign and unit the flow confirms.

    Args:
        where: begins the message.
        grid: all channels.
        v: phi, theta, p, q, r, zero where they were not recorded.

    Raises:
        InputError: names the channel that contradicts the flow, and what it looks like.
    """
    return _check_lift(where, grid) | _check_alpha(where, grid, v) | _check_beta(where, grid, v) | \
        _check_controls(where, grid)  # fmt: skip


def _check_lift(where: str, grid: Grid) -> set[str]:
    """Lift grows with alpha, by 10 to 20 times itself per radian below the stall and by 1 in it; in degrees by 0.1."""
    values = grid.values
    if not all(name in values for name in ("alpha", "az", "airspeed")):
        return set()
    lift, good = values["az"] / values["airspeed"] ** 2, grid.good(("alpha", "az", "airspeed"))
    gain, match = line(values["alpha"][good], lift[good] / np.mean(lift[good]))
    low = np.max(values["alpha"][good]) < 0.2
    if match < -0.7 and (low or abs(gain) < IN_DEGREES):
        raise InputError(f"{where}: column 'alpha' has its sign reversed: lift falls as alpha rises")
    if match > 0.7 and gain < (1.5 if low else IN_DEGREES) and np.std(values["alpha"][good]) > 0.01:
        raise InputError(f"{where}: column 'alpha' looks like degrees: lift grows by {gain:.2g} of itself per unit")
    return {"alpha"} if match > 0.7 and np.std(values["alpha"][good]) > 0.003 else set()


def _check_alpha(where: str, grid: Grid, v: Mapping[str, FloatArray]) -> set[str]:
    """V alpha' = q V + (az + g cos(theta) cos(phi)): airspeed's unit, alpha's sign and unit."""
    names = ("airspeed", "alpha", "q", "theta", "az")
    if not all(name in grid.values for name in names):
        return set()
    speed, half = grid.values["airspeed"], round(REACH / grid.dt)
    force = grid.values["az"] + G0 * np.cos(v["theta"]) * np.cos(v["phi"])
    change = smooth(speed, half) * slope(grid.values["alpha"], grid.dt, half)
    terms, good = [smooth(v["q"] * speed, half), smooth(force, half)], _whole(grid.good(names), half)
    found = factors(change, terms, good, LIVELY, EXPLAINED)
    if found is None:
        return set()
    (turn, clear_turn), (push, clear_push) = found
    if turn < 0.0 and push < 0.0 and (clear_turn or clear_push):
        raise InputError(f"{where}: column 'alpha' has its sign reversed: it falls where q and az make it rise")
    if min(turn, push) > 0.3 * DEGREES:
        raise InputError(f"{where}: column 'alpha' looks like degrees: it changes at {turn:.3g} of q")
    calm = factors(change, terms, good, LIVELY, CALM) is not None
    unit = _speed_unit(push, calm)
    if unit and clear_push and abs(turn - 1.0) < 0.3:
        raise InputError(f"{where}: column 'airspeed' looks like {unit}: az turns the flow {push:.2f} times too little")
    return {"airspeed", "alpha"} if calm and abs(turn - 1.0) < 0.3 else set()


def _whole(good: NDArray[np.bool_], half: int) -> NDArray[np.bool_]:
    """Rows with nothing missing up to `half` samples either side, shape (N,)."""
    return np.asarray(minimum_filter1d(good, 2 * half + 1), dtype=np.bool_)


def _speed_unit(factor: float, calm: bool) -> str:
    """The unit of airspeed that a factor betrays; in calm air, where gusts do not bend it, the nearest in ratio."""
    if not calm:
        return nearest_unit(factor, SPEEDS)
    if factor <= 0.0:
        return ""
    return min({"": 1.0, **SPEEDS}.items(), key=lambda one: abs(np.log(factor / one[1])))[0]


def _check_beta(where: str, grid: Grid, v: Mapping[str, FloatArray]) -> set[str]:
    """V beta' = p alpha V - r V + ay + g cos(theta) sin(phi), and a side force against beta: beta, r, ay, airspeed.

    The factor of ay is judged in calm air only: gusts from the side make it with beta, and bend it. A vane that is late
    lacks a part of beta's second derivative, fitted too, which goes as ay does: 20 ms would make its factor 0.7.
    """
    names = ("airspeed", "beta", "r", "p", "ay", "phi")
    if not all(name in grid.values for name in names):
        return set()
    good, speed, half = grid.good(names), grid.values["airspeed"], round(REACH / grid.dt)
    roll = smooth(v["p"] * grid.values.get("alpha", np.zeros(len(speed))) * speed, half)
    gravity = smooth(G0 * np.cos(v["theta"]) * np.sin(v["phi"]), half)
    change = smooth(speed, half) * slope(grid.values["beta"], grid.dt, half) - roll
    terms = [smooth(-v["r"] * speed, half), smooth(grid.values["ay"], half), gravity]
    whole, later = _whole(good, half), slope(change, grid.dt, half)
    found = factors(change, terms, whole, LIVELY, EXPLAINED, later)
    (turn, clear), (side, clear_side), (bank, clear_bank) = found or [(1.0, False)] * 3
    calm = factors(change, terms, whole, LIVELY, CALM, later) is not None
    force, match = line(grid.values["beta"][good], grid.values["ay"][good] / speed[good] ** 2)
    if clear and min(turn, bank) > 0.3 * DEGREES:
        raise InputError(f"{where}: column 'beta' looks like degrees: it changes at {turn:.3g} of r")
    if clear and turn < -0.5:
        name = "beta" if match > 0.0 else "r"
        raise InputError(f"{where}: column '{name}' has its sign reversed: beta changes at {turn:.2f} of r")
    if clear and nearest_unit(turn, {"deg/s": 1.0 / DEGREES}):
        raise InputError(f"{where}: column 'r' looks like degrees per second: beta changes at {turn:.3f} of it")
    if match > 0.7:
        name = "'ay'" if clear or (found is not None and abs(turn - 1.0) < 0.3) else "'ay' (or 'beta')"
        raise InputError(f"{where}: column {name} has its sign reversed: the side force goes with beta, not against it")
    share = _side_share(grid, force, match)
    if not calm or abs(turn - 1.0) >= 0.3:
        return _check_ay_unit(where, share)
    _check_calm_side(where, side if clear_side else 1.0, bank if clear_bank else 1.0)
    if clear_side or abs(side - 1.0) < 0.5:
        return {"beta", "r", "airspeed", "ay"}
    return {"beta", "r"} | _check_ay_unit(where, share)


def _check_calm_side(where: str, side: float, bank: float) -> None:
    """Units that the factors of ay and of gravity betray in calm air: both of airspeed, one of ay."""
    unit = _speed_unit(bank, True)
    if unit and side > 1.2:
        raise InputError(f"{where}: column 'airspeed' looks like {unit}: bank turns the flow {bank:.2f} times "
                         "too little")  # fmt: skip
    unit = nearest_unit(side, {"g": G0, "ft/s2": 0.3048}, SIDE)
    if unit and 0.7 < bank < 1.4:
        raise InputError(f"{where}: column 'ay' looks like {unit}: beta changes at {side:.2g} of it")


def _side_share(grid: Grid, force: float, match: float) -> float | None:
    """Side force per beta over lift per alpha; None where either does not show.

    Args:
        grid: the record's channels.
        force: ay / V^2 per beta, with its correlation `match`.
        match: as above.
    """
    if match > -0.7 or not all(name in grid.values for name in ("alpha", "az")):
        return None
    good = grid.good(("alpha", "az", "airspeed"))
    lift, known = line(grid.values["alpha"][good], grid.values["az"][good] / grid.values["airspeed"][good] ** 2)
    return None if known > -0.7 else force / lift


def _check_ay_unit(where: str, share: float | None) -> set[str]:
    """The side force per beta is 5 to 35 % of the lift per alpha on an aircraft with a fin; in g it is a tenth of that.

    Args:
        where: the record.
        share: of `_side_share`.
    """
    if share is None:
        return set()
    for bound, name in ((0.006, "'beta' looks like degrees"), (IN_G, "'ay' looks like g")):
        if share < bound:
            raise InputError(f"{where}: column {name}: side force is {share:.3f} of the lift's change with its angle")
    if share > FEET:
        raise InputError(f"{where}: column 'ay' looks like ft/s2: side force is {share:.2f} of the lift's change with "
                         "its angle")  # fmt: skip
    return {"ay", "beta"} if share > WEAK else set()


def _check_controls(where: str, grid: Grid) -> set[str]:
    """A positive elevator pitches down, a positive aileron rolls left, a positive rudder yaws left; each by a lot."""
    half, confirmed = half_width(grid.dt), set[str]()
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
        if found is None or not found[0][1]:
            continue
        effect = found[0][0]
        if effect > 0.0:
            raise InputError(f"{where}: column '{surface}' has its sign reversed: a positive one raises {rate}")
        if effect > -FEEBLE:
            raise InputError(f"{where}: column '{surface}' looks like degrees: it turns the aircraft by {effect:.2g} "
                             "rad/s2 per unit")  # fmt: skip
        confirmed.add(surface)
    return confirmed
