"""`Arrays`: a struct of arrays that a kernel gets as one pointer.

A kernel that takes a NamedTuple of arrays gets each array by value, as nine numbers; with the fifty
arrays of a cut step every helper would have four hundred arguments, and compiling the engine took
75 s. As one pointer to a table of addresses and shapes it takes a fifth of that, and a call from
Python does not unpack the arrays.

In Python, and with the JIT off, an `Arrays` is a plain object with its fields as attributes.
"""

import ctypes
import functools
import hashlib
import inspect
from array import array
from collections.abc import Mapping
from operator import attrgetter
from typing import Annotated, Any, ClassVar, NoReturn, Self

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_setattr_generic
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

from tissue.core.array_types import dtype_of
from tissue.core.sized import Sized
from tissue.core.vec3 import Vec3

IntCell = Annotated[int, "cell"]
"""A whole number in a struct that kernels and Python may change: `body.n_nodes += 1`."""
FloatCell = Annotated[float, "cell"]
"""A number in a struct that kernels and Python may change. A plain `float` does not change."""


_VECTOR = types.NamedUniTuple(types.float64, 3, Vec3)
"""Numba's type of a vector."""


class ArraysType(types.Type):
    """Numba's type of a subclass of `Arrays`: the names and types of its fields, in order.

    Args:
        name: Name of the class.
        fields: Name and type of each field; cells come first.
        n_cells: Number of cells.
    """

    def __init__(
        self, name: str, fields: tuple[tuple[str, types.Type], ...], n_cells: int = 0
    ) -> None:
        self.fields = fields
        self.cells = frozenset(field for field, _ in fields[:n_cells])
        described = ", ".join(f"{n}: {t}{' cell' * (n in self.cells)}" for n, t in fields)
        # The name is a part of the names of all functions that take the struct, so it is short.
        digest = hashlib.sha256(described.encode()).hexdigest()[:8]
        super().__init__(name=f"{name}({digest})")

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


def _cell(name: str, place: int, is_float: bool) -> property:
    """Return an entry at the begin of a struct's table, as an attribute.

    It is read without a call of Python, in two thirds of the time.
    """

    def write(struct: Any, value: float) -> None:
        (struct._float_cells if is_float else struct._table)[place] = value

    return property(attrgetter(f"_cell_values.{name}"), write)


