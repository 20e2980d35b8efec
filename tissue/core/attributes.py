"""The attributes of an object, read and set without a dictionary of them.

An object keeps its attributes in places of its own until its `__dict__` is read. From then on,
in CPython 3.11 and 3.12, they are in a dictionary, and each is found there for as long as the
object lives: steps of a small body took 7 % longer once its state had been saved.
"""

import gc
import inspect
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from types import CodeType, FunctionType
from typing import Any

_NONE = object()
_Defaults = dict[str, Any]
"""Names that attributes may have, and what the class itself has by each, or `_NONE`."""
_ALL: dict[type, _Defaults] = {}
_USUAL: dict[type, _Defaults] = {}


def attributes_of(value: Any) -> dict[str, Any]:
    """Return the attributes of an object by their names.

    Names are those in the code of its class. What the object refers to shows whether these are all;
    if not, its dictionary is read.
    """
    kind = type(value)
    found = _attributes_among(_USUAL.get(kind, {}), value)
    if found is None:
        if kind not in _ALL:
            _ALL[kind] = _names_and_defaults(kind)
        found = _attributes_among(_ALL[kind], value)
        if found is None:
            return dict(vars(value))
        _USUAL[kind] = {name: _ALL[kind][name] for name in found}
    return found


def _attributes_among(defaults: _Defaults, value: Any) -> dict[str, Any] | None:
    """Return the attributes of an object, or None where it has others than these."""
    left = Counter(map(id, gc.get_referents(value)))
    left[id(type(value))] -= 1
    found, unclear = {}, []
    for name, default in defaults.items():
        attribute = getattr(value, name, _NONE)
        if attribute is default:
            unclear += [name] * (default is not _NONE)  # the class has it: does the object, too?
            continue
        found[name] = attribute
        left[id(attribute)] -= 1
    for name in unclear:
        if left[id(defaults[name])] > 0:
            found[name] = defaults[name]
            left[id(defaults[name])] -= 1
    return None if any(left.values()) else found


def set_attributes(owner: Any, attributes: dict[str, Any], own: frozenset[str]) -> None:
    """Set these attributes of an object and no others.

    Args:
        owner: The object.
        attributes: The attributes by their names.
        own: Names of those that stay as they are.
    """
    now = attributes_of(owner)
    for name in now.keys() - attributes.keys() - own:
        # Of two names with one default, which the object has once, it may be the other's.
        with suppress(AttributeError):
            object.__delattr__(owner, name)
    for name, attribute in attributes.items():
        if now.get(name, _NONE) is not attribute:
            object.__setattr__(owner, name, attribute)


def _names_and_defaults(kind: type) -> _Defaults:
    """Return the names that attributes of objects of a class may have, and defaults of the class.

    They are those in the code of its methods, but for what the class computes.
    """
    names: _Defaults = {}
    for base in kind.__mro__:
        for member in vars(base).values():
            for code in _codes_of(member):
                names.update(dict.fromkeys(code.co_names, _NONE))
        names.update(dict.fromkeys(inspect.get_annotations(base), _NONE))
    for name in names:
        names[name] = getattr(kind, name, _NONE)
    return {name: of for name, of in names.items() if not hasattr(of, "__get__")}


def _codes_of(member: Any) -> Iterator[CodeType]:
    """Yield the code of a member of a class, and that inside of it."""
    parts = [member]
    while parts:
        part = parts.pop()
        if isinstance(part, property):
            parts += [part.fget, part.fset, part.fdel]
        elif isinstance(part, (staticmethod, classmethod)):
            parts.append(part.__func__)
        elif isinstance(part, FunctionType):
            parts += [part.__code__, getattr(part, "__wrapped__", None)]
        elif isinstance(part, CodeType):
            yield part
            parts += part.co_consts
