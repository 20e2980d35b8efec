"""A memento in plain form, a tree of JSON and arrays, written and read again by any process."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from tissue.core.lazy_fields import keeps_views, plain_class
from tissue.core.memento import Memento, StateRules, attributes_in, derived_in, nested_structs
from tissue.core.memory_blocks import PackedMemory, memory_of, unpacked
from tissue.core.structs import Arrays, Vectors

PACKED = "packed_"
"""Prefix of the names of the arrays of `PackedMemory`."""

TAILS, LENGTHS = "tails", "lengths"
"""Names of the bytes behind whole words, and of the lengths of all spans in words."""

_PADDING = 64
"""Alignment of arrays, and room behind them, in bytes: as much as any kernel reads beyond."""


class StateError(ValueError):
    """A state does not fit what it was to be loaded into, or is no state."""


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


def put_to(
    root: Any, tree: Mapping[str, Any], arrays: Mapping[str, Any], rules: StateRules
) -> None:
    """Put a tree of objects to what was written; where that does not fit, leave it as it is.

    The objects that are there are used where they are of the same class. Those with a number
    (`StateRules.made`) are found by it.

    Args:
        root: The root of the tree.
        tree: See `written`.
        arrays: The arrays of that tree.
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
        now: list[Any] = []
        if isinstance(live, tuple):
            # What a tuple has made of its own numbers belongs to it: a memento may hold that tuple.
            now = list(live if keeps_views(live) else tuple.__iter__(live))
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
