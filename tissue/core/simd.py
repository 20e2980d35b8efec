"""Vectors of eight doubles (`Lanes`) inside kernels, for the inner loops of the forces.

LLVM does not vectorise a gather over the neighbours of a node by itself. Here the kernel does so
explicitly: it reads as for one neighbour, but each value is a vector of eight. On a machine with
narrower registers LLVM splits each operation in two or four. A `Point` is x, y, z of one node in a
vector of four.

Each function is also a plain Python function on NumPy arrays, which runs when the JIT is off: the
tests compare the two. `+ - * /` work on both.
"""

import operator
from collections.abc import Callable
from inspect import Parameter, Signature
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import lower_builtin, models, register_model, type_callable

from tissue.core.array_types import FloatArray, SlotArray
from tissue.core.jit import inlined

WIDTH = 8
"""Doubles in a vector: one cache line, and one AVX-512 register."""

Lanes = Any
"""Eight doubles: in Python an array, in a kernel one vector. It replaces a float, so that a `Vec3`
of them is eight points, and the functions of `tissue.core.vec3` work on eight at a time."""
Point = np.ndarray
"""A point as x, y, z and a 0: in Python an array, in a kernel one vector of four."""


@inlined
def filled(n: int) -> int:
    """Return the slots that a row of `n` entries takes: a multiple of `WIDTH`."""
    return (n + WIDTH - 1) // WIDTH * WIDTH


def aligned(n: int, dtype: type = np.float64) -> np.ndarray:
    """Return `n` zeros aligned to a cache line: a vector across two lines loads at half speed."""
    line = 64 // np.dtype(dtype).itemsize
    memory: np.ndarray = np.zeros(n + line, dtype)
    skip = -memory.ctypes.data % 64 // memory.itemsize
    return memory[skip : skip + n]


def room_for_points(n: int) -> FloatArray:
    """Return zeros of shape (n, 3) with one more double behind them, which `eight_points` reads."""
    return np.zeros(3 * n + 1)[:-1].reshape(n, 3)


class LanesType(types.Type):
    """Numba's type of a vector of doubles, or of singles.

    A product and a sum of them may become one instruction unless they are unfused.
    """

    def __init__(self, width: int, *, is_single: bool = False, is_unfused: bool = False) -> None:
        self.width = width
        self.is_single = is_single
        self.is_unfused = is_unfused
        super().__init__(name=f"Lanes({width}{', single' * is_single}{', unfused' * is_unfused})")


LANES = LanesType(WIDTH)
UNFUSED = LanesType(WIDTH, is_unfused=True)
LANES_OF_SINGLES = LanesType(2 * WIDTH, is_single=True)
POINT = LanesType(4)
THREE_LANES = cast(Any, types).UniTuple(LANES, 3)
LANES_IR = ir.VectorType(ir.DoubleType(), WIDTH)
POINT_IR = ir.VectorType(ir.DoubleType(), 4)
_XYZ = ir.Constant(ir.VectorType(ir.IntType(1), 4), [1, 1, 1, 0])
I32 = ir.IntType(32)
EVEN, ODD = [0, 8, 2, 10, 4, 12, 6, 14], [1, 9, 3, 11, 5, 13, 7, 15]
FIRST, SECOND = [0, 1, 8, 9, 4, 5, 12, 13], [2, 3, 10, 11, 6, 7, 14, 15]
I64 = ir.IntType(64)


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, fe_type: LanesType) -> None:
        element = ir.FloatType() if fe_type.is_single else ir.DoubleType()
        vector = ir.VectorType(element, fe_type.width)
        cast(Any, super()).__init__(manager, fe_type, vector)


_Function = Callable[..., Any]


def intrinsic(
    function: _Function, *kinds: Any, result: types.Type | _Function = LANES
) -> Callable[[_Function], _Function]:
    """Compile `function`, on arguments of these kinds, to the code that the decorated one builds.

    It is called with the builder and the values of the arguments. `result` is the type of what it
    returns, or a function that finds it from the types of the arguments.
    """

    def fits(kind: Any, argument: types.Type) -> bool:
        return isinstance(argument, kind) if isinstance(kind, type) else argument == kind

    @type_callable(function)
    def _types(_: Any) -> _Function:
        def typer(*arguments: types.Type) -> types.Type | None:
            if len(arguments) == len(kinds) and all(map(fits, kinds, arguments)):
                return result if isinstance(result, types.Type) else result(*arguments)
            return None

        names = [f"argument_{i}" for i in range(len(kinds))]
        parameters = [Parameter(name, Parameter.POSITIONAL_OR_KEYWORD) for name in names]
        cast(Any, typer).__signature__ = Signature(parameters)  # Numba folds arguments by it
        return typer

    def register(build: _Function) -> _Function:
        def lower(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            arguments = [
                Operand(context, builder, kind, value) if isinstance(kind, types.Array) else value
                for kind, value in zip(signature.args, values, strict=True)
            ]
            made = build(builder, *arguments)
            return context.get_dummy_value() if made is None else made

        cast(Any, lower_builtin)(function, *kinds)(lower)
        return build

    return register


class Operand:
    """An array argument: where its elements are."""

    def __init__(self, context: Any, builder: Any, kind: types.Array, value: Any) -> None:
        self._data = context.make_array(kind)(context, builder, value).data
        self.element = self._data.type.pointee
        self._builder = builder

    def at(self, i: Any, n_columns: int = 1) -> Any:
        """Return a pointer to element `i`, or to the first of row `i`."""
        builder = self._builder
        if i.type.width < 64:
            i = builder.sext(i, I64)
        if n_columns > 1:
            i = builder.mul(i, ir.Constant(I64, n_columns))
        return builder.gep(self._data, [i])


def shuffled(builder: Any, a: Any, b: Any, order: Any) -> Any:
    """Return the lanes of `a`, followed by those of `b`, in another order."""
    lanes = list(order)
    return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(I32, len(lanes)), lanes))


