"""A bound on the angular frequencies of a solid at rest, at each node: it limits the time step.

Each energy is a square |sum of L_a u_a|^2 over the nodes a of a tetrahedron, or, where volumes are
averaged, over those of all tetrahedra around a node. For any positive numbers r_a

    |sum L_a u_a|^2 <= (sum r_a) (sum |L_a u_a|^2 / r_a)                     (Cauchy and Schwarz)

Added up over all energies that leaves a 3 x 3 matrix N_b at each node b, and the energy is at most
sum u_b . N_b u_b: no mode is faster than the largest w^2 = |N_b| / m_b. It is Irons' theorem for
point masses, with the mass of a node shared among the elements around it.

With r_a = |L_a| / sqrt(m_a) the bound is 10 to 45 % above the truth on meshes after cuts. The
bound of each tetrahedron by itself with a quarter of its own mass, 2 c_p sqrt(sum of 1 /
altitude^2), is up to 7 times above: a sliver has next to no mass, but it shares its nodes with
tetrahedra that have.

Better weights bring it near the truth where it is highest (`tighten`). It holds for any positive
weights x of the nodes, as the largest ratio (B x)_b / x_b does for a matrix B without negative
entries, whose own largest eigenvalue is the least such ratio (Collatz and Wielandt). The power
iteration x <- B x lowers the ratio in each round. Here only nodes near the worst take part, since
the others do not limit the time step. A fast mode is concentrated on one or two nodes, which get a
larger weight than by their mass. On an organ after cuts that lowers the bound from 1.28 to 1.06
times the highest frequency.

A fixed node does not move: it counts as infinitely heavy.
"""

import math
from typing import NamedTuple

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.vec3 import Vec3, add, axpy, dot, norm, scale, store, sub, vec3
from tissue.elasticity.finite_elements import (
    Solid,
    corner_of_slot,
    node_place,
    normals,
    rest_normals,
    tetrahedron_of_slot,
)
from tissue.geometry.tetrahedron import add_square, largest_eigenvalue, nothing_symmetric
from tissue.laws.kernels import stiffens
from tissue.mesh.body import Body
from tissue.mesh.star import Visits

STALE = 2.0
"""Factor by which the mass of a node may differ from that which its weight stands for. Any weight
gives a bound, and that of the mass now is near the best; but another weight changes the bound two
rings further. If weights never change, nodes that were split several times, or were given a larger
weight for a neighbour that is gone, make the bound twice too high."""


ROUNDS = 6
"""Rounds at most. In the organ the result is within 2 % of the least possible bound."""

NEAR_WORST = 0.64
"""Share of the highest bound on w^2 above which a node gets another weight. Nearer to 1 takes more
rounds, further from it more nodes."""

WORTH_IT = 0.98
"""Ratio of the highest bound on w^2 after and before a round above which the round is the last: in
a regular mesh all nodes are equal, and there is nothing to gain."""


@kernel
def bound_solid_frequencies(
    solid: Solid, body: Body, visits: Visits, nodes: IntArray, n: int
) -> int:
    """Write the bound on w^2 at `nodes`, and at others that depend on them; return at how many.

    These nodes are listed in `solid.listed`.

    Args:
        solid: Bounds and weights are written; the rows of `nodes` are up to date.
        body: Masses, which are up to date, and fixed nodes.
        visits: For searches.
        nodes: The nodes.
        n: How many of them.
    """
    listed, n_listed = solid.listed, 0
    for i in range(n):
        if _reweighted(solid, body, nodes[i]):
            listed[n_listed] = nodes[i]
            n_listed += 1
    n_listed = with_neighbours(solid, visits, listed, n_listed)
    n_listed = with_these(visits, listed, n_listed, nodes, n)
    return bound_around(solid, body, visits, listed, n_listed)


@kernel
def bound_around(solid: Solid, body: Body, visits: Visits, listed: IntArray, n: int) -> int:
    """Write the bound at the first `n` of `listed` and at their neighbours, which are appended.

    Args:
        solid: Bounds are written.
        body: Masses and fixed nodes.
        visits: For searches.
        listed: Nodes, the first `n` of which include all whose dilatation term has changed.
        n: How many of them.

    Returns:
        How many nodes are listed now.
    """
    if solid.law.lam_of_nodes != 0.0:
        for i in range(n):
            node = listed[i]
            solid.dilatation[node] = dilatation_term(solid, body, body.rest, visits, node)
    n = with_neighbours(solid, visits, listed, n)
    for i in range(n):
        bounds = bounds_of_node(solid, body, body.rest, solid.dilatation, visits, listed[i], False)
        solid.frequency_squared[listed[i]] = bounds.whole
        solid.shear_frequency_squared[listed[i]] = bounds.shear
    return n


