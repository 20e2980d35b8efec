"""Parts of the force on the blade: on its edge, on its faces, and friction along them."""

from typing import NamedTuple

import numpy as np

from tissue import FloatArray, RigidContacts
from tissue.support import kernel

EDGE_COSINE = 0.9
"""Cosine of the angle between a contact's normal and the blade's forward direction above which the
contact is one of the edge. Contacts of the edge have 1; a bevel of 60 degrees, the steepest, has
0.87 at most."""


class ForceParts(NamedTuple):
    """Forces of the tissue on the blade, whose sum is the wrench's at the end of the step."""

    edge: FloatArray
    """Force on the edge: the resistance to cutting, and what the edge bends aside [N]; (3,)."""
    pressing: FloatArray
    """Normal force on the faces of the blade [N], shape (3,)."""
    friction: FloatArray
    """Friction along the faces of the blade [N], shape (3,)."""


def force_parts(contacts: RigidContacts, forward: FloatArray) -> ForceParts:
    """Return the parts of the force that these contacts add up to.

    Args:
        contacts: Contacts of the blade in one step.
        forward: Unit vector in which the blade cuts at the end of the step, in the frame of the
            contacts; shape (3,).
    """
    parts = np.empty(9)
    add_up(contacts.normal, contacts.normal_force, contacts.friction, forward, parts)
    return ForceParts(*parts.reshape(3, 3))


@kernel
def add_up(
    normal: FloatArray,
    normal_force: FloatArray,
    friction: FloatArray,
    forward: FloatArray | tuple[float, float, float],
    parts: FloatArray,
) -> None:
    """Write `ForceParts`, one vector after the other, contact by contact.

    Args:
        normal: See `RigidContacts`.
        normal_force: See `RigidContacts`.
        friction: See `RigidContacts`.
        forward: Unit vector in which the blade cuts.
        parts: The first nine numbers are written [N].
    """
    for i in range(9):
        parts[i] = 0.0
    for i in range(len(normal_force)):
        cosine = 0.0
        for axis in range(3):
            cosine += normal[i, axis] * forward[axis]
        for axis in range(3):
            pressing = normal_force[i] * normal[i, axis]
            if cosine > EDGE_COSINE:
                parts[axis] -= pressing + friction[i, axis]
            else:
                parts[3 + axis] -= pressing
                parts[6 + axis] -= friction[i, axis]
