"""What passed between blade and tissue, counted: impulse, torque and work."""

import numpy as np

from tissue.jit import inlined
from tissue.types import FloatArray
from tissue.vec3 import Vec3, cross, dot

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


@inlined
def push_node(
    external: FloatArray, totals: FloatArray, node: int, w: float, force: Vec3, seconds: float
) -> None:
    """Give a node its share `w` of a force of the blade [N] that acts for `seconds`."""
    external[node, 0] += w * force.x
    external[node, 1] += w * force.y
    external[node, 2] += w * force.z
    totals[TISSUE_IMPULSE] += seconds * w * force.x
    totals[TISSUE_IMPULSE + 1] += seconds * w * force.y
    totals[TISSUE_IMPULSE + 2] += seconds * w * force.z


@inlined
def push_blade(
    totals: FloatArray, at: Vec3, force: Vec3, travel: Vec3, share: float, seconds: float
) -> None:
    """Count the reaction to a force on the tissue.

    Args:
        totals: Written.
        at: Where it acts [m].
        force: On the tissue [N].
        travel: How far that point of the blade goes in the whole time step [m].
        share: Which share of the time step it acts for.
        seconds: How long that is [s].
    """
    totals[IMPULSE] -= seconds * force.x
    totals[IMPULSE + 1] -= seconds * force.y
    totals[IMPULSE + 2] -= seconds * force.z
    torque = cross(at, force)
    totals[IMPULSE_TORQUE] -= seconds * torque.x
    totals[IMPULSE_TORQUE + 1] -= seconds * torque.y
    totals[IMPULSE_TORQUE + 2] -= seconds * torque.z
    totals[WORK_OF_BLADE] += share * dot(force, travel)
