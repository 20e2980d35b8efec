"""Named tuples some of whose fields are made on first use.

What a frame hands on are named tuples of small arrays, and most of these arrays nobody reads. To
make one takes 0.2 us, and 1 us where the body has filled the caches since the last one.
"""

from collections.abc import Callable
from typing import Any, NoReturn, TypeVar

_C = TypeVar("_C", bound=type)


class _LazyField:
    """A field that is made on first use, and kept."""

    def __init__(self, name: str, made_of: Callable[[Any], Any]) -> None:
        self._name = name
        self._made_of = made_of

    def __get__(self, owner: Any, kind: type) -> Any:
        made = owner.__dict__
        if self._name not in made:
            made[self._name] = self._made_of(owner)
        return made[self._name]

    def __set__(self, owner: Any, value: Any) -> NoReturn:
        raise AttributeError("can't set attribute")


def lazy_fields(**makers: Callable[[Any], Any]) -> Callable[[_C], _C]:
    """Return a decorator of a subclass of a named tuple: these fields are made by functions of it.

    In the tuple itself None stands for them. All that reads a tuple, and copies, also those of
    `_replace` and `pickle`, get a tuple of the named class with all of its fields. Where C reads a
    tuple itself, as in `"%s" % a_tuple`, None is seen.
    """

    def decorate(cls: _C) -> _C:
        plain: Any = cls.__mro__[1]
        for name, made_of in makers.items():
            setattr(cls, name, _LazyField(name, made_of))
        methods: dict[str, Any] = {
            "__iter__": lambda self: iter([getattr(self, name) for name in plain._fields]),
            "__reduce__": lambda self: (plain, tuple(self)),
            "__repr__": lambda self: repr(plain(*self)),
            "__radd__": _added_to,
            "_replace": lambda self, **fields: plain(*self)._replace(**fields),
        } | {name: _on_plain(name) for name in _OF_TUPLES}
        for name, method in methods.items():
            setattr(cls, name, method)
        return cls

    return decorate


def keeps_views(value: tuple[Any, ...]) -> bool:
    """Return whether fields of a tuple are views of memory that the next step changes."""
    return bool(getattr(value, "has_views", False))


def plain_class(kind: type) -> type:
    """Return the named tuple of which a class makes fields when they are read, or itself."""
    is_lazy = any(isinstance(each, _LazyField) for each in vars(kind).values())
    return kind.__mro__[1] if is_lazy else kind


_OF_TUPLES = (
    *(f"__{name}__" for name in ("eq", "ne", "lt", "le", "gt", "ge", "hash", "add", "mul", "rmul")),
    *("__getitem__", "__contains__", "count", "index"),
)
"""Methods of a tuple that read its fields."""


def _on_plain(name: str) -> Callable[..., Any]:
    """Return a method of a tuple that sees all fields of its arguments."""
    method = getattr(tuple, name)
    return lambda *arguments: method(*map(_plain, arguments))


def _added_to(after: Any, before: Any) -> Any:
    return before + tuple(after)


def _plain(value: Any) -> Any:
    return tuple(value) if isinstance(value, tuple) else value