class Arrays:
    """Base of structs of C-contiguous arrays, numbers, vectors, and other such structs.

    A subclass annotates its fields in order and is made from keywords, or by `new` where the shapes
    of its arrays are declared (`tissue.core.sized`). Only the elements of arrays
    and the fields annotated as `IntCell` or `FloatCell` change. All objects of a subclass have
    fields of the same types, unless it is made with `two_precisions=True`: then arrays may be of
    doubles in one object and of singles in another, and kernels are compiled for each.

    Raises:
        TypeError: fields are missing or unknown, or an array is not C-contiguous.
    """

    n_made: ClassVar[int] = 0
    """Number of structs that were made: while it stays, no struct was replaced by a new one."""
    _numba_type_: ArraysType
    _types: ClassVar[dict[Any, ArraysType]] = {}
    _most_types: ClassVar[int] = 1
    _cells: ClassVar[tuple[str, ...]] = ()
    _layout: ClassVar[type[ctypes.Structure]] = ctypes.Structure
    _sized: ClassVar[dict[str, Sized]] = {}
    address: int
    """Where the table is in memory; the object keeps it and the arrays alive."""

    def __init_subclass__(cls, *, two_precisions: bool = False) -> None:
        cls._types = {}
        cls._most_types = 2 if two_precisions else 1
        fields = inspect.get_annotations(cls)
        cls._cells = tuple(name for name, kind in fields.items() if kind in (IntCell, FloatCell))
        kinds = [ctypes.c_double if fields[n] is FloatCell else ctypes.c_int64 for n in cls._cells]
        layout = {"_fields_": [*zip(cls._cells, kinds, strict=True)]}
        cls._layout = type(cls.__name__, (ctypes.Structure,), layout)
        for place, name in enumerate(cls._cells):
            setattr(cls, name, _cell(name, place, fields[name] is FloatCell))
        cls._sized = {name: each for name, each in vars(cls).items() if isinstance(each, Sized)}
        for name in cls._sized:
            delattr(cls, name)

    def __init__(self, **fields: Any) -> None:
        Arrays.n_made += 1
        annotations = type(self).__annotations__
        if set(annotations) != set(fields):
            names = list(annotations)
            raise TypeError(f"{type(self).__name__} takes {names}, not {list(fields)}")
        words: list[int] = []
        kinds: list[tuple[str, types.Type]] = []
        for name in self._cells:
            is_float = annotations[name] is FloatCell
            words.append(_word(fields[name]) if is_float else int(fields[name]))
            kinds.append((name, types.float64 if is_float else types.int64))
        for name in annotations:
            if name in self._cells:
                continue
            value = fields[name]
            setattr(self, name, value)
            if isinstance(value, Arrays):
                words.append(value.address)
                kinds.append((name, value._numba_type_))
            elif isinstance(value, float):
                words.append(_word(value))
                kinds.append((name, types.float64))
            elif isinstance(value, Vec3):
                words += [_word(number) for number in value]
                kinds.append((name, _VECTOR))
            else:
                if not value.flags.c_contiguous:
                    raise TypeError(f"{type(self).__name__}.{name} is not C-contiguous")
                words += [value.ctypes.data, *value.shape]
                kinds.append((name, _array_type(value.dtype, value.ndim)))
        self._table = np.array(words, dtype=np.int64)
        self._float_cells = self._table.view(np.float64)
        self._cell_values = self._layout.from_buffer(self._table.data)
        self.address = self._table.ctypes.data
        # Numba takes long to compare types; each of these is one object that stays.
        known, key = self._types, tuple([id(kind) for _, kind in kinds])
        if key not in known:
            if len(known) == self._most_types:
                raise TypeError(f"{type(self).__name__} has fields of other types than before")
            known[key] = ArraysType(type(self).__name__, tuple(kinds), len(self._cells))
        self._numba_type_ = known[key]

    @classmethod
    def new(cls, sizes: Mapping[str, int], *, real: type = np.float64, **fields: Any) -> Self:
        """Return a struct whose cells are 0 and whose arrays hold nothing yet, but for `fields`.

        Args:
            sizes: Sizes, by the names that the shapes of its arrays have for them.
            real: Precision of floats in arrays for vectors.
            fields: Cells and arrays that are other, and all fields without a shape.
        """
        made: dict[str, Any] = dict.fromkeys(cls._cells, 0)
        for name, each in cls._sized.items():
            if name not in fields:
                dtype = dtype_of(cls.__annotations__[name])
                is_real = each.is_for_vectors and dtype is np.float64
                made[name] = each.array(sizes, real if is_real else dtype)
        return cls(**(made | fields))

    def grown(self, sizes: Mapping[str, int]) -> Self:
        """Return a struct with room for that much along the first axes of its arrays.

        What is in the arrays stays; further rows hold what new ones do. Arrays of other sizes are
        shared with this struct.
        """
        larger = {}
        for name, each in self._sized.items():
            if each.grows_with in sizes:
                old = getattr(self, name)
                rows = each._replace(shape=(each.shape[0], *old.shape[1:]))
                larger[name] = rows.array(sizes, old.dtype)
                larger[name][: len(old)] = old
        return self.replaced(**larger)

    def replaced(self, **fields: Any) -> Self:
        """Return a struct with these fields in place of its own; cells are copied."""
        kind = type(self)  # from Python 3.14 on an object has no annotations
        return kind(**{name: getattr(self, name) for name in kind.__annotations__} | fields)

    def __reduce__(self) -> NoReturn:
        """Refuse to be pickled or copied: the table of the copy would hold these addresses.

        Raises:
            TypeError: always.
        """
        raise TypeError(
            f"{type(self).__name__} holds addresses of memory, so that a Tissue can be neither "
            "pickled nor copied; take Tissue.save_state(), which an equally made one can load from "
            "bytes"
        )


