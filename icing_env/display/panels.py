"""The panels of the flight display beside the classical instruments: status line, ice, surfaces, engines."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from icing_env.display.instruments import KNOT
from icing_env.display.pen import (
    AMBER,
    BLACK,
    CYAN,
    DIM,
    EDGE,
    GREEN,
    INK,
    PANEL,
    RED,
    WELL,
    Box,
    Colour,
    Pen,
    clamp,
    mix,
    panel,
)

if TYPE_CHECKING:
    from icing_env.display.view import DisplayView

STATUS: Box = (16, 14, 690, 50)
ICE: Box = (704, 14, 944, 706)
SURFACES: Box = (240, 532, 518, 706)
ENGINES: Box = (530, 532, 690, 706)
LEFT, RIGHT = ICE[0] + 14.0, ICE[2] - 14.0


def _bar(pen: Pen, box: Box, share: float, colour: Colour) -> None:
    """Horizontal bar filled from the left to `share` (0..1)."""
    pen.rectangle(box, WELL, radius=3.0)
    width = (box[2] - box[0]) * clamp(share, 0.0, 1.0)
    if width >= 1.0:
        pen.rectangle((box[0], box[1], box[0] + width, box[3]), colour, radius=3.0 if width > 6.0 else 0.0)


def _lamp(pen: Pen, box: Box, name: str, on: bool, colour: Colour = GREEN) -> None:
    """Annunciator: lit with dark letters, or dark with dim letters."""
    pen.rectangle(box, colour if on else WELL, colour if on else EDGE, radius=4.0)
    at = ((box[0] + box[2]) / 2.0, (box[1] + box[3]) / 2.0)
    pen.text(at, name, 14.0, BLACK if on else DIM, bold=True)


def status(pen: Pen, view: DisplayView) -> None:
    """Clock, protection cue, load factor."""
    _, top, _, bottom = STATUS
    middle = (top + bottom) / 2.0
    panel(pen, (16, top, 106, bottom))
    seconds = int(clamp(view.time, 0.0, 359999.0))
    clock = f"{seconds // 60:02d}:{seconds % 60:02d}" if seconds < 3600 else f"{seconds / 3600.0:.2f} h"
    pen.text((61.0, middle), clock, 18.0, INK, bold=True)
    text, colour, loud = envelope_cue(view)
    pen.rectangle((118, top, 518, bottom), colour if loud else PANEL, colour if loud else EDGE, radius=6.0)
    pen.text((318.0, middle), text, 17.0, BLACK if loud else colour, bold=True)
    panel(pen, (530, top, 690, bottom))
    pen.text((544.0, middle), "LOAD", 14.0, DIM, "l", bold=True)
    pen.text((676.0, middle), f"{clamp(view.load_factor, -99.0, 99.0):.2f} g", 18.0, INK, "r", bold=True)


def envelope_cue(view: DisplayView) -> tuple[str, Colour, bool]:
    """What to say about the envelope, in which colour, and whether to fill the cell with it.

    The protection's own action comes first, then a limit that is passed without it; a reading or a limit that is not
    finite makes the answer unknown, never normal.
    """
    if abs(view.intervention) > 0.0:
        size = math.degrees(clamp(abs(view.intervention), 0.0, math.pi))
        return f"ALPHA PROT   {size:.1f}° elevator", AMBER, True
    margins = {
        "ALPHA": view.alpha_limit - view.alpha,
        "SPEED": view.airspeed - view.airspeed_limit,
        "BANK": view.bank_limit - abs(math.remainder(view.phi, 2.0 * math.pi) if math.isfinite(view.phi) else math.nan),
    }
    passed = [name for name, margin in margins.items() if margin < 0.0]
    if passed:
        stalled = view.alpha > max(view.alpha_limit, view.alpha_stall_clean)
        return "BEYOND LIMIT:  " + "  ".join(passed), RED if stalled else AMBER, stalled
    if not all(math.isfinite(margin) for margin in margins.values()):
        return "ENVELOPE UNKNOWN", AMBER, False
    return "ENVELOPE NORMAL", GREEN, False


def ice(pen: Pen, view: DisplayView) -> None:
    """What the observer and the ice management believe: severity, lamps, lost performance, limits, health."""
    panel(pen, ICE, "ICE")
    found = view.ice_detected > 0.5
    pen.rectangle((LEFT, 46, RIGHT, 90), AMBER if found else PANEL, AMBER if found else GREEN, radius=5.0, width=2.0)
    pen.text(((LEFT + RIGHT) / 2.0, 68.0), "ICE DETECTED" if found else "CLEAR", 21.0,
             BLACK if found else GREEN, bold=True)  # fmt: skip
    _severity(pen, view)
    _heading(pen, 208.0, "PROTECTION ASKED FOR")
    for row, names in enumerate(((("WING", view.boots_wing), ("TAIL", view.boots_tail)),
                                 (("FIN+STRUT", view.boots_vtail_struts), ("PROP HEAT", view.prop_heat)))):  # fmt: skip
        for column, (name, on) in enumerate(names):
            left, top = LEFT + 109.0 * column, 234.0 + 37.0 * row
            _lamp(pen, (left, top, left + 103.0, top + 31.0), name, on > 0.5)
    _performance(pen, view)
    _limits(pen, view)
    _observer(pen, view)


def _heading(pen: Pen, y: float, title: str) -> None:
    pen.line([(LEFT, y), (RIGHT, y)], EDGE, 1.5)
    pen.text((LEFT, y + 15.0), title, 14.0, DIM, "l", bold=True)


def _severity(pen: Pen, view: DisplayView) -> None:
    colour = GREEN if view.severity < 1.0 / 3.0 else AMBER if view.severity < 2.0 / 3.0 else RED
    pen.text((LEFT, 110.0), "SEVERITY", 14.0, INK, "l")
    pen.text((RIGHT, 110.0), f"{clamp(view.severity, -9.99, 9.99):.2f}", 19.0, colour, "r", bold=True)
    _bar(pen, (LEFT, 123, RIGHT, 139), view.severity, colour)
    for third in (1.0, 2.0):
        x = LEFT + (RIGHT - LEFT) * third / 3.0
        pen.line([(x, 123.0), (x, 145.0)], PANEL if view.severity > third / 3.0 else DIM, 2.0)
    pen.text((LEFT, 164.0), "CONFIDENCE", 14.0, INK, "l")
    pen.text((RIGHT, 164.0), f"{100.0 * clamp(view.confidence, 0.0, 1.0):.0f} %", 16.0, INK, "r", bold=True)
    _bar(pen, (LEFT, 177, RIGHT, 187), view.confidence, CYAN)


def _share_row(pen: Pen, y: float, name: str, ratio: float) -> None:
    """A derivative as a percentage of the clean aircraft's, with a bar from 50 to 110 %."""
    percent = 100.0 * clamp(ratio, -9.99, 9.99)
    colour = GREEN if percent >= 90.0 else AMBER if percent >= 75.0 else RED
    pen.text((LEFT, y), name, 14.0, INK, "l")
    pen.text((RIGHT, y), f"{percent:.0f} %", 17.0, colour, "r", bold=True)
    box = (LEFT, y + 13.0, RIGHT, y + 21.0)
    _bar(pen, box, (percent - 50.0) / 60.0, colour)
    clean = LEFT + (RIGHT - LEFT) * 50.0 / 60.0
    pen.line([(clean, y + 11.0), (clean, y + 23.0)], INK, 2.0)


