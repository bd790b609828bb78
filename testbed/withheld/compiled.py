"""What this folder compiles is kept on disk under a hash of its sources.

Numba's own cache looks at the file of a function alone: after a change of the plant, what calls it from another file
would go on flying the old one.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import config

F = TypeVar("F", bound=Callable[..., Any])


@cache
def folder(sources: Path = Path(__file__).parent) -> str:
    """Where what is compiled of these sources is kept: in `$ICING_CACHE` or the user's cache folder."""
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(sources.glob("*.py")):
        digest.update(path.name.encode() + path.read_bytes())
    base = os.environ.get("ICING_CACHE") or Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "icing"
    return str(Path(base) / f"withheld-{digest.hexdigest()[:16]}")


def part(function: F) -> F:
    """Compile a function into whatever calls it."""
    return numba.njit(function, forceinline=True)  # type: ignore[no-any-return]


def compiled(function: F) -> F:
    """Compile a function of its own."""
    before = config.CACHE_DIR
    config.CACHE_DIR = folder()  # read by numba while the dispatcher is made, for this one only
    try:
        return numba.njit(function, cache=True)  # type: ignore[no-any-return]
    finally:
        config.CACHE_DIR = before
