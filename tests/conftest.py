"""For every test: memory that one diagnosis has freed is kept for the next, and given back after each file."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from testbed.memory import give_back_memory, keep_freed_memory

keep_freed_memory()


@pytest.fixture(scope="module", autouse=True)
def memory() -> Iterator[None]:
    """A worker takes file after file."""
    yield
    give_back_memory()
