"""`icing reproduce`: every number of the founding paper that the project can put its own beside.

An item is a function of the seed that returns rows. Rules of agreement are fixed per sort of number; nothing is tuned
per row and a disagreement stays visible.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module

from icing_env.errors import InputError, nearest
from testbed.reproduce.row import Row

Item = Callable[[int], list[Row]]
ITEMS: dict[str, tuple[str, str]] = {  # module of the item's `rows`, and what it is
    "table1": ("table1", "the test matrix, every case flown"),
    "tables2_5": ("methods", "H-infinity against stepwise regression, clear and iced"),
    "flight_010302f1": ("flight", "figures 1 to 7: one flight through glaze ice, event by event"),
    "fig15_16": ("deicing", "selective de-icing"),
    "fig17_18": ("boots", "boots on a three-minute cycle"),
    "fig19": ("correlation", "drag and derivatives against the severity eta"),
    "fig20": ("scale", "turbulence in the scale factor of alpha, and that in CL_alpha"),
    "fig21_22": ("trim", "trim with and without ice"),
    "fig23_26": ("starts", "H-infinity from seven starts, clear air"),
    "fig27_30": ("natural_ice", "H-infinity in natural ice"),
    "recorded_methods": ("recorded", "every method on the recorded flights against the textbook"),
    "prediction": ("prediction", "a recorded flight predicted from another"),
    "textbook": ("textbook", "recorded flights of the same aircraft against the textbook"),
}


def reproduce(names: Sequence[str] = ("all",), seed: int = 0, progress: Callable[[str], None] | None = None
              ) -> list[Row]:
    """Rows of the items asked for, "all" for every one.

    Raises:
        InputError: no such item.
    """
    wanted = list(ITEMS) if "all" in names or not names else list(names)
    for name in wanted:
        if name not in ITEMS:
            raise InputError(f"nothing to reproduce under '{name}': {nearest(name, [*ITEMS, 'all'])}")
    found: list[Row] = []
    for name in wanted:
        module, what = ITEMS[name]
        if progress is not None:
            progress(f"{name}: {what}")
        item: Item = import_module(f"testbed.reproduce.{module}").rows
        found += item(seed)
    return found
