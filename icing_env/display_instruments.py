"""The six classical instruments of the flight display: attitude, airspeed, altitude, vertical speed, heading, and alpha.

Each function draws one instrument in its own box from a `DisplayView` (SI, rad); what a pilot reads in other units
is converted here.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from icing_env.display_pen import (
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
    YELLOW,
    Box,
    Colour,
    Pen,
    Point,
    clamp,
    mix,
    panel,
)

if TYPE_CHECKING:
    from icing_env.display import DisplayView

KNOT = 0.514444  # m/s
FOOT = 0.3048  # m
SKY: Colour = (22, 104, 178)
GROUND: Colour = (112, 70, 36)

ATTITUDE: Box = (118, 60, 518, 460)
AIRSPEED: Box = (16, 60, 106, 460)
ALTITUDE: Box = (530, 60, 630, 460)
VERTICAL_SPEED: Box = (638, 60, 690, 460)
HEADING: Box = (118, 470, 518, 522)
UNDER_AIRSPEED: Box = (16, 470, 106, 522)
UNDER_ALTITUDE: Box = (530, 470, 690, 522)
ALPHA: Box = (16, 532, 230, 706)

PITCH_SCALE = 7.0  # layout units per degree
LADDER_REACH = 122.0  # how far from the middle the ladder is drawn, so that it stays clear of the bank scale
BANK_RADIUS = 168.0


def attitude(pen: Pen, view: DisplayView) -> None:
    """Horizon, pitch ladder, aircraft symbol, bank scale with the bank limit, sideslip index under the pointer."""
    centre = ((ATTITUDE[0] + ATTITUDE[2]) / 2.0, (ATTITUDE[1] + ATTITUDE[3]) / 2.0)
    pitch = clamp(math.degrees(view.theta), -90.0, 90.0)
    bank = math.remainder(math.degrees(view.phi), 360.0)
    c, s = math.cos(view.phi), math.sin(view.phi)

    def place(along: float, up: float) -> Point:
        """Screen position of a point given along the horizon and up the sky."""
        return centre[0] + along * c - up * s, centre[1] - along * s - up * c

    with pen.inside(ATTITUDE, SKY) as inner:
        # A sliver of sky or ground always stays in sight, so that the way back to level is never a riddle.
        horizon = clamp(-pitch * PITCH_SCALE, -165.0, 165.0)
        for up, share in ((0.0, 0.24), (28.0, 0.16), (60.0, 0.08), (100.0, 0.0)):
            _band(inner, place, horizon + up, 700.0, mix(SKY, INK, share))
            _band(inner, place, horizon - up, -700.0, mix(GROUND, (222, 170, 110), share))
        inner.line([place(-700.0, horizon), place(700.0, horizon)], INK, 2.5)
        _ladder(inner, place, pitch, bank)
        _bank_scale(inner, view, centre, bank)
        _aircraft_symbol(inner, centre)
    pen.rectangle(ATTITUDE, None, EDGE, radius=6.0)


def _band(pen: Pen, place, start: float, end: float, colour: Colour) -> None:
    pen.polygon([place(-700, start), place(700, start), place(700, end), place(-700, end)], colour)


def _ladder(pen: Pen, place, pitch: float, bank: float) -> None:
    """Marks every 2.5 deg, numbers every 10 deg, red chevrons beyond 30 deg that point back to the horizon."""
    for step in range(-36, 37):
        mark = 2.5 * step
        up = (mark - pitch) * PITCH_SCALE
        if step == 0 or abs(up) > LADDER_REACH:
            continue
        half = 52.0 if step % 4 == 0 else 26.0 if step % 2 == 0 else 12.0
        pen.line([place(-half, up), place(half, up)], INK, 2.0)
        if step % 4 == 0:
            for side in (-1.0, 1.0):
                pen.text(place(side * (half + 17.0), up), f"{abs(mark):.0f}", 16.0, INK, bold=True, turn=bank)
        if abs(mark) in (35.0, 45.0, 55.0, 65.0, 75.0, 85.0):
            back = -math.copysign(1.0, mark)
            for side in (-1.0, 1.0):
                pen.line([place(side * 34.0, up - back * 14.0), place(0.0, up + back * 12.0)], RED, 5.0)


def _polar(centre: Point, radius: float, degrees: float) -> Point:
    """Point at an angle clockwise from the top."""
    angle = math.radians(degrees)
    return centre[0] + radius * math.sin(angle), centre[1] - radius * math.cos(angle)


def _bank_scale(pen: Pen, view: DisplayView, centre: Point, bank: float) -> None:
    limit = clamp(math.degrees(view.bank_limit), 0.0, 90.0)
    over = abs(bank) > limit
    pen.arc(centre, BANK_RADIUS, -60.0, 60.0, INK, 2.0)
    for tick in (-60, -45, -30, -20, -10, 10, 20, 30, 45, 60):
        length = 18.0 if tick % 30 == 0 else 10.0
        pen.line([_polar(centre, BANK_RADIUS, tick), _polar(centre, BANK_RADIUS + length, tick)], INK, 2.0)
    x, y = centre[0], centre[1] - BANK_RADIUS
    pen.polygon([(x, y), (x - 9.0, y - 15.0), (x + 9.0, y - 15.0)], INK)
    for side in (-1.0, 1.0):
        if limit < 60.0:
            first, last = sorted((side * limit, side * 60.0))
            pen.arc(centre, BANK_RADIUS, first, last, AMBER, 5.0)
        for offset in (-0.9, 0.9):
            turned = side * limit + offset
            pen.line([_polar(centre, BANK_RADIUS - 9, turned), _polar(centre, BANK_RADIUS + 13, turned)], AMBER, 2.5)
    colour = AMBER if over else YELLOW
    tip = [_polar(centre, BANK_RADIUS - 3.0, -bank)]
    base = [_polar(centre, BANK_RADIUS - 20.0, -bank + turned) for turned in (-3.8, 3.8)]
    pen.polygon(tip + base, colour, BLACK, 1.0)
    # The index stands where a slip ball would: wind from the right pushes the aircraft left, the ball goes right.
    slip = clamp(math.degrees(view.beta), -15.0, 15.0) * 0.75
    angles = (-bank + slip - 4.0, -bank + slip + 4.0)
    inner = [_polar(centre, BANK_RADIUS - 30.0, turned) for turned in reversed(angles)]
    pen.polygon([_polar(centre, BANK_RADIUS - 23.0, turned) for turned in angles] + inner, colour, BLACK, 1.0)


def _aircraft_symbol(pen: Pen, centre: Point) -> None:
    x, y = centre
    for side in (-1.0, 1.0):
        wing = [(x + side * 118.0, y), (x + side * 62.0, y), (x + side * 62.0, y + 16.0)]
        pen.line(wing, BLACK, 10.0)
        pen.line(wing, YELLOW, 6.0)
    pen.rectangle((x - 6.0, y - 6.0, x + 6.0, y + 6.0), BLACK)
    pen.rectangle((x - 3.5, y - 3.5, x + 3.5, y + 3.5), YELLOW)


def _pointer_box(pen: Pen, box: Box, text: str, colour: Colour, tip: float) -> None:
    """Reading in a black box with a pointer at `tip` (the x of its point)."""
    middle = (box[1] + box[3]) / 2.0
    edge = box[2] if tip > box[2] else box[0]
    pen.polygon([(edge, middle - 9.0), (tip, middle), (edge, middle + 9.0)], colour)
    pen.rectangle(box, BLACK, colour, radius=4.0, width=2.0)
    pen.text(((box[0] + box[2]) / 2.0, middle), text, 24.0 if len(text) < 5 else 22.0, colour, bold=True)


def _bug(pen: Pen, edge: float, y: float, side: float) -> None:
    """Cyan mark of a selected value on the edge of a tape."""
    shape = [(0.0, -11.0), (14.0, -11.0), (14.0, -5.0), (6.0, 0.0), (14.0, 5.0), (14.0, 11.0), (0.0, 11.0)]
    pen.polygon([(edge + side * a, y + b) for a, b in shape], CYAN)


def airspeed(pen: Pen, view: DisplayView) -> None:
    """True airspeed in knots; amber below the lowest speed allowed now, red below the stall that it keeps clear of."""
    speed, limit = view.airspeed / KNOT, view.airspeed_limit / KNOT
    stall = limit / view.stall_margin
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
    panel(pen, UNDER_AIRSPEED)
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
    panel(pen, UNDER_ALTITUDE)
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
            if value % 10 == 0:
                name = {0: "N", 90: "E", 180: "S", 270: "W"}.get(value % 360, f"{value % 360 // 10:02d}")
                inner.text((x, bottom - 22.0), name, 15.0, INK if name.isalpha() else DIM, bold=name.isalpha())
        if view.heading_selected is not None:
            error = math.degrees(math.remainder(view.heading_selected - view.psi, 2.0 * math.pi))
            x = clamp(middle + error * 5.0, HEADING[0] + 4.0, HEADING[2] - 4.0)
            inner.polygon([(x - 9.0, top), (x + 9.0, top), (x + 9.0, top + 7.0), (x, top + 13.0), (x - 9.0, top + 7.0)], CYAN)
        reading = round(degrees) % 360 or 360
        inner.polygon([(middle - 8.0, bottom - 10.0), (middle + 8.0, bottom - 10.0), (middle, bottom)], INK)
        inner.rectangle((middle - 30.0, top + 5.0, middle + 30.0, bottom - 10.0), BLACK, INK, radius=4.0, width=2.0)
        inner.text((middle, (top + bottom - 5.0) / 2.0), f"{reading:03d}", 22.0, INK, bold=True)
    pen.rectangle(HEADING, None, EDGE, radius=6.0)


def alpha(pen: Pen, view: DisplayView) -> None:
    """Angle of attack on a dial, -5..25 deg: amber above the limit that stands now, red above the clean stall."""
    value, limit, stall = (math.degrees(a) for a in (view.alpha, view.alpha_limit, view.alpha_stall_clean))
    centre, radius = ((ALPHA[0] + ALPHA[2]) / 2.0, 652.0), 78.0

    def turn(degrees: float) -> float:
        return (clamp(degrees, -6.0, 26.0) - 10.0) * 7.0

    panel(pen, ALPHA, "ALPHA deg")
    pen.text((ALPHA[2] - 12.0, ALPHA[1] + 17.0), f"LIM {limit:.1f}", 15.0, AMBER, "r", bold=True)
    pen.arc(centre, radius, turn(-5.0), turn(25.0), WELL, 9.0)
    top = max(limit, stall)
    pen.arc(centre, radius, turn(-5.0), turn(min(limit, 25.0)), mix(PANEL, GREEN, 0.75), 9.0)
    pen.arc(centre, radius, turn(min(limit, 25.0)), turn(min(top, 25.0)), AMBER, 9.0)
    pen.arc(centre, radius, turn(min(top, 25.0)), turn(25.0), RED, 9.0)
    for tick in (-5, 0, 5, 10, 15, 20, 25):
        pen.line([_polar(centre, radius - 10.0, turn(tick)), _polar(centre, radius - 4.0, turn(tick))], INK, 2.0)
        pen.text(_polar(centre, radius - 22.0, turn(tick)), f"{tick}", 14.0, DIM)
    pen.line([_polar(centre, radius - 12.0, turn(stall)), _polar(centre, radius + 11.0, turn(stall))], INK, 3.0)
    pen.line([_polar(centre, radius - 12.0, turn(limit)), _polar(centre, radius + 11.0, turn(limit))], AMBER, 4.0)
    colour = RED if value > top else AMBER if value > limit else INK
    pen.line([_polar(centre, 12.0, turn(value)), _polar(centre, radius + 6.0, turn(value))], BACK, 8.0)
    pen.line([_polar(centre, 12.0, turn(value)), _polar(centre, radius + 6.0, turn(value))], colour, 4.0)
    pen.arc(centre, 9.0, 0.0, 360.0, colour, 5.0)
    pen.text((centre[0], 690.0), f"{clamp(value, -99.9, 99.9):.1f}", 24.0, colour, bold=True)