def _performance(pen: Pen, view: DisplayView) -> None:
    _heading(pen, 318.0, "ESTIMATE, OF CLEAN")
    _share_row(pen, 360.0, "LIFT SLOPE", view.CL_alpha_ratio)
    _share_row(pen, 404.0, "PITCH STIFFNESS", view.Cm_alpha_ratio)
    counts = 1.0e4 * clamp(view.excess_drag, -0.9, 0.9)
    colour = GREEN if counts < 50.0 else AMBER if counts < 150.0 else RED
    pen.text((LEFT, 450.0), "DRAG, counts", 14.0, INK, "l")
    pen.text((RIGHT, 450.0), f"{counts:+.0f}", 17.0, colour, "r", bold=True)


def _limits(pen: Pen, view: DisplayView) -> None:
    _heading(pen, 474.0, "LIMITS NOW")
    cells = (
        ("ALPHA", f"{math.degrees(clamp(view.alpha_limit, -1.0, 1.0)):.1f}°"),
        ("SPEED", f"{clamp(view.airspeed_limit / KNOT, 0.0, 999.0):.0f} kt"),
        ("BANK", f"{math.degrees(clamp(view.bank_limit, 0.0, math.pi)):.0f}°"),
    )
    for column, (name, value) in enumerate(cells):
        x = LEFT + 35.0 + 71.0 * column
        pen.text((x, 515.0), value, 17.0, AMBER, bold=True)
        pen.text((x, 538.0), name, 14.0, DIM)


