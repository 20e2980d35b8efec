"""Threads that share the loops of one of them: chunks of a loop, claimed one by one.

The first thread opens a loop, claims chunks from its begin until there are none, and then waits
for those that others have claimed. The others claim from its end, so that each thread mostly finds
in its cache what it wrote in the loop before. The first thread waits for no one to begin: a thread
that the operating system does not run costs nothing, unless it is stopped inside a chunk.

A loop must give the same bits in any chunks: each item is written by its own turn alone.

The operations on shared numbers are atomic and sequentially consistent: what a thread wrote before
one of them, another thread sees after it has read the number. With the JIT off they are plain
Python functions, for one thread.
"""

import os
import platform
from typing import Any

from llvmlite import ir
from numba.core import types

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.simd import I32, Operand, aligned, declared, intrinsic
from tissue.core.structs import Arrays, FloatCell, IntCell

_ORDER = "seq_cst"

_BYTES = 8

_NUMBERS = types.Array(types.int64, 1, "C")

LOOP_CHUNKS = 256
"""Chunks in a loop at most. More: longer claims; fewer: the first thread waits longer at the end.
Less than `_ONE_FIRST`."""

SPINS_BEFORE_YIELD = 400
"""Tests by the first thread, some 20 us, before it lets others run on its core. More: where
there is one core alone, it waits for a thread that cannot run; fewer: it may lose its core."""

_OPEN, _DONE, _N_SHARED = 0, 16, 32
"""Places of the shared numbers, each in a cache line of its own and away from the next."""

_ONE_FIRST, _ONE_TURN, _TURNS = 1 << 12, 1 << 24, 1 << 38
"""The number at `_OPEN` is turn * _ONE_TURN + first * _ONE_FIRST + end: chunks from `first` to
`end` of a loop are unclaimed. Turns of two loops differ, so that no claim is taken for another."""


class Team(Arrays):
    """A loop that threads share. The first thread writes it while no chunk is claimed."""

    is_shared: IntCell
    """1 if other threads may take part, else 0."""
    loop: IntCell
    """Which loop it is."""
    n_items: IntCell
    """Number of items of the loop."""
    chunk_size: IntCell
    """Number of items of a chunk; the last one may have fewer."""
    seconds: FloatCell
    """A time that the loop is given [s]."""
    numbers: IntArray
    """Unclaimed chunks, and how many chunks others have done; see `_OPEN`, `_DONE`."""


def new_team() -> Team:
    """Return a team of one thread."""
    return Team.new({}, chunk_size=1, numbers=aligned(_N_SHARED, int))


