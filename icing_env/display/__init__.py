"""The primary flight display: what to show (`view`), where it is drawn (`page`), a window for it (`window`)."""

from icing_env.display.page import INSTRUMENTS, draw
from icing_env.display.view import DisplayView, climb_rate

__all__ = ["INSTRUMENTS", "DisplayView", "climb_rate", "draw"]
