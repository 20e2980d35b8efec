"""`Memento`: what a tree of objects was at one time, to which it can be put back.

The tree is walked. Its owners are objects of our own classes, lists, dictionaries, arrays and
structs of arrays. Of each is noted what it refers to, and of arrays what is in them. To put the
tree back, the same owners get the same objects again, and arrays what was in them: so what was
shared is shared again, and where arrays have grown since, those of then are taken again.

Numbers, texts, tuples and vectors do not change: a reference is enough.
"""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.attributes import attributes_of, set_attributes
from tissue.core.lazy_fields import keeps_views
from tissue.core.memory_blocks import (
    PackedMemory,
    StructMemory,
    StructPart,
    StructRules,
    memory_of,
    packed,
    parts_of,
    unpacked,
)
from tissue.core.structs import Arrays, Vectors


class StateRules(NamedTuple):
    """Attributes in a tree of objects that are no state. Attributes are named `Class.attribute`."""

    packages: frozenset[str]
    """Packages whose classes are walked. Objects of others are kept as they are."""
    kept: frozenset[str] = frozenset()
    """Names of classes whose objects never change, or are no state."""
    derived: Mapping[str, Callable[[], Any]] = MappingProxyType({})
    """Attributes that are made again from others, and calls that return what they are until then.
    An object that is put back does not get the old one: kernels may have changed it since."""
    own: frozenset[str] = frozenset()
    """Attributes that are no state: an object keeps its own."""
    unwritten: frozenset[str] = frozenset()
    """Attributes that are not in the plain form: an object that is put to it keeps its own."""
    structs: StructRules = StructRules()
    """Parts of the memory of structs that are state."""
    made: Mapping[str, type] = MappingProxyType({})
    """Classes of objects that are made where a state from elsewhere has more of them, by name."""

    def with_others(self, others: "StateRules") -> "StateRules":
        """Return rules for a tree of which other rules hold for a part."""
        return StateRules(
            self.packages | others.packages,
            self.kept | others.kept,
            {**self.derived, **others.derived},
            self.own | others.own,
            self.unwritten | others.unwritten,
            self.structs if others.structs == StructRules() else others.structs,
            {**self.made, **others.made},
        )


class Spares:
    """Memory that mementos of one tree share: the table of its memory, and room for what is in it.

    Memory that is new costs three times as much as the copy: the system clears each page.
    """

    def __init__(self) -> None:
        self._structs: list[Arrays] = []
        self._parts: list[list[StructPart]] = []
        self._memory: StructMemory | None = None
        self._room = np.empty(0, np.int64)

    def memory(self, structs: list[Arrays], rules: StructRules) -> StructMemory:
        """Return the memory of structs, which mostly are those of the last call."""
        ids, known = [*map(id, structs)], [*map(id, self._structs)]
        if self._memory is None or ids != known:
            # Of 70 structs a cut replaces one or two: a test of the arrays of all takes 1 ms.
            parts = dict(zip(known, self._parts, strict=True))
            self._parts = [
                parts[i] if i in parts else parts_of(struct, rules)
                for i, struct in zip(ids, structs, strict=True)
            ]
            self._structs, self._memory = structs, memory_of(structs, rules, self._parts)
        return self._memory

    def room(self) -> IntArray:
        """Return the room that was kept, once."""
        room, self._room = self._room, np.empty(0, np.int64)
        return room

    def keep(self, memory: PackedMemory) -> None:
        """Keep the room of a memento that is gone."""
        room = memory.words if memory.words.base is None else memory.words.base
        if isinstance(room, np.ndarray) and len(room) > len(self._room):
            self._room = room


_ATOMS = (int, float, bool, str, bytes, type(None), complex)
_LEAF, _OBJECT, _STRUCT, _ARRAY, _TUPLE, _LIST, _DICT = range(7)


