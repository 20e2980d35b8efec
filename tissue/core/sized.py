"""Shapes of the arrays of structs, declared where the fields are.

class Springs(Arrays):
    first: IntArray = sized("nodes")
    stiffness: FloatArray = sized("pool")

springs = Springs.new({"nodes": 8, "pool": 64})
springs = springs.grown({"pool": 128})
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from tissue.core.simd import aligned, room_for_points

Extent = int | str | tuple[int, str]
"""Extent of an axis: a number, the name of a size, or a multiple of a size, as in (4, "nodes")."""


class Sized(NamedTuple):
    """The shape of an array, and what it holds at first."""

    shape: tuple[Extent, ...]
    fill: float
    is_for_vectors: bool

    @property
    def grows_with(self) -> str:
        """Name of the size of its first axis, empty where that is a number."""
        first = self.shape[0]
        if isinstance(first, int):
            return ""
        return first if isinstance(first, str) else first[1]

    def array(self, sizes: Mapping[str, int], dtype: Any) -> np.ndarray:
        """Return the array that holds nothing yet."""
        shape = tuple(_number(extent, sizes) for extent in self.shape)
        if self.is_for_vectors:
            made = aligned(math.prod(shape), dtype).reshape(shape)
        elif shape[1:] == (3,) and dtype == np.float64:
            made = room_for_points(shape[0])
        else:
            made = np.zeros(shape, dtype)
        if self.fill:
            made[...] = self.fill
        return made


def _number(extent: Extent, sizes: Mapping[str, int]) -> int:
    """Return the extent of an axis under these sizes."""
    if isinstance(extent, int):
        return extent
    factor, name = (1, extent) if isinstance(extent, str) else extent
    return factor * sizes[name]


def sized(*shape: Extent, fill: float = 0, is_for_vectors: bool = False) -> Any:
    """Declare the shape of an array of a struct, for `Arrays.new` and `Arrays.grown`.

    Args:
        shape: Extent of each axis.
        fill: What new elements hold.
        is_for_vectors: Whether it begins with a cache line (`tissue.core.simd.aligned`), and holds
            floats in the precision that `Arrays.new` is given.
    """
    return Sized(shape, fill, is_for_vectors)
