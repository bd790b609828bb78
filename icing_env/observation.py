"""The flat observation: which channels in which order, with units and finite bounds.

Measurements, estimates and advice only. Estimates are given over the clean aircraft's value (1 is clean), errors are
what is asked less what is measured.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from icing_env.jit import kernel
from icing_env.types import ADVISORY, ESTIMATE, MEASUREMENT

Source = Literal["measurement", "task", "estimate", "advisory"]
Axes = Literal["all", "longitudinal", "lateral"]
TURN = math.pi


@dataclass(frozen=True)
class Channel:
    """One number of the observation."""

    name: str
    unit: str
    low: float
    high: float
    source: Source
    axes: Axes = "all"  # "all": in every environment; else only where that axis is flown


def _m(name: str, unit: str, low: float, high: float, axes: Axes = "all") -> Channel:
    return Channel(name, unit, low, high, "measurement", axes)


DERIVATIVES: dict[str, Axes] = {
    "CL_alpha": "all", "Cm_alpha": "longitudinal", "Cm_q": "longitudinal", "Cm_elevator": "longitudinal",
    "Cl_p": "lateral", "Cl_aileron": "lateral", "Cn_beta": "lateral", "Cn_rudder": "lateral",
}  # fmt: skip
CHANNELS: tuple[Channel, ...] = (
    _m("airspeed", "m/s", 0.0, 150.0),
    _m("altitude", "m", -1000.0, 12000.0),
    _m("alpha", "rad", -1.0, 1.0),
    _m("q", "rad/s", -3.0, 3.0, "longitudinal"),
    _m("theta", "rad", -TURN, TURN),
    _m("ax", "m/s2", -50.0, 50.0, "longitudinal"),
    _m("az", "m/s2", -100.0, 100.0),
    _m("elevator", "rad", -1.0, 1.0, "longitudinal"),
    _m("throttle_left", "0..1", 0.0, 1.0),
    _m("throttle_right", "0..1", 0.0, 1.0),
    _m("flap", "rad", 0.0, 1.0),
    _m("beta", "rad", -1.0, 1.0, "lateral"),
    _m("p", "rad/s", -5.0, 5.0, "lateral"),
    _m("r", "rad/s", -3.0, 3.0, "lateral"),
    _m("phi", "rad", -2.0*TURN, 2.0*TURN),
    _m("ay", "m/s2", -50.0, 50.0, "lateral"),
    _m("aileron", "rad", -1.0, 1.0, "lateral"),
    _m("rudder", "rad", -1.0, 1.0, "lateral"),
    _m("temperature", "K", 150.0, 350.0),
    Channel("altitude_error", "m", -2000.0, 2000.0, "task", "longitudinal"),
    Channel("climb_rate_error", "m/s", -100.0, 100.0, "task", "longitudinal"),
    Channel("airspeed_error", "m/s", -150.0, 150.0, "task", "longitudinal"),
    Channel("heading_error", "rad", -TURN, TURN, "task", "lateral"),
    Channel("bank_error", "rad", -3.0*TURN, 3.0*TURN, "task", "lateral"),
    *(Channel(name, "1", -10.0, 10.0, "estimate", axes) for name, axes in DERIVATIVES.items()),
    Channel("excess_drag", "1", -1.0, 1.0, "estimate"),
    Channel("excitation_longitudinal", "0..1", 0.0, 1.0, "estimate", "longitudinal"),
    Channel("excitation_lateral", "0..1", 0.0, 1.0, "estimate", "lateral"),
    Channel("health", "0/1", 0.0, 1.0, "estimate"),
    *(Channel(name, unit, low, high, "advisory") for name, unit, low, high in (
        ("severity", "1", 0.0, 5.0), ("confidence", "0..1", 0.0, 1.0), ("ice_detected", "0/1", 0.0, 1.0),
        ("boots_wing", "0/1", 0.0, 1.0), ("boots_tail", "0/1", 0.0, 1.0), ("boots_vtail_struts", "0/1", 0.0, 1.0),
        ("prop_heat", "0/1", 0.0, 1.0), ("alpha_limit", "rad", -2.0, 2.0), ("airspeed_limit", "m/s", 0.0, 150.0),
        ("bank_limit", "rad", 0.0, TURN), ("flap_limit", "rad", 0.0, 2.0), ("intervention", "rad", -1.0, 1.0))),
)  # fmt: skip
SOURCES: tuple[Source, ...] = ("measurement", "task", "estimate", "advisory")
N_BOUNDS = len(SOURCES) + 1


def channels(axes: Axes) -> tuple[Channel, ...]:
    """Channels of an environment that flies these axes, in order."""
    return tuple(c for c in CHANNELS if axes == "all" or c.axes in ("all", axes))


class Observation:
    """Layout of the observations of `n` aircraft, and their memory `out` [n, channels] (float32).

    `reference`: ESTIMATE row of the clean aircraft, by which estimates are divided.
    """

    def __init__(self, axes: Axes, n: int, task_dtype: np.dtype, reference: NDArray) -> None:
        self.channels = channels(axes)
        names = {"measurement": MEASUREMENT.names, "task": task_dtype.names, "estimate": ESTIMATE.names,
                 "advisory": ADVISORY.names}
        bounds = np.cumsum([0, *(sum(c.source == s for c in self.channels) for s in SOURCES)])
        index = [(names[c.source] or ()).index(c.name) for c in self.channels]
        self.layout = np.array([*bounds, *index], np.int64)
        self.low = np.array([c.low for c in self.channels], np.float32)
        self.high = np.array([c.high for c in self.channels], np.float32)
        gain = [1.0/float(reference[c.name][0]) if c.name[0] == "C" and reference[c.name][0] != 0.0 else 1.0
                for c in self.channels]
        self.scaling = np.array([gain, self.low, self.high])
        self.out = np.zeros((n, len(self.channels)), np.float32)


@kernel
def gather(i: int, measurement: Any, task: Any, estimate: Any, advisory: Any, layout: Any, scaling: Any,
           out: Any) -> None:
    """Observation of row `i`.

    Sources are float64 views [n, fields]. `layout`: the bounds of the sources' channels, then each channel's field;
    `scaling`: gain, low and high of each channel.
    """
    pick(i, measurement, layout[0], layout[1], layout, scaling, out)
    pick(i, task, layout[1], layout[2], layout, scaling, out)
    pick(i, estimate, layout[2], layout[3], layout, scaling, out)
    pick(i, advisory, layout[3], layout[4], layout, scaling, out)


@kernel
def pick(i: int, source: Any, first: int, last: int, layout: Any, scaling: Any, out: Any) -> None:
    """Copy, scale and clip the channels of one source; a value that is no number becomes the lower bound."""
    for j in range(first, last):
        value = source[i, layout[N_BOUNDS + j]]*scaling[0, j]
        out[i, j] = min(max(value, scaling[1, j]), scaling[2, j]) if value == value else scaling[1, j]
