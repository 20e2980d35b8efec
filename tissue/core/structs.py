"""`Arrays`: a struct of arrays that a kernel gets as one pointer.

A kernel that takes a NamedTuple of arrays gets each array by value, as nine numbers; with the fifty
arrays of a cut step every helper would have four hundred arguments, and compiling the engine took
75 s. As one pointer to a table of addresses and shapes it takes a fifth of that, and a call from
Python does not unpack the arrays.

In Python, and with the JIT off, an `Arrays` is a plain object with its fields as attributes.
"""

from typing import Any, ClassVar, Self

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)
from numba.np import arrayobj, numpy_support


class ArraysType(types.Type):
    """Numba's type of a subclass of `Arrays`: the names and types of its fields, in order."""

    def __init__(self, name: str, fields: tuple[tuple[str, types.Type], ...]) -> None:
        self.fields = fields
        super().__init__(name=f"{name}({', '.join(f'{n}: {t}' for n, t in fields)})")

    def place(self, attribute: str) -> int:
        """Return where the field's entry begins in the table, in words of 8 bytes."""
        place = 0
        for name, field in self.fields:
            if name == attribute:
                return place
            place += _n_words(field)
        raise KeyError(attribute)


def _n_words(field: types.Type) -> int:
    """Return how long the entry of a field is in the table, in words of 8 bytes."""
    if isinstance(field, types.Array):
        return 1 + field.ndim
    return len(field) if isinstance(field, types.NamedUniTuple) else 1


class Arrays:
    """Base of structs of C-contiguous arrays, floats, and other such structs.

    A subclass annotates its fields in order; it is made from keywords and does not change. All
    objects of a subclass have fields of the same types.

    Raises:
        TypeError: fields are missing or unknown, or an array is not C-contiguous.
    """

    _numba_type_: ClassVar[ArraysType | None] = None
    address: int
    """Where the table is in memory; the object keeps it and the arrays alive."""

    def __init__(self, **fields: Any) -> None:
        names = list(type(self).__annotations__)
        if set(names) != set(fields):
            raise TypeError(f"{type(self).__name__} takes {names}, not {list(fields)}")
        words: list[int] = []
        kinds = []
        for name in names:
            value = fields[name]
            setattr(self, name, value)
            if isinstance(value, Arrays):
                words.append(value.address)
                kinds.append((name, typeof_impl(value, None)))
            elif isinstance(value, float):
                words.append(int(np.float64(value).view(np.int64)))
                kinds.append((name, types.float64))
            else:
                if not value.flags.c_contiguous:
                    raise TypeError(f"{type(self).__name__}.{name} is not C-contiguous")
                words += [value.ctypes.data, *value.shape]
                dtype = numpy_support.from_dtype(value.dtype)
                kinds.append((name, types.Array(dtype, value.ndim, "C")))
        self._table = np.array(words, dtype=np.int64)
        self.address = self._table.ctypes.data
        known = type(self)._numba_type_
        if known is None:
            type(self)._numba_type_ = ArraysType(type(self).__name__, tuple(kinds))
        elif known.fields != tuple(kinds):
            raise TypeError(f"{type(self).__name__} has fields of other types than before")

    def replaced(self, **fields: Any) -> Self:
        """Return a struct with these fields in place of its own."""
        return type(self)(**{name: getattr(self, name) for name in self.__annotations__} | fields)


@typeof_impl.register(Arrays)
def _typeof(value: Arrays, _: Any) -> ArraysType | None:
    return type(value)._numba_type_


@register_model(ArraysType)
class _Pointer(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: ArraysType) -> None:
        super().__init__(manager, fe_type, ir.IntType(64).as_pointer())


@unbox(ArraysType)
def _unbox(_: ArraysType, value: Any, c: Any) -> NativeValue:
    address = c.pyapi.object_getattr_string(value, "address")
    number = c.pyapi.long_as_longlong(address)
    c.pyapi.decref(address)
    return NativeValue(
        c.builder.inttoptr(number, ir.IntType(64).as_pointer()),
        is_error=cgutils.is_not_null(c.builder, c.pyapi.err_occurred()),
    )


@infer_getattr
class _Attributes(AttributeTemplate):
    key = ArraysType

    def resolve(self, struct: ArraysType, attribute: str) -> types.Type | None:
        return dict(struct.fields).get(attribute)


@lower_getattr_generic(ArraysType)
def _getattr(context: Any, builder: Any, struct: ArraysType, table: Any, attribute: str) -> Any:
    field: Any = dict(struct.fields)[attribute]
    place = struct.place(attribute)

    def word(i: int) -> Any:
        value = builder.load(builder.gep(table, [ir.Constant(ir.IntType(32), place + i)]))
        # The table never changes while a kernel runs: LLVM may load it once and keep it.
        value.set_metadata("invariant.load", builder.module.add_metadata([]))
        return value

    if isinstance(field, ArraysType):
        return builder.inttoptr(word(0), ir.IntType(64).as_pointer())
    if field == types.float64:
        return builder.bitcast(word(0), ir.DoubleType())
    if isinstance(field, types.NamedUniTuple):  # of floats: see `tissue.blade.anchors.Edge`
        numbers = [builder.bitcast(word(i), ir.DoubleType()) for i in range(len(field))]
        return context.make_tuple(builder, field, numbers)
    itemsize = context.get_abi_sizeof(context.get_data_type(field.dtype))
    shape = [word(1 + i) for i in range(field.ndim)]
    strides = [ir.Constant(ir.IntType(64), itemsize)]
    for extent in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], extent))
    array = context.make_array(field)(context, builder)
    arrayobj.populate_array(
        array,
        data=builder.inttoptr(word(0), array.data.type),
        shape=shape,
        strides=strides,
        itemsize=ir.Constant(ir.IntType(64), itemsize),
        meminfo=None,
    )
    return array._getvalue()
