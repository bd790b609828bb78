"""Figures 27 to 30: H-infinity in ice without turbulence, started where stepwise regression ends, as the paper did."""

from __future__ import annotations

from estimators.hinf import record as hinf_record
from estimators.observer.record import History
from testbed.reproduce.cases import NAMES, UNITS, airframe_at, fly_case
from testbed.reproduce.pictures import Picture
from testbed.reproduce.row import Row
from testbed.reproduce.starts import course, draw
from testbed.reproduce.windows import Window

ITEM = "fig27_30"
CASE = "ice, high V"
# The paper's text: CL_alpha at high velocity agreed within 13.2 %, the pitching moment's derivatives within 21 %.
WITHIN = {"CL_alpha": 13.2, "Cm_alpha": 21.0, "Cm_q": 21.0, "Cm_elevator": 21.0}


def rows(seed: int) -> list[Row]:
    """For each derivative: the final value over stepwise regression's, beside the paper's bound."""
    window = calm(seed)
    run = history(window)
    return [_row(name, run, window) for name in NAMES]


def calm(seed: int) -> Window:
    """One iced doublet set in still air: the paper's case is one without turbulence."""
    return fly_case(CASE, seed, 0.0, 1)[0]


def history(window: Window) -> History:
    """The observer's course from stepwise regression's values."""
    return hinf_record.history(window.record, airframe=airframe_at(window.stepwise))


def _row(name: str, run: History, window: Window) -> Row:
    unit, scale = UNITS[name]
    final, steps = float(course(run, name)[-1]), scale*window.stepwise[name].estimate
    difference, bound = 100.0*(final/steps - 1.0), WITHIN[name]
    agrees = abs(difference) <= bound
    why = f"one set, eta 0.05 on every surface, still air; {final:.4g} against {steps:.4g} {unit}"
    return Row(ITEM, f"{name}: final H-infinity over stepwise", "simulated", f"within {bound:g}", difference, "%", None,
               agrees, f"within the paper's {bound:g} %", why if agrees else
               f"{why}; the doublet does not pull the observer to what regression sees")


def pictures(seed: int) -> list[Picture]:
    """The four courses and stepwise regression's values."""
    window = calm(seed)
    figure = draw([history(window)], {name: UNITS[name][1]*window.stepwise[name].estimate for name in NAMES})
    return [Picture(figure, "Figures 27 to 30: the H-infinity observer in ice without turbulence, started at stepwise "
                    "regression's values (grey) as the paper started it.",
                    "Courses of four derivatives beside stepwise regression's constant values")]
