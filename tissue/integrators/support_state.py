"""State of the supports, the nodes that are fixed or moved by a given velocity."""

from tissue.core.array_types import FloatArray
from tissue.core.simd import room_for_points
from tissue.core.structs import Arrays, FloatCell, IntCell


class Supports(Arrays):
    """Whether supports move, and the work that they did."""

    is_moving: IntCell
    """1 if a fixed node has a velocity, else 0."""
    work: FloatCell
    """Work that moving supports did on the tissue so far [J]."""
    force: FloatArray
    """Scratch: the force on one node [N], shape (1, 3)."""


def supports_at_rest() -> Supports:
    """Return supports that do not move."""
    return Supports(is_moving=0, work=0.0, force=room_for_points(1))
