"""Rows of the list of contacts: how one begins, is copied, or goes on with the force of another."""

from tissue.contact.penalty.contact_forces import HANDED_ON, PenaltyForces, weighted_sum
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, axpy, dot, store, sub, vec3
from tissue.mesh.body import Body

SAME_DIRECTION = 0.7
"""Cosine between normals above which contacts are one: 45 degrees. Larger: a node on a curved lip
has several that share its stiffness; smaller: it is not held in a corner."""


@kernel
def begin_contact(forces: PenaltyForces, c: int, height: float) -> None:
    """Let contact `c` begin without a force; `height`: that of the floor [m], else 0."""
    forces.height[c] = height
    forces.stiffness[c] = 0.0
    forces.offset[c] = 0.0
    forces.push[c] = 0.0
    store(forces.anchor, c, Vec3(0.0, 0.0, 0.0))
    store(forces.impulse, c, Vec3(0.0, 0.0, 0.0))


@kernel
def take_over(
    forces: PenaltyForces, body: Body, before: tuple[int, int], now: tuple[int, int]
) -> None:
    """Let the contacts of a node go on with the forces of those before, each by one heir at most.

    `before` and `now`: first contact, and how many.
    """
    for c in range(now[0], now[0] + now[1]):
        normal, heir, most = vec3(forces.normal, c), -1, SAME_DIRECTION
        for old in range(before[0], before[0] + before[1]):
            cosine = dot(vec3(forces.normal, old), normal)
            if cosine > most and forces.push[old] != HANDED_ON:
                heir, most = old, cosine
        if heir < 0:
            continue
        forces.push[c] = forces.push[heir]
        forces.stiffness[c] = forces.stiffness[heir]
        forces.offset[c] = forces.offset[heir]
        forces.push[heir] = HANDED_ON
        stretch = sub(_across(forces, body, heir), vec3(forces.anchor, heir))
        stretch = axpy(-dot(stretch, normal), normal, stretch)
        store(forces.anchor, c, sub(_across(forces, body, c), stretch))


@kernel
def _across(forces: PenaltyForces, body: Body, c: int) -> Vec3:
    """Return what separates the sides of contact `c` across its normal [m]."""
    d, normal = weighted_sum(forces, c, body.positions), vec3(forces.normal, c)
    return axpy(-dot(d, normal), normal, d)


@kernel
def copy_contact(forces: PenaltyForces, c: int, to: int) -> None:
    """Copy a contact to another row."""
    for q in range(4):
        forces.node[to, q] = forces.node[c, q]
        forces.weight[to, q] = forces.weight[c, q]
    store(forces.normal, to, vec3(forces.normal, c))
    store(forces.anchor, to, vec3(forces.anchor, c))
    store(forces.impulse, to, Vec3(0.0, 0.0, 0.0))
    forces.height[to] = forces.height[c]
    forces.stiffness[to] = forces.stiffness[c]
    forces.offset[to] = forces.offset[c]
    forces.push[to] = forces.push[c]
