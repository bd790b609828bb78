"""The library of effects: every way in which an aircraft may differ from its model, one file each.

Adding one: write its file, add its line here. It is then simulated (`icing fly --effect`), randomised, searched for
(`icing diagnose`) and held to the contract tests.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from icing_env.effects import (
    aileron_gearing,
    aileron_lag,
    aileron_power,
    air_density,
    airspeed_scale,
    alpha_bias,
    alpha_scale,
    asymmetric_ice,
    asymmetric_thrust,
    axial_accelerometer_bias,
    beta_bias,
    boom_oscillation,
    cg_shift,
    derivatives,
    dihedral_effect,
    directional_stability,
    discrepancy,
    downwash_lag,
    drag_due_to_lift,
    early_stall,
    elevator_gearing,
    elevator_lag,
    elevator_offset,
    elevator_power,
    elevator_rate_limit,
    fin_ice,
    ice_drag,
    inertia_error,
    lateral_cg,
    lift_slope,
    mass_error,
    normal_accelerometer_bias,
    pitch_attitude_bias,
    pitch_damping,
    pitch_gyro_bias,
    pitch_trim,
    power_pitching,
    roll_damping,
    roll_trim,
    rudder_gearing,
    rudder_lag,
    rudder_power,
    side_force,
    spool_lag,
    static_stability,
    tail_ice,
    thrust_loss,
    turbulence,
    updraft,
    vane_lag,
    vane_position,
    wind_shear,
    wing_ice,
)
from icing_env.effects.effect import Effect, Parameter
from icing_env.errors import InputError, nearest
from icing_env.parameters import copied

LIBRARY: dict[str, Effect] = {
    module.EFFECT.name: module.EFFECT
    for module in (
        wing_ice,
        tail_ice,
        fin_ice,
        asymmetric_ice,
        ice_drag,
        lift_slope,
        static_stability,
        pitch_damping,
        aileron_power,
        rudder_power,
        roll_damping,
        directional_stability,
        dihedral_effect,
        side_force,
        elevator_power,
        drag_due_to_lift,
        early_stall,
        pitch_trim,
        roll_trim,
        downwash_lag,
        power_pitching,
        thrust_loss,
        asymmetric_thrust,
        spool_lag,
        mass_error,
        cg_shift,
        lateral_cg,
        inertia_error,
        elevator_lag,
        elevator_gearing,
        aileron_lag,
        aileron_gearing,
        rudder_lag,
        rudder_gearing,
        elevator_offset,
        elevator_rate_limit,
        alpha_bias,
        beta_bias,
        pitch_gyro_bias,
        pitch_attitude_bias,
        axial_accelerometer_bias,
        normal_accelerometer_bias,
        alpha_scale,
        airspeed_scale,
        vane_lag,
        vane_position,
        boom_oscillation,
        updraft,
        wind_shear,
        air_density,
        turbulence,
    )
}

# Ways of flying a description, which are no explanation and are never searched for.
DESCRIPTIONS: dict[str, Effect] = {e.name: e for e in (derivatives.EFFECT, discrepancy.EFFECT)}


def get(name: str) -> Effect:
    """The effect of that name, of the library or a description.

    Raises:
        InputError: there is none; the nearest is named.
    """
    if name in LIBRARY:
        return LIBRARY[name]
    if name in DESCRIPTIONS:
        return DESCRIPTIONS[name]
    raise InputError(f"no effect '{name}': {nearest(name, [*LIBRARY, *DESCRIPTIONS])}")


def with_effects(parameters: NDArray, effects: Mapping[str, Mapping[str, float | NDArray]]) -> NDArray:
    """Copy of a PARAMETERS array with effects in it.

    Args:
        parameters: one row for all or one per aircraft.
        effects: values by parameter, by effect; a parameter left out stays neutral.

    Raises:
        InputError: unknown effect or parameter, a value that is no finite number, or not one per aircraft.
    """
    out = copied(parameters)
    for name, values in effects.items():
        effect = get(name)
        valid = [p.name for p in effect.parameters]
        for key, value in values.items():
            if key not in valid:
                raise InputError(f"effect '{name}' has no parameter '{key}': {nearest(key, valid)}")
            if not np.isfinite(value).all():
                raise InputError(f"effect '{name}': {key} is {value}: expected a finite number")
            if np.size(value) not in (1, len(out)):
                raise InputError(f"effect '{name}': {np.size(value)} values of {key} for {len(out)} aircraft")
        effect.apply(out, {**effect.neutral(), **values})
    return out


def parse(text: str) -> tuple[str, dict[str, float]]:
    """Effect and values of `NAME` or `NAME:PARAM=VALUE,...`; without values the typical ones.

    Raises:
        InputError: not of that form.
    """
    name, _, rest = text.partition(":")
    effect = get(name)
    values = {} if rest else effect.typical()
    for part in filter(None, rest.split(",")):
        key, _, number = part.partition("=")
        try:
            values[key] = float(number)
        except ValueError:
            right = f"{name}:{_example(effect)}"
            raise InputError(f"effect '{text}': '{part}' is not PARAM=NUMBER, as in {right}") from None
    return name, values


def _example(effect: Effect) -> str:
    return ",".join(f"{p.name}={p.typical:g}" for p in effect.parameters)


__all__ = ["DESCRIPTIONS", "LIBRARY", "Effect", "Parameter", "get", "parse", "with_effects"]
