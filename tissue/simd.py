"""Vectors of eight doubles (`Lanes`) inside kernels, for the loops that the 1 kHz rests on.

LLVM does not vectorise a gather over the neighbours of a node by itself. Here the kernel says so: a
vector holds two points of four lanes (x, y, z and nothing), or eight scalars. On a machine with
narrower registers LLVM splits each operation in two or four; the bits are the same.

Each function is also a plain Python function on NumPy arrays of eight, which runs when the JIT is
off: the tests compare the two. `+ - * /` work on both.
"""

import operator
from collections.abc import Callable
from inspect import Parameter, Signature
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import lower_builtin, models, register_model, type_callable

from tissue.types import FloatArray, IntArray

WIDTH = 8
"""Doubles in a vector: one cache line, and one AVX-512 register."""

Lanes = np.ndarray
"""In Python eight doubles; in a kernel one vector."""


class LanesType(types.Type):
    """Numba's type of a vector of eight doubles."""

    def __init__(self) -> None:
        super().__init__(name="Lanes")


LANES = LanesType()
_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
_POINT = ir.VectorType(ir.DoubleType(), 4)
_XYZ = ir.Constant(ir.VectorType(ir.IntType(1), 4), [1, 1, 1, 0])
_I32 = ir.IntType(32)
_I64 = ir.IntType(64)


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: LanesType) -> None:
        super().__init__(manager, fe_type, _VECTOR)


def _compiled(
    function: Callable, *kinds: Any, result: types.Type = LANES
) -> Callable[[Callable], Callable]:
    """Give `function`, on arguments of these kinds, the code that the decorated one builds.

    It is called with the builder, the numba types of the arguments, and their values.
    """

    def fits(kind: Any, argument: types.Type) -> bool:
        return isinstance(argument, kind) if isinstance(kind, type) else argument == kind

    @type_callable(function)
    def _types(_: Any) -> Callable:
        def typer(*arguments: types.Type) -> types.Type | None:
            if len(arguments) == len(kinds) and all(map(fits, kinds, arguments)):
                return result
            return None

        names = [f"argument_{i}" for i in range(len(kinds))]
        parameters = [Parameter(name, Parameter.POSITIONAL_OR_KEYWORD) for name in names]
        cast(Any, typer).__signature__ = Signature(parameters)  # Numba folds arguments by it
        return typer

    def register(build: Callable) -> Callable:
        @lower_builtin(function, *kinds)
        def _lower(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            arguments = [
                _Array(context, builder, kind, value) if isinstance(kind, types.Array) else value
                for kind, value in zip(signature.args, values, strict=True)
            ]
            made = build(builder, *arguments)
            return context.get_dummy_value() if made is None else made

        return build

    return register


class _Array:
    """An array argument: where its elements are."""

    def __init__(self, context: Any, builder: Any, kind: types.Array, value: Any) -> None:
        self._data = context.make_array(kind)(context, builder, value).data
        self._builder = builder

    def at(self, i: Any, n_columns: int = 1) -> Any:
        """Return a pointer to element `i`, or to the first of row `i`."""
        builder = self._builder
        if i.type.width < 64:
            i = builder.sext(i, _I64)
        if n_columns > 1:
            i = builder.mul(i, ir.Constant(_I64, n_columns))
        return builder.gep(self._data, [i])


def _shuffled(builder: Any, a: Any, b: Any, order: Any) -> Any:
    lanes = list(order)
    return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(_I32, len(lanes)), lanes))


def _operator(function: Callable, instruction: str) -> None:
    @_compiled(function, LANES, LANES)
    def _build(builder: Any, a: Any, b: Any) -> Any:
        # A product and a sum may become one instruction that rounds once: faster, and no less
        # exact. Nothing is reordered.
        return getattr(builder, instruction)(a, b, flags=("contract",))


_operator(operator.add, "fadd")
_operator(operator.sub, "fsub")
_operator(operator.mul, "fmul")
_operator(operator.truediv, "fdiv")


def lanes(value: float) -> Lanes:
    """Return eight times the same number."""
    return np.full(WIDTH, value)


@_compiled(lanes, types.Float)
def _lanes(builder: Any, value: Any) -> Any:
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), value, ir.Constant(_I32, 0))
    return _shuffled(builder, one, one, [0] * WIDTH)


def load(array: FloatArray, i: int) -> Lanes:
    """Return the eight elements of a vector from `i` on."""
    return array[i : i + WIDTH].copy()


@_compiled(load, types.Array, types.Integer)
def _load(builder: Any, array: _Array, i: Any) -> Any:
    return builder.load(builder.bitcast(array.at(i), _VECTOR.as_pointer()), align=8)


def store(array: FloatArray, i: int, values: Lanes) -> None:
    """Write eight elements of a vector from `i` on."""
    array[i : i + WIDTH] = values


@_compiled(store, types.Array, types.Integer, LANES, result=types.void)
def _store(builder: Any, array: _Array, i: Any, values: Any) -> None:
    builder.store(values, builder.bitcast(array.at(i), _VECTOR.as_pointer()), align=8)


