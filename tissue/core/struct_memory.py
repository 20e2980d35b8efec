"""The memory of structs of arrays, as a table of spans that is copied at once."""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.memory_blocks import WORD
from tissue.core.structs import Arrays


class RowsInUse(NamedTuple):
    """How much of an array of a struct is in use: things that are counted, the first ones first."""

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
    """Its field."""
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
