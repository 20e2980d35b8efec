"""The shape of a fibre that goes around the edge, and the force at which that goes into it."""

import math
from typing import Final, NamedTuple

from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, norm, scale, sub
from tissue.forces.attachments import Attachments

_THIN: Final = 0.1
"""Radius of a strand over that of the tie. Larger: the account of energy lacks work of the blade
where a tie is short; smaller: steps become short where the edge comes near an end."""


class BentFibre(NamedTuple):
    """A fibre that goes around a bend."""

    to_point: Vec3
    """Unit vector from the bend to the point of the tissue."""
    to_end: Vec3
    """Unit vector from the bend to the other end."""
    length: float
    """Length of the fibre [m]."""


@kernel
def _radius(attachments: Attachments, p: int) -> float:
    """Return the radius of fibre `p` [m]."""
    return math.sqrt(attachments.section[p] / math.pi)


@kernel
def end_zone(attachments: Attachments, p: int) -> float:
    """Return how near to an end fibre `p` has no direction [m]: its radius.

    A tie between two bodies is many thin strands beside each other, often shorter than the whole is
    thick.
    """
    share = _THIN if attachments.is_tie[p] == 1 else 1.0
    return share * _radius(attachments, p)


@kernel
def cutting_resistance(fibres: Attachments, p: int) -> float:
    """Return the force at which the edge goes into fibre `p` [N]."""
    force: float = fibres.toughness[p] * fibres.section[p] / (2.0 * _radius(fibres, p))
    return force


@kernel
def bent_fibre(attachments: Attachments, p: int, x: Vec3, bend: Vec3, end: Vec3) -> BentFibre:
    """Return fibre `p` from `x` around a bend to its other end [m].

    Nearer to an end than `end_zone` a fibre has no direction: there the vectors are shorter.

    Args:
        attachments: All of them.
        p: The fibre.
        x: Its point of the tissue [m].
        bend: Where it goes around the edge [m].
        end: Its other end [m].
    """
    radius = end_zone(attachments, p)
    a, b = sub(x, bend), sub(end, bend)
    la, lb = norm(a), norm(b)
    return BentFibre(scale(1.0 / max(la, radius), a), scale(1.0 / max(lb, radius), b), la + lb)
