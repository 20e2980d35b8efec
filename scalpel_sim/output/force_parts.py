"""Parts of the force on the blade: on its edge, on its faces, and friction along them."""

from typing import NamedTuple

import numpy as np

from tissue import BladeContacts, FloatArray

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


def force_parts(contacts: BladeContacts, forward: FloatArray) -> ForceParts:
    """Return the parts of the force that these contacts add up to.

    Args:
        contacts: Contacts of one step.
        forward: Unit vector in which the blade cuts at the end of the step, in the frame of the
            contacts; shape (3,).
    """
    pressing = contacts.normal_force[:, None] * contacts.normal
    is_edge = contacts.normal @ forward > EDGE_COSINE
    is_face = ~is_edge
    edge = (pressing + contacts.friction)[is_edge]
    total = np.add.reduce  # half the time of `sum`
    return ForceParts(-total(edge), -total(pressing[is_face]), -total(contacts.friction[is_face]))
