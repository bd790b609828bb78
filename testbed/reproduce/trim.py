"""Figures 21 and 22: what it takes to fly level with ice, at the same speed."""

from __future__ import annotations

import numpy as np

from icing_env import aircraft
from testbed.reproduce.flight import SEEDS, fly_all
from testbed.reproduce.pictures import Picture
from testbed.reproduce.row import Row, Rule, row
from testbed.reproduce.windows import Window

ITEM = "fig21_22"


def rows(seed: int) -> list[Row]:
    """Rise of angle of attack, thrust coefficient and elevator from the baseline to the worst iced set."""
    flights = fly_all("flight_010302f1", seed, SEEDS)
    area = float(aircraft.load()["wing_area"][0])
    pairs = [(flight["baseline"], flight["second_encounter"]) for flight in flights]
    alpha = float(np.mean([np.degrees(iced.trim["alpha"] - clean.trim["alpha"]) for clean, iced in pairs]))
    elevator = float(np.mean([np.degrees(iced.trim["elevator"] - clean.trim["elevator"]) for clean, iced in pairs]))
    clean, iced = (float(np.mean([_thrust_coefficient(pair[k], area) for pair in pairs])) for k in (0, 1))
    note = f"measured before the baseline and the 14:35 sets, mean of {SEEDS} flights"
    more = elevator < -0.05
    return [
        row(ITEM, "rise of trim angle of attack, flight 010302f1", 1.5, alpha, "deg", Rule(absolute=0.5),
            f"{note}; the paper's 1 to 2 deg where the clean aircraft trims near 0",
            miss="the UIUC ice factors take a tenth of the slope and leave the lift at zero incidence"),
        row(ITEM, "thrust coefficient, clean", 0.06, clean, "1", Rule(relative=0.2), note,
            miss="at a lift coefficient of 0.54; the paper's baseline flew at about zero incidence"),
        row(ITEM, "thrust coefficient, iced over clean", 0.08/0.06, iced/clean, "1", Rule(relative=0.15), note),
        Row(ITEM, "elevator to trim the same aircraft with ice", "simulated", "more", elevator, "deg", None, more,
            "more nose-up elevator by 0.05 deg or more", f"{note}; positive is trailing edge down" if more else
            f"{note}; positive is trailing edge down; ice takes static stability as well as elevator power here"),
    ]


def _thrust_coefficient(window: Window, area: float) -> float:
    """Thrust over dynamic pressure and wing area, from measured thrust and airspeed."""
    trim = window.trim
    pressure = 0.5*window.truth["density"]*trim["airspeed"]**2
    return (trim["thrust_left"] + trim["thrust_right"])/(pressure*area)


def pictures(seed: int) -> list[Picture]:
    """Figures of this item."""
    from testbed.reproduce import flight_figures  # it draws what this module flies

    return flight_figures.trims(seed)
