"""Forces that no aircraft has: what a wrong unit of airspeed, mass or thrust makes of lift and drag.

The lift slope of a wing follows from its aspect ratio A, CL_alpha = 2 pi A / (2 + sqrt(A^2 + 4)) (Helmbold's equation,
e.g. McCormick, Aerodynamics, Aeronautics and Flight Mechanics); a record whose slope is far from it has the airspeed or
the mass in another unit. Drag of an aircraft with engines is more than a twenty-fifth of its lift, and never a thrust
turned round. Bounds are assumed: ice halves a lift slope at most, flaps and slipstream raise it by half.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from estimators.signals.coefficients import Airframe, body_forces, dynamic_pressure, lift_drag
from estimators.signals.consistency import line
from estimators.signals.magnitudes import POUNDS, SPEEDS
from estimators.signals.resample import Grid
from icing_env.errors import InputError
from icing_env.record import DataProblem, FlightRecord

LBF = 4.4482  # N
LOWEST, HIGHEST = 0.45, 1.9  # of Helmbold's slope
STEEP = 5.0  # growth of lift by itself per rad, whatever the units, in attached flow
GLIDE = 25.0  # lift over drag
ALIKE = 0.06  # share by which one engine's thrust may differ from the other's in pounds to be taken for them
THRUST = ("thrust_left", "thrust_right")


def check_lift_slope(where: str, grid: Grid, record: FlightRecord) -> bool:
    """Whether the record shows its lift slope, which is then right.

    Args:
        where: begins the message.
        grid: the record's channels.
        record: for mass and geometry; without them nothing can be said.

    Raises:
        InputError: the slope is another unit's of airspeed or mass.
    """
    meta, v = record.meta, grid.values
    if meta.mass is None or meta.geometry is None or not all(n in v for n in ("alpha", "az", "airspeed")):
        return False
    force = dynamic_pressure({n: x for n, x in v.items() if n != "qbar"}) * meta.geometry.wing_area \
        if _has_air(grid) else None  # fmt: skip
    good = grid.good(("alpha", "az", "airspeed"))
    if force is None or good.sum() == 0:
        return False
    slope, match = line(v["alpha"][good], (-v.get("mass", np.full(len(grid.time), meta.mass)) * v["az"] / force)[good])
    normal = (v["az"] / v["airspeed"] ** 2)[good]
    gain, _ = line(v["alpha"][good], normal / np.mean(normal))
    if match < 0.85 or slope <= 0.0 or gain < STEEP or np.std(v["alpha"][good]) < 0.005:
        return False  # a wing that stalls has no slope of its own
    aspect = meta.geometry.span**2 / meta.geometry.wing_area
    ratio = slope / (2.0 * math.pi * aspect / (2.0 + math.sqrt(aspect**2 + 4.0)))
    if LOWEST < ratio < HIGHEST:
        return True
    likely = {f"'airspeed' looks like {unit}": k**-2 for unit, k in SPEEDS.items()}
    likely |= {f"'mass' looks like {unit}": k for unit, k in POUNDS.items()}
    near = sorted(likely, key=lambda what: abs(math.log(ratio / likely[what])))
    told = [what for what in near if abs(math.log(ratio / likely[what])) < 0.35] or ["'airspeed' or 'mass' is wrong"]
    raise InputError(f"{where}: column {' or '.join(told)}: lift grows with alpha at {ratio:.2g} of what a wing of "
                     f"aspect ratio {aspect:.1f} gives")  # fmt: skip


def without_doubtful_thrust(record: FlightRecord, grid: Grid) -> FlightRecord:
    """The record without its thrust where that cannot be in N; drag is then refused, the rest is not touched."""
    why = _doubt(record, grid)
    if not why:
        return record
    start, end = float(record.time[0]), float(record.time[-1])
    kept = {n: v for n, v in record.channels.items() if n not in THRUST}
    found = [DataProblem(n, f"{why}, set aside", start, end, True) for n in THRUST if n in record.channels]
    return replace(record, channels=kept).with_problems(found)


def _doubt(record: FlightRecord, grid: Grid) -> str:
    """What is wrong with the thrust, "" if nothing can be said against it."""
    v, meta = grid.values, record.meta
    if not all(name in v for name in THRUST):
        return ""
    left, right = (float(np.median(v[name])) for name in THRUST)
    for one, other, name in ((left, right, "thrust_left"), (right, left, "thrust_right")):
        if one < 0.0 < other and one < -0.5 * other:
            return f"{name} has its sign reversed"
        if one > 0.0 and abs(other / one / LBF - 1.0) < ALIKE:
            return f"{name} looks like lbf beside the other engine's N"
    needed = ("ax", "az", "alpha", "airspeed")
    if meta.mass is None or meta.geometry is None or meta.inertia is None or not all(n in v for n in needed):
        return ""
    if not _has_air(grid):
        return ""
    airframe = Airframe(meta.mass, meta.inertia, meta.geometry)
    forces = body_forces(v, dynamic_pressure(v), airframe)
    lift, drag = lift_drag(forces["CX"], forces["CZ"], v["alpha"])
    glide = float(np.median(lift) / GLIDE)
    if left + right < 0.0:
        return "thrust has its sign reversed"
    if left + right > 0.0 and float(np.median(drag)) < glide:
        return f"thrust looks like lbf: drag would be {float(np.median(drag)/np.median(lift)):.3f} of the lift"
    return ""


def _has_air(grid: Grid) -> bool:
    """Whether air density can be had."""
    return "altitude" in grid.values or "density" in grid.values or {"pressure", "temperature"} <= set(grid.values)
