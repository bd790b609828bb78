"""A simple ice management system: how bad is the ice, what protects against it, and what may still be flown.

It sees measurements and estimates only. The four functions of Bragg et al. (AIAA-2000-0360): sense and characterise the
ice, operate the ice protection, protect the envelope, advise the crew.

* severity: inverse-variance mean of the severities that excess drag and, where elevator inputs have excited them, the
  losses of CL_alpha, Cm_alpha and Cm_elevator speak for. Drag comes first because its scatter is the smallest part of
  its icing effect (founding paper: excess drag follows icing above 80 %); the fleet scatter in each variance says so.
* detection: confirmed after a time above a threshold, released after a time below a lower one (hysteresis), by one
  counter that runs up and down
* alpha_limit = alpha_stall (less with flap) - shift * severity - margin
* V_s = sqrt(2 m g/(rho S CL_max)), CL_max = CL at alpha_stall, clean, + flap, less a loss per severity;
  airspeed_limit = factor V_s
* bank_limit = acos(1/n_max), n_max = (V/(factor V_s))^2
* flap_limit: intermediate flap while tail ice is suspected, until the ice is gone
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.kernels import air_density, clip
from controllers.parameters import read_parameters
from icing_env.atmosphere import G0
from icing_env.jit import entry, kernel
from icing_env.types import ADVISORY, Field, structured

IMS_TUNING_FIELDS: list[Field] = [
    ("drag_severe", "1", "excess drag coefficient at severity 1"),
    ("drag_scatter", "1", "standard deviation of the drag coefficient between aircraft of the type"),
    ("derivative_loss_severe", "1", "relative loss of CL_alpha, Cm_alpha and Cm_elevator at severity 1"),
    ("derivative_scatter", "1", "relative standard deviation of these derivatives between aircraft of the type"),
    ("excitation_low", "1", "excitation below which derivatives do not count"),
    ("excitation_high", "1", "excitation above which they count fully"),
    ("severity_time", "s", "time constant of the severity"),
    ("confidence_half", "1", "standard deviation of the severity at which the confidence is one half"),
    ("confidence_min", "1", "confidence below which nothing is newly detected"),
    ("detect_severity", "1", "severity above which ice is believed"),
    ("clear_severity", "1", "severity below which it is no longer believed"),
    ("detect_time", "s", "time above the threshold until ice is detected"),
    ("clear_time", "s", "time below the lower threshold until it is no longer"),
    ("boots_temperature", "K", "static temperature below which boots are cycled"),
    ("heat_temperature", "K", "static temperature below which propellers are heated"),
    ("alpha_shift", "rad", "loss of stall angle at severity 1"),
    ("alpha_margin", "rad", "distance of the limit from the stall angle"),
    ("alpha_flap", "1", "change of the stall angle per flap angle"),
    ("CL_max_loss", "1", "relative loss of maximum lift at severity 1"),
    ("CL_max_flap", "1/rad", "maximum lift coefficient gained per flap angle"),
    ("stall_factor_clean", "1", "airspeed limit over stall speed, clean"),
    ("stall_factor_iced", "1", "airspeed limit over stall speed, ice detected"),
    ("bank_factor_clean", "1", "airspeed over stall speed at which no bank is left, clean"),
    ("bank_factor_iced", "1", "the same, ice detected"),
    ("bank_min", "rad", "bank that is always allowed"),
    ("bank_max", "rad", "bank that is never exceeded"),
    ("flap_full", "rad", "flap allowed without tail ice"),
    ("flap_tail_ice", "rad", "flap allowed with tail ice suspected"),
    ("tail_loss", "1", "relative loss of Cm_elevator that makes tail ice suspected"),
    ("tail_severity", "1", "severity above which tail ice is suspected whatever the derivatives say"),
]
IMS_TUNING = structured(IMS_TUNING_FIELDS)


def load_tuning(name: str | Path = "ice_management") -> NDArray[Any]:
    """Thresholds of the ice management, one row of IMS_TUNING. Raises InputError for a file that does not fit."""
    return read_parameters(name, IMS_TUNING_FIELDS)


def init(n: int) -> NDArray[Any]:
    """Advisories for `n` aircraft before the first step: no ice, nothing limited (ADVISORY rows)."""
    advisory = np.zeros(n, ADVISORY)
    for name in ("alpha_limit", "bank_limit", "flap_limit"):
        advisory[name] = 0.5 * math.pi
    return advisory


@kernel
def loss(estimate: float, std: float, clean: float, g: Any) -> tuple[float, float]:
    """Severity that one derivative speaks for, and its weight (one over the variance)."""
    severity = (1.0 - estimate/clean)/g.derivative_loss_severe
    variance = (std/clean)*(std/clean) + g.derivative_scatter*g.derivative_scatter
    return severity, g.derivative_loss_severe*g.derivative_loss_severe/variance


@kernel
def assess(e: Any, frame: Any, g: Any) -> tuple[float, float]:
    """Severity (0..1) and its confidence (0..1) from the estimate of now."""
    weight = g.drag_severe*g.drag_severe/(e.CD_0_std*e.CD_0_std + g.drag_scatter*g.drag_scatter)
    total = weight*e.excess_drag/g.drag_severe
    gate = clip((e.excitation_longitudinal - g.excitation_low)/(g.excitation_high - g.excitation_low), 0.0, 1.0)
    for k in range(3):
        if k == 0:
            severity, w = loss(e.CL_alpha, e.CL_alpha_std, frame.CX_0 - frame.CZ_alpha, g)
        elif k == 1:
            severity, w = loss(e.Cm_alpha, e.Cm_alpha_std, frame.Cm_alpha, g)
        else:
            severity, w = loss(e.Cm_elevator, e.Cm_elevator_std, frame.Cm_elevator, g)
        total += gate*w*severity
        weight += gate*w
    variance = 1.0/weight
    confidence = 1.0/(1.0 + variance/(g.confidence_half*g.confidence_half))
    return clip(total/weight, 0.0, 1.0), confidence


@kernel
def characterise(a: Any, e: Any, frame: Any, g: Any, dt: float) -> None:
    """Severity, confidence and detection. An unhealthy or undefined estimate changes the confidence only."""
    severity, confidence = assess(e, frame, g)
    if e.health != 1.0 or not (math.isfinite(severity) and math.isfinite(confidence)):
        a.confidence = 0.0
        a.since_detection += dt*a.ice_detected
        return
    a.severity += (severity - a.severity)*(1.0 - math.exp(-dt/g.severity_time))
    a.confidence = confidence
    if a.severity > g.detect_severity and confidence >= g.confidence_min:
        a.memory = min(a.memory + dt/g.detect_time, 1.0)
    elif a.severity < g.clear_severity:
        a.memory = max(a.memory - dt/g.clear_time, 0.0)
    if a.memory >= 1.0:
        a.ice_detected = 1.0
    elif a.memory <= 0.0:
        a.ice_detected = 0.0
    a.since_detection = (a.since_detection + dt)*a.ice_detected


@kernel
def operate_protection(a: Any, m: Any, g: Any) -> None:
    """Boots and propeller heat: on while ice is detected and it is cold enough to freeze."""
    boots = a.ice_detected if m.temperature < g.boots_temperature else 0.0
    a.boots_wing = a.boots_tail = a.boots_vtail_struts = boots
    a.prop_heat = a.ice_detected if m.temperature < g.heat_temperature else 0.0


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


@entry
def step(
    advisory: NDArray[Any],
    estimate: NDArray[Any],
    measurement: NDArray[Any],
    airframe: NDArray[Any],
    tuning: NDArray[Any],
    dt: float,
) -> None:
    """One step of every ice management, in place.

    Args:
        advisory: ADVISORY rows, one per aircraft; what they held before is the memory.
        estimate: ESTIMATE rows.
        measurement: MEASUREMENT rows.
        airframe: one row for all or one per aircraft, with `wing_area` m2, `mass` kg, `alpha_stall` rad and the clean
            derivatives by name.
        tuning: one IMS_TUNING row for all, or one per aircraft.
        dt: time since the last step [s].
    """
    for i in range(len(advisory)):
        a, e, m = advisory[i], estimate[i], measurement[i]
        frame = airframe[i if len(airframe) > 1 else 0]
        g = tuning[i if len(tuning) > 1 else 0]
        characterise(a, e, frame, g, dt)
        operate_protection(a, m, g)
        limit_envelope(a, m, frame, g)
        limit_flap(a, e, frame, g)


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
