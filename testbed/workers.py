"""What worker processes start with: a core each, and memory that is kept."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

# NumPy reads the first when it is imported: set in a worker it would come too late, and as many threads as there are
# cores, of every worker, would wait for one another. The others keep the C library from giving every large array back
# to the system and asking for it anew, which cost two diagnoses 10 and 20 % of their time.
START = {"OMP_NUM_THREADS": "1", "MALLOC_MMAP_THRESHOLD_": str(2**32), "MALLOC_TRIM_THRESHOLD_": str(2**33)}


@contextmanager
def a_core_each() -> Iterator[None]:
    """Processes spawned meanwhile start with START, but for what the user has set."""
    mine = {name: value for name, value in START.items() if name not in os.environ}
    os.environ.update(mine)
    try:
        yield
    finally:
        for name in mine:
            del os.environ[name]
