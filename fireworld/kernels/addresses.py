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
from llvmlite import ir
from numba import types
from numba.core.errors import TypingError
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import intrinsic, models, register_model
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


def row_length(kind: Any) -> int:
    """Return how many numbers the row of a named tuple has."""
    return sum(_n_numbers(member) for _, member in fields_of(kind))


def _n_numbers(member: Any) -> int:
    if isinstance(member, tuple):
        return 1 + int(member[1])
    if get_origin(member) is tuple:
        return len(get_args(member))
    return 1 if member in _SCALARS else row_length(member)


class Opened(types.Type):  # type: ignore[misc]  # numba is untyped
    """Numba's type of a named tuple of which a kernel has the address of its row, and reads what it needs.

    A function takes one number for it, however many arrays it has: that halves the time of compilation.
    """

    def __init__(self, kind: Any) -> None:
        self.kind = kind
        self.member: dict[str, tuple[int, Any]] = {}
        """Of each field its place in the row, and its class or `(dtype, axes)`."""
        place = 0
        for name, member in fields_of(kind):
            self.member[name] = place, member
            place += _n_numbers(member)
        super().__init__(f"Opened({kind.__module__}.{kind.__qualname__})")

    def member_type(self, name: str) -> Any:
        """Return numba's type of a field; None if there is none of that name."""
        if name not in self.member:
            return None
        _, member = self.member[name]
        if isinstance(member, tuple):
            dtype, n_axes = member
            return types.Array(numpy_support.from_dtype(dtype), n_axes, "C")
        if get_origin(member) is tuple:
            return types.UniTuple(types.float64, len(get_args(member)))
        return _SCALARS[member] if member in _SCALARS else Opened(member)


@register_model(Opened)
class _OpenedModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, opened_type: Opened) -> None:
        super().__init__(manager, opened_type, ir.IntType(64).as_pointer())


@infer_getattr
class _OpenedFields(AttributeTemplate):  # type: ignore[misc]
    key = Opened

    def generic_resolve(self, opened_type: Opened, name: str) -> Any:
        return opened_type.member_type(name)


@lower_getattr_generic(Opened)
def _read_field(context: Any, builder: Any, opened_type: Opened, row: Any, name: str) -> Any:
    """Write the code that reads a field of a row."""
    place, _ = opened_type.member[name]
    kind = opened_type.member_type(name)
    reader = _Reader(context, builder, row, place)
    if isinstance(kind, Opened):
        return reader.place()
    if isinstance(kind, types.UniTuple):
        return context.make_tuple(builder, kind, [_scalar(reader, kind.dtype) for _ in range(kind.count)])
    return _array(reader, kind) if isinstance(kind, types.Array) else _scalar(reader, kind)


def opener(kind: type[Any]) -> Callable[[Array], Any]:
    """Return a function for kernels that gives the named tuple of a row, (k,) int64, its fields as they are read."""
    opened_type = Opened(kind)

    @intrinsic
    def opened(context: Any, row: Any) -> tuple[Any, Any]:
        del context
        if not isinstance(row, types.Array) or row.dtype != types.int64 or row.ndim != 1 or row.layout != "C":
            raise TypingError("expected a row of int64")

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return make_array(signature.args[0])(context, builder, arguments[0]).data

        return opened_type(row), generate

    return opened


class _Reader:
    """Writes the code that reads the numbers of a row one after another."""

    def __init__(self, context: Any, builder: Any, row: Any, place: int) -> None:
        self.context, self.builder = context, builder
        self._row, self._place = row, place

    def constant(self, value: int) -> Any:
        return self.context.get_constant(types.intp, value)

    def place(self) -> Any:
        return self.builder.gep(self._row, [self.constant(self._place)])

    def next(self) -> Any:
        number = self.builder.load(self.place())
        # No kernel writes on a row: what is read of it once need not be read again after every store.
        number.set_metadata("invariant.load", self.builder.module.add_metadata([]))
        self._place += 1
        return number


def _scalar(reader: _Reader, kind: Any) -> Any:
    number = reader.next()
    if kind == types.float64:
        return reader.builder.bitcast(number, reader.context.get_value_type(kind))
    return reader.context.cast(reader.builder, number, types.int64, kind)


def _array(reader: _Reader, kind: Any) -> Any:
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
