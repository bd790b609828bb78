"""Effects that the diagnosed library names, coded by formulas of the benchmark's own, each in two forms.

`same` has the library's functional form, `other` another one for the same phenomenon: saturating instead of linear,
second order instead of first, growing with speed or angle of attack instead of constant. Sizes are those that the
library calls typical (facts, docs and `icing effects`). What a size changes is written as (numbers of the airframe,
numbers of the instruments).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from testbed.withheld.published import PUBLISHED

Change = tuple[dict[str, float], dict[str, float]]
Form = Callable[[float], Change]
N = PUBLISHED


@dataclass(frozen=True)
class Effect:
    """One phenomenon: where it enters (components of a diagnosis), its typical size and its forms.

    `parameter` is the number in the library's words; `signed`: both signs are drawn.
    """

    name: str
    where: tuple[str, ...]
    parameter: str
    typical: float
    same: Form
    other: Form
    signed: bool = True


def times(*names: str) -> Form:
    """The named numbers, each by the factor 1 + size."""
    return lambda s: ({n: N[n] * (1.0 + s) for n in names}, {})


def plus(name: str) -> Form:
    """One number of the airframe, the size added."""
    return lambda s: ({name: N.get(name, 0.0) + s}, {})


def sense(name: str) -> Form:
    """One number of the instruments, the size itself."""
    return lambda s: ({}, {name: s})


def soft(*pairs: tuple[str, float]) -> Form:
    """A relative change of derivatives that saturates at large angles or rates."""
    return lambda s: ({f"{n}_soft": weight * s * N[n] for n, weight in pairs}, {})


def iced(part: str, names: tuple[str, ...]) -> Form:
    """Published ice factors of one part, linear in severity."""
    return lambda s: ({n: N[n] * (1.0 + N[f"k_{n}_{part}"] * s) for n in names}, {})


LONG = ("CX_alpha", "CX_alpha2", "CZ_q", "CZ_elevator", "Cm_alpha", "Cm_q", "Cm_elevator", "CZ_alpha", "CX_0")
LAT = ("CY_beta", "CY_rudder", "Cl_beta", "Cl_p", "Cl_aileron", "Cl_rudder", "Cn_beta", "Cn_r", "Cn_rudder")


def _wing_same(s: float) -> Change:
    changes = iced("wing", LONG + LAT)(s)[0]
    return {**changes, "alpha_stall": N["alpha_stall"] - N["k_alpha_stall_wing"] * s}, {}


def _wing_other(s: float) -> Change:
    """Lift lost as the angle grows, drag that grows with it, roll power and damping that saturate."""
    return {"CZ_alpha_soft": N["k_CZ_alpha_wing"] * s * N["CZ_alpha"], "CX_0": N["CX_0"] * (1.0 + 0.8 * s),
            "CD_alpha": 0.025 * s, "Cl_aileron_soft": N["k_Cl_aileron_wing"] * s * N["Cl_aileron"],
            "Cl_p_soft": N["k_Cl_p_wing"] * s * N["Cl_p"], "alpha_stall": N["alpha_stall"] - 0.3 * s,
            "stall_width": N["stall_width"] * (1.0 + 2.0 * s)}, {}  # fmt: skip


def _tail_same(s: float) -> Change:
    changes = iced("htail", LONG)(s)[0]
    return {**changes, "alpha_tail_stall": N["alpha_tail_stall"] * (1.0 - 2.5 * s)}, {}


def _tail_other(s: float) -> Change:
    return {"Cm_alpha_soft": N["k_Cm_alpha_htail"] * s * N["Cm_alpha"],
            "Cm_elevator_soft": N["k_Cm_elevator_htail"] * s * N["Cm_elevator"],
            "CZ_elevator": N["CZ_elevator"] * (1.0 - s), "Cm_q": N["Cm_q"] * (1.0 - 0.8 * s),
            "CZ_alpha": N["CZ_alpha"] * (1.0 - 0.45 * s)}, {}  # fmt: skip


def _fin_other(s: float) -> Change:
    return {"Cn_beta_soft": N["k_Cn_beta_vtail"] * s * N["Cn_beta"],
            "Cn_rudder_soft": N["k_Cn_rudder_vtail"] * s * N["Cn_rudder"],
            "CY_beta_soft": N["k_CY_beta_vtail"] * s * N["CY_beta"], "Cn_r": N["Cn_r"] * (1.0 - s)}, {}  # fmt: skip


# What an effect adds as a share of another number goes with the aircraft's own: (effect, what it adds to): that number.
PART_OF = {("asymmetric_ice", "Cl_alpha"): "CZ_alpha", ("asymmetric_ice", "Cn_0"): "CX_0",
           ("asymmetric_ice", "CZ_alpha_right"): "CZ_alpha", ("asymmetric_ice", "CX_0_right"): "CX_0"}  # fmt: skip
ADDED = {("pitch_trim", "Cm_0")}  # to a number that is not zero: as it is, whatever the aircraft's own is


def _asymmetric_same(s: float) -> Change:
    half = 0.5 * N["lift_arm"] * s
    return {"Cl_alpha": half * N["k_CZ_alpha_wing"] * N["CZ_alpha"], "Cn_0": -half * N["k_CX_0_wing"] * N["CX_0"]}, {}


def _asymmetric_other(s: float) -> Change:
    """The right half wing itself loses lift and gains drag."""
    return {"CZ_alpha_right": N["k_CZ_alpha_wing"] * s * N["CZ_alpha"],
            "CX_0_right": N["k_CX_0_wing"] * s * N["CX_0"]}, {}  # fmt: skip


def _thrust(both: float, right: float) -> Form:
    return lambda s: ({"thrust_factor_left": 1.0 + (both - right) * s, "thrust_factor_right": 1.0 + (both + right) * s},
                      {})  # fmt: skip


def _second(surface: str) -> Form:
    """Second-order actuator of the same delay, 2 zeta/frequency = lag."""
    return lambda s: ({f"{surface}_frequency": 1.4 / (N[f"{surface}_lag"] + s)}, {})


def _pair(first: Form, second: Form, share: float) -> Form:
    """Both at once, the second at `share` of the size."""

    def both(s: float) -> Change:
        (a, b), (c, d) = first(s), second(share * s)
        return {**a, **c}, {**b, **d}

    return both


def _rate_limit(soften: float) -> Form:
    return lambda s: ({"elevator_rate": N["elevator_rate"] * (1.0 - min(s, 0.95)), "elevator_soft_rate": soften}, {})


def _surface(name: str) -> tuple[Effect, ...]:
    where = (f"{name}_path",)
    return (
        Effect(f"{name}_lag", where, "extra", 0.1, plus(f"{name}_lag"), _second(name), False),
        Effect(f"{name}_gearing", where, "change", -0.1, plus(f"{name}_gearing"),
               _pair(plus(f"{name}_gearing"), plus(f"{name}_cubic"), -0.5)),
    )  # fmt: skip


def _bias(name: str, channel: str, size: float) -> Effect:
    return Effect(name, (f"sensor:{channel}",), "offset", size, sense(f"bias_{channel}"), sense(f"wander_{channel}"))


def _low_cg(s: float) -> Change:
    return {"cg_shift_z": s, "inertia_yy": N["inertia_yy"] * (1.0 + abs(s) / 3.0)}, {}


_Z, _M, _L, _N = "z_force", "pitching_moment", "rolling_moment", "yawing_moment"
EFFECTS: tuple[Effect, ...] = (
    Effect("wing_ice", (_Z, "x_force", _M, _L), "eta", 0.07, _wing_same, _wing_other, False),
    Effect("tail_ice", (_M, _Z), "eta", 0.1, _tail_same, _tail_other, False),
    Effect("fin_ice", ("y_force", _N), "eta", 0.1, iced("vtail", LAT), _fin_other, False),
    Effect("asymmetric_ice", (_L, _N), "eta", 0.05, _asymmetric_same, _asymmetric_other),
    Effect("ice_drag", ("x_force",), "delta_CD_0", 0.015, plus("CD_parasite"),
           _pair(lambda s: ({"CD_parasite": 0.6 * s}, {}), plus("CD_alpha"), 0.4), False),
    Effect("lift_slope", (_Z,), "change", -0.12, times("CZ_alpha"), soft(("CZ_alpha", 1.2))),
    Effect("static_stability", (_M,), "change", -0.12, times("Cm_alpha"), soft(("Cm_alpha", 1.2))),
    Effect("pitch_damping", (_M,), "change", -0.15, times("Cm_q"), soft(("Cm_q", 1.3))),
    Effect("aileron_power", (_L,), "change", 0.25, times("Cl_aileron"), soft(("Cl_aileron", 1.2))),
    Effect("rudder_power", (_N,), "change", -0.1, times("Cn_rudder"), soft(("Cn_rudder", 1.2))),
    Effect("roll_damping", (_L,), "change", -0.15, times("Cl_p"), soft(("Cl_p", 1.2))),
    Effect("directional_stability", (_N,), "change", -0.2, times("Cn_beta"), soft(("Cn_beta", 1.2))),
    Effect("dihedral_effect", (_L,), "change", 0.25, times("Cl_beta"), soft(("Cl_beta", 1.2))),
    Effect("side_force", ("y_force",), "change", 0.3, times("CY_beta"), soft(("CY_beta", 1.2))),
    Effect("elevator_power", (_M, _Z), "change", -0.12, times("Cm_elevator", "CZ_elevator"),
           _pair(soft(("Cm_elevator", 1.2)), times("CZ_elevator"), 0.7)),
    Effect("drag_due_to_lift", ("x_force",), "change", -0.2, times("CX_alpha2"),
           lambda s: ({"CD_lift": -0.05 * s}, {})),
    Effect("early_stall", (_Z, _M), "angle", 0.05, lambda s: ({"alpha_stall": N["alpha_stall"] - s}, {}),
           lambda s: ({"alpha_stall": N["alpha_stall"] - s, "stall_width": N["stall_width"] * 1.3}, {}), False),
    Effect("pitch_trim", (_M,), "delta_Cm_0", 0.03, plus("Cm_0"), plus("Cm_at_72")),
    Effect("roll_trim", (_L,), "delta_Cl_0", 0.004, plus("Cl_0"), plus("Cl_at_72")),
    Effect("downwash_lag", (_M,), "change", -4.0, plus("Cm_alphadot"), lambda s: ({"Cm_downwash2": 0.5 * s}, {})),
    Effect("power_pitching", (_M,), "Cm_CT", 0.15, plus("Cm_CT"), plus("Cm_ct2")),
    Effect("thrust_loss", ("propulsion",), "change", -0.1, _thrust(1.0, 0.0), plus("thrust_at_72")),
    Effect("asymmetric_thrust", ("propulsion", _N), "difference", 0.1, _thrust(0.0, -0.5),
           lambda s: ({"thrust_right_at_72": -s}, {})),
    Effect("spool_lag", ("propulsion",), "extra", 0.8, plus("spool_time"), plus("spool_second"), False),
    Effect("mass_error", ("mass",), "change", 0.05, times("mass"),
           _pair(times("mass"), times("inertia_xx", "inertia_zz"), 1.0)),
    Effect("cg_shift", ("mass", _M), "forward", -0.1, plus("cg_shift_x"),
           _pair(plus("cg_shift_x"), _low_cg, 0.4)),
    Effect("lateral_cg", ("mass", _L), "right", 0.1, plus("cg_shift_y"),
           _pair(plus("cg_shift_y"), lambda s: ({"inertia_xx": N["inertia_xx"] * (1.0 + abs(s))}, {}), 0.5)),
    Effect("inertia_error", ("mass",), "xx", 0.15, times("inertia_xx"),
           _pair(times("inertia_xx"), times("inertia_xz"), 2.0)),
    *_surface("elevator"), *_surface("aileron"), *_surface("rudder"),
    Effect("elevator_offset", ("elevator_path",), "angle", 0.017, plus("elevator_offset"), plus("elevator_float")),
    Effect("elevator_rate_limit", ("elevator_path",), "reduction", 0.8, _rate_limit(0.0), _rate_limit(1.0), False),
    _bias("alpha_bias", "alpha", 0.009), _bias("beta_bias", "beta", 0.009), _bias("pitch_gyro_bias", "q", 0.005),
    _bias("pitch_attitude_bias", "theta", 0.009), _bias("axial_accelerometer_bias", "ax", 0.1),
    _bias("normal_accelerometer_bias", "az", 0.3),
    Effect("alpha_scale", ("sensor:alpha",), "change", 0.1, sense("scale_alpha"),
           _pair(lambda s: ({}, {"scale_alpha": 0.6 * s}), sense("scale_alpha2"), 0.4)),
    Effect("airspeed_scale", ("sensor:airspeed",), "change", 0.03, sense("scale_airspeed"),
           sense("pressure_airspeed")),
    Effect("vane_lag", ("sensor:alpha", "sensor:beta"), "extra", 0.1, sense("vane_extra"), sense("vane_second"), False),
    Effect("vane_position", ("sensor:alpha", "sensor:beta"), "error", 1.0, sense("vane_error"),
           _pair(sense("vane_error"), sense("vane_cross"), -0.5)),
    Effect("boom_oscillation", ("sensor:alpha",), "gain", 0.001, sense("boom_extra"), sense("boom_other")),
    Effect("updraft", ("wind",), "speed", 1.0, plus("wind_up"), _pair(plus("wind_up"), plus("wind_wave"), 0.4)),
    Effect("wind_shear", ("wind",), "gradient", 0.02, plus("shear"), plus("shear_bounded")),
    Effect("air_density", ("wind",), "change", 0.03, plus("density_factor"), plus("density_lapse")),
)  # fmt: skip
# Parameters of the library beside the one that is drawn, so that an answer that uses them can be flown.
FURTHER: dict[str, dict[str, Form]] = {
    "inertia_error": {"yy": times("inertia_yy"), "zz": times("inertia_zz")},
    "ice_drag": {"growth": lambda s: ({"CD_alpha": 0.06**2 * s}, {})}}
BY_NAME = {effect.name: effect for effect in EFFECTS} | {
    f"{name}.{parameter}": Effect(f"{name}.{parameter}", (), parameter, 0.0, form, form)
    for name, forms in FURTHER.items() for parameter, form in forms.items()}
