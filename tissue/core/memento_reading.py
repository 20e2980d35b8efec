"""Puts a tree of objects to a memento in plain form, which another process may have written."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from tissue.core.lazy_fields import plain_class
from tissue.core.memento import StateRules, derived_in
from tissue.core.memento_writing import LENGTHS, PACKED, TAILS, name_of_tuple
from tissue.core.memory_blocks import PackedMemory, unpacked
from tissue.core.struct_memory import memory_of
from tissue.core.structs import Arrays

_PADDING = 64
"""Alignment of arrays, and room behind them, in bytes: as much as any kernel reads beyond."""


class StateError(ValueError):
    """A state does not fit what it was to be loaded into, or is no state."""


def put_to(
    root: Any, tree: Mapping[str, Any], arrays: Mapping[str, Any], rules: StateRules
) -> None:
    """Put a tree of objects to what was written; where that does not fit, leave it as it is.

    The objects that are there are used where they are of the same class. Those with a number
    (`StateRules.made`) are found by it.

    Args:
        root: The root of the tree.
        tree: See `written`.
        arrays: The arrays beside it.
        rules: Those by which it was written.

    Raises:
        StateError: it was written by another version, or is of a tree with other parts.
    """
    reader = _Reader(tree, arrays, rules)
    reader.value(tree["root"], root)
    memory = memory_of(reader.structs(), rules.structs)
    tails = np.split(arrays[TAILS], np.cumsum([tail.size for tail in memory.tails]))
    fits = np.array_equal(memory.spans[:, 1], arrays[LENGTHS]) and not tails[-1].size
    if not fits:
        raise _other_version("arrays have other lengths")
    packed = PackedMemory(*(arrays[f"{PACKED}{name}"] for name in PackedMemory._fields))
    for change in reader.changes:
        change()
    unpacked(memory.spans, packed, is_new=True)
    for tail, then in zip(memory.tails, tails, strict=False):
        tail[:] = then


class _Reader:
    """Finds or makes the objects of a tree, and notes how they change."""

    def __init__(
        self, tree: Mapping[str, Any], arrays: Mapping[str, Any], rules: StateRules
    ) -> None:
        self.changes: list[Callable[[], None]] = []
        """Calls that make the objects what was written."""
        self._nodes, self._arrays, self._rules = tree["nodes"], arrays, rules
        self._made: dict[int, Any] = {}
        self._taken: set[int] = set()
        self._structs: dict[int, Arrays] = {}
        self._struct_classes = {kind.__name__: kind for kind in _subclasses(Arrays)}
        self._tuple_classes = _tuple_classes(rules.packages)

    def structs(self) -> list[Arrays]:
        """Return the structs in the order in which their memory was packed."""
        return [self._structs[i] for i in range(len(self._structs))]

    def value(self, written: Any, live: Any, *, is_in_tuple: bool = False) -> Any:
        """Return an object; `live` is what is in its place now, as an item of a tuple or not."""
        if not isinstance(written, dict):
            return written
        if "float" in written:
            return float(written["float"])
        if "number" in written:
            return np.dtype(written["dtype"]).type(written["number"])
        number = written["@"]
        if number not in self._made:
            self._make(number, live, is_in_tuple)
        return self._made[number]

    def _make(self, number: int, live: Any, is_in_tuple: bool) -> None:
        """Find or make the object of a node."""
        node = self._nodes[number]
        kind = next(iter(node))
        if kind == "kept":
            if type(live).__name__ != node["kept"]:
                raise _other_version(f"there is no {node['kept']} here")
            self._made[number] = live
        elif kind == "array":
            self._make_array(number, self._arrays[node["array"]], live, is_in_tuple)
        elif kind == "vectors":
            numbers = tuple(self.value(each, None) for each in node["numbers"])
            self._made[number] = self._struct_class(node["vectors"]).of_numbers(numbers)
        else:
            getattr(self, f"_make_{kind}")(number, node, live)

    def _make_array(self, number: int, then: np.ndarray, live: Any, is_in_tuple: bool) -> None:
        """Take the array that is there, of which others may be views, or make one.

        What owns its memory in a tuple may be a constant of a module: there one is made.
        """
        found = then.copy()
        is_like = isinstance(live, np.ndarray) and (live.shape, live.dtype) == (
            then.shape,
            then.dtype,
        )
        is_ours = is_like and not (is_in_tuple and live.flags.owndata)
        if is_ours and live.flags.writeable and id(live) not in self._taken:
            found = live
            self._taken.add(id(live))
            self.changes.append(lambda: live.__setitem__(..., then))
        self._made[number] = found

    def _make_object(self, number: int, node: dict[str, Any], live: Any) -> None:
        name = node["object"]
        if type(live).__name__ == name and id(live) not in self._taken:
            found, now = live, vars(live)
        elif name in self._rules.made:
            found, now = object.__new__(self._rules.made[name]), {}
        else:
            raise _other_version(f"there is no {name} here")
        self._made[number] = found
        self._taken.add(id(found))
        attributes = {
            each: self.value(item, now.get(each)) for each, item in node["attributes"].items()
        }
        for each, make in derived_in(self._rules, type(found)).items():
            attributes[each] = make()
        self.changes.append(lambda: vars(found).update(attributes))

    def _make_list(self, number: int, node: dict[str, Any], live: Any) -> None:
        is_here = isinstance(live, list) and id(live) not in self._taken
        found: list[Any] = live if is_here else []
        self._made[number] = found
        self._taken.add(id(found))
        items = self._items(node["list"], list(found))
        self.changes.append(lambda: found.__setitem__(slice(None), items))

    def _make_dict(self, number: int, node: dict[str, Any], live: Any) -> None:
        is_here = isinstance(live, dict) and id(live) not in self._taken
        found: dict[Any, Any] = live if is_here else {}
        self._made[number] = found
        self._taken.add(id(found))
        entries = {}
        for key, item in node["dict"]:
            name = self.value(key, None)
            entries[name] = self.value(item, found.get(name))

        def change() -> None:
            found.clear()
            found.update(entries)

        self.changes.append(change)

    def _make_tuple(self, number: int, node: dict[str, Any], live: Any) -> None:
        name = node["tuple"]
        now = list(live) if isinstance(live, tuple) else []
        items = self._items(node["items"], now, are_in_tuple=True)
        if name == name_of_tuple(tuple):
            self._made[number] = tuple(items)
        elif name in self._tuple_classes:
            self._made[number] = tuple.__new__(self._tuple_classes[name], items)
        else:
            raise _other_version(f"there is no {name} here")

    def _make_struct(self, number: int, node: dict[str, Any], live: Any) -> None:
        kind = self._struct_class(node["struct"])
        if set(kind.__annotations__) != set(node["fields"]):
            raise _other_version(f"{node['struct']} has other fields")
        same = type(live) is kind and id(live) not in self._taken
        fields: dict[str, Any] = {}
        for name, written in node["fields"].items():
            now = getattr(live, name) if type(live) is kind else None
            if isinstance(written, dict) and "cell" in written:
                fields[name] = 0.0 if written["cell"] == "float" else 0
            elif isinstance(written, dict) and "shape" in written:
                shape, dtype = tuple(written["shape"]), np.dtype(written["dtype"])
                same = same and now is not None and (now.shape, now.dtype) == (shape, dtype)
                fields[name] = now
            else:
                fields[name] = self.value(written, now)
                same = same and (fields[name] is now or fields[name] == now)
        struct = live if same else kind(**(fields | _new_arrays(node["fields"])))
        self._taken.add(id(struct))
        self._made[number] = self._structs[node["index"]] = struct

    def _items(
        self, written: list[Any], live: list[Any], *, are_in_tuple: bool = False
    ) -> list[Any]:
        """Return the items of a list: those with a number are found by it, others by place."""
        numbers = {getattr(item, "number", None): item for item in live}
        found = []
        for i, item in enumerate(written):
            here = live[i] if i < len(live) else None
            number = self._number_of(item)
            now = here if number is None else numbers.get(number)
            found.append(self.value(item, now, is_in_tuple=are_in_tuple))
        return found

    def _number_of(self, written: Any) -> Any:
        """Return the number of an object in a list; None where it has none."""
        if not (isinstance(written, dict) and "@" in written):
            return None
        return self._nodes[written["@"]].get("attributes", {}).get("number")

    def _struct_class(self, name: str) -> Any:
        if name not in self._struct_classes:
            raise _other_version(f"there is no {name} here")
        return self._struct_classes[name]


def _new_arrays(fields: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Return arrays for the fields of a struct; those that were part of another are so again."""
    written = {
        name: each for name, each in fields.items() if isinstance(each, dict) and "shape" in each
    }
    made = {
        name: _room(tuple(each["shape"]), np.dtype(each["dtype"])) for name, each in written.items()
    }
    for name, each in written.items():
        if "within" in each:
            whole = made[each["within"]].reshape(-1).view(np.uint8)
            part = whole[each["from"] : each["from"] + made[name].nbytes]
            made[name] = part.view(made[name].dtype).reshape(made[name].shape)
    return made


def _room(shape: tuple[int, ...], dtype: np.dtype) -> np.ndarray:
    """Return zeros as any array of a struct may be laid out: aligned, with room behind."""
    n_bytes = int(np.prod(shape)) * dtype.itemsize
    memory: np.ndarray = np.zeros(n_bytes + 2 * _PADDING, np.uint8)
    skip = -memory.ctypes.data % _PADDING
    return memory[skip : skip + n_bytes].view(dtype).reshape(shape)


def _tuple_classes(packages: Iterable[str]) -> dict[str, type]:
    """Return the classes of tuples of some packages by their names."""
    ours = [kind for kind in _subclasses(tuple) if kind.__module__.partition(".")[0] in packages]
    return {name_of_tuple(kind): plain_class(kind) for kind in ours}


def _subclasses(kind: type) -> list[type]:
    """Return all classes under a class."""
    below: list[type] = kind.__subclasses__()
    return [found for each in below for found in (each, *_subclasses(each))]


def _other_version(why: str) -> StateError:
    return StateError(
        f"the state was saved by another version of the program, or with other parts ({why}): "
        "load it with the version that saved it"
    )
