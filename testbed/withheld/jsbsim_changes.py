"""What is changed in JSBSim's DHC-6, or in the reading of its instruments: effects that the diagnosed library names.

Each enters JSBSim where JSBSim has it: a table made steeper, a function scaled, a mass moved, a propeller weakened, a
lever's range shortened; forms are JSBSim's ("jsbsim"), not the library's. Sizes are those the library calls typical.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from testbed.withheld.jsbsim_edit import Edit, added, gearing, loaded, scaled, steeper, thrust


def _unchanged(size: float) -> tuple[Edit, ...]:
    return ()


def _right(size: float) -> dict[str, float]:
    return {}


@dataclass(frozen=True)
class Change:
    """One effect: where it enters (components of a diagnosis), its parameter in the library's words, typical size.

    `edits` of the aircraft's files, `wrong` errors of the instruments, `rising`: the size is a speed of rising air.
    """

    effect: str
    where: tuple[str, ...]
    parameter: str
    typical: float
    edits: Callable[[float], tuple[Edit, ...]] = field(default=_unchanged)
    wrong: Callable[[float], dict[str, float]] = field(default=_right)
    signed: bool = True
    rising: bool = False


def _factor(*names: str) -> Callable[[float], tuple[Edit, ...]]:
    return lambda s: (scaled(dict.fromkeys(names, 1.0 + s)),)


_Z, _M, _L, _N = "z_force", "pitching_moment", "rolling_moment", "yawing_moment"
CHANGES: tuple[Change, ...] = (
    Change("elevator_power", (_M, _Z), "change", -0.12, _factor("CmDe", "CLde")),
    Change("lift_slope", (_Z,), "change", -0.12, lambda s: (steeper("CLalpha", 1.0 + s),)),
    Change("ice_drag", ("x_force",), "delta_CD_0", 0.015, lambda s: (added("DRAG", s),), signed=False),
    Change("roll_damping", (_L,), "change", -0.15, _factor("Clp")),
    Change("directional_stability", (_N,), "change", -0.2, _factor("Cnb")),
    Change("thrust_loss", ("propulsion",), "change", -0.1, lambda s: (thrust(1.0 + s),)),
    Change("pitch_trim", (_M,), "delta_Cm_0", 0.03, lambda s: (added("PITCH", s),)),
    Change("cg_shift", ("mass", _M), "forward", -0.1, lambda s: (loaded(forward=s),)),
    Change("alpha_bias", ("sensor:alpha",), "offset", 0.009, wrong=lambda s: {"bias_alpha": s}),
    Change("side_force", ("y_force",), "change", 0.3, _factor("CYb")),
    Change("aileron_power", (_L,), "change", -0.25, _factor("Clda")),
    Change("elevator_gearing", ("elevator_path",), "change", -0.1, lambda s: (gearing("Elevator Control", 1.0 + s),)),
    Change("static_stability", (_M,), "change", -0.12, lambda s: (steeper("Cma", 1.0 + s),)),
    Change("airspeed_scale", ("sensor:airspeed",), "change", 0.03, wrong=lambda s: {"scale_airspeed": s}),
    Change("mass_error", ("mass",), "change", 0.05, lambda s: (loaded(factor=1.0 + s),)),
    Change("roll_trim", (_L,), "delta_Cl_0", 0.004, lambda s: (added("ROLL", s),)),
    Change("pitch_damping", (_M,), "change", -0.15, _factor("Cmq")),
    Change("rudder_power", (_N,), "change", -0.1, _factor("Cndr")),
    Change("dihedral_effect", (_L,), "change", 0.25, _factor("Clb")),
    Change("lateral_cg", ("mass", _L), "right", 0.1, lambda s: (loaded(right=s),)),
    Change("inertia_error", ("mass",), "xx", 0.15, lambda s: (loaded(inertia_xx=1.0 + s),)),
    Change("alpha_scale", ("sensor:alpha",), "change", 0.1, wrong=lambda s: {"scale_alpha": s}),
    Change("pitch_gyro_bias", ("sensor:q",), "offset", 0.005, wrong=lambda s: {"bias_q": s}),
    Change("updraft", ("wind",), "speed", 1.0, rising=True),
)
BY_NAME = {change.effect: change for change in CHANGES}
