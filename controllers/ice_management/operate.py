"""Function 2, operate the ice protection: which boots inflate when, and how long the propellers are heated.

An inflation leaves thin ice nearly as it is and a quarter of thick ice; what it leaves is the residual that the next
one meets. So boots wait for a thickness that they can shed, which follows from the measured liquid water: a surface
collects catch LWC V/rho_ice, an inflation leaves the share residual + (1 - residual) exp(-thickness/thin) of it
(`icing_env.ice_protection`). They inflate

* once as soon as ice is believed, whatever was there before (a start with ice, a failed probe)
* when the collected thickness is worth an inflation
* after a cycle where a surface is told to carry ice although none was collected, or the probe says nothing
* at the latest after a long cycle while ice is believed

but never sooner than some time after the last inflation, and not in air too warm for ice to form. Propellers are heated
while they collect water in the cold, and for a cycle after ice is first believed or while ice is told of them, part of
the time (the longer, the colder): a little ice costs little thrust, the heat costs power.

What failed is told by the characteriser, for which each inflation is an experiment; boots go on inflating, for the
other side and in hope.
"""

from __future__ import annotations

import math
from typing import Any

from numpy.typing import NDArray

from controllers.kernels import airspeed_of, clip
from icing_env.jit import entry, kernel
from icing_env.types import Field

PULSE = 1.0  # s that a boot's switch stays on: one inflation, seen by whoever looks once a second
FREEZING = 273.15  # K
OPERATE_FIELDS: list[Field] = [
    ("boots_temperature", "K", "static temperature below which boots inflate"),
    ("heat_temperature", "K", "static temperature below which propellers are heated"),
    ("catch_wing", "1", "share of the liquid water ahead of it that freezes on the wing's leading edge"),
    ("catch_tail", "1", "the same for the tailplane"),
    ("catch_struts", "1", "the same for fin and struts"),
    ("boot_thickness", "m", "collected ice that is worth an inflation"),
    ("boot_residual", "1", "share of thick ice that an inflation leaves"),
    ("boot_thin", "m", "thickness that an inflation mostly leaves"),
    ("boot_interval", "s", "shortest time between inflations"),
    ("boot_cycle", "s", "time between inflations on ice that was told, not collected"),
    ("boot_cycle_most", "s", "longest time between inflations while ice is believed"),
    ("boot_severity", "1", "eta of a surface that is worth an inflation"),
    ("water_least", "kg/m3", "liquid water content from which propellers are heated"),
    ("heat_period", "s", "period of the propeller heat"),
    ("heat_share_warm", "1", "share of it that is heated at 0 C"),
    ("heat_share_cold", "1", "share of it that is heated at -20 C"),
    ("heat_after", "s", "heat after the last water"),
    ("ice_density", "kg/m3", "density of ice"),
]


@kernel
def collected(thickness: float, catch: float, m: Any, g: Any, dt: float) -> float:
    """Ice on a leading edge a step on [m]: what the measured water adds; none stays in warm air."""
    if m.temperature >= FREEZING:
        return thickness*math.exp(-dt/g.boot_interval)
    water = m.lwc if math.isfinite(m.lwc) and m.temperature < FREEZING else 0.0
    return min(thickness + catch*max(water, 0.0)*airspeed_of(m)/g.ice_density*dt, 1.0)


@kernel
def left_of(thickness: float, g: Any) -> float:
    """Ice that an inflation leaves of it [m]."""
    return thickness*(g.boot_residual + (1.0 - g.boot_residual)*math.exp(-thickness/g.boot_thin))


@kernel
def inflates(a: Any, since: float, thickness: float, eta: float, m: Any, g: Any) -> bool:
    """Whether a group of boots inflates now; `since` 0: not yet since ice is believed."""
    if a.ice_detected == 0.0 or not m.temperature < g.boots_temperature:
        return False
    blind = not math.isfinite(m.lwc)
    wait = g.boot_cycle if blind or eta > g.boot_severity else g.boot_cycle_most
    return since == 0.0 or (since >= g.boot_interval and (thickness >= g.boot_thickness or since >= wait))


