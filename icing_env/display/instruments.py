"""Five instruments of the flight display: airspeed, altitude, vertical speed, heading, angle of attack.

Each function draws one instrument in its own box from a `DisplayView` (SI, rad); what a pilot reads in other units
is converted here.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from icing_env.display.pen import (
    AMBER,
    BACK,
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
    polar,
)

if TYPE_CHECKING:
    from icing_env.display.view import DisplayView

KNOT = 0.514444  # m/s
FOOT = 0.3048  # m

AIRSPEED: Box = (16, 60, 106, 460)
ALTITUDE: Box = (530, 60, 630, 460)
VERTICAL_SPEED: Box = (638, 60, 690, 460)
HEADING: Box = (118, 470, 518, 522)
UNDER_AIRSPEED: Box = (16, 470, 106, 522)
UNDER_ALTITUDE: Box = (530, 470, 690, 522)
ALPHA: Box = (16, 532, 230, 706)


def _pointer_box(pen: Pen, box: Box, text: str, colour: Colour, tip: float) -> None:
    """Reading in a black box with a pointer at `tip` (the x of its point)."""
    middle = (box[1] + box[3]) / 2.0
    edge = box[2] if tip > box[2] else box[0]
    pen.polygon([(edge, middle - 9.0), (tip, middle), (edge, middle + 9.0)], colour)
    pen.rectangle(box, BLACK, colour, radius=4.0, width=2.0)
    pen.text(((box[0] + box[2]) / 2.0, middle), text, 24.0 if len(text) < 5 else 20.0, colour, bold=True)


def _bug(pen: Pen, edge: float, y: float, side: float) -> None:
    """Cyan mark of a selected value on the edge of a tape."""
    shape = [(0.0, -11.0), (14.0, -11.0), (14.0, -5.0), (6.0, 0.0), (14.0, 5.0), (14.0, 11.0), (0.0, 11.0)]
    pen.polygon([(edge + side * a, y + b) for a, b in shape], CYAN)


def airspeed(pen: Pen, view: DisplayView) -> None:
    """True airspeed in knots; amber below the lowest speed allowed now, red below the stall that it keeps clear of."""
    speed, limit = view.airspeed / KNOT, view.airspeed_limit / KNOT
    stall = limit / max(view.stall_margin, 1.0)
    middle = (AIRSPEED[1] + AIRSPEED[3]) / 2.0
    right = AIRSPEED[2]

    def y(knots: float) -> float:
        return clamp(middle + (speed - knots) * 5.0, AIRSPEED[1] - 30.0, AIRSPEED[3] + 30.0)

    with pen.inside(AIRSPEED, PANEL) as inner:
        first = max(0, 5 * math.ceil((speed - 45.0) / 5.0))
        for knots in range(first, math.floor(speed + 45.0) + 1, 5):
            long = knots % 10 == 0
            inner.line([(right - (32.0 if long else 24.0), y(knots)), (right - 14.0, y(knots))], DIM, 2.0)
            if long:
                inner.text((right - 38.0, y(knots)), f"{knots}", 17.0, INK, "r")
        inner.rectangle((right - 12.0, y(limit), right, y(stall)), AMBER)
        inner.rectangle((right - 12.0, y(stall), right, y(0.0)), RED)
        if view.airspeed_selected is not None:
            _bug(inner, right - 14.0, y(view.airspeed_selected / KNOT), 1.0)
        colour = RED if speed < stall else AMBER if speed < limit else INK
        box = (AIRSPEED[0] + 4.0, middle - 19.0, right - 26.0, middle + 19.0)
        _pointer_box(inner, box, f"{speed:.0f}", colour, right - 13.0)
    pen.rectangle(AIRSPEED, None, EDGE, radius=6.0)
    pen.text((61.0, 484.0), "TAS kt", 14.0, DIM, bold=True)
    pen.text((61.0, 506.0), f"MIN {limit:.0f}", 15.0, AMBER, bold=True)


def altitude(pen: Pen, view: DisplayView) -> None:
    """Pressure altitude in feet, read to ten feet."""
    feet = view.altitude / FOOT
    middle = (ALTITUDE[1] + ALTITUDE[3]) / 2.0
    left = ALTITUDE[0]

    def y(value: float) -> float:
        return clamp(middle + (feet - value) * 0.4, ALTITUDE[1] - 30.0, ALTITUDE[3] + 30.0)

    with pen.inside(ALTITUDE, PANEL) as inner:
        for value in range(100 * math.ceil((feet - 560.0) / 100.0), math.floor(feet + 560.0) + 1, 100):
            long = value % 200 == 0
            inner.line([(left + 14.0, y(value)), (left + (28.0 if long else 22.0), y(value))], DIM, 2.0)
            if long:
                inner.text((ALTITUDE[2] - 8.0, y(value)), f"{value}", 16.0, INK, "r")
        if view.altitude_selected is not None:
            _bug(inner, left + 14.0, y(view.altitude_selected / FOOT), -1.0)
        box = (left + 18.0, middle - 19.0, ALTITUDE[2] - 3.0, middle + 19.0)
        _pointer_box(inner, box, f"{10 * round(feet / 10.0)}", INK, left + 8.0)
    pen.rectangle(ALTITUDE, None, EDGE, radius=6.0)


def vertical_speed(pen: Pen, view: DisplayView) -> None:
    """Rate of climb in feet per minute on a scale that is finest near level flight."""
    rate = view.vertical_speed / FOOT * 60.0
    middle = (VERTICAL_SPEED[1] + VERTICAL_SPEED[3]) / 2.0
    left, right = VERTICAL_SPEED[0], VERTICAL_SPEED[2]

    def y(value: float) -> float:
        return middle - math.copysign(185.0 * (1.0 - math.exp(-abs(value) / 1400.0)), value)

    panel(pen, VERTICAL_SPEED)
    for value in (500, 1000, 2000, 4000):
        for sign in (-1.0, 1.0):
            pen.line([(left + 24.0, y(sign * value)), (left + 33.0, y(sign * value))], DIM, 2.0)
            pen.text((left + 20.0, y(sign * value)), {500: ".5"}.get(value, f"{value // 1000}"), 14.0, DIM, "r")
    pen.line([(left + 20.0, middle), (left + 33.0, middle)], INK, 2.5)
    pen.line([(right - 1.0, middle), (left + 30.0, y(rate))], GREEN, 4.0)
    pen.text((580.0, 484.0), "ALT ft", 14.0, DIM, bold=True)
    pen.text((652.0, 484.0), "VS fpm", 14.0, DIM, bold=True)
    shown = "----" if view.altitude_selected is None else f"{view.altitude_selected / FOOT:.0f}"
    pen.text((580.0, 506.0), shown, 15.0, CYAN, bold=True)
    pen.text((652.0, 506.0), f"{clamp(50 * round(rate / 50.0), -99950, 99950):+.0f}", 15.0, GREEN, bold=True)


def heading(pen: Pen, view: DisplayView) -> None:
    """Heading strip, degrees; north is 360 in the reading and N on the strip."""
    degrees = math.degrees(math.remainder(view.psi, 2.0 * math.pi)) % 360.0
    middle, top, bottom = (HEADING[0] + HEADING[2]) / 2.0, HEADING[1], HEADING[3]
    with pen.inside(HEADING, PANEL) as inner:
        for value in range(5 * math.ceil((degrees - 45.0) / 5.0), math.floor(degrees + 45.0) + 1, 5):
            x = middle + (value - degrees) * 5.0
            inner.line([(x, bottom), (x, bottom - (12.0 if value % 10 == 0 else 7.0))], DIM, 2.0)
            if value % 10 == 0 and abs(x - middle) > 44.0:
                name = {0: "N", 90: "E", 180: "S", 270: "W"}.get(value % 360, f"{value % 360 // 10:02d}")
                inner.text((x, bottom - 22.0), name, 15.0, INK if name.isalpha() else DIM, bold=name.isalpha())
        if view.heading_selected is not None:
            error = math.degrees(math.remainder(view.heading_selected - view.psi, 2.0 * math.pi))
            x = clamp(middle + error * 5.0, HEADING[0] + 4.0, HEADING[2] - 4.0)
            bug = [(-9.0, 0.0), (9.0, 0.0), (9.0, 7.0), (0.0, 13.0), (-9.0, 7.0)]
            inner.polygon([(x + a, top + b) for a, b in bug], CYAN)
        reading = round(degrees) % 360 or 360
        inner.polygon([(middle - 8.0, bottom - 10.0), (middle + 8.0, bottom - 10.0), (middle, bottom)], INK)
        inner.rectangle((middle - 30.0, top + 5.0, middle + 30.0, bottom - 10.0), BLACK, INK, radius=4.0, width=2.0)
        inner.text((middle, (top + bottom - 5.0) / 2.0), f"{reading:03d}", 22.0, INK, bold=True)
    pen.rectangle(HEADING, None, EDGE, radius=6.0)


def alpha(pen: Pen, view: DisplayView) -> None:
    """Angle of attack on a dial, -5..25 deg: amber above the limit that stands now, red above the clean stall."""
    value, limit, stall = (math.degrees(a) for a in (view.alpha, view.alpha_limit, view.alpha_stall_clean))
    centre, radius = ((ALPHA[0] + ALPHA[2]) / 2.0, 648.0), 66.0

    def turn(degrees: float) -> float:
        return (clamp(degrees, -6.0, 26.0) - 10.0) * 7.0

    panel(pen, ALPHA, "ALPHA deg")
    pen.arc(centre, radius, turn(-5.0), turn(25.0), WELL, 9.0)
    top = max(limit, stall)
    pen.arc(centre, radius, turn(-5.0), turn(min(limit, 25.0)), mix(PANEL, GREEN, 0.75), 9.0)
    pen.arc(centre, radius, turn(min(limit, 25.0)), turn(min(top, 25.0)), AMBER, 9.0)
    pen.arc(centre, radius, turn(min(top, 25.0)), turn(25.0), RED, 9.0)
    for tick in (-5, 0, 5, 10, 15, 20, 25):
        pen.line([polar(centre, radius - 10.0, turn(tick)), polar(centre, radius - 4.0, turn(tick))], INK, 2.0)
        pen.text(polar(centre, radius + 17.0, turn(tick)), f"{tick}", 14.0, DIM)
    pen.line([polar(centre, radius - 12.0, turn(stall)), polar(centre, radius + 7.0, turn(stall))], INK, 3.0)
    pen.line([polar(centre, radius - 12.0, turn(limit)), polar(centre, radius + 7.0, turn(limit))], AMBER, 4.0)
    colour = RED if value > top else AMBER if value > limit else INK
    pen.line([polar(centre, 12.0, turn(value)), polar(centre, radius - 8.0, turn(value))], BACK, 8.0)
    pen.line([polar(centre, 12.0, turn(value)), polar(centre, radius - 8.0, turn(value))], colour, 4.0)
    pen.arc(centre, 9.0, 0.0, 360.0, colour, 5.0)
    pen.text((centre[0], 677.0), f"{clamp(value, -99.9, 99.9):.1f}", 22.0, colour, bold=True)
    pen.text((ALPHA[0] + 10.0, 693.0), f"LIM {clamp(limit, -99.0, 99.0):.1f}", 14.0, AMBER, "l", bold=True)
    pen.text((ALPHA[2] - 10.0, 693.0), f"CLEAN {clamp(stall, -99.0, 99.0):.0f}", 14.0, INK, "r")
