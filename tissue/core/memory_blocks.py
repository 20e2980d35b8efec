"""Memory of structs of arrays: a table of spans that is copied into one vector, and back.

Arrays have room to grow. Of each the part in use is copied; what follows still holds what it was
made with, one value. In that part blocks that hold one value are not copied either.
"""

import ctypes
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final, NamedTuple, cast

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import lower_builtin, type_callable
from numba.np import arrayobj

from tissue.core.array_types import BoolArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays

WORD: Final = 8
"""Bytes of a word."""

BLOCK: Final = 256
"""Words of a block: half a page. Larger: more of one value is copied; smaller: more to look up."""

ADDRESS, SPAN_LENGTH, COUNTER, UNIT, PER_UNIT, LEAD, HAS_REST = range(7)
"""Columns of a table of spans, each a number of words but for:

ADDRESS, where it begins; COUNTER, address of the number of things in use, or 0 where all is;
UNIT, how many things share PER_UNIT words, behind LEAD words in use in any case; and HAS_REST, 1
where what is not in use holds one value, 0 where it means nothing."""

SPARE_SHARE: Final = 4
"""A new room is larger by one part in this many: a body that is cut grows, and the next memento may
use it still. New memory costs three times as much as the copy: the system clears each page."""


class RowsInUse(NamedTuple):
    """Part of an array of a struct that is in use: counted things, the first ones first."""

    struct: Arrays
    field: str
    counter: tuple[Arrays, str]
    """The struct and the cell that count."""
    elements: int | None = None
    """Elements of the array for each thing; None: those of a row."""
    block: int = 1
    """Things that are stored together."""
    lead: int = 0
    """Elements before the first thing."""
    has_rest: bool = True
    """Whether the rest holds what the array was made with; if not, it means nothing."""


class StructRules(NamedTuple):
    """Which memory of structs is state."""

    scratch: frozenset[str] = frozenset()
    """Names of classes, and of arrays as `Class.field`, that hold nothing from step to step."""
    in_use: Callable[[Sequence[Arrays]], Iterable[RowsInUse]] = lambda _: ()
    """Returns what is in use in some of these structs; of others all is."""


class StructPart(NamedTuple):
    """An array of a struct that is state."""

    name: str
    """Name of the field."""
    array: np.ndarray
    """The array."""
    address: int
    """Where it begins."""
    n_words: int
    """Whole words of it; 0 where it does not begin with one."""
    tail: np.ndarray
    """View of the bytes behind those."""


def parts_of(struct: Arrays, rules: StructRules) -> list[StructPart]:
    """Return the arrays of a struct that are state; none of structs in it. They never change."""
    kind = type(struct).__name__
    if kind in rules.scratch:
        return []
    parts = []
    for name in type(struct).__annotations__:
        array = getattr(struct, name)
        if isinstance(array, np.ndarray) and f"{kind}.{name}" not in rules.scratch:
            address = array.ctypes.data
            n_words = array.nbytes // WORD if address % WORD == 0 else 0
            tail = array.reshape(-1).view(np.uint8)[WORD * n_words :]
            parts.append(StructPart(name, array, address, n_words, tail))
    return parts


class StructMemory(NamedTuple):
    """The memory of some structs that is state."""

    spans: IntArray
    """Whole words of cells and arrays; see `memory_blocks.ADDRESS`. Shape (n_spans, 7)."""
    tails: list[np.ndarray]
    """Views of the bytes behind the whole words of arrays."""


