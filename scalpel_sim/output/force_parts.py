"""What the force on the blade is made of: its edge, its faces, and what rubs on them."""

from typing import NamedTuple

import numpy as np

from tissue import BladeContacts, FloatArray

EDGE_COSINE = 0.9
"""Of the angle between a contact's normal and the blade's forward direction, above which it is one
of the edge. Contacts of the edge have 1; a bevel of 60 degrees, the steepest, has 0.87 at most."""


class ForceParts(NamedTuple):
    """Forces of the tissue on the blade, whose sum is the wrench's at the end of the step."""

    edge: FloatArray
    """What holds the edge: the resistance to cutting, and what it must bend aside [N]; (3,)."""
    pressing: FloatArray
    """Of the tissue's faces on those of the blade, along their normals [N], shape (3,)."""
    friction: FloatArray
    """Along the blade's faces [N], shape (3,)."""


def force_parts(contacts: BladeContacts, forward: FloatArray) -> ForceParts:
    """Return the parts of the force that these contacts add up to.

    Args:
        contacts: Of one step.
        forward: Unit vector in which the blade cuts at its end, in their frame; shape (3,).
    """
    pressing = contacts.normal_force[:, None] * contacts.normal
    is_edge = contacts.normal @ forward > EDGE_COSINE
    is_face = ~is_edge
    edge = (pressing + contacts.friction)[is_edge]
    total = np.add.reduce  # `sum`, which takes twice as long to get there
    return ForceParts(-total(edge), -total(pressing[is_face]), -total(contacts.friction[is_face]))