@kernel
def open_loop(team: Team, loop: int, seconds: float, n: int, chunk_size: int) -> int:
    """Open a loop, whose chunks threads claim; return how many there are.

    Args:
        team: Written; the loop before has ended.
        loop: Which loop.
        seconds: A time that it is given [s].
        n: Number of items.
        chunk_size: Items of a chunk; more where there would be over `LOOP_CHUNKS`.
    """
    size = max(chunk_size, (n + LOOP_CHUNKS - 1) // LOOP_CHUNKS)
    n_chunks = (n + size - 1) // size
    team.loop = loop
    team.seconds = seconds
    team.n_items = n
    team.chunk_size = size
    store_shared(team.numbers, _DONE, 0)
    turn = load_shared(team.numbers, _OPEN) // _ONE_TURN + 1
    store_shared(team.numbers, _OPEN, turn % _TURNS * _ONE_TURN + n_chunks)
    return n_chunks


@kernel
def claim_first(team: Team) -> int:
    """Return the first chunk that is unclaimed, for the first thread; -1 where there is none."""
    while True:
        now = load_shared(team.numbers, _OPEN)
        first, end = now // _ONE_FIRST % _ONE_FIRST, now % _ONE_FIRST
        if first == end:
            return -1
        if replace_shared(team.numbers, _OPEN, now, now + _ONE_FIRST):
            return first


@kernel
def claim_last(team: Team) -> int:
    """Return the last chunk that is unclaimed, for another thread; -1 where there is none."""
    while True:
        now = load_shared(team.numbers, _OPEN)
        first, end = now // _ONE_FIRST % _ONE_FIRST, now % _ONE_FIRST
        if first == end:
            return -1
        if replace_shared(team.numbers, _OPEN, now, now - 1):
            return end - 1


@kernel
def items_of(team: Team, chunk: int) -> tuple[int, int]:
    """Return the first item of a claimed chunk, and the end of them."""
    begin = chunk * team.chunk_size
    return begin, min(begin + team.chunk_size, team.n_items)


@kernel
def end_chunk(team: Team) -> None:
    """Count a chunk as done that was claimed by another than the first thread."""
    add_shared(team.numbers, _DONE, 1)


@kernel
def wait_for_others(team: Team, n: int) -> None:
    """Wait until others have done `n` chunks, all that they have claimed of this loop."""
    spins = 0
    while load_shared(team.numbers, _DONE) < n:
        spins += 1
        if spins < SPINS_BEFORE_YIELD:
            pause()
        else:
            yield_core()


def load_shared(numbers: IntArray, i: int) -> int:
    """Return element `i` of a vector."""
    return int(numbers[i])


@intrinsic(load_shared, _NUMBERS, types.Integer, result=types.int64)
def _load(builder: Any, numbers: Operand, i: Any) -> Any:
    return builder.load_atomic(numbers.at(i), _ORDER, _BYTES)


def store_shared(numbers: IntArray, i: int, value: int) -> None:
    """Write element `i` of a vector."""
    numbers[i] = value


@intrinsic(store_shared, _NUMBERS, types.Integer, types.Integer, result=types.void)
def _store(builder: Any, numbers: Operand, i: Any, value: Any) -> None:
    builder.store_atomic(value, numbers.at(i), _ORDER, _BYTES)


def add_shared(numbers: IntArray, i: int, value: int) -> None:
    """Add to element `i` of a vector."""
    numbers[i] += value


@intrinsic(add_shared, _NUMBERS, types.Integer, types.Integer, result=types.void)
def _add(builder: Any, numbers: Operand, i: Any, value: Any) -> None:
    builder.atomic_rmw("add", numbers.at(i), value, _ORDER)


def replace_shared(numbers: IntArray, i: int, expected: int, value: int) -> bool:
    """Write element `i` of a vector if it is what is expected; return whether it was."""
    if numbers[i] != expected:
        return False
    numbers[i] = value
    return True


@intrinsic(
    replace_shared, _NUMBERS, types.Integer, types.Integer, types.Integer, result=types.boolean
)
def _replace(builder: Any, numbers: Operand, i: Any, expected: Any, value: Any) -> Any:
    found = builder.cmpxchg(numbers.at(i), expected, value, _ORDER, _ORDER)
    return builder.extract_value(found, 1)


def pause() -> None:
    """Pause the core for some tens of nanoseconds, in a loop that waits."""


@intrinsic(pause, result=types.void)
def _pause(builder: Any) -> None:
    machine = platform.machine().lower()
    if machine in ("x86_64", "amd64"):
        kind = ir.FunctionType(ir.VoidType(), [])
        builder.call(declared(builder.module, "llvm.x86.sse2.pause", kind), [])
    elif machine in ("arm64", "aarch64"):
        kind = ir.FunctionType(ir.VoidType(), [I32])
        hint = declared(builder.module, "llvm.aarch64.hint", kind)
        builder.call(hint, [I32(1)])  # the instruction `yield`


def yield_core() -> None:
    """Yield this core to another thread; without POSIX, do nothing."""


@intrinsic(yield_core, result=types.void)
def _yield_core(builder: Any) -> None:
    if os.name == "posix":
        builder.call(declared(builder.module, "sched_yield", ir.FunctionType(I32, [])), [])
