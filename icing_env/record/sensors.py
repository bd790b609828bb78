"""The table `sensors` of a side file in the words that the project reads; what else stands there is told, not guessed.

The form of a side file fixes what `sensors` tells (position of vanes and accelerometers, lag, filter, whether corrected
to the c.g. and for upwash, source of airspeed), not its words: those that others use are taken for ours.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

WORDS: dict[str, tuple[str, ...]] = {
    "alpha": ("position", "corrected", "upwash_corrected", "lag", "bending"),
    "beta": ("position", "corrected", "upwash_corrected", "lag"),
    "airspeed": ("lag", "source"),
    "accelerometers": ("position", "corrected"),
    "attitude": ("lag", "source"),
    "filter": ("lag", "frequency", "order", "found"),
    "thrust": ("source",),
}
FILTERED = ("alpha", "beta", "accelerometers", "rates", "surfaces")  # by one low pass, the recorder's
ORDER = 2  # of a low pass that stands with a channel: an anti-alias filter's, if nothing is said (assumed)
ENTRIES = {
    "accelerometer": ("accelerometers",), "vane": ("alpha", "beta"), "vanes": ("alpha", "beta"),
    "pitot": ("airspeed",), "recorder": ("filter",), "attitudes": ("attitude",), "inertial": ("attitude",),
    "ins": ("attitude",), "gyro": ("rates",), "gyros": ("rates",), "rate_gyros": ("rates",)}  # fmt: skip
SAME = {
    "corrected_to_cg": "corrected", "at_cg": "corrected", "position_m": "position", "lag_s": "lag", "latency": "lag",
    "latency_s": "lag", "corrected_for_upwash": "upwash_corrected", "frequency_hz": "frequency", "filter_hz": "filter",
    "filter_frequency": "filter", "filter_frequency_hz": "filter", "cutoff_hz": "filter"}  # fmt: skip


def understood(sensors: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """The table in our words, and what of it is not read, such as `sensors.alpha.colour`.

    Entries that are no tables stay as they are: whoever reads them says what is wrong. A word of ours that stands there
    too goes before another's. The low pass of a channel is taken for the recorder's, whose own entry goes before it; of
    several, the slowest.
    """
    out, unread, passed = dict[str, Any](), list[str](), list[Any]()
    for entry, content in sorted(sensors.items(), key=lambda item: item[0] in ENTRIES):
        for name in ENTRIES.get(entry, (entry,)):
            if name not in WORDS and not (name in FILTERED and isinstance(content, Mapping)):
                unread.append(f"sensors.{entry}")
            elif not isinstance(content, Mapping):
                out.setdefault(name, content)
            else:
                words = {SAME.get(word, word): value for word, value in content.items() if word in SAME}
                words |= {word: value for word, value in content.items() if word not in SAME}
                if name == "filter" and "filter" in words:
                    words.setdefault("frequency", words.pop("filter"))
                passed += [words.pop("filter")] if name in FILTERED and "filter" in words else []
                unread += [f"sensors.{entry}.{word}" for word in words if word not in WORDS.get(name, ())]
                if name in WORDS:
                    kept = {word: value for word, value in words.items() if word in WORDS[name]}
                    before = out.get(name)
                    out[name] = {**kept, **before} if isinstance(before, dict) else kept
    return _with_filter(out, passed), list(dict.fromkeys(unread))


def _with_filter(sensors: dict[str, Any], passed: list[Any]) -> dict[str, Any]:
    """The table with what channels tell of the recorder's low pass: a cut-off in Hz, or a table as the recorder's."""
    tables = [told if isinstance(told, Mapping) else {"frequency": told, "order": ORDER} for told in passed]
    if "filter" in sensors or not tables:
        return sensors
    return sensors | {"filter": dict(max(tables, key=_slowness))}


def _slowness(low_pass: Mapping[str, Any]) -> float:
    """Rough lag; of what is no number infinite, so that whoever reads it says so."""
    lag, frequency = low_pass.get("lag", 0.0), low_pass.get("frequency", 0.0)
    if not all(isinstance(value, int | float) for value in (lag, frequency)):
        return math.inf
    return float(lag or (1.0 / frequency if frequency else 0.0))
