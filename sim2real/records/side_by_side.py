"""Records side by side: what is done to one of them does not wait for the others.

The linear algebra of a diagnosis is many small products. Its threads would wait for one another, and for those of the
records, far longer than they work (twice the processor time, and a half more on the clock, on two cores): it gets one.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits

T = TypeVar("T")
F = TypeVar("F", bound=Callable[..., Any])


def algebra_in_one_thread(function: F) -> F:
    """A function whose linear algebra starts no threads of its own."""
    return threadpool_limits.wrap(limits=1, user_api="blas")(function)


def threads() -> int:
    """As many as OMP_NUM_THREADS allows, which governs the linear algebra too; else one a core."""
    told = os.environ.get("OMP_NUM_THREADS", "")
    return int(told) if told.isdigit() and int(told) > 0 else os.cpu_count() or 1


def each(work: Callable[..., T], *of_records: Iterable[Any]) -> list[T]:
    """`work` done to every record, in order; the compiled flight and the linear algebra hold no lock.

    Args:
        work: changes nothing that another call reads.
        of_records: its arguments, one of each for every record.
    """
    if threads() == 1:
        return [work(*of_one) for of_one in zip(*of_records, strict=True)]
    with ThreadPoolExecutor(threads()) as pool:
        return list(pool.map(lambda of_one: work(*of_one), zip(*of_records, strict=True)))
