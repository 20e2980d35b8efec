"""`LazyResult`: a `StepResult` whose wrenches and arrays are made when they are asked for."""

from collections.abc import Callable, Iterator
from operator import attrgetter
from typing import Any, Self, cast

from tissue.blade.wrench import BladeReport
from tissue.types import StepResult


class _Lazy:
    """A field that is made from the report when it is asked for first, and kept."""

    def __init__(self, field: str, of_report: str) -> None:
        self._field = field
        self._made_of = attrgetter(of_report)

    def __get__(self, result: "LazyResult", owner: type) -> Any:
        value = result.__dict__[self._field] = self._made_of(result._report)
        return value


class LazyResult(StepResult):
    """A `StepResult` that differs from one only in when its first six fields are made.

    With all of their arrays made in each step, a frame took 15 us more in a body that fills the
    caches. Copies, also those of `_replace` and `pickle`, are plain results.
    """

    _report: BladeReport

    @classmethod
    def of(cls, report: BladeReport, *others: object) -> Self:
        """Return the result of a step: its report, and the fields of `StepResult` after these."""
        result = cast(Any, tuple.__new__)(cls, (*_NOT_MADE, *others))
        result._report = report
        return cast(Self, result)

    def __iter__(self) -> Iterator[Any]:
        """Return an iterator over all fields."""
        return iter([getattr(self, field) for field in self._fields])

    def __reduce__(self) -> tuple[type[StepResult], tuple[Any, ...]]:
        """Be copied and pickled as a plain result."""
        return StepResult, tuple(self)

    def __repr__(self) -> str:
        """Return what a plain result shows."""
        return repr(StepResult(*self))

    def _replace(self, **fields: Any) -> Any:
        """Return a plain result with these fields in place of its own."""
        return StepResult(*self)._replace(**fields)


_FIELDS = {
    "wrench": "mean_wrench",
    "wrench_t1": "wrench",
    "stiffness": "stiffness",
    "contacts": "contacts",
    "force_on_tissue": "mean_force_on_tissue",
    "bounds": "bounds",
}
"""The first fields of a result, and what they are in a report."""
_NOT_MADE = (None,) * len(_FIELDS)


def _plain(value: Any) -> Any:
    return StepResult(*value) if isinstance(value, LazyResult) else value


def _as_plain(name: str) -> Callable[..., Any]:
    """Return a method of a tuple that acts on plain results."""

    def method(*arguments: Any) -> Any:
        return getattr(tuple, name)(*map(_plain, arguments))

    return method


for _field, _of_report in _FIELDS.items():
    setattr(LazyResult, _field, _Lazy(_field, _of_report))
for _name in ("eq", "ne", "lt", "le", "gt", "ge", "add", "contains", "getitem", "hash"):
    setattr(LazyResult, f"__{_name}__", _as_plain(f"__{_name}__"))
for _name in ("count", "index"):
    setattr(LazyResult, _name, _as_plain(_name))