def _observer(pen: Pen, view: DisplayView) -> None:
    _heading(pen, 562.0, "OBSERVER")
    healthy = view.health > 0.5
    _lamp(pen, (LEFT, 588, RIGHT, 620), "HEALTHY" if healthy else "NOT TO BE TRUSTED", True, GREEN if healthy else RED)
    pen.text((LEFT, 644.0), "EXCITATION", 14.0, INK, "l")
    pen.text((RIGHT, 644.0), f"{100.0 * clamp(view.excitation, 0.0, 1.0):.0f} %", 16.0, INK, "r", bold=True)
    _bar(pen, (LEFT, 658, RIGHT, 668), view.excitation, CYAN)
    known = "learning" if view.excitation > 0.3 else "little to learn from"
    pen.text((LEFT, 687.0), known, 14.0, DIM, "l")


def surfaces(pen: Pen, view: DisplayView) -> None:
    """Measured positions of elevator, aileron, rudder and flap, degrees, as signed in the flight record."""
    panel(pen, SURFACES, "SURFACES deg")
    rows = (("ELEV", view.elevator, -30.0, 30.0), ("AIL", view.aileron, -30.0, 30.0),
            ("RUD", view.rudder, -30.0, 30.0), ("FLAP", view.flap, 0.0, 40.0))  # fmt: skip
    left, right = SURFACES[0] + 66.0, SURFACES[2] - 72.0
    for row, (name, position, low, high) in enumerate(rows):
        y = SURFACES[1] + 49.0 + 33.0 * row
        degrees = math.degrees(clamp(position, -1.7, 1.7))
        zero = left + (right - left) * (0.0 - low) / (high - low)
        x = left + (right - left) * clamp((degrees - low) / (high - low), 0.0, 1.0)
        pen.text((SURFACES[0] + 12.0, y), name, 15.0, INK, "l")
        pen.rectangle((left, y - 4.0, right, y + 4.0), WELL, radius=2.0)
        pen.rectangle((zero, y - 4.0, x, y + 4.0), mix(PANEL, GREEN, 0.6))
        pen.line([(zero, y - 8.0), (zero, y + 8.0)], DIM, 2.0)
        pen.rectangle((x - 3.0, y - 9.0, x + 3.0, y + 9.0), GREEN, radius=2.0)
        pen.text((SURFACES[2] - 12.0, y), f"{degrees:+.1f}", 16.0, INK, "r", bold=True)


def engines(pen: Pen, view: DisplayView) -> None:
    """Power levers, percent."""
    panel(pen, ENGINES, "POWER %")
    for name, lever, x in (("L", view.throttle_left, 575.0), ("R", view.throttle_right, 645.0)):
        share = clamp(lever, 0.0, 1.0)
        top, bottom = 564.0, 648.0
        pen.rectangle((x - 13.0, top, x + 13.0, bottom), WELL, radius=3.0)
        height = (bottom - top) * share
        if height >= 1.0:
            pen.rectangle((x - 13.0, bottom - height, x + 13.0, bottom), mix(PANEL, GREEN, 0.6))
        pen.line([(x - 18.0, bottom - height), (x + 18.0, bottom - height)], GREEN, 4.0)
        pen.text((x, 668.0), f"{100.0 * share:.0f}", 18.0, INK, bold=True)
        pen.text((x, 690.0), name, 14.0, DIM, bold=True)
    for quarter in range(5):
        y = 648.0 - 21.0 * quarter
        pen.line([(605.0, y), (615.0, y)], EDGE, 2.0)
