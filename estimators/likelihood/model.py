"""Which parameters of an axis are free in a fit, where they start, and the flight they give."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.likelihood.equations import (
    LATERAL_NAMES,
    LATERAL_STATES,
    LONGITUDINAL_NAMES,
    LONGITUDINAL_STATES,
    ROW_LONGITUDINAL,
    VANE_LAG,
)
from estimators.likelihood.inputs import OUTPUTS, Flown
from estimators.likelihood.simulate import free_flight
from icing_env.atmosphere import G0
from icing_env.record import FloatArray

NAMES = {"longitudinal": LONGITUDINAL_NAMES, "lateral": LATERAL_NAMES}
COUNT = {"longitudinal": LONGITUDINAL_STATES, "lateral": LATERAL_STATES}
STATE_NAMES = {"longitudinal": ("start_w", "start_q", "start_theta", "start_downwash"),
               "lateral": ("start_v", "start_p", "start_r", "start_phi")}  # fmt: skip
OUTPUT_OF = {"CZ": "az", "Cm": "q", "CX": "ax", "CY": "ay", "Cl": "p", "Cn": "r"}  # where a coefficient shows
INSTRUMENTS = {
    "longitudinal": ("alpha_scale", "alpha_lag", "theta_lag", "bias_q", "bias_az"),
    "lateral": ("beta_scale", "beta_lag", "phi_lag", "bias_p", "bias_ay"),
}
GUSTS = ("tail_lift", "gust_lag")
# A gyro's constant error, an accelerometer's and that of attitude are told apart by one equation too few: the force
# across the path. Those named above are free, the others zero.
TYPICAL = {"alpha_scale": 0.1, "beta_scale": 0.1, "alpha_lag": 0.05, "theta_lag": 0.05,
           "beta_lag": 0.05, "phi_lag": 0.05, "gust_lag": 0.05, "bias_az": 0.1,
           "bias_ay": 0.1, "start_w": 0.5, "start_v": 0.5}  # fmt: skip
CM_ALPHADOT = -8.0  # JSBSim's DHC-6 (configs/aircraft/twin_otter.toml); the record cannot tell it from Cm_q
TAIL_LIFT = 1.0 / 1.1  # of the lift that all the damping would need: wing and body damp a tenth as much as the tail
#                        (Etkin & Reid, section 5.5)
SMALL, STEP = 0.02, 0.01  # typical size of what is not named above; difference step over value or typical size


@dataclass(frozen=True)
class Model:
    """One axis of a record with some of its parameters free.

    `base` (p + n,): value of every parameter, then of every initial state; `free`: indices of those to be fitted.
    """

    flown: Flown
    names: tuple[str, ...]
    base: FloatArray
    free: tuple[int, ...]

    @property
    def theta0(self) -> FloatArray:
        """Where the free ones start."""
        return self.base[list(self.free)]

    @property
    def free_names(self) -> tuple[str, ...]:
        """Names of the free ones, in order."""
        return tuple(self.names[i] for i in self.free)

    def step(self, theta: FloatArray) -> FloatArray:
        """Half widths of the central differences about `theta`."""
        typical = np.array([TYPICAL.get(name, SMALL if "bias" in name or "start" in name else 1.0) *
                            (0.1 if name.endswith("_0") else 1.0) for name in self.free_names])  # fmt: skip
        return np.asarray(STEP * np.maximum(np.abs(theta), 0.1 * typical), dtype=np.float64)

    def spread(self, thetas: FloatArray) -> FloatArray:
        """Whole parameter vectors (m, p + n) of free ones (m, f)."""
        whole = np.repeat(self.base[None], len(thetas), axis=0)
        whole[:, list(self.free)] = thetas
        return whole

    def simulate(self, thetas: FloatArray) -> FloatArray:
        """Outputs (m, N, 5) in free flight through the record's inputs."""
        whole, count = self.spread(thetas), len(NAMES[self.flown.axis])
        parameters, starts = np.ascontiguousarray(whole[:, :count]), np.ascontiguousarray(whole[:, count:])
        flight = self.flown
        out = free_flight(flight.index, parameters, starts, flight.data, flight.inverse, flight.dt)
        return np.asarray(out, dtype=np.float64)


def model(flown: Flown, start: dict[str, float], fixed: tuple[str, ...] = (), gusts: bool = False) -> Model:
    """The model of one axis.

    Args:
        start: value of each parameter that does not start at zero.
        fixed: names kept at their start. What only an absent output could tell is kept there too.
        gusts: free what only matters to gusts.
    """
    names = (*NAMES[flown.axis], *STATE_NAMES[flown.axis])
    absent = [o for o, column in zip(OUTPUTS[flown.axis], flown.measured.T, strict=True) if np.isnan(column).all()]
    base = np.array([start.get(name, 0.0) for name in names])
    if "Cm_alphadot" not in start and flown.axis == "longitudinal":
        base[names.index("Cm_alphadot")] = CM_ALPHADOT
    if flown.axis == "longitudinal":
        base[names.index("tail_lift")] = TAIL_LIFT
    base[names.index("gust_lag")] = start.get("gust_lag", VANE_LAG)
    base[len(NAMES[flown.axis]):] = flown.start
    tied = {*fixed, *(n for n in NAMES[flown.axis] if "_" in n and OUTPUT_OF.get(n.split("_")[0]) in absent)}
    tied |= {f"bias_{o}" for o in absent} | {f"{o}_lag" for o in absent}
    tied |= {"Cm_alphadot", "start_downwash"}
    instruments = {n for n in NAMES[flown.axis] if n.split("_")[0] not in OUTPUT_OF} - set(INSTRUMENTS[flown.axis])
    instruments -= set(GUSTS) if gusts else set()
    free = tuple(i for i, name in enumerate(names) if name not in tied | instruments)
    return Model(flown, names, base, free)


def quasi_steady(plan: Model, theta: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Parameters and covariance with the moment derivatives that a model without a downwash lag would have.

    With alpha' = q + (force/V)(CZ + g/force) the lag adds k = Cm_alphadot (c/2V) force/V times the lift derivative to
    each, and its next term, nearly q', divides all of them by 1 + Cm_alphadot moment (c/2V) tail_arm/V (Etkin & Reid,
    section 5.5). Unchanged laterally and where Cm_alphadot is zero.
    """
    if plan.flown.axis != "longitudinal":
        return theta, covariance
    row = dict(zip(ROW_LONGITUDINAL, plan.flown.data.mean(axis=0), strict=True))
    whole = plan.spread(theta[None])[0]
    lag = whole[plan.names.index("Cm_alphadot")] * row["hat"]
    inertia = 1.0 + lag * row["moment"] * 2.0 / row["delay_rate"]
    lag *= row["force"] / plan.flown.airspeed
    change, value = np.eye(len(theta)), theta.copy()
    for name in ("0", "alpha", "q", "elevator"):
        i = plan.free_names.index(f"Cm_{name}")
        lift = whole[plan.names.index(f"CZ_{name}")] + (G0 / row["force"] if name == "0" else 0.0)
        value[i] = (theta[i] + lag * lift) / inertia
        change[i, i] = 1.0 / inertia
        if f"CZ_{name}" in plan.free_names:
            change[i, plan.free_names.index(f"CZ_{name}")] = lag / inertia
    return value, np.asarray(change @ covariance @ change.T, dtype=np.float64)