@kernel
def _reweighted(solid: Solid, body: Body, node: int) -> bool:
    """Give a node another weight if its mass has changed much; return whether it did."""
    if body.fixed[node]:
        return False
    mass = body.masses[node]
    ratio = solid.weight[node] * solid.weight[node] * mass
    if 1.0 / STALE <= ratio <= STALE:
        return False
    solid.weight[node] = 1.0 / math.sqrt(mass)
    return True


@kernel
def with_these(visits: Visits, listed: IntArray, n_listed: int, nodes: IntArray, n: int) -> int:
    """Add nodes to a list unless they are in it; return its length.

    Args:
        visits: For marks.
        listed: The list.
        n_listed: Its length.
        nodes: Nodes to add.
        n: How many of them.
    """
    _mark_listed(visits, listed, n_listed)
    for i in range(n):
        n_listed = _list(visits, listed, n_listed, nodes[i])
    return n_listed


@kernel
def with_neighbours(solid: Solid, visits: Visits, listed: IntArray, n: int) -> int:
    """Add the neighbours of the `n` nodes of a list to it; return its new length."""
    _mark_listed(visits, listed, n)
    n_listed = n
    for i in range(n):
        node = listed[i]
        for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
            t = tetrahedron_of_slot(solid, slot)
            for k in range(4):
                n_listed = _list(visits, listed, n_listed, solid.nodes[node_place(solid, t, k)])
    return n_listed


@kernel
def _mark_listed(visits: Visits, listed: IntArray, n: int) -> None:
    visits.epoch += 1
    for i in range(n):
        visits.nodes[listed[i]] = visits.epoch


@kernel
def _list(visits: Visits, listed: IntArray, n: int, node: int) -> int:
    """Add a node to a list of length `n` unless it is marked; return its new length."""
    if visits.nodes[node] == visits.epoch:
        return n
    visits.nodes[node] = visits.epoch
    listed[n] = node
    return n + 1


@kernel
def dilatation_term(
    solid: Solid, body: Body, points: FloatArray, visits: Visits, node: int
) -> float:
    """Return the factor of the averaged volume of a node in the bounds of the nodes around it.

    The averaged volume V_a J changes by the sum of C_b . u_b, C_b = sum of V grad N_b / 4 over the
    tetrahedra around node a. Its energy is lam / (2 V_a) times the square of that.

    Args:
        solid: Weights and the row of the node.
        body: The body.
        points: Where the nodes are [m]; at rest for the bound at rest.
        visits: For searches.
        node: Node a.
    """
    visits.epoch += 1
    n = 0
    for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
        t = tetrahedron_of_slot(solid, slot)
        n1, n2, n3, _ = normals(body, points, t)
        n = _add_to_ring(solid, visits, n, t, 0, scale(-1.0, add(n1, add(n2, n3))))
        n = _add_to_ring(solid, visits, n, t, 1, n1)
        n = _add_to_ring(solid, visits, n, t, 2, n2)
        n = _add_to_ring(solid, visits, n, t, 3, n3)
    total = 0.0
    for i in range(n):
        total += solid.weight[solid.ring_nodes[i]] * norm(vec3(solid.ring, i))
    term: float = solid.law.lam_of_nodes / solid.node_volume[node] * total
    return term


@inlined
def _add_to_ring(solid: Solid, visits: Visits, n: int, t: int, k: int, normal: Vec3) -> int:
    """Add a share of V grad N / 4 to node `k` of a tetrahedron; return the nodes listed so far."""
    node = solid.nodes[node_place(solid, t, k)]
    if visits.nodes[node] != visits.epoch:
        visits.nodes[node] = visits.epoch
        visits.place[node] = n
        solid.ring_nodes[n] = node
        store(solid.ring, n, Vec3(0.0, 0.0, 0.0))
        n += 1
    at = visits.place[node]
    store(solid.ring, at, axpy(1.0 / 24.0, normal, vec3(solid.ring, at)))
    return n


class NodeBounds(NamedTuple):
    """Bounds on w^2 at a node [1/s2]."""

    whole: float
    """|N_b| / m_b."""
    shear: float
    """That of the part that grows under a law that stiffens."""


