"""Effects drawn up when a solver was done, to see what it says of what nobody had in mind while it was written.

`unknown.py` has such that no library holds, too, but their failures were looked at, and generic terms added for some of
them. Whoever mends a solver by what it said of STRANGERS makes them MET, and takes others. Sizes as there (assumed).
"""

from __future__ import annotations

from testbed.withheld.effects import Effect, Form, plus, sense, times
from testbed.withheld.published import PUBLISHED


def _one(name: str, where: tuple[str, ...], typical: float, form: Form, signed: bool = True) -> Effect:
    return Effect(name, where, "size", typical, form, form, signed)


def about(slope: str, curved: str) -> Form:
    """A derivative that changes with the angle of attack, as published at 0.03 rad."""
    return lambda s: ({slope: PUBLISHED[slope] - 0.03 * s, curved: s}, {})


MET: tuple[Effect, ...] = (  # by the solvers of 26 November 2026: three lists
    _one("drag_of_sideslip", ("x_force",), 1.5, plus("CD_beta2"), False),  # per rad2
    _one("lift_of_sideslip", ("z_force",), 6.0, plus("CZ_beta2")),  # per rad2: the fuselage shades the wing
    _one("roll_of_yaw_rate", ("rolling_moment",), 0.8, times("Cl_r")),
    _one("yaw_of_roll_rate", ("yawing_moment",), 0.8, times("Cn_p")),
    _one("yaw_of_ailerons", ("yawing_moment",), -0.02, plus("Cn_aileron")),  # per rad
    _one("roll_of_rudder", ("rolling_moment",), 0.02, plus("Cl_rudder")),  # per rad
    _one("pitch_damping_at_alpha", ("pitching_moment",), -150.0, plus("Cm_alpha_q")),
    _one("roll_damping_at_alpha", ("rolling_moment",), 4.0, plus("Cl_alpha_p")),
    _one("lift_of_slipstream", ("z_force",), -8.0, plus("CZ_ct_alpha")),  # lift slope that grows with thrust
    _one("wing_rock", ("rolling_moment",), 0.003, plus("Cl_wave"), False),  # every 7 s, for no reason
    _one("loose_load", ("mass", "pitching_moment"), -0.6, plus("loose_load"), False),  # m/rad: it slides as she pitches
    _one("rudder_one_sided", ("rudder_path",), -0.15, plus("rudder_one_sided")),  # gearing to the right alone
    _one("rudder_of_aileron", ("rudder_path",), 0.15, plus("rudder_of_aileron")),  # a hidden interconnection
    _one("vane_sticks", ("sensor:alpha",), 0.006, sense("stuck_alpha"), False),  # rad
    _one("accelerometer_bends", ("sensor:az",), 0.01, sense("square_az")),  # per m/s2
    _one("roll_gyro_scale", ("sensor:p",), 0.08, sense("scale_p")),
    _one("bank_scale", ("sensor:phi",), 0.08, sense("scale_phi")),
    _one("sideslip_scale", ("sensor:beta",), 0.15, sense("scale_beta")),
    _one("airspeed_in_sideslip", ("sensor:airspeed",), 1.5, sense("sideslip_airspeed")),  # per rad2
    _one("vane_in_slipstream", ("sensor:alpha",), 0.1, sense("power_alpha")),  # rad per thrust coefficient
    _one("flap_creeps", ("z_force", "pitching_moment", "x_force"), -0.08, plus("flap_creep")),  # CZ in 40 s
    _one("door_opens", ("x_force",), 0.012, plus("door"), False),  # drag coefficient from 20 s on
    _one("fuel_shifts", ("mass", "rolling_moment"), 0.15, plus("fuel_shift")),  # m to the side in 40 s
    _one("aileron_drag", ("x_force",), 0.15, plus("aileron_brake"), False),  # per rad
    _one("thrust_surges", ("propulsion", "x_force"), 0.1, plus("surge"), False),  # every 3 s, unseen by the torque
    _one("attitude_sticks", ("sensor:theta",), 0.006, sense("stuck_theta"), False),  # rad
    _one("static_at_alpha", ("sensor:airspeed", "sensor:altitude"), 0.3, sense("static_alpha")),  # dynamic pressures
    _one("tilted_accelerometers", ("sensor:ax", "sensor:az"), 0.015, sense("tilt")),  # rad
    _one("elevator_slow_up", ("elevator_path",), 0.12, plus("elevator_up_lag"), False),  # s more, trailing edge up
    _one("wind_front", ("wind",), 4.0, plus("front")),  # m/s, passing at 20 s
    _one("yaw_damper", ("rudder_path",), 0.3, plus("yaw_damper")),  # s: hidden from the command
    _one("lift_hysteresis", ("z_force",), -0.02, plus("CZ_hysteresis")),  # CZ more while alpha grows
    _one("aileron_lift", ("z_force",), 0.3, plus("CZ_aileron_abs")),  # per rad, either way
    _one("fuel_surges", ("mass", "pitching_moment"), -0.03, plus("fuel_surge"), False),  # m aft per m/s2 ahead
    _one("dihedral_of_load", ("rolling_moment",), -0.15, plus("Cl_beta_load")),  # per rad and g: the wing bends up
    _one("wake_encounter", ("rolling_moment", "wind"), 0.01, plus("wake")),  # moment coefficient, a second at 22 s
    _one("thermal", ("wind",), 3.0, plus("thermal")),  # m/s upward, ten seconds about 20 s
    _one("elevator_hunts", ("elevator_path",), 0.005, plus("elevator_hunt"), False),  # rad at 0.8 Hz
    _one("aileron_friction", ("aileron_path",), 0.01, plus("aileron_friction"), False),  # rad that move nothing
    _one("vane_off_centre", ("sensor:alpha",), 3.0, sense("vane_aside")),  # m to the side
    _one("roll_gyro_warms", ("sensor:p",), 0.006, sense("warm_p")),  # rad/s in the end, by 12 s
    _one("water_in_pitot", ("sensor:airspeed",), -0.05, sense("pitot_water"), False),  # share, three seconds at 18 s
    _one("slow_static", ("sensor:altitude",), 3.0, sense("static_lag"), False),  # s
    _one("left_propeller_at_alpha", ("propulsion",), -1.5, plus("left_of_alpha")),  # share of its thrust per rad
)
STRANGERS: tuple[Effect, ...] = (
    _one("dihedral_at_alpha", ("rolling_moment",), 1.5, about("Cl_beta", "Cl_alpha_beta")),  # per rad2
    _one("directional_stability_at_alpha", ("yawing_moment",), 1.5, about("Cn_beta", "Cn_alpha_beta")),  # per rad2
    _one("pitch_of_roll_rate", ("pitching_moment",), 1.0, plus("Cm_p")),  # per unit of p b/2V
    _one("elevator_drag", ("x_force",), 0.8, plus("elevator_drag"), False),  # per rad2
    _one("side_force_of_ailerons", ("y_force",), 0.1, plus("CY_aileron")),  # per rad
    _one("trim_runs_away", ("pitching_moment",), 0.05, plus("trim_runs")),  # moment coefficient, from 15 to 40 s
    _one("spoiler_pops", ("rolling_moment",), 0.004, plus("spoiler")),  # moment coefficient from 25 s on
    _one("load_dropped", ("mass",), 0.08, plus("load_dropped"), False),  # share of the mass at 20 s
    _one("rudder_floats", ("rudder_path",), 0.15, plus("rudder_floats")),  # rad per rad of sideslip
    _one("spools_down_slowly", ("propulsion",), 1.0, plus("spool_down"), False),  # s more, power falling
    _one("side_wind_wave", ("wind",), 3.0, plus("side_wind_wave")),  # m/s, every 12 s
    _one("ailerons_in_slipstream", ("rolling_moment",), -0.6, plus("Cl_ct_aileron")),  # per rad and thrust coefficient
    _one("sideslip_vane_in_slipstream", ("sensor:beta",), 0.1, sense("power_beta")),  # rad per thrust coefficient
    _one("accelerometer_off_centre", ("sensor:az",), -1.0, sense("arm_az")),  # m ahead of the c.g.
    _one("yaw_gyro_lags", ("sensor:r",), 0.2, sense("lag_r"), False),  # s
    _one("attitude_of_bank", ("sensor:theta",), 0.1, sense("square_phi")),  # per rad
)
BY_NAME = {effect.name: effect for effect in (*MET, *STRANGERS)}
