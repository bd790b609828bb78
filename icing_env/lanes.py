"""Eight aircraft side by side: each field of their records in eight neighbouring numbers.

A kernel that reads `x.u` and writes `dx.u` does not ask where a field lies. `lane` gives it one aircraft of a block,
in which the fields lie `LANES` numbers apart: a loop over the aircraft of the block then reads neighbours, and the
compiler turns straight-line equations into vector instructions. Each aircraft's arithmetic stays the same to the bit.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    lower_setattr_generic,
    overload,
    register_model,
)
from numpy.typing import NDArray

LANES = 8


class PlainLane:
    """One aircraft of a block for plain Python: fields are columns of numbers."""

    def __init__(self, block: NDArray, first: int, j: int, kind: np.dtype) -> None:
        self.__dict__["_block"] = block
        self.__dict__["_places"] = {name: (first + k)*LANES + j for k, name in enumerate(kind.names or ())}

    def __getattr__(self, name: str) -> float:
        return float(self.__dict__["_block"][self.__dict__["_places"][name]])

    def __setattr__(self, name: str, value: float) -> None:
        self.__dict__["_block"][self.__dict__["_places"][name]] = value


def lane(block: NDArray, first: int, j: int, kind: np.dtype) -> Any:
    """Aircraft `j` of a block as a record of float64 fields `kind`, the first of them in row `first`.

    `block`: rows of LANES numbers, one after another (compiled code knows the distance of two rows only so).
    """
    return PlainLane(block, first, j, kind)


class Lane(types.Type):
    """Numba's type of such a record."""

    def __init__(self, fields: tuple[str, ...]) -> None:
        self.fields = fields
        super().__init__(f"Lane({', '.join(fields)})")


@register_model(Lane)
class LaneModel(models.PrimitiveModel):
    """The address of the first field."""

    def __init__(self, manager: Any, kind: Lane) -> None:
        super().__init__(manager, kind, manager[types.float64].get_value_type().as_pointer())


@infer_getattr
class LaneFields(AttributeTemplate):
    """Every field is a float64."""

    key = Lane

    def generic_resolve(self, kind: Lane, name: str) -> Any:
        """Type of a field; None if there is none, which numba reports."""
        return types.float64 if name in kind.fields else None


def _address(builder: Any, kind: Lane, value: Any, name: str) -> Any:
    return cgutils.gep_inbounds(builder, value, kind.fields.index(name)*LANES)


@lower_getattr_generic(Lane)
def _load(_context: Any, builder: Any, kind: Lane, value: Any, name: str) -> Any:
    return builder.load(_address(builder, kind, value, name))


@lower_setattr_generic(Lane)
def _store(context: Any, builder: Any, signature: Any, args: Any, name: str) -> None:
    kind, given = signature.args
    builder.store(context.cast(builder, args[1], given, types.float64), _address(builder, kind, args[0], name))


@intrinsic
def _compiled_lane(_context: Any, block: Any, first: Any, j: Any, kind: Any) -> Any:
    """`lane` in compiled code."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, args[0])
        row = builder.mul(args[1], context.get_constant(types.intp, LANES))
        return builder.gep(array.data, [builder.add(row, args[2])])

    return Lane(tuple(kind.dtype.fields))(block, types.intp, types.intp, kind), code


@overload(lane, strict=False)
def _lane(block: Any, first: Any, j: Any, kind: Any) -> Any:
    """What `lane` is in compiled code."""
    del block, first, j, kind
    return lambda block, first, j, kind: _compiled_lane(block, first, j, kind)