def square_root(a: Lanes) -> Lanes:
    """Return the square root of each."""
    return np.sqrt(a)


@_compiled(square_root, LANES)
def _square_root(builder: Any, a: Any) -> Any:
    function = _declared(builder.module, "llvm.sqrt.v8f64", ir.FunctionType(_VECTOR, [_VECTOR]))
    return builder.call(function, [a])


def twice(points: FloatArray, i: int) -> Lanes:
    """Return row `i` of an array of shape (n, 3) with a 0 behind it, and the same again."""
    return np.array([*points[i], 0.0] * 2)


@_compiled(twice, types.Array, types.Integer)
def _twice(builder: Any, points: _Array, i: Any) -> Any:
    row = _row(builder, points, i)
    return _shuffled(builder, row, row, [*range(4)] * 2)


def two_points(points: FloatArray, of: IntArray, i: int) -> Lanes:
    """Return rows `of[i]` and `of[i + 4]` of an array of shape (n, 3), each with a 0 behind it."""
    return np.array([*points[of[i]], 0.0, *points[of[i + 4]], 0.0])


@_compiled(two_points, types.Array, types.Array, types.Integer)
def _two_points(builder: Any, points: _Array, of: _Array, i: Any) -> Any:
    row, other = (
        _row(builder, points, builder.load(of.at(builder.add(i, i.type(k))))) for k in (0, 4)
    )
    return _shuffled(builder, row, other, range(WIDTH))


def _row(builder: Any, points: _Array, i: Any) -> Any:
    """x, y, z of row `i` and a 0; nothing behind the row is read."""
    pointer = builder.bitcast(points.at(i, 3), _POINT.as_pointer())
    kind = ir.FunctionType(_POINT, [_POINT.as_pointer(), _I32, _XYZ.type, _POINT])
    function = _declared(builder.module, "llvm.masked.load.v4f64.p0v4f64", kind)
    zero = ir.Constant(_POINT, [0.0] * 4)
    return builder.call(function, [pointer, ir.Constant(_I32, 8), _XYZ, zero])


def _declared(module: Any, name: str, kind: Any) -> Any:
    known = module.globals.get(name)
    return known if known is not None else ir.Function(module, kind, name)


def paired(a: Lanes, b: Lanes, c: Lanes, d: Lanes) -> Lanes:
    """Sum up the four lanes of each of eight points: first a's, b's, c's, d's first, then seconds.

    a holds points 0 and 4, b 1 and 5, c 2 and 6, d 3 and 7.
    """
    ends = np.stack([a, b, c, d]).reshape(4, 2, 4)
    first = ends[..., 0] + ends[..., 1]
    return np.ascontiguousarray((first + (ends[..., 2] + ends[..., 3])).T).ravel()


@_compiled(paired, LANES, LANES, LANES, LANES)
def _paired(builder: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    even, odd = [0, 8, 2, 10, 4, 12, 6, 14], [1, 9, 3, 11, 5, 13, 7, 15]

    def halves(one: Any, other: Any) -> Any:
        low = _shuffled(builder, one, other, even)
        return builder.fadd(low, _shuffled(builder, one, other, odd))

    ab, cd = halves(a, b), halves(c, d)
    low = _shuffled(builder, ab, cd, [0, 1, 8, 9, 4, 5, 12, 13])
    return builder.fadd(low, _shuffled(builder, ab, cd, [2, 3, 10, 11, 6, 7, 14, 15]))


def spread(values: Lanes, which: int) -> Lanes:
    """Return value `which` of the first four in four lanes, and that of the last four."""
    return np.repeat(values.reshape(2, 4)[:, which], 4)


def _spread(which: int) -> Callable[[Lanes], Lanes]:
    def function(values: Lanes) -> Lanes:
        return spread(values, which)

    @_compiled(function, LANES)
    def _build(builder: Any, values: Any) -> Any:
        return _shuffled(builder, values, values, [which] * 4 + [4 + which] * 4)

    return function


spread_0, spread_1, spread_2, spread_3 = (_spread(which) for which in range(4))
"""`spread` of a place that is known when the kernel is compiled."""


def folded(values: Lanes) -> tuple[float, float, float]:
    """Return the sum of the two points in `values`."""
    return (
        float(values[0] + values[4]),
        float(values[1] + values[5]),
        float(values[2] + values[6]),
    )


@_compiled(folded, LANES, result=types.UniTuple(types.float64, 3))
def _folded(builder: Any, values: Any) -> Any:
    low = _shuffled(builder, values, values, range(4))
    total = builder.fadd(low, _shuffled(builder, values, values, range(4, WIDTH)))
    made = ir.Constant(ir.ArrayType(ir.DoubleType(), 3), ir.Undefined)
    for c in range(3):
        made = builder.insert_value(made, builder.extract_element(total, ir.Constant(_I32, c)), c)
    return made
