"""The nouns: every record that passes between the parts, as NumPy structured types with one row per aircraft.

Each field is written once, with its unit and meaning. SI and radians throughout; body axes x forward, y right,
z down; local frame north, east, down. Names of measured channels are the column names of a flight record.
"""

from __future__ import annotations

import numpy as np

Field = tuple[str, str, str]  # name, unit, meaning


def unit_of(coefficient: str) -> str:
    """Unit of an aerodynamic coefficient by its name: CX_0 has none, CX_alpha2 goes with the square of an angle."""
    return "1" if coefficient.endswith("_0") else "1/rad2" if coefficient.endswith("2") else "1/rad"


# What the Runge-Kutta step integrates.
CONTINUOUS_FIELDS: list[Field] = [
    ("north", "m", "position north of the start"),
    ("east", "m", "position east of the start"),
    ("altitude", "m", "geometric altitude above sea level"),
    ("u", "m/s", "inertial velocity, body x"),
    ("v", "m/s", "inertial velocity, body y"),
    ("w", "m/s", "inertial velocity, body z"),
    ("e0", "1", "attitude quaternion (body from local), scalar part"),
    ("e1", "1", "attitude quaternion, x"),
    ("e2", "1", "attitude quaternion, y"),
    ("e3", "1", "attitude quaternion, z"),
    ("p", "rad/s", "roll rate"),
    ("q", "rad/s", "pitch rate"),
    ("r", "rad/s", "yaw rate"),
    ("elevator", "rad", "surface position, positive trailing edge down (pitches down)"),
    ("aileron", "rad", "surface position, positive rolls left"),
    ("rudder", "rad", "surface position, positive yaws left"),
    ("flap", "rad", "flap position"),
    ("power_left", "W", "shaft power of the left engine"),
    ("power_right", "W", "shaft power of the right engine"),
    ("alpha_downwash", "rad", "angle of attack whose downwash reaches the tail now"),
]

GUST_FIELDS: list[Field] = [
    ("gust_u", "m/s", "turbulence and discrete gust, air velocity along body x, now"),
    ("gust_v", "m/s", "the same along body y"),
    ("gust_w", "m/s", "the same along body z"),
    ("gust_p", "rad/s", "rotation of the air about body x"),
    ("gust_q", "rad/s", "rotation of the air about body y"),
    ("gust_r", "rad/s", "rotation of the air about body z"),
    ("gust_w_tail", "m/s", "vertical gust that the tail meets now"),
    ("dryden_u", "m/s", "state of the Dryden filter of u"),
    ("dryden_v1", "m/s", "first state of the Dryden filter of v"),
    ("dryden_v2", "m/s", "second state of the Dryden filter of v"),
    ("dryden_w1", "m/s", "first state of the Dryden filter of w"),
    ("dryden_w2", "m/s", "second state of the Dryden filter of w"),
    ("dryden_p", "rad/s", "state of the Dryden filter of p"),
    ("dryden_q", "m/s", "state of the Dryden filter of q"),
    ("dryden_r", "m/s", "state of the Dryden filter of r"),
]

CLOUD_FIELDS: list[Field] = [
    ("lwc", "kg/m3", "liquid water content met now"),
    ("mvd", "m", "median volume diameter of the drops"),
    ("temperature", "K", "static air temperature at the aircraft"),
    ("cloud_left", "m", "distance to the end of this cloud (positive) or of this gap (negative)"),
    ("cloud_lwc_mean", "kg/m3", "mean liquid water content of this cloud"),
    ("cloud_lwc_noise", "1", "slow relative fluctuation of the liquid water content"),
]

# Surfaces on which ice is counted; each has the fields of ICE_FIELDS with the surface's name appended.
SURFACES = ("left_wing", "right_wing", "htail", "vtail", "struts", "propeller", "other")
ICE_FIELDS: list[Field] = [
    (f"{quantity}_{surface}", unit, f"{meaning}, {surface.replace('_', ' ')}")
    for quantity, unit, meaning in (
        ("eta", "1", "icing severity"),
        ("thickness", "m", "ice thickness at the stagnation line"),
        ("ice_mass", "kg", "mass of ice"),
    )
    for surface in SURFACES
]
PROTECTION_FIELDS: list[Field] = [
    ("boot_age_wing", "s", "time since the wing boots last inflated"),
    ("boot_age_tail", "s", "time since the horizontal-tail boots last inflated"),
    ("boot_age_vtail_struts", "s", "time since the fin and strut boots last inflated"),
    ("boot_was_wing", "0/1", "wing boot command a step ago, to find its rising edge"),
    ("boot_was_tail", "0/1", "tail boot command a step ago"),
    ("boot_was_vtail_struts", "0/1", "fin and strut boot command a step ago"),
    ("boot_cycles", "1", "inflations so far, all boots"),
    ("heat_energy", "J", "electric energy spent on propeller heat so far"),
]