def memory_of(
    structs: Sequence[Arrays],
    rules: StructRules,
    parts: Sequence[list[StructPart]] | None = None,
) -> StructMemory:
    """Return the memory of structs that is state, in their order.

    Args:
        structs: The structs.
        rules: What of them is state.
        parts: What `parts_of` returned for each, where that is known.
    """
    if parts is None:
        parts = [parts_of(struct, rules) for struct in structs]
    uses = {(id(use.struct), use.field): use for use in rules.in_use(structs)}
    spans: list[list[int]] = []
    tails: list[np.ndarray] = []
    for struct, own in zip(structs, parts, strict=True):
        if struct._cells and type(struct).__name__ not in rules.scratch:
            spans.append([struct.address, len(struct._cells), 0, 1, 0, 0, 0])
        for name, array, address, n_words, tail in own:
            if n_words:
                use = uses.get((id(struct), name))
                spans.append([address, n_words, *_use(array, use)])
            if tail.size:
                tails.append(tail)
    return StructMemory(np.array(spans, np.int64).reshape(-1, 7), tails)


def _use(array: np.ndarray, use: RowsInUse | None) -> list[int]:
    """Return the columns of a span that say what of it is in use."""
    if use is None:
        return [0, 1, 0, 0, 0]
    struct, cell = use.counter
    elements = array[:1].size if use.elements is None else use.elements
    n_bytes, unit = elements * array.itemsize * use.block, use.block
    while n_bytes % WORD:
        n_bytes, unit = 2 * n_bytes, 2 * unit
    lead = use.lead * array.itemsize // WORD
    counter = struct.address + WORD * struct._cells.index(cell)
    return [counter, unit, n_bytes // WORD, lead, int(use.has_rest)]


_WORDS = types.Array(types.int64, 1, "C")


def words_at(address: int, n: int) -> IntArray:
    """Return `n` words of memory from an address on, a multiple of `WORD`; nothing keeps it."""
    if n == 0:
        return np.zeros(0, np.int64)
    words: IntArray = np.ctypeslib.as_array((ctypes.c_int64 * int(n)).from_address(int(address)))
    return words


@type_callable(words_at)
def _type_of_words(_: Any) -> Any:
    def typer(address: types.Type, n: types.Type) -> types.Type | None:
        are_whole = isinstance(address, types.Integer) and isinstance(n, types.Integer)
        return _WORDS if are_whole else None

    return typer


def _lower_words(context: Any, builder: Any, _: Any, values: Any) -> Any:
    address, n = values
    array = context.make_array(_WORDS)(context, builder)
    cast(Any, arrayobj).populate_array(
        array,
        data=builder.inttoptr(address, array.data.type),
        shape=[n],
        strides=[ir.Constant(ir.IntType(64), WORD)],
        itemsize=ir.Constant(ir.IntType(64), WORD),
        meminfo=None,
    )
    return array._getvalue()


cast(Any, lower_builtin)(words_at, types.Integer, types.Integer)(_lower_words)


class PackedMemory(NamedTuple):
    """Contents of the spans of a table at one time."""

    in_use: IntArray
    """Words in use of each span, shape (n_spans,)."""
    rest: IntArray
    """The word that each span held behind them, shape (n_spans,)."""
    is_filled: BoolArray
    """Whether all words of a block in use are the same, shape (n_blocks,)."""
    value: IntArray
    """The one word of each block, shape (n_blocks,)."""
    words: IntArray
    """The words of all other blocks, one after the other."""


def packed(spans: IntArray, room: IntArray) -> PackedMemory:
    """Return what is in spans of memory.

    Args:
        spans: See `ADDRESS`, shape (n_spans, 7).
        room: Taken for the words, if all in use have room; else more is made. What is not
            written of it takes no memory.
    """
    n = len(spans)
    in_use, rest = np.empty(n, np.int64), np.empty(n, np.int64)
    n_blocks = measure_memory(spans, in_use, rest)
    is_filled, value = np.empty(n_blocks, np.bool_), np.empty(n_blocks, np.int64)
    most = int(in_use.sum())
    if len(room) < most:
        room = np.empty(most + most // SPARE_SHARE, np.int64)
    n_words = pack_memory(spans, in_use, is_filled, value, room)
    return PackedMemory(in_use, rest, is_filled, value, room[:n_words])


def unpacked(spans: IntArray, memory: PackedMemory, *, is_new: bool = False) -> None:
    """Put back what `packed` found.

    Args:
        spans: As long as those that were packed.
        memory: What is put back.
        is_new: Whether the spans are new and hold 0, not what was in use since it was packed.
    """
    live, rest = np.empty((2, len(spans)), np.int64)
    measure_memory(spans, live, rest)
    unpack_memory(spans, spans[:, SPAN_LENGTH] if is_new else live, *memory)


@kernel
def measure_memory(spans: IntArray, in_use: IntArray, rest: IntArray) -> int:
    """Write how many words of each span are in use, and the one behind; return how many blocks."""
    n_blocks = 0
    for i in range(len(spans)):
        n = spans[i, SPAN_LENGTH]
        if spans[i, COUNTER] != 0:
            units = -(-words_at(spans[i, COUNTER], 1)[0] // spans[i, UNIT])
            n = min(n, spans[i, LEAD] + units * spans[i, PER_UNIT])
        in_use[i] = n
        has_more = n < spans[i, SPAN_LENGTH]
        rest[i] = words_at(spans[i, ADDRESS] + WORD * n, 1)[0] if has_more else 0
        n_blocks += -(-n // BLOCK)
    return n_blocks


@kernel
def pack_memory(
    spans: IntArray, in_use: IntArray, is_filled: BoolArray, value: IntArray, words: IntArray
) -> int:
    """Find the blocks in use that hold one value, and that; write the words of all others.

    In one pass: a test of each block before any is copied takes as long as the copy.

    Args:
        spans: See `ADDRESS`, shape (n_spans, 7).
        in_use: See `PackedMemory`, as the rest.
        is_filled: Written.
        value: Written.
        words: Written; as long as all that is in use.

    Returns:
        Number of words written.
    """
    block = at = 0
    for i in range(len(spans)):
        n = in_use[i]
        memory = words_at(spans[i, ADDRESS], n)
        for begin in range(0, n, BLOCK):
            end = min(begin + BLOCK, n)
            is_filled[block] = _holds_one_value(memory, begin, end)
            value[block] = memory[begin]
            if not is_filled[block]:
                for k in range(end - begin):
                    words[at + k] = memory[begin + k]
                at += end - begin
            block += 1
    return at


@kernel
def unpack_memory(
    spans: IntArray,
    live: IntArray,
    in_use: IntArray,
    rest: IntArray,
    is_filled: BoolArray,
    value: IntArray,
    words: IntArray,
) -> None:
    """Do `unpacked`.

    Args:
        spans: Where it is put.
        live: Number of words of each span that have been in use.
        in_use: See `PackedMemory`, as the rest.
        rest: The word behind those in use.
        is_filled: Whether a block holds one value.
        value: That value.
        words: The words of others.
    """
    block = at = 0
    for i in range(len(spans)):
        n = in_use[i]
        memory = words_at(spans[i, ADDRESS], spans[i, SPAN_LENGTH])
        for begin in range(0, n, BLOCK):
            end = min(begin + BLOCK, n)
            if is_filled[block]:
                _fill(memory, begin, end, value[block])
            else:
                for k in range(end - begin):
                    memory[begin + k] = words[at + k]
                at += end - begin
            block += 1
        if spans[i, HAS_REST] == 1:
            _fill(memory, n, live[i], rest[i])


@kernel
def _fill(memory: IntArray, begin: int, end: int, value: int) -> None:
    """Write one value to memory; where it is there already, do not touch the page."""
    if begin < end and not (memory[begin] == value and _holds_one_value(memory, begin, end)):
        for k in range(begin, end):
            memory[k] = value


@kernel
def _holds_one_value(memory: IntArray, begin: int, end: int) -> bool:
    """Return whether all words from `begin` to `end` are the same."""
    first, differs = memory[begin], 0
    if memory[end - 1] != first or memory[(begin + end) // 2] != first:
        return False
    for k in range(begin, end):
        differs |= memory[k] ^ first
    return bool(differs == 0)
