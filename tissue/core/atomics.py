"""Atomic operations on whole numbers in an array that several threads share, for kernels.

All are sequentially consistent: what a thread wrote before one of them, another thread sees after
it has read the number. With the JIT off they are plain Python functions, for one thread.
"""

import os
import platform
from typing import Any

from llvmlite import ir
from numba.core import types

from tissue.core.array_types import IntArray
from tissue.core.simd import _I32, _Array, _compiled, _declared

_ORDER = "seq_cst"
_BYTES = 8
_NUMBERS = types.Array(types.int64, 1, "C")


def load_shared(numbers: IntArray, i: int) -> int:
    """Return element `i` of a vector."""
    return int(numbers[i])


@_compiled(load_shared, _NUMBERS, types.Integer, result=types.int64)
def _load(builder: Any, numbers: _Array, i: Any) -> Any:
    return builder.load_atomic(numbers.at(i), _ORDER, _BYTES)


def store_shared(numbers: IntArray, i: int, value: int) -> None:
    """Write element `i` of a vector."""
    numbers[i] = value


@_compiled(store_shared, _NUMBERS, types.Integer, types.Integer, result=types.void)
def _store(builder: Any, numbers: _Array, i: Any, value: Any) -> None:
    builder.store_atomic(value, numbers.at(i), _ORDER, _BYTES)


def add_shared(numbers: IntArray, i: int, value: int) -> None:
    """Add to element `i` of a vector."""
    numbers[i] += value


@_compiled(add_shared, _NUMBERS, types.Integer, types.Integer, result=types.void)
def _add(builder: Any, numbers: _Array, i: Any, value: Any) -> None:
    builder.atomic_rmw("add", numbers.at(i), value, _ORDER)


def replace_shared(numbers: IntArray, i: int, expected: int, value: int) -> bool:
    """Write element `i` of a vector if it is what is expected; return whether it was."""
    if numbers[i] != expected:
        return False
    numbers[i] = value
    return True


@_compiled(
    replace_shared, _NUMBERS, types.Integer, types.Integer, types.Integer, result=types.boolean
)
def _replace(builder: Any, numbers: _Array, i: Any, expected: Any, value: Any) -> Any:
    found = builder.cmpxchg(numbers.at(i), expected, value, _ORDER, _ORDER)
    return builder.extract_value(found, 1)


def pause() -> None:
    """Let the core rest for some tens of nanoseconds, in a loop that waits."""


@_compiled(pause, result=types.void)
def _pause(builder: Any) -> None:
    machine = platform.machine().lower()
    if machine in ("x86_64", "amd64"):
        kind = ir.FunctionType(ir.VoidType(), [])
        builder.call(_declared(builder.module, "llvm.x86.sse2.pause", kind), [])
    elif machine in ("arm64", "aarch64"):
        kind = ir.FunctionType(ir.VoidType(), [_I32])
        hint = _declared(builder.module, "llvm.aarch64.hint", kind)
        builder.call(hint, [_I32(1)])  # the instruction `yield`


def yield_core() -> None:
    """Let the operating system run another thread on this core; without POSIX, do nothing."""


@_compiled(yield_core, result=types.void)
def _yield_core(builder: Any) -> None:
    if os.name == "posix":
        builder.call(_declared(builder.module, "sched_yield", ir.FunctionType(_I32, [])), [])
