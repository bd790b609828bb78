"""The primary flight display: what the crew sees, drawn without a screen.

It shows measurements, what the observer estimates and what the ice management advises. True icing is not shown,
because nobody on board would know it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np
from PIL import Image

from icing_env.display import attitude, instruments, panels
from icing_env.display.pen import BACK, PAGE, Box, Pen, clamp, failed, panel
from icing_env.display.view import DisplayView
from icing_env.errors import InputError

SMALLEST, LARGEST = 240, 4096  # pixels a side


def _showable(view: DisplayView) -> DisplayView:
    """The view with every finite reading inside +-1e6 (no tape is longer) and no selected value that is not finite."""
    values: dict[str, float | None] = {}
    for reading in fields(view):
        value = getattr(view, reading.name)
        if value is None or (reading.name.endswith("_selected") and not math.isfinite(value)):
            values[reading.name] = None
        else:
            values[reading.name] = clamp(value, -1.0e6, 1.0e6) if math.isfinite(value) else math.nan
    return replace(view, **values)  # type: ignore[arg-type]  # None only where the field allows it


# Instrument, its box, its name when it has failed, and the readings that it cannot do without.
Draw = Callable[[Pen, DisplayView], None]
INSTRUMENTS: tuple[tuple[Draw, Box, str, tuple[str, ...]], ...] = (
    (attitude.attitude, attitude.ATTITUDE, "ATTITUDE", ("phi", "theta", "beta", "bank_limit")),
    (instruments.airspeed, instruments.AIRSPEED, "SPEED", ("airspeed", "airspeed_limit", "stall_margin")),
    (instruments.altitude, instruments.ALTITUDE, "ALTITUDE", ("altitude",)),
    (instruments.vertical_speed, instruments.VERTICAL_SPEED, "VS", ("vertical_speed",)),
    (instruments.heading, instruments.HEADING, "HEADING", ("psi",)),
    (instruments.alpha, instruments.ALPHA, "ALPHA", ("alpha", "alpha_limit", "alpha_stall_clean")),
    (panels.status, panels.STATUS, "STATUS", ("time", "intervention", "load_factor")),
    (panels.ice, panels.ICE, "ICE OBSERVER", (
        "severity", "confidence", "ice_detected", "boots_wing", "boots_tail", "boots_vtail_struts", "prop_heat",
        "alpha_limit", "airspeed_limit", "bank_limit", "CL_alpha_ratio", "Cm_alpha_ratio", "excess_drag",
        "excitation", "health")),
    (panels.surfaces, panels.SURFACES, "SURFACES", ("elevator", "aileron", "rudder", "flap")),
    (panels.engines, panels.ENGINES, "POWER", ("throttle_left", "throttle_right")),
)  # fmt: skip


def draw(view: DisplayView, size: tuple[int, int] = (960, 720)) -> np.ndarray:
    """Frame of the flight display.

    Args:
        view: what to show.
        size: width and height, pixels; the page keeps its 4:3 shape and is centred in any other.

    Returns:
        uint8 array, shape (height, width, 3), RGB. The same view gives the same frame.

    Raises:
        InputError: a size outside 240..4096 pixels a side.
    """
    width, height = size
    if not (SMALLEST <= width <= LARGEST and SMALLEST <= height <= LARGEST):
        raise InputError(f"display size {width} x {height}: each side must lie in {SMALLEST}..{LARGEST} pixels")
    view = _showable(view)
    scale = 2.0 * min(width / PAGE[0], height / PAGE[1])
    origin = (PAGE[0] / 2.0 - width / scale, PAGE[1] / 2.0 - height / scale)
    page = Image.new("RGB", (2 * width, 2 * height), BACK)
    pen = Pen(page, scale, origin)
    panel(pen, instruments.UNDER_AIRSPEED)
    panel(pen, instruments.UNDER_ALTITUDE)
    for instrument, box, name, needs in INSTRUMENTS:
        if all(math.isfinite(getattr(view, reading)) for reading in needs):
            instrument(pen, view)
        else:
            failed(pen, box, name)
    return np.asarray(page.reduce(2))
