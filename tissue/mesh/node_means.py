"""Friction and drag of the nodes of a body of several: means over the tetrahedra around them.

A contact is between nodes, or points between them. Each side of it has the mean of its nodes, by
their weights, and the two together have the smaller: what is wet makes both slip. That is the same
whichever side is named first. Where nothing but a floor or a geom touches, the tissue decides.

Drag is a force per mass and velocity. What a quarter of each tetrahedron gives its node adds up to
the mean by mass.
"""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.geometry.tetrahedron import tetrahedron_volume
from tissue.mesh.body import Body
from tissue.mesh.star import Visits, sorted_star

LEAST_DRAG = 1e-12
"""`Body.drag` at least, far below any that is felt: pieces without drag have a rigid part, too."""


@kernel
def write_node_means(body: Body, visits: Visits, nodes: IntArray, n: int, around: IntArray) -> None:
    """Write friction and drag of the first `n` of `nodes`, where materials differ in one of them.

    Args:
        body: Written.
        visits: For searches.
        nodes: The nodes.
        n: How many of them.
        around: Scratch, shape (LARGEST_STAR,).
    """
    materials = body.materials
    if materials.has_one_friction == 1 and materials.has_one_drag == 1:
        return
    highest = 0.0
    for rate in materials.viscous_damping:
        highest = max(highest, rate)
    for i in range(n):
        node, friction, volume, drag, mass = nodes[i], 0.0, 0.0, 0.0, 0.0
        for k in range(sorted_star(body, visits, node, around)):
            row = body.material[around[k]]
            share = tetrahedron_volume(body.rest, body.tetrahedra, around[k])
            volume += share
            friction += share * materials.friction[row]
            share *= materials.density[row]
            mass += share
            drag += share * materials.viscous_damping[row]
        body.friction[node] = friction / volume
        if materials.has_one_drag == 0:
            body.drag[node] = max(drag / (mass * highest), LEAST_DRAG)


@kernel
def friction_of_row(body: Body, nodes: IntArray, weights: FloatArray, c: int) -> float:
    """Return the coefficient of friction of contact `c`.

    Args:
        body: The body, whose materials differ in friction.
        nodes: Nodes of contacts, shape (n, 3) or (n, 4).
        weights: Weight of each node. Those of one side add up to 1, and those of the other, if it
            is tissue as well, to -1.
        c: The contact.
    """
    one, other, of_other = 0.0, 0.0, 0.0
    for q in range(nodes.shape[1]):
        weight, friction = weights[c, q], body.friction[nodes[c, q]]
        if weight >= 0.0:
            one += weight * friction
        else:
            other -= weight * friction
            of_other -= weight
    return min(one, other) if of_other > 0.0 else one