INSTRUMENT_FIELDS: list[Field] = [
    ("pitot", "m/s", "airspeed behind the pitot lag and the anti-boom filter"),
    ("vane_alpha", "rad", "angle of attack behind the vane lag"),
    ("vane_beta", "rad", "sideslip behind the vane lag"),
    ("boom_position", "rad", "deflection of the nose boom as an angle"),
    ("boom_rate", "rad/s", "its rate"),
    *((f"filtered_{c}", u, f"{c} behind the anti-boom low pass") for c, u in (
        ("alpha", "rad"), ("beta", "rad"), ("p", "rad/s"), ("q", "rad/s"), ("r", "rad/s"),
        ("ax", "m/s2"), ("ay", "m/s2"), ("az", "m/s2"),
        ("elevator", "rad"), ("aileron", "rad"), ("rudder", "rad"))),
]

# Constants of the instruments' filters at the present step, renewed on the slow clock.
HELD_FIELDS: list[Field] = [
    ("gain_pitot", "1", "share of the way the pitot lag goes in a step"),
    ("gain_vane", "1", "the same for the flow vanes"),
    ("gain_filter", "1", "the same for the anti-boom low pass"),
    ("filter_rate", "1/s", "rate of what the low pass shows per distance from what it is shown"),
    ("boom_xx", "1", "boom deflection after a step per deflection before"),
    ("boom_xv", "s", "boom deflection after a step per rate before"),
    ("boom_vx", "1/s", "boom rate after a step per deflection before"),
    ("boom_vv", "1", "boom rate after a step per rate before"),
]

STATE_FIELDS = (
    CONTINUOUS_FIELDS + GUST_FIELDS + CLOUD_FIELDS + ICE_FIELDS + PROTECTION_FIELDS + INSTRUMENT_FIELDS + HELD_FIELDS
)

# What is asked of the aircraft: surfaces, power, ice protection.
COMMAND_FIELDS: list[Field] = [
    ("elevator", "rad", "commanded elevator"),
    ("aileron", "rad", "commanded aileron"),
    ("rudder", "rad", "commanded rudder"),
    ("flap", "rad", "commanded flap"),
    ("throttle_left", "0..1", "power lever, left"),
    ("throttle_right", "0..1", "power lever, right"),
    ("boots_wing", "0/1", "wing boots: a rising edge is one shot, held on it cycles"),
    ("boots_tail", "0/1", "horizontal-tail boots"),
    ("boots_vtail_struts", "0/1", "fin and strut boots"),
    ("prop_heat", "0/1", "electric propeller heat"),
]

# What the instruments read. Channels marked 10 Hz or 1 Hz keep their value between samples.
MEASUREMENT_FIELDS: list[Field] = [
    ("time", "s", "time since reset"),
    ("airspeed", "m/s", "true airspeed"),
    ("alpha", "rad", "angle of attack at the c.g."),
    ("beta", "rad", "sideslip at the c.g."),
    ("p", "rad/s", "roll rate"),
    ("q", "rad/s", "pitch rate"),
    ("r", "rad/s", "yaw rate"),
    ("phi", "rad", "bank angle"),
    ("theta", "rad", "pitch angle"),
    ("psi", "rad", "heading, continuous"),
    ("ax", "m/s2", "specific force along x at the c.g."),
    ("ay", "m/s2", "specific force along y at the c.g."),
    ("az", "m/s2", "specific force along z at the c.g."),
    ("elevator", "rad", "measured position"),
    ("aileron", "rad", "measured position"),
    ("rudder", "rad", "measured position"),
    ("flap", "rad", "measured position"),
    ("throttle_left", "0..1", "power lever"),
    ("throttle_right", "0..1", "power lever"),
    ("thrust_left", "N", "thrust from torque, speed of rotation and the propeller chart (10 Hz)"),
    ("thrust_right", "N", "the same on the right (10 Hz)"),
    ("torque_left", "N m", "shaft torque (10 Hz)"),
    ("torque_right", "N m", "shaft torque (10 Hz)"),
    ("rpm_left", "1/min", "propeller speed (10 Hz)"),
    ("rpm_right", "1/min", "propeller speed (10 Hz)"),
    ("altitude", "m", "pressure altitude (10 Hz)"),
    ("temperature", "K", "static temperature (1 Hz)"),
    ("pressure", "Pa", "static pressure (10 Hz)"),
    ("lwc", "kg/m3", "liquid water content (1 Hz)"),
    ("mvd", "m", "median volume diameter (1 Hz)"),
    ("ground_speed", "m/s", "speed over ground (10 Hz)"),
    ("track", "rad", "track over ground (10 Hz)"),
    ("hinge_moment_elevator", "N m", "elevator hinge moment (10 Hz)"),
    ("hinge_moment_aileron", "N m", "aileron hinge moment (10 Hz)"),
]

