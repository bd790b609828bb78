"""Memory of this process: how much it had, and what becomes of it when an array is no longer needed.

By itself the C library gives every large array back to the system and asks for it anew, which costs a diagnosis a
tenth of its time. What is kept instead falls to pieces from one diagnosis to the next, until a process that needs
1.4 GB for each has 2.4; so it goes back when one is done.
"""

from __future__ import annotations

import ctypes
import os
import sys

TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3  # of mallopt(3)
LARGE = 2**30  # bytes up to which memory is kept; both are C ints


def keep_freed_memory() -> None:
    """Keep freed arrays for the next ones from now on, where the C library is GNU's and the user has not said."""
    library = _gnu()
    for name, parameter in (("MALLOC_TRIM_THRESHOLD_", TRIM_THRESHOLD), ("MALLOC_MMAP_THRESHOLD_", MMAP_THRESHOLD)):
        if library is not None and name not in os.environ:
            library.mallopt(parameter, LARGE)


def give_back_memory() -> None:
    """Give the system what was freed, where the C library is GNU's."""
    if (library := _gnu()) is not None:
        library.malloc_trim(0)


def peak_memory_gb() -> float | None:
    """Most memory that this process has had so far [GB]; None where the system does not say (Windows)."""
    if sys.platform == "win32":
        return None
    import resource

    unit = 1.0 if sys.platform == "darwin" else 1024.0  # bytes there, KiB elsewhere
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e9


def _gnu() -> ctypes.CDLL | None:
    """The C library of this process, if it is GNU's."""
    if sys.platform != "linux":
        return None
    library = ctypes.CDLL(None)
    return library if hasattr(library, "gnu_get_libc_version") else None
