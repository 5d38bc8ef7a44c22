"""Address rows: the arrays and scalars of a named tuple as one row of whole numbers, which a kernel opens.

To hand over a city and a world costs more than a small step does, because numba looks at each of a hundred arrays in
every call. A row of where they are costs as much as one array, and a table of rows is many worlds.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import cache
from typing import Any, Final, get_args, get_origin, get_type_hints

import numpy as np
from numba import types
from numba.core.errors import TypingError
from numba.extending import intrinsic
from numba.np import numpy_support
from numba.np.arrayobj import make_array, populate_array

from fireworld.kernels.arrays import Array

_SCALARS: Final = {float: types.float64, int: types.int64, bool: types.boolean}


@cache
def fields_of(kind: Any) -> tuple[tuple[str, Any], ...]:
    """Return the fields of a named tuple: of each its name, and its class, or `(dtype, axes)`."""
    hints = get_type_hints(kind, include_extras=True)
    found = []
    for name in kind._fields:
        dtype, *axes = getattr(hints[name], "__metadata__", (None,))
        found.append((name, (np.dtype(dtype), *axes) if axes else hints[name]))
    return tuple(found)


def address_row(group: Any) -> Array:
    """Return where the arrays of a named tuple lie, and its scalars, as (k,) int64; it must outlive the row.

    An array takes one number for its address and one for each axis; a scalar takes one, of its bits.

    Raises:
        TypeError: an array is not of the type that its class says.
    """
    row: list[int] = []
    _append(group, row)
    return np.array(row, dtype=np.int64)


def _append(group: Any, row: list[int]) -> None:
    for (name, kind), value in zip(fields_of(group.__class__), group, strict=True):
        if isinstance(kind, tuple):
            dtype, n_axes = kind
            if (
                (value.dtype is not dtype and value.dtype != dtype)
                or value.ndim != n_axes
                or not value.flags.c_contiguous
            ):
                wanted = f"contiguous {np.dtype(dtype).name} of {n_axes} axes"
                raise TypeError(f"{type(group).__name__}.{name}: expected {wanted}, got {value.dtype} {value.shape}")
            row += (value.__array_interface__["data"][0], *value.shape)
        elif kind is float:
            row += struct.unpack("<q", struct.pack("<d", value))
        elif kind in _SCALARS:
            row.append(int(value))
        elif get_origin(kind) is tuple:
            row += struct.unpack(f"<{len(value)}q", struct.pack(f"<{len(value)}d", *value))
        else:
            _append(value, row)


def numba_type(kind: Any) -> Any:
    """Return numba's type of a named tuple's class."""
    members = []
    for _, member in fields_of(kind):
        if isinstance(member, tuple):
            dtype, n_axes = member
            members.append(types.Array(numpy_support.from_dtype(dtype), n_axes, "C"))
        elif get_origin(member) is tuple:
            members.append(types.UniTuple(types.float64, len(get_args(member))))
        else:
            members.append(_SCALARS[member] if member in _SCALARS else numba_type(member))
    return types.NamedTuple(tuple(members), kind)


def opener(kind: type[Any]) -> Callable[[Array], Any]:
    """Return a function for kernels that makes the named tuple again of its row, (k,) int64."""
    opened_type = numba_type(kind)

    @intrinsic
    def opened(context: Any, row: Any) -> tuple[Any, Any]:
        del context
        if not isinstance(row, types.Array) or row.dtype != types.int64 or row.ndim != 1 or row.layout != "C":
            raise TypingError("expected a row of int64")

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            numbers = make_array(signature.args[0])(context, builder, arguments[0]).data
            return _build(_Reader(context, builder, numbers), opened_type)

        return opened_type(row), generate

    return opened


class _Reader:
    """Writes the code that reads the numbers of a row one after another."""

    def __init__(self, context: Any, builder: Any, numbers: Any) -> None:
        self.context, self.builder = context, builder
        self._numbers, self._at = numbers, 0

    def constant(self, value: int) -> Any:
        return self.context.get_constant(types.intp, value)

    def next(self) -> Any:
        place = self.builder.gep(self._numbers, [self.constant(self._at)])
        self._at += 1
        return self.builder.load(place)


def _build(reader: _Reader, kind: Any) -> Any:
    """Write the code that makes a value of numba's type `kind`."""
    context, builder = reader.context, reader.builder
    if isinstance(kind, types.BaseTuple):
        return context.make_tuple(builder, kind, [_build(reader, member) for member in kind.types])
    if isinstance(kind, types.Array):
        return _build_array(reader, kind)
    number = reader.next()
    if kind == types.float64:
        return builder.bitcast(number, context.get_value_type(kind))
    return context.cast(builder, number, types.int64, kind)


def _build_array(reader: _Reader, kind: Any) -> Any:
    context, builder = reader.context, reader.builder
    items = context.get_data_type(kind.dtype)
    item_bytes = reader.constant(context.get_abi_sizeof(items))
    data = builder.inttoptr(reader.next(), items.as_pointer())
    shape = [reader.next() for _ in range(kind.ndim)]
    strides: list[Any] = []
    stride = item_bytes
    for length in reversed(shape):
        strides.insert(0, stride)
        stride = builder.mul(stride, length)
    array = make_array(kind)(context, builder)
    populate_array(array, data=data, shape=shape, strides=strides, itemsize=item_bytes, meminfo=None)
    return array._getvalue()  # noqa: SLF001 - as numba itself writes it
