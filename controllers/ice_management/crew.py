"""What the crew is told, in plain cockpit words: one list of messages out of an ADVISORY row.

Levels as on a flight deck (14 CFR 25.1322): a warning wants action at once, a caution action soon, an advisory none.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

LEVELS = ("warning", "caution", "advisory")
SEVERE, MODERATE = 0.6, 0.3  # severity from which ice is called so: shares of what takes all the power (assumed)
PARTS = {"left_wing": "LEFT WING", "right_wing": "RIGHT WING", "htail": "TAIL", "propeller": "PROPELLER"}
UNLIKE = 0.04  # difference of the half wings' eta that is told (assumed: trim of a degree of aileron)
TAIL = 0.05  # eta of the tailplane that is told (assumed)
KNOT = 0.514444  # m/s
MOVED = 0.005  # rad of a control moved by the protection that is told (assumed: a third of a degree)


@dataclass(frozen=True)
class Message:
    """One line: its level, of LEVELS, and its words."""

    level: str
    text: str

    def __str__(self) -> str:
        return f"{self.level.upper()}: {self.text}"


def messages(a: Any) -> list[Message]:
    """What an ADVISORY row has to say, the most urgent first; nothing in clear air.

    Args:
        a: ADVISORY record (one row) or mapping with its fields.
    """
    said = [*_upsets(a), *_ice(a), *_failures(a), *_limits(a), *_adaptation(a)]
    return sorted(said, key=lambda message: LEVELS.index(message.level))


def log(time: NDArray[np.float64], advisory: NDArray[Any], period: float = 1.0, again: float = 60.0
        ) -> list[tuple[float, Message]]:  # fmt: skip
    """Messages of a flight when they begin: (time [s], message).

    Args:
        time, advisory: [samples], s and ADVISORY rows.
        period: s between looks.
        again: s of silence after which the same words are news; a number in them is not.
    """
    told: list[tuple[float, Message]] = []
    last: dict[str, float] = {}
    look = -math.inf
    for now, row in zip(time, advisory, strict=True):
        if now - look < period - 1e-6:
            continue
        look = float(now)
        for message in messages(row):
            words = re.sub(r"\d+", "", message.text)
            if look - last.get(words, -math.inf) > again:
                told.append((look, message))
            last[words] = look
    return told


def _upsets(a: Any) -> list[Message]:
    said = []
    if a["tail_stall"]:
        said.append(Message("warning", "TAIL STALL - FLAPS UP ONE STEP, PULL, POWER AS SET"))
    if a["roll_upset"]:
        said.append(Message("warning", "ROLL UPSET - UNLOAD, ROLL LEVEL"))
    if a["power_lacking"]:
        said.append(Message("caution", "POWER LACKING - SPEED AND HEIGHT CANNOT BOTH BE HELD, LEAVE ICING"))
    return said


def _ice(a: Any) -> list[Message]:
    if not a["ice_detected"]:
        return []
    severity = a["severity"]
    word, level = (("SEVERE", "warning") if severity >= SEVERE else
                   ("MODERATE", "caution") if severity >= MODERATE else ("LIGHT", "advisory"))
    said = [Message(level, f"ICE {word}" + (" - LEAVE ICING" if level == "warning" else ""))]
    left, right = a["severity_left_wing"], a["severity_right_wing"]
    if abs(left - right) > UNLIKE:
        said.append(Message("caution", f"ICE UNEVEN - MORE ON {'LEFT' if left > right else 'RIGHT'} WING"))
    if a["severity_htail"] > TAIL:
        said.append(Message("caution", "TAIL ICE - LIMIT FLAPS"))
    return said


def _failures(a: Any) -> list[Message]:
    return [Message("caution", f"{name} {'HEAT' if part == 'propeller' else 'BOOT'} FAILED")
            for part, name in PARTS.items() if a[f"failed_{part}"]]


def _limits(a: Any) -> list[Message]:
    said = []
    if a["ice_detected"]:
        said.append(Message("advisory", f"MINIMUM SPEED {a['airspeed_limit']/KNOT:.0f} KT TRUE, "
                                        f"MAXIMUM BANK {math.degrees(a['bank_limit']):.0f} DEG"))
    if abs(a["intervention"]) > MOVED or abs(a["intervention_aileron"]) > MOVED:
        said.append(Message("caution", "ENVELOPE PROTECTION ACTIVE"))
    boots = [name for name, on in (("WING", a["boots_wing"]), ("TAIL", a["boots_tail"]),
                                   ("FIN AND STRUT", a["boots_vtail_struts"])) if on]
    if boots:
        said.append(Message("advisory", f"{', '.join(boots)} BOOTS INFLATING"))
    if a["prop_heat"]:
        said.append(Message("advisory", "PROPELLER HEAT ON"))
    return said


def _adaptation(a: Any) -> list[Message]:
    if not a["adaptation"]:
        return []
    if a["adaptation_frozen"] and a["ice_detected"]:
        return [Message("advisory", "FLIGHT CONTROL ADAPTATION HELD - CONTROL FEEL MAY CHANGE")]
    return [Message("advisory", "FLIGHT CONTROLS ADAPTED TO ICE")] if a["ice_detected"] else []
