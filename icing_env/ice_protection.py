"""Ice protection: pneumatic boots on wing, tailplane, fin and struts, and electric heat on the propellers.

A rising edge of a boot command inflates that group once; a command held on inflates again every `boot_cycle_time`.
An inflation leaves of each surface's ice the share
    residual + (1 - residual) exp(-thickness / boot_thin_thickness),
so that thin ice stays on better than thick ice; with both parameters zero the boots are perfect, as the paper's
severity assumes. Only the booted share of the struts is cleared. Some of what was cleared refreezes on the parts
without protection (runback, ridges behind the boots), while it is cold enough. A failed boot inflates without effect.
Propeller heat removes ice with a time constant and costs power while it is on.
"""

from __future__ import annotations

import math
from typing import Any

from icing_env.accretion import add_severity
from icing_env.jit import kernel
from icing_env.types import Field

PROTECTION_PARAMETERS: list[Field] = [
    ("boot_cycle_time", "s", "time between inflations while a boot command is held on"),
    ("boot_residual", "1", "share of thick ice that an inflation leaves"),
    ("boot_thin_thickness", "m", "thickness below which ice bridges or stays; 0 for none of that"),
    ("boot_share_struts", "1", "share of strut and gear ice that the boots can reach"),
    ("boot_runback_share", "1", "share of the cleared mass that refreezes on other parts below 0 C"),
    ("runback_severity", "1/kg", "severity of the other parts per mass refrozen on them"),
    ("boot_failed_left_wing", "0/1", "boot without effect"),
    ("boot_failed_right_wing", "0/1", "boot without effect"),
    ("boot_failed_htail", "0/1", "boot without effect"),
    ("boot_failed_vtail", "0/1", "boot without effect"),
    ("boot_failed_struts", "0/1", "boot without effect"),
    ("prop_heat_power", "W", "electric power of the propeller heat, both propellers"),
    ("prop_heat_time", "s", "time constant with which the heat removes propeller ice"),
    ("prop_heat_failed", "0/1", "no heat and no power drawn"),
]


@kernel
def left_by_boot(p: Any, thickness: float, failed: float, reach: float) -> float:
    """Share of a surface's ice left by one inflation that reaches the share `reach` of it."""
    if failed != 0.0:
        return 1.0
    left: float = p.boot_residual
    if p.boot_thin_thickness > 0.0:
        left += (1.0 - left) * math.exp(-thickness / p.boot_thin_thickness)
    return 1.0 - reach * (1.0 - left)


@kernel
def run_back(s: Any, p: Any, cleared: float) -> None:
    """Refreeze some of a cleared mass (kg) on the other parts."""
    if s.temperature < 273.15 and cleared > 0.0:
        mass = p.boot_runback_share * cleared
        s.ice_mass_other += mass
        s.eta_other = add_severity(s.eta_other, p.runback_severity * mass, p.eta_saturation_other)


@kernel
def inflate_wing(s: Any, p: Any) -> None:
    """One inflation of the wing boots."""
    left = left_by_boot(p, s.thickness_left_wing, p.boot_failed_left_wing, 1.0)
    right = left_by_boot(p, s.thickness_right_wing, p.boot_failed_right_wing, 1.0)
    cleared = (1.0 - left) * s.ice_mass_left_wing + (1.0 - right) * s.ice_mass_right_wing
    s.eta_left_wing *= left
    s.thickness_left_wing *= left
    s.ice_mass_left_wing *= left
    s.eta_right_wing *= right
    s.thickness_right_wing *= right
    s.ice_mass_right_wing *= right
    run_back(s, p, cleared)


@kernel
def inflate_tail(s: Any, p: Any) -> None:
    """One inflation of the tailplane boots."""
    left = left_by_boot(p, s.thickness_htail, p.boot_failed_htail, 1.0)
    cleared = (1.0 - left) * s.ice_mass_htail
    s.eta_htail *= left
    s.thickness_htail *= left
    s.ice_mass_htail *= left
    run_back(s, p, cleared)


@kernel
def inflate_vtail_struts(s: Any, p: Any) -> None:
    """One inflation of the fin and strut boots."""
    fin = left_by_boot(p, s.thickness_vtail, p.boot_failed_vtail, 1.0)
    struts = left_by_boot(p, s.thickness_struts, p.boot_failed_struts, p.boot_share_struts)
    cleared = (1.0 - fin) * s.ice_mass_vtail + (1.0 - struts) * s.ice_mass_struts
    s.eta_vtail *= fin
    s.thickness_vtail *= fin
    s.ice_mass_vtail *= fin
    s.eta_struts *= struts
    s.thickness_struts *= struts
    s.ice_mass_struts *= struts
    run_back(s, p, cleared)


@kernel
def fires(on: bool, was: bool, age: float, cycle: float) -> bool:
    """True when a boot inflates now: its command rose, or is held and the cycle is over."""
    return on and (not was or age >= cycle)


@kernel
def advance_protection(s: Any, p: Any, command: Any, dt: float) -> None:
    """Obey the ice-protection commands for a step.

    Args:
        s: STATE record; writes the protection and ice fields.
        p: PROTECTION_PARAMETERS and eta_saturation_other.
        command: COMMAND record; reads boots_wing, boots_tail, boots_vtail_struts, prop_heat (on above 0.5).
        dt: step, s.
    """
    s.boot_age_wing += dt
    s.boot_age_tail += dt
    s.boot_age_vtail_struts += dt
    wing, tail, fin = command.boots_wing > 0.5, command.boots_tail > 0.5, command.boots_vtail_struts > 0.5
    cycle = p.boot_cycle_time - 0.5 * dt  # a cycle of whole steps, whatever the rounding of the sum
    if fires(wing, s.boot_was_wing > 0.5, s.boot_age_wing, cycle):
        inflate_wing(s, p)
        s.boot_age_wing = 0.0
        s.boot_cycles += 1.0
    if fires(tail, s.boot_was_tail > 0.5, s.boot_age_tail, cycle):
        inflate_tail(s, p)
        s.boot_age_tail = 0.0
        s.boot_cycles += 1.0
    if fires(fin, s.boot_was_vtail_struts > 0.5, s.boot_age_vtail_struts, cycle):
        inflate_vtail_struts(s, p)
        s.boot_age_vtail_struts = 0.0
        s.boot_cycles += 1.0
    s.boot_was_wing = 1.0 if wing else 0.0
    s.boot_was_tail = 1.0 if tail else 0.0
    s.boot_was_vtail_struts = 1.0 if fin else 0.0
    heat_propeller(s, p, command.prop_heat > 0.5 and p.prop_heat_failed == 0.0, dt)


@kernel
def heat_propeller(s: Any, p: Any, on: bool, dt: float) -> None:
    """Electric heat on the propellers for a step."""
    if on:
        s.heat_energy += p.prop_heat_power * dt
        if s.ice_mass_propeller > 0.0 or s.eta_propeller > 0.0:
            left = math.exp(-dt / p.prop_heat_time)
            s.eta_propeller *= left
            s.thickness_propeller *= left
            s.ice_mass_propeller *= left
