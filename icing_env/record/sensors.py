"""The table `sensors` of a side file in the words that the project reads; what else stands there is told, not guessed.

The form of a side file fixes what `sensors` tells (position of vanes and accelerometers, lag, filter, whether corrected
to the c.g. and for upwash, source of airspeed), not its words: those that others use are taken for ours.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

WORDS: dict[str, tuple[str, ...]] = {
    "alpha": ("position", "corrected", "upwash_corrected", "lag", "bending"),
    "beta": ("position", "corrected", "upwash_corrected", "lag"),
    "airspeed": ("lag", "source"),
    "accelerometers": ("position", "corrected"),
    "filter": ("lag", "frequency", "found"),
    "thrust": ("source",),
}
ENTRIES = {"accelerometer": ("accelerometers",), "vane": ("alpha", "beta"), "vanes": ("alpha", "beta"),
           "pitot": ("airspeed",), "recorder": ("filter",)}  # fmt: skip
SAME = {"corrected_to_cg": "corrected", "at_cg": "corrected", "position_m": "position", "lag_s": "lag",
        "corrected_for_upwash": "upwash_corrected", "frequency_hz": "frequency"}  # fmt: skip


def understood(sensors: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """The table in our words, and what of it is not read, such as `sensors.alpha.filter_hz`.

    Entries that are no tables stay as they are: whoever reads them says what is wrong. A word of ours that stands there
    too goes before another's.
    """
    out, unread = dict[str, Any](), list[str]()
    for entry, content in sorted(sensors.items(), key=lambda item: item[0] in ENTRIES):
        for name in ENTRIES.get(entry, (entry,)):
            if name not in WORDS:
                unread.append(f"sensors.{entry}")
            elif not isinstance(content, Mapping):
                out.setdefault(name, content)
            else:
                words = {SAME.get(word, word): value for word, value in content.items() if word in SAME}
                words |= {word: value for word, value in content.items() if word not in SAME}
                unread += [f"sensors.{entry}.{word}" for word in words if word not in WORDS[name]]
                kept = {word: value for word, value in words.items() if word in WORDS[name]}
                before = out.get(name)
                out[name] = {**kept, **before} if isinstance(before, dict) else kept
    return out, list(dict.fromkeys(unread))
