"""Rows of the list of contacts: how one begins, is copied, or goes on with the force of another."""

from tissue.contact.penalty.contact_forces import HANDED_ON, PenaltyForces, weighted_sum
from tissue.core.jit import inlined, kernel
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
    """Let contacts of a node that have just begun go on with the forces of those before.

    Each takes over one force at most: that of its own face, else that of the nearest direction.

    Args:
        forces: Written.
        body: Where the nodes are.
        before: First contact of the node before, and how many.
        now: First contact of the node now, and how many.
    """
    for of_same_face in (True, False):
        for c in range(now[0], now[0] + now[1]):
            if forces.stiffness[c] > 0.0:
                continue
            normal, heir, most = vec3(forces.normal, c), -1, SAME_DIRECTION
            for old in range(before[0], before[0] + before[1]):
                cosine = dot(vec3(forces.normal, old), normal)
                may_take = forces.push[old] != HANDED_ON and (
                    not of_same_face or _are_of_same_nodes(forces, old, c)
                )
                if may_take and cosine > most:
                    heir, most = old, cosine
            if heir >= 0:
                _take_over_from(forces, body, heir, c)


@kernel
def _take_over_from(forces: PenaltyForces, body: Body, old: int, c: int) -> None:
    """Let contact `c` go on with the force of the contact `old`."""
    forces.push[c] = forces.push[old]
    forces.stiffness[c] = forces.stiffness[old]
    forces.offset[c] = forces.offset[old]
    forces.push[old] = HANDED_ON
    normal = vec3(forces.normal, c)
    stretch = sub(_across(forces, body, old), vec3(forces.anchor, old))
    stretch = axpy(-dot(stretch, normal), normal, stretch)
    store(forces.anchor, c, sub(_across(forces, body, c), stretch))


@inlined
def _are_of_same_nodes(forces: PenaltyForces, a: int, b: int) -> bool:
    """Whether two contacts have the same nodes."""
    node = forces.node
    return bool(
        node[a, 0] == node[b, 0]
        and node[a, 1] == node[b, 1]
        and node[a, 2] == node[b, 2]
        and node[a, 3] == node[b, 3]
    )


@kernel
def _across(forces: PenaltyForces, body: Body, c: int) -> Vec3:
    """Return what separates the sides of contact `c` across its normal [m]."""
    d, normal = weighted_sum(forces, c, body.positions), vec3(forces.normal, c)
    return axpy(-dot(d, normal), normal, d)


@kernel
def copy_contact(forces: PenaltyForces, c: int, to: int) -> None:
    """Copy a contact to a row of the next list, where it goes on."""
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
    forces.push[c] = HANDED_ON
