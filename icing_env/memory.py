"""Arrays by address: what a step that costs a few microseconds can afford to be given.

Python hands an array to compiled code in 0.04 us, and a step works on some thirty. They stay where they are, so their
addresses and lengths are written down once, in one array of integers, and that is all that a step is given.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from numba.core import types
from numba.extending import intrinsic, overload
from numpy.typing import NDArray

from icing_env.jit import bound


def call_at(function: Any, *arrays: NDArray) -> Callable[[], Any]:
    """An `entry` of one argument, the table of these arrays, as a call without arguments.

    The arrays are kept alive and must stay where they are: write into them. The call's `table` is there for other
    compiled code.

    Raises:
        ValueError: an array is not contiguous in memory.
    """
    for array in arrays:
        if not array.flags.c_contiguous:
            raise ValueError(f"an array of {array.dtype} is not contiguous")
    table = np.array([(array.ctypes.data, len(array)) for array in arrays], np.int64).reshape(-1)
    call = bound(function, table)
    call.arrays, call.table = arrays, table  # type: ignore[attr-defined]
    return call


def rows(table: NDArray, k: int, kind: np.dtype) -> Any:
    """Array `k` of a table: one-dimensional, of type `kind`."""
    kind = np.dtype(kind)
    array = _memory(table, k, kind.itemsize).view(kind)
    return array.view(np.recarray) if kind.names else array


def matrix(table: NDArray, k: int, columns: int, kind: np.dtype) -> Any:
    """Array `k` of a table: numbers [its length, columns]."""
    return _memory(table, k, columns*np.dtype(kind).itemsize).view(kind).reshape(-1, columns)


def _memory(table: NDArray, k: int, size: int) -> NDArray[np.uint8]:
    """Bytes of array `k` of a table, `size` an item."""
    return np.ctypeslib.as_array((ctypes.c_uint8*(int(table[2*k + 1])*size)).from_address(int(table[2*k])))


@intrinsic
def _pointer(_context: Any, address: Any) -> Any:
    """An integer as an address."""

    def code(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return builder.inttoptr(args[0], context.get_value_type(types.voidptr))

    return types.voidptr(types.int64), code


@overload(rows, strict=False)
def _rows(table: Any, k: Any, kind: Any) -> Any:
    """What `rows` is in compiled code."""
    del table, k, kind
    return lambda table, k, kind: numba.carray(_pointer(table[2*k]), table[2*k + 1], kind)


@overload(matrix, strict=False)
def _matrix(table: Any, k: Any, columns: Any, kind: Any) -> Any:
    """What `matrix` is in compiled code."""
    del table, k, columns, kind
    return lambda table, k, columns, kind: numba.carray(_pointer(table[2*k]), (table[2*k + 1], columns), kind)
