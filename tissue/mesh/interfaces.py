"""Layers between the parts of a body: each has a toughness of its own, and no thickness."""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays

NO_LAYER = -1
"""In place of a row of `Interfaces`: the two are bonded perfectly, or are one part."""


class Interfaces(Arrays):
    """Pairs of labels with a layer where they share faces. All others are bonded perfectly."""

    label: IntArray = sized("layers", 2)
    """The two labels, the lower one first, shape (n_layers, 2)."""
    toughness: FloatArray = sized("layers")
    """Energy per area of a slow cut by a sharp edge along the layer [J/m2], shape (n_layers,)."""


def no_interfaces() -> Interfaces:
    """Return no layer."""
    return Interfaces.new({"layers": 0})


@kernel
def layer_between(interfaces: Interfaces, first: int, second: int) -> int:
    """Return the row of the layer between two labels, or NO_LAYER."""
    low, high = min(first, second), max(first, second)
    for row in range(len(interfaces.toughness)):
        if interfaces.label[row, 0] == low and interfaces.label[row, 1] == high:
            return row
    return NO_LAYER


@kernel
def is_beside(interfaces: Interfaces, row: int, label: int) -> bool:
    """Return whether a layer is one of those of a label; NO_LAYER is none."""
    is_one: bool = row != NO_LAYER and (
        interfaces.label[row, 0] == label or interfaces.label[row, 1] == label
    )
    return is_one
