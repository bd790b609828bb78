"""What a diagnosis took as given of its records: lags, offsets in time and what drives the model where."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from typing import Any

NUMBER = re.compile(r"-?\d+(\.\d+)?")


def taken_as_given(provenance: Mapping[str, Any]) -> list[tuple[str, int]]:
    """Notes of all records, each with how many have it; of those that differ in their numbers alone, the first."""
    first: dict[str, str] = {}
    count: Counter[str] = Counter()
    for record in (*provenance["records"], *provenance["held_out"]):
        count.update({NUMBER.sub("#", note) for note in record["notes"]})
        for note in record["notes"]:
            first.setdefault(NUMBER.sub("#", note), note)
    return [(note, count[kind]) for kind, note in first.items()]