class Memento:
    """A tree of objects as it is now.

    Args:
        root: Its root.
        rules: What is no state.
        spares: What is used again from memento to memento of the same tree.
    """

    def __init__(self, root: Any, rules: StateRules, spares: "Spares | None" = None) -> None:
        self.root = root
        self.rules = rules
        self._spares = Spares() if spares is None else spares
        self.objects: list[tuple[Any, dict[str, Any]]] = []
        """Objects, and what their attributes were, but for those that are derived."""
        self.lists: list[tuple[list[Any], list[Any]]] = []
        """Lists, and what was in them."""
        self.dicts: list[tuple[dict[Any, Any], dict[Any, Any]]] = []
        """Dictionaries, and what was in them."""
        self.arrays: list[tuple[np.ndarray, np.ndarray]] = []
        """Arrays outside of structs, and copies."""
        self.structs: list[Arrays] = []
        """Structs, those inside others too."""
        self._kinds = _kinds_under(rules)
        self._seen: set[int] = set()
        self._walk(root)
        self.memory = self._spares.memory(self.structs, rules.structs)
        """Where their memory is."""
        self.packed = packed(self.memory.spans, self._spares.room())
        """Contents of the tree."""
        self.tails = [tail.copy() for tail in self.memory.tails]
        """The bytes behind whole words."""
        del self._kinds, self._seen

    def __del__(self) -> None:
        """Leave the room to the next one."""
        if hasattr(self, "packed"):
            self._spares.keep(self.packed)

    def _walk(self, value: Any) -> None:
        """Add an object, and those that it refers to."""
        kind = self._kinds[type(value)]
        order = kind.order
        if order == _LEAF or id(value) in self._seen:
            return
        self._seen.add(id(value))
        if order == _TUPLE:
            # What a tuple makes of memory that changes is made now, and what is in it is kept.
            for item in value if keeps_views(value) else tuple.__iter__(value):
                self._walk(item)
        elif order == _STRUCT:
            self.structs.append(value)
            for name in nested_structs(type(value)):
                self._walk(getattr(value, name))
        elif order == _ARRAY:
            if value.flags.writeable:
                self.arrays.append((value, value.copy()))
        elif order == _OBJECT:
            attributes = attributes_of(value)
            for name in (*kind.own, *kind.derived):
                attributes.pop(name, None)
            self.objects.append((value, attributes))
            for part in attributes.values():
                self._walk(part)
        elif order == _LIST:
            self.lists.append((value, list(value)))
            for item in value:
                self._walk(item)
        else:
            self.dicts.append((value, dict(value)))
            for item in value.values():
                self._walk(item)

    def restore(self) -> None:
        """Put the tree back to what it was."""
        kinds = _kinds_under(self.rules)
        for owner, attributes in self.objects:
            # What was derived then may have gone on since: it is made again.
            kind = kinds[type(owner)]
            derived = {name: make() for name, make in kind.derived.items()}
            set_attributes(owner, attributes | derived, kind.own)
        for each, items in self.lists:
            each[:] = items
        for table, entries in self.dicts:
            table.clear()
            table.update(entries)
        for array, copy in self.arrays:
            array[...] = copy
        unpacked(self.memory.spans, self.packed)
        for tail, tail_copy in zip(self.memory.tails, self.tails, strict=True):
            tail[:] = tail_copy


def nested_structs(kind: type[Arrays]) -> tuple[str, ...]:
    """Return the fields of a class of structs that are structs themselves."""
    found = _NESTED.get(kind)
    if found is None:
        annotations = kind.__annotations__.items()
        found = tuple(
            name
            for name, of in annotations
            if isinstance(of, type) and issubclass(of, Arrays) and not issubclass(of, Vectors)
        )
        _NESTED[kind] = found
    return found


_NESTED: dict[type, tuple[str, ...]] = {}


def attributes_in(names: Iterable[str], kind: type) -> frozenset[str]:
    """Return the attributes of a class, or of one that it inherits from, that are named."""
    bases = {base.__name__ for base in kind.__mro__}
    split = [name.split(".") for name in names]
    return frozenset(attribute for base, attribute in split if base in bases)


def derived_in(rules: StateRules, kind: type) -> dict[str, Callable[[], Any]]:
    """Return the attributes of a class that are made again, and what makes their defaults."""
    bases = {base.__name__ for base in kind.__mro__}
    split = [(name.split("."), make) for name, make in rules.derived.items()]
    return {attribute: make for (base, attribute), make in split if base in bases}


class _Kind(NamedTuple):
    """Way in which objects of a class are walked under some rules."""

    order: int
    """Kind of the objects: `_LEAF`, `_OBJECT` and so on."""
    own: frozenset[str] = frozenset()
    """Attributes that are no state."""
    derived: Mapping[str, Callable[[], Any]] = MappingProxyType({})
    """Attributes that are made again, and what makes their defaults."""


class _Kinds(dict[type, _Kind]):
    """Ways in which objects of each class are walked under some rules."""

    def __init__(self, rules: StateRules) -> None:
        super().__init__({kind: _Kind(_LEAF) for kind in _ATOMS})
        self._rules = rules

    def __missing__(self, kind: type) -> _Kind:
        """Find it out for a class that was not met before."""
        order, rules = self._order_of(kind), self._rules
        own, derived = attributes_in(rules.own, kind), derived_in(rules, kind)
        found = self[kind] = _Kind(order, own, derived) if order == _OBJECT else _Kind(order)
        return found

    def _order_of(self, kind: type) -> int:
        if kind.__name__ in self._rules.kept or issubclass(kind, (Vectors, type)):
            return _LEAF
        for base, found in (
            (Arrays, _STRUCT),
            (np.ndarray, _ARRAY),
            (tuple, _TUPLE),
            (list, _LIST),
            (dict, _DICT),
        ):
            if issubclass(kind, base):
                return found
        is_ours = any(
            base.__module__.partition(".")[0] in self._rules.packages for base in kind.__mro__
        )
        return _OBJECT if is_ours and kind.__dictoffset__ else _LEAF


def _kinds_under(rules: StateRules) -> _Kinds:
    """Return how objects are walked under some rules, the same in each call."""
    found = _KINDS.get(id(rules))
    if found is None or found[0] is not rules:
        found = _KINDS[id(rules)] = (rules, _Kinds(rules))
    return found[1]


_KINDS: dict[int, tuple[StateRules, _Kinds]] = {}
