"""Function 3, its limits: what may still be flown with what is known now (`controllers.protection` keeps them).

* alpha_limit = alpha_stall (less with flap) - shift * severity - margin
* V_s = sqrt(2 m g/(rho S CL_max)), CL_max = CL at alpha_stall, clean, + flap, less a loss per severity;
  airspeed_limit = factor V_s
* bank_limit = acos(1/n_max), n_max = (V/(factor V_s))^2
* flap_limit: intermediate flap while tail ice is suspected, until the ice is gone
"""

from __future__ import annotations

import math
from typing import Any

from controllers.kernels import air_density, clip
from icing_env.atmosphere import G0
from icing_env.jit import kernel


@kernel
def limit_envelope(a: Any, m: Any, frame: Any, g: Any) -> None:
    """Limits of angle of attack, airspeed and bank for the present severity, mass, density and flap."""
    flap = clip(m.flap, 0.0, g.flap_full)
    a.alpha_limit = frame.alpha_stall + g.alpha_flap*flap - g.alpha_shift*a.severity - g.alpha_margin
    lift = -(frame.CZ_0 + frame.CZ_alpha*frame.alpha_stall) + g.CL_max_flap*flap
    lift = max(lift*(1.0 - g.CL_max_loss*a.severity), 0.1)
    stall = math.sqrt(2.0*frame.mass*G0/(air_density(m)*frame.wing_area*lift))
    iced = min(a.severity/g.detect_severity, 1.0)
    a.airspeed_limit = stall*(g.stall_factor_clean + (g.stall_factor_iced - g.stall_factor_clean)*iced)
    level = stall*(g.bank_factor_clean + (g.bank_factor_iced - g.bank_factor_clean)*iced)
    ratio = max(m.airspeed, 1.0)/level
    a.bank_limit = clip(math.acos(1.0/max(ratio*ratio, 1.0)), g.bank_min, g.bank_max)


@kernel
def limit_flap(a: Any, e: Any, frame: Any, g: Any) -> None:
    """Flap limit: full flap loads an iced tailplane into its stall, so it waits until the ice is gone."""
    suspected = a.severity > g.tail_severity
    if e.health == 1.0 and e.excitation_longitudinal >= g.excitation_high:
        suspected = suspected or e.Cm_elevator/frame.Cm_elevator < 1.0 - g.tail_loss
    if a.ice_detected == 0.0:
        a.flap_limit = g.flap_full
    elif suspected:
        a.flap_limit = g.flap_tail_ice
