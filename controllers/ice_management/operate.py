"""Function 2, operate the ice protection: boots and propeller heat."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from icing_env.jit import entry, kernel


@kernel
def operate_protection(a: Any, m: Any, g: Any) -> None:
    """Boots and propeller heat: on while ice is detected and it is cold enough to freeze."""
    boots = a.ice_detected if m.temperature < g.boots_temperature else 0.0
    a.boots_wing = a.boots_tail = a.boots_vtail_struts = boots
    a.prop_heat = a.ice_detected if m.temperature < g.heat_temperature else 0.0


@entry
def operate(command: NDArray[Any], advisory: NDArray[Any]) -> None:
    """Switch boots and heat in COMMAND rows as the ADVISORY rows ask: on with the ice, off with the all-clear.

    While the management operates the ice protection, the switches are its own; a crew that wants them back switches
    the management's hand off (`boots=False`).
    """
    for i in range(len(command)):
        c, a = command[i], advisory[i]
        c.boots_wing = a.boots_wing
        c.boots_tail = a.boots_tail
        c.boots_vtail_struts = a.boots_vtail_struts
        c.prop_heat = a.prop_heat
