"""The edge of a blade, and a wrench: values of three vectors, which may be made of plain numbers.

SI units. The suffixes `_t0` and `_t1` mean the start and the end of a step.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numpy as np

from tissue.core.array_types import FloatArray
from tissue.core.lazy_fields import lazy_fields

_T = TypeVar("_T")

Nine = tuple[float, float, float, float, float, float, float, float, float]
"""The numbers of three vectors, one after the other."""


class BladeSegment(NamedTuple):
    """The cutting edge at one instant: the paper's thin line, and where it faces."""

    tip: FloatArray
    """Sharp end of the edge [m], shape (3,)."""
    heel: FloatArray
    """End of the edge nearest the handle [m], shape (3,)."""
    forward: FloatArray
    """Unit vector across the edge, in the plane of the blade, in which it cuts; shape (3,)."""

    @property
    def numbers(self) -> Nine:
        """Tip, heel and forward in plain numbers."""
        return _numbers_of(self)

    @staticmethod
    def of_numbers(numbers: Nine) -> "BladeSegment":
        """Return a segment of such numbers; its arrays are made on first use."""
        return _of_numbers(_LazySegment, numbers)


class BladeSweep(NamedTuple):
    """The cutting edge at the start and at the end of a step."""

    t0: BladeSegment
    """The edge at the start."""
    t1: BladeSegment
    """The edge at the end."""


class Wrench(NamedTuple):
    """A force and a torque, and the point they act at."""

    force: FloatArray
    """Force [N], shape (3,)."""
    torque: FloatArray
    """Torque about `point` [N m], shape (3,)."""
    point: FloatArray
    """Point at which they act [m], shape (3,)."""

    @property
    def numbers(self) -> Nine:
        """Force, torque and point in plain numbers."""
        return _numbers_of(self)

    def about(self, point: FloatArray) -> "Wrench":
        """Return the same wrench about another point [m]: its torque gains lever x force."""
        # Plain floats: np.cross and small-array arithmetic would cost 31 us here instead of 2.
        fx, fy, fz, tx, ty, tz, px, py, pz = self.numbers
        x, y, z = point.tolist()
        rx, ry, rz = px - x, py - y, pz - z
        tx += ry * fz - rz * fy
        ty += rz * fx - rx * fz
        tz += rx * fy - ry * fx
        return Wrench.of_numbers((fx, fy, fz, tx, ty, tz, x, y, z))

    @staticmethod
    def of_numbers(numbers: Nine) -> "Wrench":
        """Return a wrench of such numbers; its arrays are made on first use."""
        return _of_numbers(_LazyWrench, numbers)


def _vector(k: int) -> Callable[[Any], FloatArray]:
    """Return what makes field `k` of three vectors of numbers."""
    return lambda vectors: _arrays_of(vectors)[k]


class _Numbers:
    """The numbers of vectors of which arrays were made; before, each object has its own."""

    def __get__(self, vectors: Any, kind: type) -> Nine:
        return _numbers_of(vectors)


@lazy_fields(tip=_vector(0), heel=_vector(1), forward=_vector(2))
class _LazySegment(BladeSegment):
    numbers: Any = _Numbers()


@lazy_fields(force=_vector(0), torque=_vector(1), point=_vector(2))
class _LazyWrench(Wrench):
    numbers: Any = _Numbers()


_new: Any = tuple.__new__
_NONE_MADE = (None, None, None)


def _of_numbers(kind: type[_T], numbers: Nine) -> _T:
    three: _T = _new(kind, _NONE_MADE)
    three.__dict__["numbers"] = numbers
    return three


def _numbers_of(vectors: tuple[FloatArray, FloatArray, FloatArray]) -> Nine:
    u, v, w = vectors
    (a, b, c), (d, e, f), (g, h, i) = u.tolist(), v.tolist(), w.tolist()
    return a, b, c, d, e, f, g, h, i


def _arrays_of(vectors: Any) -> list[FloatArray]:
    """Make the arrays, and forget the numbers: whoever has an array may change it."""
    arrays = [*np.array(vectors.__dict__.pop("numbers")).reshape(3, 3)]
    vectors.__dict__.update(zip(vectors._fields, arrays, strict=True))
    return arrays