def _operator(function: _Function, instruction: str, kind: LanesType) -> None:
    @intrinsic(function, kind, kind, result=kind)
    def _build(builder: Any, a: Any, b: Any) -> Any:
        # A product and a sum may become one instruction that rounds once: faster, and no less
        # exact. Nothing is reordered.
        flags = () if kind.is_unfused else ("contract",)
        return getattr(builder, instruction)(a, b, flags=flags)


for _kind in (LANES, UNFUSED, LANES_OF_SINGLES, POINT):
    _operator(operator.add, "fadd", _kind)
    _operator(operator.sub, "fsub", _kind)
    _operator(operator.mul, "fmul", _kind)
    _operator(operator.truediv, "fdiv", _kind)


def lanes(value: float) -> Lanes:
    """Return eight times the same number."""
    return np.full(WIDTH, value)


@intrinsic(lanes, types.Float)
def _lanes(builder: Any, value: Any) -> Any:
    return in_all_lanes(builder, value, LANES_IR)


def in_all_lanes(builder: Any, value: Any, kind: Any) -> Any:
    """Return a vector that holds `value` in all lanes."""
    one = builder.insert_element(ir.Constant(kind, ir.Undefined), value, ir.Constant(I32, 0))
    return shuffled(builder, one, one, [0] * kind.count)


def load_lanes(array: FloatArray, i: int) -> Lanes:
    """Return the eight elements of a vector from `i` on."""
    return array[i : i + WIDTH].copy()


@intrinsic(load_lanes, types.Array, types.Integer)
def _load(builder: Any, array: Operand, i: Any) -> Any:
    return builder.load(builder.bitcast(array.at(i), LANES_IR.as_pointer()), align=8)


def store_lanes(array: FloatArray, i: int, values: Lanes) -> None:
    """Write eight elements of a vector from `i` on."""
    array[i : i + WIDTH] = values


@intrinsic(store_lanes, types.Array, types.Integer, LANES, result=types.void)
@intrinsic(store_lanes, types.Array, types.Integer, UNFUSED, result=types.void)
def _store(builder: Any, array: Operand, i: Any, values: Any) -> None:
    builder.store(values, builder.bitcast(array.at(i), LANES_IR.as_pointer()), align=8)


def unfused(a: Lanes) -> Lanes:
    """Return the same numbers; what is computed from them has the bits of scalars.

    It is unfused, too: a product is rounded before it is added, which takes a little longer.
    """
    return a


@intrinsic(unfused, LANES, result=UNFUSED)
def _unfused(_: Any, a: Any) -> Any:
    return a


def square_root(a: Lanes) -> Lanes:
    """Return the square roots of eight numbers."""
    return np.sqrt(a)


@intrinsic(square_root, LANES)
@intrinsic(square_root, UNFUSED, result=UNFUSED)
def _square_root(builder: Any, a: Any) -> Any:
    function = declared(builder.module, "llvm.sqrt.v8f64", ir.FunctionType(LANES_IR, [LANES_IR]))
    return builder.call(function, [a])


def times(value: float, a: Point) -> Point:
    """Return a point times a number."""
    return value * a


@intrinsic(times, types.Float, POINT, result=POINT)
def _times(builder: Any, value: Any, a: Any) -> Any:
    return builder.fmul(in_all_lanes(builder, value, POINT_IR), a, flags=("contract",))


def point(points: FloatArray, i: int) -> Point:
    """Return row `i` of an array of shape (n, 3) with a 0 behind it."""
    return np.array([*points[i], 0.0])


@intrinsic(point, types.Array, types.Integer, result=POINT)
def _load_point(builder: Any, points: Operand, i: Any) -> Any:
    pointer = builder.bitcast(points.at(i, 3), POINT_IR.as_pointer())
    kind = ir.FunctionType(POINT_IR, [POINT_IR.as_pointer(), I32, _XYZ.type, POINT_IR])
    function = declared(builder.module, "llvm.masked.load.v4f64.p0v4f64", kind)
    zero = ir.Constant(POINT_IR, [0.0] * 4)
    return builder.call(function, [pointer, ir.Constant(I32, 8), _XYZ, zero])


