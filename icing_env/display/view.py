"""What the primary flight display shows of one aircraft."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

STANDARD_GRAVITY = 9.80665  # m/s2


@dataclass(frozen=True)
class DisplayView:
    """Everything that the display shows, SI and rad; signs as in the flight record.

    `airspeed_limit / stall_margin` is where the red band of the speed tape begins. A selected value of None is not
    shown. A reading that is not finite is shown as failed: its instrument gives way to a red cross.
    """

    time: float = 0.0
    airspeed: float = 0.0
    altitude: float = 0.0
    vertical_speed: float = 0.0
    phi: float = 0.0
    theta: float = 0.0
    psi: float = 0.0
    alpha: float = 0.0
    beta: float = 0.0
    load_factor: float = 1.0
    throttle_left: float = 0.0
    throttle_right: float = 0.0
    elevator: float = 0.0
    aileron: float = 0.0
    rudder: float = 0.0
    flap: float = 0.0
    severity: float = 0.0
    confidence: float = 0.0
    ice_detected: float = 0.0
    boots_wing: float = 0.0
    boots_tail: float = 0.0
    boots_vtail_struts: float = 0.0
    prop_heat: float = 0.0
    alpha_limit: float = math.radians(12.0)
    airspeed_limit: float = 40.0
    bank_limit: float = math.radians(45.0)
    intervention: float = 0.0
    CL_alpha_ratio: float = 1.0
    Cm_alpha_ratio: float = 1.0
    excess_drag: float = 0.0
    excitation: float = 0.0
    health: float = 1.0
    alpha_stall_clean: float = math.radians(15.0)
    stall_margin: float = 1.2  # assumed
    airspeed_selected: float | None = None
    altitude_selected: float | None = None
    heading_selected: float | None = None

    @classmethod
    def from_rows(
        cls,
        measurement: np.void,
        advisory: np.void,
        estimate: np.void,
        clean: tuple[float, float],
        alpha_stall_clean: float,
        selected: tuple[float | None, float | None, float | None] = (None, None, None),
    ) -> DisplayView:
        """View of one aircraft from its rows of MEASUREMENT, ADVISORY and ESTIMATE.

        Args:
            measurement: a row of `types.MEASUREMENT`.
            advisory: a row of `types.ADVISORY`.
            estimate: a row of `types.ESTIMATE`.
            clean: CL_alpha and Cm_alpha of the clean aircraft, 1/rad.
            alpha_stall_clean: angle of attack at which the clean wing stalls, rad.
            selected: airspeed (m/s), altitude (m) and heading (rad) that the autopilot holds, None where it does not.

        Returns:
            The view. Vertical speed is that of the aircraft through the air, as no instrument on board records it.
        """
        from_measurement = ("time", "airspeed", "altitude", "phi", "theta", "psi", "alpha", "beta", "throttle_left",
                            "throttle_right", "elevator", "aileron", "rudder", "flap")  # fmt: skip
        from_advisory = ("severity", "confidence", "ice_detected", "boots_wing", "boots_tail", "boots_vtail_struts",
                         "prop_heat", "alpha_limit", "airspeed_limit", "bank_limit", "intervention")  # fmt: skip
        values = {name: float(measurement[name]) for name in from_measurement}
        values |= {name: float(advisory[name]) for name in from_advisory}
        return cls(
            **values,
            vertical_speed=climb_rate(*(values[k] for k in ("airspeed", "alpha", "beta", "phi", "theta"))),
            load_factor=-float(measurement["az"]) / STANDARD_GRAVITY,
            CL_alpha_ratio=float(estimate["CL_alpha"]) / clean[0],
            Cm_alpha_ratio=float(estimate["Cm_alpha"]) / clean[1],
            excess_drag=float(estimate["excess_drag"]),
            excitation=float(estimate["excitation_longitudinal"]),
            health=float(estimate["health"]),
            alpha_stall_clean=alpha_stall_clean,
            airspeed_selected=selected[0],
            altitude_selected=selected[1],
            heading_selected=selected[2],
        )


def climb_rate(airspeed: float, alpha: float, beta: float, phi: float, theta: float) -> float:
    """Vertical speed through the air, m/s up (Stevens & Lewis, navigation equations, with no wind)."""
    u = airspeed * math.cos(alpha) * math.cos(beta)
    v = airspeed * math.sin(beta)
    w = airspeed * math.sin(alpha) * math.cos(beta)
    return u * math.sin(theta) - (v * math.sin(phi) + w * math.cos(phi)) * math.cos(theta)