# Aerodynamic coefficients as the aircraft is now (ice included): the truth that estimators are scored against.
DERIVATIVE_NAMES = (
    "CX_0", "CX_alpha", "CX_alpha2", "CZ_0", "CZ_alpha", "CZ_q", "CZ_elevator",
    "Cm_0", "Cm_alpha", "Cm_q", "Cm_elevator",
    "CY_beta", "CY_p", "CY_r", "CY_rudder",
    "Cl_beta", "Cl_p", "Cl_r", "Cl_aileron", "Cl_rudder",
    "Cn_beta", "Cn_p", "Cn_r", "Cn_aileron", "Cn_rudder",
)  # fmt: skip
CURRENT_FIELDS: list[Field] = [
    *((name, unit_of(name), "value now, ice included") for name in DERIVATIVE_NAMES),
    ("CZ_alpha_left", "1/rad", "lift-curve slope of the left half wing"),
    ("CZ_alpha_right", "1/rad", "lift-curve slope of the right half wing"),
    *((f"CX_0_{side}", "1", f"axial coefficient of the {side} half wing") for side in ("left", "right")),
    ("CD_parasite", "1", "drag along the air stream of struts, gear and other bluff parts"),
    ("alpha_stall_left", "rad", "onset of separation on the left half wing"),
    ("alpha_stall_right", "rad", "onset of separation on the right half wing"),
    ("alpha_tail_stall", "rad", "tail angle (negative lift) at which the tailplane separates"),
    ("mass", "kg", "mass, ice included"),
    ("efficiency", "1", "propeller efficiency factor, ice included"),
    ("elapsed", "s", "time since the start where the step begins"),
    ("standard_pressure", "Pa", "standard pressure at the altitude where the step begins"),
    ("per_standard_temperature", "1/K", "1/standard temperature there; 0 above the tropopause"),
    # Reciprocals that every stage of the integration needs; a division costs ten multiplications.
    ("per_mass", "1/kg", "1/mass"),
    ("per_inertia_xx", "1/(kg m2)", "element of the inverse inertia tensor"),
    ("per_inertia_yy", "1/(kg m2)", "element of the inverse inertia tensor"),
    ("per_inertia_zz", "1/(kg m2)", "element of the inverse inertia tensor"),
    ("per_inertia_xz", "1/(kg m2)", "element of the inverse inertia tensor"),
    ("per_stall_width", "1/rad", "1/stall_width"),
    ("per_tail_stall_width", "1/rad", "1/tail_stall_width"),
    ("per_tail_arm", "1/m", "1/tail_arm"),
    *((f"per_{surface}_lag", "1/s", f"1/{surface}_lag") for surface in ("elevator", "aileron", "rudder")),
    ("per_spool_time", "1/s", "1/spool_time"),
    *((f"per_{surface}_stiffness", "rad/(N m)", f"1/hinge_{surface}_stiffness") for surface in ("elevator", "aileron")),
]

# The truth that tasks and scores look at, never estimators or controllers.
OUTCOME_FIELDS: list[Field] = [
    ("airspeed", "m/s", "true airspeed"),
    ("alpha", "rad", "true angle of attack"),
    ("beta", "rad", "true sideslip"),
    ("load_factor", "1", "normal load factor, -Fz/(m g0)"),
]


def structured(fields: list[Field], *extra: tuple[str, str]) -> np.dtype:
    """Structured type of float64 fields, followed by `extra` (name, numpy type) pairs."""
    return np.dtype([(name, "f8") for name, _, _ in fields] + list(extra))


CONTINUOUS = structured(CONTINUOUS_FIELDS)
# The integers come first: a type that merely went on after CONTINUOUS would pass for one in numba.
STATE = np.dtype([("step", "i8"), ("seed", "u8"), *structured(STATE_FIELDS).descr])
COMMAND = structured(COMMAND_FIELDS)
MEASUREMENT = structured(MEASUREMENT_FIELDS)
CURRENT = structured(CURRENT_FIELDS)
OUTCOME = structured(OUTCOME_FIELDS)
N_CONTINUOUS = len(CONTINUOUS_FIELDS)


def units(fields: list[Field]) -> dict[str, str]:
    """Unit of each field by name."""
    return {name: unit for name, unit, _ in fields}

