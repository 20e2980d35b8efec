"""A body that touches the floor with one node."""

from tissue import block
from tissue.contact.constraints import Manifold, new_contacts
from tissue.contact.solver import add_contact
from tissue.core.vec3 import Vec3
from tissue.geometry.tetrahedron import Weights
from tissue.mesh.body import build_body

UP = Vec3(0.0, 0.0, 1.0)
STEP = 1e-3


def one_on_floor(velocity, depth=0.0, n_contacts=1, before=0.0, recovery=0.0):
    """Return a body with node 0 on the floor or in it, and the contact of that node.

    Args:
        velocity: Velocity of node 0 [m/s].
        depth: Depth of node 0 in the floor now [m].
        n_contacts: Capacity for contacts.
        before: Depth of node 0 in the floor at the start of the step [m].
        recovery: Speed at which an overlap is undone [m/s].
    """
    body = build_body(block((1, 1, 1)), None, None)
    body.masses[:] = 0.5
    start = body.positions.copy()
    start[0, 2] = -before
    body.positions[0, 2] = -depth
    body.velocities[0] = velocity
    contacts = new_contacts(len(body.rest), n_contacts, recovery)
    contacts.seconds = STEP
    add_contact(contacts, body, (0, 0, 0, 0), Manifold(Weights(1.0, 0.0, 0.0, 0.0), UP), 0.0, start)
    return body, contacts
