"""A memento in plain form: a tree of JSON, and arrays beside it."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from tissue.core.lazy_fields import plain_class
from tissue.core.memento import Memento, StateRules, attributes_in, nested_structs
from tissue.core.structs import Arrays, Vectors

PACKED = "packed_"
"""What the names of the arrays of `PackedMemory` begin with."""

TAILS, LENGTHS = "tails", "lengths"
"""Names of the bytes behind whole words, and of the lengths of all spans in words."""


def written(
    memento: Memento, around: Memento | None = None
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return a memento as a tree of JSON, and arrays by their names.

    The tree has the `root` and `nodes`, to which `{"@": number}` refers: objects, lists, tuples,
    arrays and structs. What is kept is named alone.

    Args:
        memento: What is written.
        around: A larger tree without structs, of the same time, of which that one is a part: it is
            written with it.
    """
    writer = _Writer(memento, around)
    root = writer.value(memento.root if around is None else around.root)
    arrays = writer.arrays | {
        f"{PACKED}{name}": array
        for name, array in zip(memento.packed._fields, memento.packed, strict=True)
    }
    arrays[TAILS] = np.concatenate([np.zeros(0, np.uint8), *memento.tails])
    arrays[LENGTHS] = memento.memory.spans[:, 1].copy()
    return {"root": root, "nodes": writer.nodes}, arrays


class _Writer:
    """Writes the nodes of a memento, each once."""

    def __init__(self, memento: Memento, around: Memento | None) -> None:
        self.nodes: list[dict[str, Any]] = []
        self.arrays: dict[str, np.ndarray] = {}
        self._numbers: dict[int, int] = {}
        self._alive: list[Any] = []  # so that no other object gets the same id
        both = [memento] if around is None else [memento, around]
        self._omitted = [name for each in both for name in _omitted(each.rules)]
        self._objects = {id(owner): then for each in both for owner, then in each.objects}
        self._lists = {id(owner): then for each in both for owner, then in each.lists}
        self._dicts = {id(owner): then for each in both for owner, then in each.dicts}
        self._copies = {id(owner): then for each in both for owner, then in each.arrays}
        self._structs = {id(struct): i for i, struct in enumerate(memento.structs)}

    def value(self, value: Any) -> Any:
        """Return what stands for an object where it is referred to."""
        if value is None or isinstance(value, (bool, str)):
            return value
        if isinstance(value, np.generic):
            return {"number": value.item(), "dtype": value.dtype.str}
        if isinstance(value, int):
            return value
        if isinstance(value, float):
            return value if math.isfinite(value) else {"float": repr(value)}
        if id(value) not in self._numbers:
            self._numbers[id(value)] = number = len(self.nodes)
            self._alive.append(value)
            self.nodes.append({})
            self.nodes[number] = self._node(value)
        return {"@": self._numbers[id(value)]}

    def _node(self, value: Any) -> dict[str, Any]:
        """Return the node of an object."""
        key, name = id(value), type(value).__name__
        if key in self._objects:
            omitted = attributes_in(self._omitted, type(value))
            then = {each: x for each, x in self._objects[key].items() if each not in omitted}
            return {
                "object": name,
                "attributes": {each: self.value(item) for each, item in then.items()},
            }
        if key in self._structs:
            fields = {each: self._field(value, each) for each in type(value).__annotations__}
            return {"struct": name, "index": self._structs[key], "fields": fields}
        if key in self._lists:
            return {"list": [self.value(item) for item in self._lists[key]]}
        if key in self._dicts:
            entries = self._dicts[key].items()
            return {"dict": [[self.value(each), self.value(item)] for each, item in entries]}
        if isinstance(value, np.ndarray):
            array = f"array_{len(self.arrays)}"
            self.arrays[array] = self._copies.get(key, value)
            return {"array": array}
        if isinstance(value, Vectors):
            numbers = [number for each in value._names for number in getattr(value, each)]
            return {"vectors": name, "numbers": [self.value(number) for number in numbers]}
        if isinstance(value, tuple):
            return {
                "tuple": name_of_tuple(type(value)),
                "items": [self.value(item) for item in value],
            }
        return {"kept": name}

    def _field(self, struct: Arrays, name: str) -> Any:
        """Return a field of a struct; what is in its cells and arrays is in the packed memory."""
        value = getattr(struct, name)
        if name in type(struct)._cells:
            return {"cell": type(value).__name__}
        if name in nested_structs(type(struct)):
            return self.value(value)
        if isinstance(value, np.ndarray):
            return {"dtype": value.dtype.str, "shape": list(value.shape)} | _within(struct, value)
        return self.value(value)


def name_of_tuple(kind: type) -> str:
    """Return the name of a class of tuples with its module: some classes share the name alone."""
    plain = plain_class(kind)
    return f"{plain.__module__}.{plain.__name__}"


def _omitted(rules: StateRules) -> Iterable[str]:
    """Return the attributes that are not in the plain form."""
    return (*rules.derived, *rules.unwritten)


def _within(struct: Arrays, part: np.ndarray) -> dict[str, Any]:
    """Return which other array of its struct an array is a part of, and from which byte on."""
    for name in type(struct).__annotations__:
        whole = getattr(struct, name)
        if isinstance(whole, np.ndarray) and whole.nbytes > part.nbytes > 0:
            begin = part.ctypes.data - whole.ctypes.data
            if 0 <= begin <= whole.nbytes - part.nbytes:
                return {"within": name, "from": begin}
    return {}