# What an observer believes, from measurements only; the interface between observer and ice management.
ESTIMATED_NAMES = (
    "CD_0", "CL_0", "CL_alpha", "CL_elevator",
    "Cm_0", "Cm_alpha", "Cm_q", "Cm_elevator",
    "CY_0", "CY_beta", "CY_r", "CY_rudder",
    "Cl_0", "Cl_beta", "Cl_p", "Cl_r", "Cl_aileron", "Cl_rudder",
    "Cn_0", "Cn_beta", "Cn_p", "Cn_r", "Cn_aileron", "Cn_rudder",
)  # fmt: skip
ESTIMATE_FIELDS: list[Field] = [
    *((name, unit_of(name), "estimate") for name in ESTIMATED_NAMES),
    *((f"{name}_std", unit_of(name), "its standard error") for name in ESTIMATED_NAMES),
    ("excess_drag", "1", "CD_0 above that of the clean aircraft, smoothed for decisions"),
    ("excitation_longitudinal", "1", "share of recent pitch activity that the elevator caused, 0..1"),
    ("excitation_lateral", "1", "share of recent roll and yaw activity that aileron and rudder caused, 0..1"),
    ("health", "0/1", "1 while the observer's matrices are positive definite and finite"),
]

SENSED_PARTS = ("left_wing", "right_wing", "htail", "propeller")  # where ice, and failed protection, is told apart

# What the ice management says to the crew, to the protection system and to whatever controller flies.
ADVISORY_FIELDS: list[Field] = [
    ("severity", "1", "estimated icing severity, 0 clean, 1 severe"),
    ("confidence", "0..1", "confidence in the severity"),
    ("ice_detected", "0/1", "ice is believed to be on the aircraft"),
    ("boots_wing", "0/1", "wing boots asked for"),
    ("boots_tail", "0/1", "horizontal-tail boots asked for"),
    ("boots_vtail_struts", "0/1", "fin and strut boots asked for"),
    ("prop_heat", "0/1", "propeller heat asked for"),
    ("alpha_limit", "rad", "highest angle of attack allowed now"),
    ("airspeed_limit", "m/s", "lowest true airspeed allowed now"),
    ("bank_limit", "rad", "largest bank allowed now"),
    ("flap_limit", "rad", "largest flap allowed now"),
    ("intervention", "rad", "size of the change the protection made to the elevator in this step"),
    ("intervention_aileron", "rad", "the same for the aileron"),
    ("load_factor_limit", "1", "largest normal load factor allowed now"),
    ("pitch_limit", "rad", "highest pitch angle allowed now"),
    *((f"severity_{part}", "1", f"estimated eta of the {part.replace('_', ' ')}") for part in SENSED_PARTS),
    *((f"failed_{part}", "0/1", f"its ice protection is believed to have failed: {part}") for part in SENSED_PARTS),
    ("tail_stall", "0/1", "the tailplane is near its stall: less flap, stick back"),
    ("roll_upset", "0/1", "the roll is more than aileron explains: unload, roll level"),
    ("power_lacking", "0/1", "speed or altitude asked for need more power than there is"),
    ("adaptation", "0..1", "share of the adaptation of the control laws that is in force"),
    ("adaptation_frozen", "0/1", "the estimate is too poor: the adaptation stays where it is"),
]
ESTIMATE = structured(ESTIMATE_FIELDS)
ADVISORY = structured(ADVISORY_FIELDS, *((memory, "f8") for memory in (
    "memory", "since_detection", "alpha_slow", "alpha_energy", "tail_share", "wing_share", "roll_slow", "roll_model",
    "climb_spare", "told", "collected_wing", "collected_tail", "collected_struts", "collected_propeller", "shot_wing",
    "shot_tail", "shot_struts", "heating", "power_share")))

# What an autopilot is to hold.
TARGET_FIELDS: list[Field] = [
    ("pitch_mode", "0..2", "0 holds theta, 1 altitude, 2 climb_rate"),
    ("theta", "rad", "pitch angle to hold"),
    ("altitude", "m", "pressure altitude to hold"),
    ("climb_rate", "m/s", "vertical speed to hold, positive up"),
    ("speed_mode", "0..1", "0 sets throttle, 1 holds airspeed"),
    ("throttle", "0..1", "power lever to set"),
    ("airspeed", "m/s", "true airspeed to hold"),
    ("roll_mode", "0..1", "0 holds phi, 1 heading"),
    ("phi", "rad", "bank angle to hold"),
    ("heading", "rad", "heading to hold"),
    ("flap", "rad", "flap to set"),
]
TARGET = structured(TARGET_FIELDS)
