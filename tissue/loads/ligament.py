"""Ligaments: fibres between tissue and the world, which the blade can cut."""

import math

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import FloatArray
from tissue.core.limits import LARGEST_COORDINATE
from tissue.loads.attachment import Attachment, checked_amount, expect_strength
from tissue.loads.material_points import MaterialPoints


class Ligament(Attachment):
    """Fibres from points of a tissue to other places: each pulls where it is taut.

    The edge of the blade bends the fibres that it sweeps across, and cuts them
    (`tissue.forces.fibres`). The other ends are fixed to a frame: the world, until `move`.

    Args:
        points: The points of the tissue, each with its share of stiffness and cross-section.
        others: Where the fibres end [m], shape (n, 3).
        lengths: Length up to which each is slack [m], shape (n,).
        stiffness: Of all fibres together, along them [N/m].
        area: Cross-section of all fibres together [m2].
        toughness: Energy of cutting them [J/m2].
        damping: Of all of them together, along them [N s/m].
        breaks_at: Force of all of them at which they release the tissue [N].

    Raises:
        ValueError: a number is not finite, has the wrong sign, or is beyond `tissue.core.limits`.
    """

    def __init__(
        self,
        points: MaterialPoints,
        others: FloatArray,
        lengths: FloatArray,
        stiffness: float,
        area: float,
        toughness: float,
        damping: float = 0.0,
        breaks_at: float = math.inf,
    ) -> None:
        if not 0.0 < area <= LARGEST_COORDINATE:
            raise ValueError(
                f"area is {area} m2; it must be positive and at most {LARGEST_COORDINATE:g}"
            )
        expect_strength("toughness", toughness, "J/m2")
        super().__init__(points, others, stiffness=stiffness, damping=damping, breaks_at=breaks_at)
        self.lengths = lengths
        self.sections = area * points.shares
        self.toughness = float(toughness)


def ends_of_fibres(
    positions: FloatArray, to: npt.ArrayLike, rest_length: float | None
) -> tuple[FloatArray, FloatArray]:
    """Return where fibres end [m], shape (n, 3), and up to which length each is slack [m], (n,).

    Args:
        positions: Where they begin [m], shape (n, 3).
        to: Where they end [m], shape (n, 3), or (3,) for one place.
        rest_length: Length up to which each is slack [m]; None: the distance of its ends.

    Raises:
        ValueError: `to` has another shape or is not finite, or the length is negative.
    """
    others = np.array(to, dtype=np.float64)
    is_near = (np.abs(others) <= LARGEST_COORDINATE).all()  # false for NaN
    if others.shape not in ((3,), positions.shape) or not is_near:
        raise ValueError(
            f"to is {to!r}; it is one place in m, or one for each of the {len(positions)} points, "
            f"all finite and at most {LARGEST_COORDINATE:g}"
        )
    others = others + np.zeros_like(positions)
    if rest_length is None:
        return others, np.linalg.norm(others - positions, axis=1)
    return others, np.full(
        len(positions), checked_amount("rest_length", rest_length, LARGEST_COORDINATE)
    )