def store_point(points: FloatArray, i: int, a: Point) -> None:
    """Write x, y, z into row `i` of an array of shape (n, 3)."""
    points[i] = a[:3]


@intrinsic(store_point, types.Array, types.Integer, POINT, result=types.void)
def _store_point(builder: Any, points: Operand, i: Any, a: Any) -> None:
    # As two stores: one of four lanes with a mask takes 6 ns here, seven times as long.
    pointer = points.at(i, 3)
    low = shuffled(builder, a, a, [0, 1])
    builder.store(low, builder.bitcast(pointer, low.type.as_pointer()), align=8)
    last = builder.gep(pointer, [ir.Constant(I64, 2)])
    builder.store(builder.extract_element(a, I32(2)), last)


def point_of(x: float, y: float, z: float) -> Point:
    """Return a point of these coordinates."""
    return np.array([x, y, z, 0.0])


@intrinsic(point_of, types.Float, types.Float, types.Float, result=POINT)
def _point_of(builder: Any, *coordinates: Any) -> Any:
    made = ir.Constant(POINT_IR, [0.0] * 4)
    for c, value in enumerate(coordinates):
        made = builder.insert_element(made, value, ir.Constant(I32, c))
    return made


def spread(a: Point) -> tuple[Lanes, Lanes, Lanes]:
    """Return x, y and z of a point, each in all lanes."""
    return lanes(a[0]), lanes(a[1]), lanes(a[2])


@intrinsic(spread, POINT, result=THREE_LANES)
def _spread(builder: Any, a: Any) -> Any:
    return tuple_of(builder, [shuffled(builder, a, a, [c] * WIDTH) for c in range(3)])


def eight_points(points: FloatArray, of: SlotArray, i: int) -> tuple[Lanes, Lanes, Lanes]:
    """Return x, y and z of rows `of[i]` to `of[i + 7]` of an array of shape (n, 3).

    Four doubles are read for each point, for which the array must have room (`room_for_points`).
    With three a force takes a tenth longer.
    """
    rows = points[of[i : i + WIDTH]]
    return rows[:, 0].copy(), rows[:, 1].copy(), rows[:, 2].copy()


@intrinsic(eight_points, types.Array, types.Array, types.Integer, result=THREE_LANES)
def _eight_points(builder: Any, points: Operand, of: Operand, i: Any) -> Any:
    rows = []
    for k in range(WIDTH):
        row = points.at(builder.load(of.at(builder.add(i, i.type(k)))), 3)
        rows.append(builder.load(builder.bitcast(row, POINT_IR.as_pointer()), align=8))
    return tuple_of(builder, transposed(builder, rows))


def transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """Return x, y and z of eight points."""
    a, b, c, d = (shuffled(builder, rows[k], rows[k + 4], range(WIDTH)) for k in range(4))
    ab, cd = (shuffled(builder, *pair, EVEN) for pair in ((a, b), (c, d)))
    x = shuffled(builder, ab, cd, FIRST)
    z = shuffled(builder, ab, cd, SECOND)
    ab, cd = (shuffled(builder, *pair, ODD) for pair in ((a, b), (c, d)))
    return [x, shuffled(builder, ab, cd, FIRST), z]


def tuple_of(builder: Any, values: list[Any]) -> Any:
    """Return values of one type as a tuple of a kernel."""
    made = ir.Constant(ir.ArrayType(values[0].type, len(values)), ir.Undefined)
    for i, value in enumerate(values):
        made = builder.insert_value(made, value, i)
    return made


def declared(module: Any, name: str, kind: Any) -> Any:
    """Return the function of LLVM with that name, declared in the module once."""
    known = module.globals.get(name)
    return known if known is not None else ir.Function(module, kind, name)


def summed(x: Lanes, y: Lanes, z: Lanes) -> Point:
    """Return the point whose coordinates are the sums of eight numbers, neighbours first."""
    pairs = np.stack([x, y, z]).reshape(3, 4, 2).sum(axis=2)
    halves = pairs[:, :2] + pairs[:, 2:]
    return np.array([*(halves[:, 0] + halves[:, 1]), 0.0])


@intrinsic(summed, LANES, LANES, LANES, result=POINT)
def _summed(builder: Any, x: Any, y: Any, z: Any) -> Any:
    def halves(a: Any, b: Any) -> Any:
        pairs = builder.fadd(shuffled(builder, a, b, EVEN), shuffled(builder, a, b, ODD))
        low = shuffled(builder, pairs, pairs, range(4))
        return builder.fadd(low, shuffled(builder, pairs, pairs, range(4, WIDTH)))

    xy, z0 = halves(x, y), halves(z, ir.Constant(LANES_IR, [0.0] * WIDTH))
    low = shuffled(builder, xy, z0, [0, 1, 4, 5])
    return builder.fadd(low, shuffled(builder, xy, z0, [2, 3, 6, 7]))
