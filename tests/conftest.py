"""For every test: freed memory is kept for the next one and given back after each file, and none is timed."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import settings

from testbed.memory import give_back_memory, keep_freed_memory

keep_freed_memory()
settings.register_profile("no clock", deadline=None)  # what takes 0.1 s takes 0.3 on a busy machine
settings.load_profile("no clock")


@pytest.fixture(scope="module", autouse=True)
def memory() -> Iterator[None]:
    """A worker takes file after file."""
    yield
    give_back_memory()
