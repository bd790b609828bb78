"""Worker processes: a core each and memory that is kept, no longer than who started them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from threading import Thread

from testbed.memory import keep_freed_memory

# NumPy reads it when it is imported: set in a worker it would come too late, and as many threads as there are cores, of
# every worker, would wait for one another.
START = {"OMP_NUM_THREADS": "1"}


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
    return ProcessPoolExecutor(workers, mp_context=get_context(start), initializer=begin)


def begin() -> None:
    """What a worker does first."""
    keep_freed_memory()
    end_with_parent()


def end_with_parent() -> None:
    """End this process when its parent does: a killed command left workers of 1.8 GB each waiting for ever."""
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        parent.join()
        os._exit(1)

    Thread(target=watch, daemon=True).start()
