"""Worker processes: a core each and memory that is kept, no longer than who started them; and memory of a process."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from threading import Thread

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


def processes(workers: int, start: str | None = "spawn") -> ProcessPoolExecutor:
    """Worker processes that end when the process that started them does, killed or not.

    Args:
        workers: how many.
        start: method; None for the system's own, which hands down what was registered in this process.
    """
    return ProcessPoolExecutor(workers, mp_context=get_context(start), initializer=end_with_parent)


def end_with_parent() -> None:
    """End this process when its parent does: a killed command left workers of 1.8 GB each waiting for ever."""
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        parent.join()
        os._exit(1)

    Thread(target=watch, daemon=True).start()


def peak_memory_gb() -> float | None:
    """Most memory that this process has had so far [GB]; None where the system does not say (Windows)."""
    if sys.platform == "win32":
        return None
    import resource

    unit = 1.0 if sys.platform == "darwin" else 1024.0  # bytes there, KiB elsewhere
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e9
