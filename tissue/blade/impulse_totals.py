"""What passed between blade and tissue, counted: impulse, torque and work."""

from typing import NamedTuple

import numpy as np

from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined
from tissue.core.vec3 import Vec3, cross, dot, scale, sub

IMPULSE, IMPULSE_TORQUE, TISSUE_IMPULSE = 0, 3, 6
"""Places in the totals: of the tissue on the blade [N s] and [N m s] about the origin, and on the
tissue; three each."""

WORK_OF_BLADE, WORK_OF_CUTTING, WORK_OF_BREAKING, RELEASED = 9, 10, 11, 12
"""[J]; [J]; what breaking the skin took beyond the area that was cut [J]; and the energy of what
the blade let go of, less that of what it took hold of [J]."""
WORK_OF_FRICTION = 13
"""What sliding along the faces of the blade took [J]."""
N_TOTALS = 14


def new_totals() -> FloatArray:
    """Return that nothing has passed yet."""
    return np.zeros(N_TOTALS)


class Tally(NamedTuple):
    """What passed between blade and tissue: sums that a loop keeps out of memory."""

    impulse: Vec3
    """Of the tissue on the blade [N s]."""
    torque: Vec3
    """The same about the origin [N m s]."""
    on_tissue: Vec3
    """Of the blade on the nodes [N s]."""
    work: float
    """Of the blade [J]."""


@inlined
def tally_of(totals: FloatArray) -> Tally:
    """What has passed so far."""
    return Tally(
        _three(totals, IMPULSE),
        _three(totals, IMPULSE_TORQUE),
        _three(totals, TISSUE_IMPULSE),
        totals[WORK_OF_BLADE],
    )


@inlined
def keep_tally(totals: FloatArray, tally: Tally) -> None:
    """Write what has passed by now."""
    for c in range(3):
        totals[IMPULSE + c] = tally.impulse[c]
        totals[IMPULSE_TORQUE + c] = tally.torque[c]
        totals[TISSUE_IMPULSE + c] = tally.on_tissue[c]
    totals[WORK_OF_BLADE] = tally.work


@inlined
def _three(totals: FloatArray, first: int) -> Vec3:
    return Vec3(totals[first], totals[first + 1], totals[first + 2])


@inlined
def push_node(
    external: FloatArray, tally: Tally, node: int, w: float, force: Vec3, seconds: float
) -> Tally:
    """Give a node its share `w` of a force of the blade [N] that acts for `seconds`; count it."""
    external[node, 0] += w * force.x
    external[node, 1] += w * force.y
    external[node, 2] += w * force.z
    before = tally.on_tissue
    on_tissue = Vec3(
        before.x + seconds * w * force.x,
        before.y + seconds * w * force.y,
        before.z + seconds * w * force.z,
    )
    return Tally(tally.impulse, tally.torque, on_tissue, tally.work)


@inlined
def push_blade(
    tally: Tally, at: Vec3, force: Vec3, travel: Vec3, share: float, seconds: float
) -> Tally:
    """Count the reaction to a force on the tissue.

    Args:
        tally: What has passed so far.
        at: Where it acts [m].
        force: On the tissue [N].
        travel: How far that point of the blade goes in the whole time step [m].
        share: Which share of the time step it acts for.
        seconds: How long that is [s].
    """
    return Tally(
        sub(tally.impulse, scale(seconds, force)),
        sub(tally.torque, scale(seconds, cross(at, force))),
        tally.on_tissue,
        tally.work + share * dot(force, travel),
    )
