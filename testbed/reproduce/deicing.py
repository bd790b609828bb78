"""Figures 15 and 16: which surface's de-icing gives back which coefficient."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from testbed.reproduce.flight import Flights, fly_all, stepwise
from testbed.reproduce.flight_figures import over_sets
from testbed.reproduce.pictures import Picture
from testbed.reproduce.row import Row, Rule, row
from testbed.reproduce.windows import Window

ITEM = "fig15_16"
SEEDS = 3
SETS = ("iced", "wing_deiced", "tail_deiced", "vtail_struts_deiced")
CHANGE = Rule(absolute=5.0)


def rows(seed: int) -> list[Row]:
    """CL_alpha after the wing against clean, and which steps of lift slope and drag are the large ones."""
    flights = fly_all("selective_deicing", seed, SEEDS)
    note = f"stepwise, mean of {SEEDS} flights"
    lift = {name: _mean(flights, name, lambda w, clean: 100.0*(stepwise(w, "CL_alpha")/stepwise(clean, "CL_alpha") - 1))
            for name in SETS}
    drag = {name: _mean(flights, name, lambda w, clean: w.excess_drag - clean.excess_drag) for name in SETS}
    gained = np.diff([lift[name] for name in SETS])
    shed = -np.diff([drag[name] for name in SETS])
    steps = "steps by wing, horizontal tail, vertical tail and struts: "
    return [
        row(ITEM, "CL_alpha after the wing's de-icing, against clean", -7.0, lift["wing_deiced"], "%", CHANGE,
            f"{note}; iced {lift['iced']:.1f} %; the paper's log notes lots of residuals"),
        _claim("only the wing moves CL_alpha", "wing largest", gained[0] > 2.0*max(abs(gained[1]), abs(gained[2])),
               f"{steps}{', '.join(f'{g:+.1f}' for g in gained)} % of clean",
               "largest by a factor of two", "scatter between doublet sets in turbulence is of the other steps' size"),
        _claim("wing and vertical tail with struts carry the drag", "tail smallest",
               0.5*min(shed[0], shed[2]) > abs(shed[1]), f"{steps}{', '.join(f'{-s:+.4f}' for s in shed)} in CD",
               "horizontal tail less than half of either", "the drag steps are of like size"),
        row(ITEM, "drag left after all three, of the iced excess", 100.0*0.0218/0.0282,
            100.0*drag["vtail_struts_deiced"]/drag["iced"], "%", Rule(absolute=15.0),
            f"observer in flight, mean of {SEEDS} flights; the paper's figure is not data: "
            "its flight 010302f1 kept 0.0218 of 0.0282"),
    ]


def _mean(flights: Flights, name: str, of: Callable[[Window, Window], float]) -> float:
    return float(np.mean([of(flight[name], flight["baseline"]) for flight in flights]))


def _claim(quantity: str, paper: str, holds: bool, found: str, rule: str, miss: str) -> Row:
    """A statement of the paper that holds here or does not."""
    return Row(ITEM, quantity, "simulated", paper, paper if holds else "not so", "", None, bool(holds), rule,
               found if holds else f"{found}; {miss}")


def pictures(seed: int) -> list[Picture]:
    """Figures 15 and 16."""
    flights = fly_all("selective_deicing", seed, SEEDS)
    return [over_sets(flights, ("baseline", *SETS), ("clean", "iced", "wing", "tail", "vtail, struts"),
                      "Figures 15 and 16: CL_alpha and excess drag before ice, with ice, and after each surface's "
                      "de-icing in turn.")]
