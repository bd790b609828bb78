"""Effects that no library of the project holds: what a diagnosis must call unknown instead of naming something.

Sizes are drawn about `typical`, which makes most of them stand well out of the noise (assumed). Both forms of an
`Effect` are the same here.
"""

from __future__ import annotations

from testbed.withheld.effects import Effect, Form, plus, sense


def _one(name: str, where: tuple[str, ...], typical: float, form: Form, signed: bool = True) -> Effect:
    return Effect(name, where, "size", typical, form, form, signed)


UNKNOWN: tuple[Effect, ...] = (
    _one("aileron_pitching", ("pitching_moment",), 0.12, plus("Cm_aileron")),  # per rad: ailerons pitch the aircraft
    _one("sideslip_pitching", ("pitching_moment",), 4.0, plus("Cm_beta2")),  # per rad2
    _one("cubic_pitching", ("pitching_moment",), -30.0, plus("Cm_hump"), False),  # per rad3 about alpha = 0.03
    _one("wake_on_tail", ("pitching_moment",), 8.0, plus("Cm_rotor_wake")),  # slipstream times alpha on the tail
    _one("slipstream_on_fin", ("yawing_moment",), 5.0, plus("fin_ct")),  # fin power grows with thrust coefficient
    _one("fuel_slosh", ("rolling_moment", "y_force"), 250.0, plus("slosh_mass"), False),  # kg that swing in the wing
    _one("elevator_play", ("elevator_path", "pitching_moment"), 0.008, plus("elevator_play"), False),  # rad, behind the
    # point where the position is measured
    _one("sidewash_lag", ("yawing_moment",), 0.12, plus("Cn_betadot")),
    _one("propeller_torque", ("rolling_moment",), 0.06, plus("Cl_torque")),  # roll moment that grows with thrust
    _one("p_factor", ("yawing_moment",), 1.5, plus("Cn_pfactor")),  # yaw moment of thrust at an angle
    _one("elevator_blowback", ("pitching_moment", "z_force"), 0.25, plus("blowback"), False),  # bends with qbar
    _one("adverse_yaw", ("yawing_moment",), 0.6, plus("Cn_alpha_aileron")),  # of ailerons, with angle of attack
    _one("gyroscopic_propellers", ("pitching_moment", "yawing_moment"), 6000.0, plus("gyroscopic")),  # kg m2/s
    _one("unsteady_lift", ("z_force",), -14.0, plus("CZ_alphadot")),
    _one("rudder_at_alpha", ("y_force",), 3.0, plus("CY_alpha_rudder")),
    _one("rudder_drag", ("x_force",), 0.25, plus("brake_drag"), False),
    _one("aileron_dead_zone", ("aileron_path",), 0.02, plus("aileron_dead"), False),  # rad of the wheel
    _one("elevator_delay", ("elevator_path",), 0.10, plus("elevator_delay"), False),  # s of pure delay
    _one("flexible_fuselage", ("sensor:az",), 0.15, sense("flexible_az")),  # 3.2 Hz mode under the accelerometer
    _one("gyro_g_sensitivity", ("sensor:q",), 0.002, sense("gyro_g")),  # rad/s per m/s2
    _one("gyro_misalignment", ("sensor:q",), 0.04, sense("gyro_cross")),  # pitch gyro feels roll
    _one("gyro_erection", ("sensor:theta",), 0.06, sense("attitude_cross")),  # vertical gyro leans with bank
    _one("airspeed_at_alpha", ("sensor:airspeed",), 0.4, sense("airspeed_alpha")),  # static error with alpha
)
BY_NAME = {effect.name: effect for effect in UNKNOWN}
