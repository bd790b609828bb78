"""What a record gives the equations of motion: inputs by sample, what was measured, and where to start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from estimators.likelihood.equations import (
    LATERAL_OUTPUTS,
    LONGITUDINAL_OUTPUTS,
    ROW_LATERAL,
    ROW_LONGITUDINAL,
    TAIL_CHORDS,
)
from estimators.regression.noisy_regressors import white_noise
from estimators.signals.coefficients import Airframe, dynamic_pressure, thrust
from estimators.signals.differentiate import low_pass
from estimators.signals.resample import Grid
from icing_env.atmosphere import G0
from icing_env.record import FloatArray

AIRSPEED_WINDOW = 1.0  # s: parabola through which the airspeed passes; its noise would else shake the forces (assumed)
FOOT = 0.3048  # m, exact
HIGH = 1000.0  # m above ground where no altitude was recorded: turbulence is isotropic from 610 m
CUTOFF = 5.0  # Hz: nothing of the rigid aircraft is faster, and noise on a control weakens its derivatives (assumed)
FAST = ("alpha", "beta", "p", "q", "r", "phi", "theta", "ax", "ay", "az", "elevator", "aileron", "rudder")
SURFACES = {"longitudinal": ("elevator",), "lateral": ("aileron", "rudder")}
COLUMNS = {"longitudinal": ROW_LONGITUDINAL, "lateral": ROW_LATERAL}
OUTPUTS = {"longitudinal": LONGITUDINAL_OUTPUTS, "lateral": LATERAL_OUTPUTS}
TOLD = {"longitudinal": ("alpha", "q", "theta", "alpha"), "lateral": ("beta", "p", "r", "phi")}  # what a state shows as


@dataclass(frozen=True)
class Flown:
    """One axis of one record.

    Attributes:
        axis: "longitudinal" or "lateral".
        dt: s.
        data: (N, c) inputs of the equations, columns as COLUMNS[axis].
        measured: (N, 5) as OUTPUTS[axis]; nan where a channel is absent or has a gap.
        inverse: (2, 2) of the roll and yaw inertia.
        start: (n,) first state as measured.
        airspeed: mean, m/s.
        noise: variance of the noise on each of SURFACES[axis], rad2.
        thin: every how manieth sample is fitted.
    """

    axis: str
    dt: float
    data: FloatArray
    measured: FloatArray
    inverse: FloatArray
    start: FloatArray
    airspeed: float
    noise: FloatArray
    thin: int

    @property
    def index(self) -> int:
        """0 longitudinal, 1 lateral."""
        return 0 if self.axis == "longitudinal" else 1


def flown(grid: Grid, airframe: Airframe, axis: str, smooth: bool = True) -> Flown:
    """One axis of a record ready to be flown again.

    With `smooth`, every fast channel, controls included, passes through the same low pass at CUTOFF, and of what was
    measured as many samples are kept as are then independent.

    A cross-axis channel that was not recorded is taken as zero; without attitude the flight path is level; without
    thrust the axial force contains it.
    """
    n = len(grid.time)
    values = dict(grid.values)
    for name in ("alpha", "beta", "p", "q", "r", "phi", "aileron", "rudder", "elevator"):
        values.setdefault(name, np.zeros(n))
    values.setdefault("theta", values["alpha"])
    noise = np.array([white_noise(values[name]) for name in SURFACES[axis]])
    thin = max(1, int(0.5 / (CUTOFF * grid.dt))) if smooth else 1
    if thin > 1:
        values.update({name: low_pass(values[name], grid.dt, CUTOFF) for name in FAST if name in values})
    columns = _common(values, grid.dt, airframe)
    columns.update((_longitudinal if axis == "longitudinal" else _lateral)(values, columns, airframe))
    data = np.column_stack([columns[name] for name in COLUMNS[axis]])
    measured = np.full((n, len(OUTPUTS[axis])), np.nan)
    for i, name in enumerate(OUTPUTS[axis]):
        if name in grid.values:
            measured[:, i] = np.where(grid.good((name,)), values[name], np.nan)
    xx, _, zz, xz = airframe.inertia
    first = max(2, round(0.1 / grid.dt))
    start = np.array([float(np.mean(values[name][:first])) for name in TOLD[axis]])
    start[0] = np.tan(start[0]) * columns["u"][0]
    inverse = np.linalg.inv(np.array([[xx, -xz], [-xz, zz]]))
    return Flown(axis, grid.dt, data, measured, inverse, start, float(np.mean(columns["airspeed"])), noise, thin)


def scale_lengths(altitude: float) -> tuple[float, float]:
    """Scale lengths (m) of side and vertical gusts at a height (m) above ground.

    MIL-F-8785C, 3.7.2: the low-altitude model up to 1000 ft, 1750 ft from 2000 ft, straight lines between.
    """
    height = min(max(altitude / FOOT, 10.0), 1000.0)
    low = (height / (0.177 + 0.000823 * height) ** 1.2, height)
    share = min(max(altitude / FOOT - 1000.0, 0.0), 1000.0) / 1000.0
    across, down = (FOOT * (length + share * (1750.0 - length)) for length in low)
    return across, down


def _common(values: dict[str, FloatArray], dt: float, airframe: Airframe) -> dict[str, FloatArray]:
    n, airspeed = len(values["airspeed"]), values["airspeed"]
    window = min(2 * round(0.5 * AIRSPEED_WINDOW / dt) + 1, n - 1 + n % 2)
    smooth = savgol_filter(airspeed, window, 2) if window > 3 else airspeed
    alpha, beta, phi, theta = (values[name] for name in ("alpha", "beta", "phi", "theta"))
    qbar = dynamic_pressure(values) * (smooth / airspeed) ** 2
    force = qbar * airframe.geometry.wing_area
    altitude = float(np.mean(values["altitude"])) if "altitude" in values else HIGH
    across, down = scale_lengths(altitude)
    return {
        "airspeed": smooth, "u": smooth * np.cos(alpha) * np.cos(beta), "v": smooth * np.sin(beta),
        "w": smooth * np.sin(alpha) * np.cos(beta), "qS": force,
        "force": force / values.get("mass", np.full(n, airframe.mass)),
        "level": G0 * np.cos(theta) * np.cos(phi), "rate_w": smooth / down,
        "rate_v": smooth / across, "delay_rate": 2.0 * smooth / (TAIL_CHORDS * airframe.geometry.chord),
    }  # fmt: skip


def _longitudinal(
    values: dict[str, FloatArray], common: dict[str, FloatArray], airframe: Airframe
) -> dict[str, FloatArray]:
    xx, yy, zz, xz = airframe.inertia
    alpha, theta, phi, p, r = (values[name] for name in ("alpha", "theta", "phi", "p", "r"))
    slope = np.cos(alpha) ** 2 / common["u"]
    push = thrust(values)
    return {
        "per_u": 1.0 / common["u"], "angle": alpha - np.sin(alpha) * np.cos(alpha), "slope": slope,
        "moment": common["qS"] * airframe.geometry.chord / yy,
        "hat": airframe.geometry.chord / (2.0 * common["airspeed"]), "elevator": values["elevator"],
        "gravity": common["level"] + G0 * np.sin(theta) * np.cos(phi) * theta,
        "gravity_slope": -G0 * np.sin(theta) * np.cos(phi),
        "coupling": ((zz - xx) * p * r - xz * (p * p - r * r)) / yy, "cross_force": -p * common["v"],
        "cos_phi": np.cos(phi), "cross_rate": -r * np.sin(phi),
        "thrust": np.zeros(len(alpha)) if push is None else push * common["force"] / common["qS"],
        "alpha": alpha, "gust_rate": common["rate_w"],
    }  # fmt: skip


def _lateral(
    values: dict[str, FloatArray], common: dict[str, FloatArray], airframe: Airframe
) -> dict[str, FloatArray]:
    xx, yy, zz, xz = airframe.inertia
    beta, theta, phi, q = (values[name] for name in ("beta", "theta", "phi", "q"))
    gravity = G0 * np.cos(theta)
    return {
        "angle": beta - np.tan(beta), "slope": 1.0 / (common["airspeed"] * np.cos(beta)),
        "moment": common["qS"] * airframe.geometry.span,
        "hat": airframe.geometry.span / (2.0 * common["airspeed"]),
        "aileron": values["aileron"], "rudder": values["rudder"],
        "gravity": gravity * (np.sin(phi) - np.cos(phi) * phi), "gravity_slope": gravity * np.cos(phi),
        "roll_pq": xz * q, "roll_qr": (yy - zz) * q, "yaw_qr": -xz * q, "yaw_pq": (xx - yy) * q,
        "kinematic": np.tan(theta) * np.sin(phi) * q, "kinematic_r": np.tan(theta) * np.cos(phi), "beta": beta,
        "gust_rate": common["rate_v"],
    }  # fmt: skip
