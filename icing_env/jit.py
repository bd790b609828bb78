"""How the physics is compiled: three decorators over numba's `njit`.

`kernel` marks a scalar building block; it is compiled into whatever calls it (a call costs more than most of their
arithmetic). `block` marks a large piece called from several places; it stays a function of its own. `entry` marks a
function that Python calls: it releases the GIL and is cached on disk. Numba's own cache looks only at the file of the
entry itself, so that a change in a file it calls would run stale code; ours lives in a folder named by a hash of every
source file of the packages that the entry can reach, so that a changed source can never meet an old binary, and a
changed estimator leaves the compiled aircraft as it is.

Division follows IEEE 754 (`error_model="numpy"`): a check for zero at each division would cost a third of a step.
Neither uses `fastmath`: it would let the compiler drop NaN checks and make one aircraft differ from a batch.
"""

from __future__ import annotations

import gc
import hashlib
import os
import subprocess
import sys
from collections.abc import Callable
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import config
from numba.core.event import Event, Listener, register
from numba.core.registry import CPUDispatcher

F = TypeVar("F", bound=Callable[..., Any])
BESIDE = "ICING_COMPILES_BESIDE"  # in the environment of a process that `compile_beside` began
LAYERS = {  # what the entries of a package can reach: imports point one way
    "icing_env": ("icing_env",),
    "estimators": ("icing_env", "estimators"),
    "controllers": ("icing_env", "estimators", "controllers"),
    "sim2real": ("icing_env", "estimators", "sim2real"),
}
EVERYTHING = ("icing_env", "estimators", "controllers", "sim2real", "testbed")


@cache
def source_hash(package: str) -> str:
    """Hash of every source file that an entry of a package can reach (hex, 16 characters)."""
    root = Path(__file__).resolve().parent.parent
    digest = hashlib.sha256(f"{numba.__version__}".encode())
    for reached in LAYERS.get(package, EVERYTHING):
        for path in sorted((root / reached).rglob("*.py")):
            digest.update(str(path.relative_to(root)).encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@cache
def cache_folder(package: str) -> str:
    """Folder of a package's compiled entries: `$ICING_CACHE` or the user's cache folder, then the source hash."""
    base = os.environ.get("ICING_CACHE") or Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "icing"
    return str(Path(base) / source_hash(package))


class Pause(Listener):
    """No garbage collection while numba compiles: it makes millions of objects that live, a seventh of the time."""

    def __init__(self) -> None:
        self.depth, self.collecting = 0, False

    def on_start(self, event: Event) -> None:
        """A function, or one that it calls, begins to compile."""
        if self.depth == 0:
            self.collecting = gc.isenabled()
            gc.disable()
        self.depth += 1

    def on_end(self, event: Event) -> None:
        """It is compiled."""
        self.depth -= 1
        if self.depth == 0 and self.collecting:
            gc.enable()


register("numba:compile", Pause())


_begun: list[subprocess.Popen[bytes]] = []


def compiles_beside() -> bool:
    """True in a process that `compile_beside` began: the plant is the other's to compile."""
    return BESIDE in os.environ


def compile_beside(module: str) -> None:
    """At a cold start, compile in a second process what this one will need after the plant: run `module` there.

    The processes meet in the cache. Whichever comes first to an entry compiles it; if the second fails, this one does
    all of it. Only the first call begins a process: the module that needs most calls first.
    """
    cold = not any(Path(cache_folder("icing_env")).rglob("*.nbi"))
    if not cold or _begun or compiles_beside() or (os.cpu_count() or 1) < 2:
        return
    _begun.append(subprocess.Popen([sys.executable, "-m", module], env=os.environ | {BESIDE: "1"},
                                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))


class Building(CPUDispatcher):  # type: ignore[misc]
    """A compiled function that other compiled functions call.

    What Python would need in order to call it takes a fifth of the time to compile, so it is made when Python first
    does: tests do, flights do not.
    """

    @cached_property
    def called_from_python(self) -> Any:
        """The same function as Python calls it."""
        return numba.njit(self.py_func, error_model="numpy")

    def __call__(self, *arguments: Any) -> Any:
        """Call it from Python."""
        return self.called_from_python(*arguments)


def _building(function: F, **options: bool) -> F:
    if config.DISABLE_JIT:
        return function
    options |= {"nopython": True, "no_cfunc_wrapper": True, "no_cpython_wrapper": True}
    return Building(function, targetoptions={**options, "error_model": "numpy"})  # type: ignore[no-any-return]


def kernel(function: F) -> F:
    """Compile a scalar building block into its callers; made to be called from other compiled functions."""
    return _building(function, forceinline=True)


def block(function: F) -> F:
    """Compile a large piece that is called from several places: kept as one function, so that it compiles once."""
    return _building(function)


def entry(function: F) -> F:
    """Compile a function that Python calls: GIL released, cached under the hash of the sources it can reach."""
    before = config.CACHE_DIR
    # read by numba while the dispatcher is made, for this one only
    config.CACHE_DIR = cache_folder(function.__module__.partition(".")[0])
    try:
        return numba.njit(function, cache=True, nogil=True, error_model="numpy")  # type: ignore[no-any-return]
    finally:
        config.CACHE_DIR = before


def bound(function: Any, *arguments: Any) -> Callable[[], Any]:
    """An `entry` tied to its arguments: the types are looked up once instead of at each call.

    A call then costs 0.04 us an argument instead of 0.11. The arguments are kept, not copied; arrays must stay where
    they are (write into them). With NUMBA_DISABLE_JIT the plain function is called.
    """
    if not hasattr(function, "compile"):
        return partial(function, *arguments)
    signature = tuple(function.typeof_pyval(argument) for argument in arguments)
    function.compile(signature)
    return partial(function.overloads[signature].entry_point, *arguments)
