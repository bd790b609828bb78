"""How figures look: colours by role, type sizes, and the units in which each channel is shown.

Figures are made with matplotlib's objects alone, never with pyplot, so that nothing is kept behind the caller's back.
Colours are those of Okabe and Ito (Color Universal Design, 2008), told apart by colour-blind readers too, one per role.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from icing_env.errors import InputError, nearest

Channels = Mapping[str, NDArray[np.float64]]

ROLES: dict[str, dict[str, Any]] = {
    "clean": {"color": "#56B4E9", "linestyle": "-"},
    "iced": {"color": "#D55E00", "linestyle": "-"},
    "estimate": {"color": "#0072B2", "linestyle": "-"},
    "truth": {"color": "#1A1A1A", "linestyle": (0, (4, 2))},
    "protected": {"color": "#009E73", "linestyle": "-"},
    "unprotected": {"color": "#CC79A7", "linestyle": "-"},
    "limit": {"color": "#E69F00", "linestyle": (0, (6, 2, 1, 2))},
}
GREY = "#8A8F98"
STYLE: Any = {
    "font.size": 9.5, "axes.titlesize": 10.5, "axes.labelsize": 9.5, "legend.fontsize": 9.0,
    "xtick.labelsize": 8.5, "ytick.labelsize": 8.5, "lines.linewidth": 1.4, "lines.solid_capstyle": "round",
    "axes.spines.top": False, "axes.spines.right": False, "axes.edgecolor": "#5B6675", "axes.linewidth": 0.8,
    "axes.labelcolor": "#1C2430", "text.color": "#1C2430", "xtick.color": "#3C4653", "ytick.color": "#3C4653",
    "axes.grid": True, "grid.color": "#E3E6EA", "grid.linewidth": 0.7, "axes.axisbelow": True,
    "legend.frameon": False, "figure.facecolor": "white", "axes.formatter.useoffset": False,
}  # fmt: skip
styled = rc_context(STYLE)  # a decorator here: the style holds while a figure is made, and nowhere else


@dataclass(frozen=True)
class Scale:
    """How a channel is shown: `shown = recorded * factor + offset`, in `unit`."""

    label: str
    unit: str
    factor: float = 1.0
    offset: float = 0.0


DEG = 180.0 / math.pi
KNOT, FOOT, GRAVITY = 0.514444, 0.3048, 9.80665  # m/s, m, m/s2
SCALES: dict[str, Scale] = {
    "airspeed": Scale("airspeed", "kt", 1.0 / KNOT), "airspeed_limit": Scale("speed limit", "kt", 1.0 / KNOT),
    "ground_speed": Scale("ground speed", "kt", 1.0 / KNOT), "altitude": Scale("altitude", "ft", 1.0 / FOOT),
    "vertical_speed": Scale("climb", "ft/min", 60.0 / FOOT), "temperature": Scale("temperature", "°C", 1.0, -273.15),
    **{name: Scale(text, "deg", DEG) for name, text in (
        ("alpha", "α"), ("beta", "β"), ("phi", "φ"), ("theta", "θ"), ("psi", "ψ"), ("track", "track"),
        ("elevator", "elevator"), ("aileron", "aileron"), ("rudder", "rudder"), ("flap", "flap"),
        ("elevator_command", "elevator cmd"), ("aileron_command", "aileron cmd"), ("rudder_command", "rudder cmd"),
        ("alpha_limit", "α limit"), ("bank_limit", "bank limit"), ("intervention", "intervention"))},
    **{name: Scale(name, "deg/s", DEG) for name in ("p", "q", "r")},
    **{name: Scale(name, "g", 1.0 / GRAVITY) for name in ("ax", "ay", "az")},
    **{f"{name}_dot": Scale(f"{name} dot", "deg/s²", DEG) for name in ("p", "q", "r")},
    **{f"{name}_{side}": Scale(f"{name} {side}", unit, factor) for name, unit, factor in (
        ("throttle", "%", 100.0), ("thrust", "kN", 1.0e-3), ("torque", "kN m", 1.0e-3), ("rpm", "1/min", 1.0))
       for side in ("left", "right")},
    "lwc": Scale("liquid water", "g/m³", 1.0e3), "mvd": Scale("drop size", "µm", 1.0e6),
    "pressure": Scale("pressure", "hPa", 1.0e-2), "mass": Scale("mass", "kg"), "ice": Scale("water met", "kg/m²"),
    "severity": Scale("severity", ""), "confidence": Scale("confidence", "%", 100.0),
    "excess_drag": Scale("excess drag", "counts", 1.0e4), "power": Scale("power", "kW", 1.0e-3),
    "time": Scale("time", "s"),
}  # fmt: skip


def role_style(label: str, roles: Mapping[str, str] | None, index: int) -> dict[str, Any]:
    """Line style of a series: of the role it is given, else of the role its label names, else the next colour."""
    role = (roles or {}).get(label, label)
    if role in ROLES:
        return ROLES[role]
    if roles and label in roles:
        raise InputError(f"role '{role}' of '{label}': {nearest(role, list(ROLES))}")
    spare = [ROLES[name] for name in ("estimate", "iced", "protected", "unprotected", "clean", "limit")]
    return {**spare[index % len(spare)], "linestyle": "-"}


def scale_of(channel: str) -> Scale:
    """How `channel` is shown; a channel without an entry keeps its own unit."""
    return SCALES.get(channel, Scale(channel.replace("_", " "), ""))


def line(axes: Axes, time: NDArray[np.float64], values: NDArray[np.float64], **style: Any) -> None:
    """A line through the samples there are: channels slower than the record hold nan in between."""
    there = np.isfinite(values)
    if there.any():
        axes.plot(time[there], values[there], **style)


def legend_above(figure: Figure, axes: Sequence[Axes]) -> None:
    """One legend for all axes, above them, each label once."""
    seen: dict[str, Any] = {}
    for one in axes:
        for handle, label in zip(*one.get_legend_handles_labels(), strict=True):
            seen.setdefault(label, handle)
    if len(seen) > 1:
        figure.legend(list(seen.values()), list(seen), loc="outside upper left", ncols=min(len(seen), 5))