@functools.cache
def _array_type(dtype: np.dtype, n_dimensions: int) -> types.Type:
    """Return Numba's type of a C-contiguous array, always the same object."""
    return types.Array(numpy_support.from_dtype(dtype), n_dimensions, "C")


def _word(number: float) -> int:
    """Return the bits of a number as they stand in the table."""
    return int(np.float64(number).view(np.int64))


class Vectors(Arrays):
    """Base of structs of vectors alone, made from one vector a field, in order.

    For what is made in every step: it takes a third of the time of an `Arrays`, and a kernel
    that got a tuple of tuples instead took 3 us more.
    """

    _names: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls) -> None:
        cls._names = tuple(cls.__annotations__)
        fields = tuple((name, _VECTOR) for name in cls._names)
        cls._numba_type_ = ArraysType(cls.__name__, fields)

    def __init__(self, *vectors: Vec3) -> None:
        self._keep(sum(vectors, ()))

    @classmethod
    def of_numbers(cls, numbers: tuple[float, ...]) -> Self:
        """Return a struct of vectors whose numbers follow one another.

        Raises:
            TypeError: they are too few or too many, or no numbers.
        """
        vectors = cls.__new__(cls)
        vectors._keep(numbers)
        return vectors

    def _keep(self, numbers: tuple[float, ...]) -> None:
        if len(numbers) != 3 * len(self._names):
            raise TypeError(f"{type(self).__name__} takes {list(self._names)}")
        self._numbers = numbers
        # An array of Python's own is made in half the time of one of NumPy.
        self._memory = array("d", numbers)
        self.address = self._memory.buffer_info()[0]

    def __getattr__(self, name: str) -> Vec3:
        """Return a vector, which is made on first use."""
        if name not in self._names:
            raise AttributeError(f"{type(self).__name__} has no {name}")
        first = 3 * self._names.index(name)
        vector = self.__dict__[name] = Vec3(*self._numbers[first : first + 3])
        return vector


@typeof_impl.register(Arrays)
def _typeof(value: Arrays, _: Any) -> ArraysType:
    return value._numba_type_


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


def _entry(builder: Any, table: Any, place: int) -> Any:
    """Return the address of a word of the table."""
    return builder.gep(table, [ir.Constant(ir.IntType(32), place)])


@lower_setattr_generic(ArraysType)
def _setattr(context: Any, builder: Any, signature: Any, args: Any, attribute: str) -> None:
    struct, kind = signature.args
    if attribute not in struct.cells:
        raise TypeError(f"{struct}.{attribute} is no cell: a kernel cannot replace it")
    value = args[1]
    if kind == types.float64:
        value = builder.bitcast(value, ir.IntType(64))
    builder.store(value, _entry(builder, args[0], struct.place(attribute)))


@lower_getattr_generic(ArraysType)
def _getattr(context: Any, builder: Any, struct: ArraysType, table: Any, attribute: str) -> Any:
    field: Any = dict(struct.fields)[attribute]
    place = struct.place(attribute)

    def word(i: int) -> Any:
        value = builder.load(_entry(builder, table, place + i))
        if attribute not in struct.cells:
            # It never changes while a kernel runs: LLVM may load it once and keep it.
            value.set_metadata("invariant.load", builder.module.add_metadata([]))
        return value

    if field == types.int64:
        return word(0)

    if isinstance(field, ArraysType):
        return builder.inttoptr(word(0), ir.IntType(64).as_pointer())
    if field == types.float64:
        return builder.bitcast(word(0), ir.DoubleType())
    if isinstance(field, types.NamedUniTuple):
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