@kernel
def shot(a: Any, since: float, now: bool, g: Any, dt: float) -> float:
    """Time since the last inflation a step on [s]; 0 once ice is no longer believed and the boots may inflate again."""
    if now:
        return dt
    if since == 0.0 or (a.ice_detected == 0.0 and since >= g.boot_interval):
        return 0.0
    return since + dt


@kernel
def inflate(a: Any, m: Any, g: Any, dt: float) -> None:
    """All groups of boots."""
    a.collected_wing = collected(a.collected_wing, g.catch_wing, m, g, dt)
    a.collected_tail = collected(a.collected_tail, g.catch_tail, m, g, dt)
    a.collected_struts = collected(a.collected_struts, g.catch_struts, m, g, dt)
    wing = inflates(a, a.shot_wing, a.collected_wing, max(a.severity_left_wing, a.severity_right_wing), m, g)
    tail = inflates(a, a.shot_tail, a.collected_tail, a.severity_htail, m, g)
    struts = inflates(a, a.shot_struts, a.collected_struts, 0.0, m, g)
    if wing:
        a.collected_wing = left_of(a.collected_wing, g)
    if tail:
        a.collected_tail = left_of(a.collected_tail, g)
    if struts:
        a.collected_struts = left_of(a.collected_struts, g)
    a.shot_wing = shot(a, a.shot_wing, wing, g, dt)
    a.shot_tail = shot(a, a.shot_tail, tail, g, dt)
    a.shot_struts = shot(a, a.shot_struts, struts, g, dt)
    a.boots_wing = 1.0 if 0.0 < a.shot_wing <= PULSE else 0.0
    a.boots_tail = 1.0 if 0.0 < a.shot_tail <= PULSE else 0.0
    a.boots_vtail_struts = 1.0 if 0.0 < a.shot_struts <= PULSE else 0.0


@kernel
def heat(a: Any, m: Any, g: Any, dt: float) -> None:
    """Propeller heat: `heating` is its clock, 0 while there is no need."""
    cold = m.temperature < g.heat_temperature
    told = a.ice_detected == 1.0 and (a.severity_propeller > g.boot_severity or a.since_detection < g.boot_cycle
                                      or not math.isfinite(m.lwc))
    if cold and (m.lwc > g.water_least or told):
        a.collected_propeller = g.heat_after  # s for which the need outlasts the water
    else:
        a.collected_propeller = max(a.collected_propeller - dt, 0.0)
    if not cold or a.collected_propeller == 0.0:
        a.heating, a.prop_heat = 0.0, 0.0
        return
    share = g.heat_share_warm + (g.heat_share_cold - g.heat_share_warm)*(FREEZING - m.temperature)/20.0
    a.prop_heat = 1.0 if a.heating < clip(share, 0.0, 1.0)*g.heat_period else 0.0
    a.heating = a.heating + dt if a.heating < g.heat_period else 0.0


@kernel
def operate_protection(a: Any, m: Any, g: Any, dt: float) -> None:
    """Boots and propeller heat of one aircraft, one step."""
    inflate(a, m, g, dt)
    heat(a, m, g, dt)


@entry
def operate(command: NDArray[Any], advisory: NDArray[Any]) -> None:
    """Switch boots and heat in COMMAND rows as the ADVISORY rows ask: on with the ice, off with the all-clear.

    While the management operates the ice protection, the switches are its own; a crew that wants them back switches
    the management's hand off (`boots=False`).
    """
    for i in range(len(command)):
        c, a = command[i], advisory[i]
        c.boots_wing = a.boots_wing
        c.boots_tail = a.boots_tail
        c.boots_vtail_struts = a.boots_vtail_struts
        c.prop_heat = a.prop_heat
