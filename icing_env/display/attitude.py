"""Attitude indicator: horizon, pitch ladder, aircraft symbol, bank scale with the bank limit, sideslip index."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from icing_env.display.pen import AMBER, BLACK, EDGE, INK, RED, YELLOW, Box, Colour, Pen, Point, clamp, mix, polar

if TYPE_CHECKING:
    from icing_env.display.view import DisplayView

Place = Callable[[float, float], Point]
SKY: Colour = (22, 104, 178)
GROUND: Colour = (112, 70, 36)
HAZE: Colour = (222, 170, 110)
ATTITUDE: Box = (118, 60, 518, 460)
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
        for up, share in ((12.0 * step, 0.26 - 0.026 * step) for step in range(11)):
            _band(inner, place, horizon + up, 700.0, mix(SKY, INK, share))
            _band(inner, place, horizon - up, -700.0, mix(GROUND, HAZE, share))
        inner.line([place(-700.0, horizon), place(700.0, horizon)], INK, 2.5)
        _ladder(inner, place, pitch, bank)
        _bank_scale(inner, view, centre, bank)
        _aircraft_symbol(inner, centre)
    pen.rectangle(ATTITUDE, None, EDGE, radius=6.0)


def _band(pen: Pen, place: Place, start: float, end: float, colour: Colour) -> None:
    pen.polygon([place(-700, start), place(700, start), place(700, end), place(-700, end)], colour)


def _ladder(pen: Pen, place: Place, pitch: float, bank: float) -> None:
    """Marks every 2.5 deg, numbers every 10 deg, red chevrons beyond 30 deg that point back to the horizon."""
    middle = place(0.0, 0.0)
    for step in range(-36, 37):
        mark = 2.5 * step
        up = (mark - pitch) * PITCH_SCALE
        if step == 0 or abs(up) > LADDER_REACH or (abs(mark) > 30.0 and step % 4):
            continue
        half = 52.0 if step % 4 == 0 else 26.0 if step % 2 == 0 else 12.0
        pen.line([place(-half, up), place(half, up)], INK, 2.0)
        for side in (-1.0, 1.0) if step % 4 == 0 else ():
            at = place(side * (half + 17.0), up)
            if abs(at[1] - middle[1]) > 24.0 or abs(abs(at[0] - middle[0]) - 90.0) > 44.0:  # not under the symbol
                pen.text(at, f"{abs(mark):.0f}", 16.0, INK, bold=True, turn=bank)
    for mark in (-85, -75, -65, -55, -45, -35, 35, 45, 55, 65, 75, 85):
        up, back = (mark - pitch) * PITCH_SCALE, -math.copysign(1.0, mark)
        for side in (-1.0, 1.0) if abs(up) < LADDER_REACH - 12.0 else ():
            pen.line([place(side * 34.0, up - back * 14.0), place(0.0, up + back * 12.0)], RED, 5.0)


def _bank_scale(pen: Pen, view: DisplayView, centre: Point, bank: float) -> None:
    limit = clamp(math.degrees(view.bank_limit), 0.0, 90.0)
    over = abs(bank) > limit
    pen.arc(centre, BANK_RADIUS, -60.0, 60.0, INK, 2.0)
    for tick in (-60, -45, -30, -20, -10, 10, 20, 30, 45, 60):
        length = 18.0 if tick % 30 == 0 else 10.0
        pen.line([polar(centre, BANK_RADIUS, tick), polar(centre, BANK_RADIUS + length, tick)], INK, 2.0)
    x, y = centre[0], centre[1] - BANK_RADIUS
    pen.polygon([(x, y), (x - 9.0, y - 15.0), (x + 9.0, y - 15.0)], INK)
    for side in (-1.0, 1.0):
        if limit < 60.0:
            first, last = sorted((side * limit, side * 60.0))
            pen.arc(centre, BANK_RADIUS, first, last, AMBER, 5.0)
        mark = [polar(centre, BANK_RADIUS + reach, side * limit) for reach in (-10.0, 16.0)]
        pen.line(mark, BLACK, 9.0)
        pen.line(mark, AMBER, 5.0)
    colour = AMBER if over else YELLOW
    tip = [polar(centre, BANK_RADIUS - 3.0, -bank)]
    base = [polar(centre, BANK_RADIUS - 20.0, -bank + turned) for turned in (-3.8, 3.8)]
    pen.polygon(tip + base, colour, BLACK, 1.0)
    # The index stands where a slip ball would: wind from the right pushes the aircraft left, the ball goes right.
    slip = clamp(math.degrees(view.beta), -15.0, 15.0) * 0.75
    angles = (-bank + slip - 4.0, -bank + slip + 4.0)
    inner = [polar(centre, BANK_RADIUS - 30.0, turned) for turned in reversed(angles)]
    pen.polygon([polar(centre, BANK_RADIUS - 23.0, turned) for turned in angles] + inner, colour, BLACK, 1.0)


def _aircraft_symbol(pen: Pen, centre: Point) -> None:
    x, y = centre
    for side in (-1.0, 1.0):
        wing = [(x + side * 118.0, y), (x + side * 62.0, y), (x + side * 62.0, y + 16.0)]
        pen.line(wing, BLACK, 10.0)
        pen.line(wing, YELLOW, 6.0)
    pen.rectangle((x - 6.0, y - 6.0, x + 6.0, y + 6.0), BLACK)
    pen.rectangle((x - 3.5, y - 3.5, x + 3.5, y + 3.5), YELLOW)