@kernel
def bounds_of_node(
    solid: Solid,
    body: Body,
    points: FloatArray,
    dilatation: FloatArray,
    visits: Visits,
    node: int,
    is_strained: bool,
) -> NodeBounds:
    """Return the bounds on w^2 at a node with its tetrahedra deformed.

    The shear part of the law is taken at rest; under a law that stiffens with the modulus
    `solid.stiffening` and its slope (`tissue.elasticity.frequency.quick`).

    Args:
        solid: Weights and the row of the node.
        body: Rest positions and masses.
        points: Where the nodes are [m]; at rest for the bound at rest.
        dilatation: `dilatation_term` at the same points, of all nodes around, shape (nodes,).
        visits: For searches.
        node: The node.
        is_strained: Whether `points` are not at rest.
    """
    weight = solid.weight[node]
    if weight == 0.0:
        return NodeBounds(0.0, 0.0)
    law = solid.law
    # The part of lam that is not averaged, at small strain. Where it is negative it is limited: the
    # bound still holds.
    mu = law.shear_modulus
    lam = max(law.lam_of_tetrahedra - law.excess, -2.0 / 3.0 * mu)
    averaged = law.lam_of_nodes != 0.0
    has_stiffened = is_strained and stiffens(law)
    isotropic, stiffness = 0.0, nothing_symmetric()
    visits.epoch += 1
    n = 0
    for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
        t, k = tetrahedron_of_slot(solid, slot), corner_of_slot(solid, slot)
        n1, n2, n3, volume = rest_normals(body, t)
        n0 = scale(-1.0, add(n1, add(n2, n3)))
        ratios = (
            solid.weight[solid.nodes[node_place(solid, t, 0)]] * norm(n0)
            + solid.weight[solid.nodes[node_place(solid, t, 1)]] * norm(n1)
            + solid.weight[solid.nodes[node_place(solid, t, 2)]] * norm(n2)
            + solid.weight[solid.nodes[node_place(solid, t, 3)]] * norm(n3)
        )
        at_rest = n0 if k == 0 else (n1 if k == 1 else (n2 if k == 2 else n3))
        normal = at_rest
        if is_strained:
            n1, n2, n3, _ = normals(body, points, t)
            normal = n1 if k == 1 else (n2 if k == 2 else n3)
            if k == 0:
                normal = scale(-1.0, add(n1, add(n2, n3)))
        length = norm(at_rest)
        share = ratios / (36.0 * volume * weight)  # of V grad N^2 = n^2 / (36 V)
        if has_stiffened:
            place = solid.around[slot]
            isotropic += float(solid.stiffening[place]) * mu * share * length
            slope = 2.0 * float(solid.stiffening_slope[place]) * mu * share / length
            along = sub(_stretched(body, points, t, at_rest), normal)
            stiffness = add_square(stiffness, slope, along)
        else:
            isotropic += mu * share * length
        c = (mu + lam) * share / length
        stiffness = add_square(stiffness, c, normal)
        if averaged:
            for other in range(4):
                n = _add_to_ring(solid, visits, n, t, other, normal)
    for i in range(n):
        normal = vec3(solid.ring, i)
        length = norm(normal)
        if length > 0.0:
            c = dilatation[solid.ring_nodes[i]] / (weight * length)
            stiffness = add_square(stiffness, c, normal)
    mass = body.masses[node]
    return NodeBounds((isotropic + largest_eigenvalue(stiffness)) / mass, isotropic / mass)


@inlined
def _stretched(body: Body, points: FloatArray, t: int, a: Vec3) -> Vec3:
    """Return F a of a tetrahedron with its nodes at `points`."""
    n1, n2, n3, volume = rest_normals(body, t)
    x0 = vec3(points, body.tetrahedra[t, 0])
    total = scale(dot(n1, a), sub(vec3(points, body.tetrahedra[t, 1]), x0))
    total = axpy(dot(n2, a), sub(vec3(points, body.tetrahedra[t, 2]), x0), total)
    total = axpy(dot(n3, a), sub(vec3(points, body.tetrahedra[t, 3]), x0), total)
    return scale(1.0 / (6.0 * volume), total)


@kernel
def tighten(solid: Solid, body: Body, visits: Visits, n_listed: int, allowed: float) -> int:
    """Change the weights of the worst nodes of `solid.listed` until their bounds are `allowed`.

    Args:
        solid: Weights and bounds are written.
        body: For the masses.
        visits: For searches.
        n_listed: Nodes listed; the bound of other nodes is not above `allowed`.
        allowed: Bound on w^2 that the rest of the body has [1/s2]; lower bounds are of no use.

    Returns:
        Length of `solid.listed` with all nodes whose bound has changed.
    """
    listed, raised = solid.listed, solid.raised
    worst = _worst(solid, n_listed)
    for _ in range(ROUNDS):
        if worst <= allowed:
            break
        threshold = max(NEAR_WORST * worst, allowed)
        n = 0
        for i in range(n_listed):
            node = listed[i]
            if solid.frequency_squared[node] > threshold:
                solid.weight[node] *= solid.frequency_squared[node] / threshold
                raised[n] = node
                n += 1
        n = bound_around(solid, body, visits, raised, with_neighbours(solid, visits, raised, n))
        n_listed = with_these(visits, listed, n_listed, raised, n)
        before, worst = worst, _worst(solid, n_listed)
        if worst > WORTH_IT * before:
            break
    return n_listed


@kernel
def _worst(solid: Solid, n_listed: int) -> float:
    """Return the highest bound on w^2 of the listed nodes [1/s2]."""
    worst = 0.0
    for i in range(n_listed):
        worst = max(worst, solid.frequency_squared[solid.listed[i]])
    return worst
