"""A bound on the angular frequencies of a solid at rest, at each node: it limits the time step.

Each energy is a square |sum of L_a u_a|^2 over the nodes a of a tetrahedron, or, where volumes or
shear are averaged, over those of all tetrahedra around a node. For any positive numbers r_a

    |sum L_a u_a|^2 <= (sum r_a) (sum |L_a u_a|^2 / r_a)                     (Cauchy and Schwarz)

Added up over all energies that leaves a 3 x 3 matrix N_b at each node b, and the energy is at most
sum u_b . N_b u_b: no mode is faster than the largest w^2 = |N_b| / m_b. It is Irons' theorem for
point masses, with the mass of a node shared among the elements around it.

With r_a = |L_a| / sqrt(m_a) the bound is 10 to 45 % above the truth on meshes after cuts. The
bound of each tetrahedron by itself with a quarter of its own mass, 2 c_p sqrt(sum of 1 /
altitude^2), is up to 7 times above: a sliver has next to no mass, but it shares its nodes with
tetrahedra that have.

A fixed node does not move: it counts as infinitely heavy.
"""

import math
from typing import NamedTuple

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd_blocks import width_of
from tissue.core.vec3 import Vec3, add, axpy, dot, norm, scale, store, sub, vec3
from tissue.elasticity.finite_elements import Solid, averages_shear, is_graded, node_place
from tissue.elasticity.graded import modulus_of_node, own_moduli, shear_of_node
from tissue.elasticity.rest_shapes import normals, rest_normals
from tissue.elasticity.stars import corner_of_slot, is_averaged, tetrahedron_of_slot
from tissue.geometry.tetrahedron import add_square, largest_eigenvalue, nothing_symmetric
from tissue.laws.kernels import stiffens
from tissue.mesh.body import Body
from tissue.mesh.star import Visits

STALE = 2.0
"""Factor by which the mass of a node may differ from that which its weight stands for. Any weight
gives a bound, and that of the mass now is near the best; but another weight changes the bound two
rings further. If weights never change, nodes that were split several times, or were given a larger
weight for a neighbour that is gone, make the bound twice too high."""


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
        if not is_averaged(solid, slot):
            continue
        t = tetrahedron_of_slot(solid, slot)
        n1, n2, n3, _ = normals(body, points, t)
        n0 = scale(-1.0, add(n1, add(n2, n3)))
        n = _add_to_ring(solid, visits, n, t, 0, n0, n0)
        n = _add_to_ring(solid, visits, n, t, 1, n1, n1)
        n = _add_to_ring(solid, visits, n, t, 2, n2, n2)
        n = _add_to_ring(solid, visits, n, t, 3, n3, n3)
    total = 0.0
    for i in range(n):
        total += solid.weight[solid.ring_nodes[i]] * norm(vec3(solid.ring, i))
    term: float = modulus_of_node(solid, node) / solid.node_volume[node] * total
    return term


@inlined
def _add_to_ring(
    solid: Solid, visits: Visits, n: int, t: int, k: int, normal: Vec3, at_rest: Vec3
) -> int:
    """Add a share of V grad N / 4 to a node of a tetrahedron; return the nodes listed so far.

    Args:
        solid: Its rings are written.
        visits: For marks.
        n: Nodes listed so far.
        t: The tetrahedron.
        k: Which of its nodes.
        normal: 6 V grad N [m2].
        at_rest: The same at rest [m2].
    """
    node = solid.nodes[node_place(solid, t, k)]
    if visits.nodes[node] != visits.epoch:
        visits.nodes[node] = visits.epoch
        visits.place[node] = n
        solid.ring_nodes[n] = node
        store(solid.ring, n, Vec3(0.0, 0.0, 0.0))
        store(solid.rest_ring, n, Vec3(0.0, 0.0, 0.0))
        n += 1
    at = visits.place[node]
    store(solid.ring, at, axpy(1.0 / 24.0, normal, vec3(solid.ring, at)))
    store(solid.rest_ring, at, axpy(1.0 / 24.0, at_rest, vec3(solid.rest_ring, at)))
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
    law, mass = solid.law, body.masses[node]
    # The part of lam of each tetrahedron by itself, at small strain. Where it is negative it is
    # limited: the bound still holds.
    own_share = 1.0 - law.shear_of_nodes
    mu = own_share * law.shear_modulus
    lam = max(law.lam_of_tetrahedra - own_share * law.excess, -2.0 / 3.0 * mu)
    averaged = law.lam_of_nodes != 0.0
    has_stiffened = is_strained and stiffens(law)
    isotropic, stiffness = 0.0, nothing_symmetric()
    visits.epoch += 1
    n = 0
    for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
        t, k = tetrahedron_of_slot(solid, slot), corner_of_slot(solid, slot)
        if is_graded(solid):
            mu, lam = own_moduli(solid, body, t)
        n1, n2, n3, volume = rest_normals(body, t)
        n0 = scale(-1.0, add(n1, add(n2, n3)))
        ratios = (
            solid.weight[solid.nodes[node_place(solid, t, 0)]] * norm(n0)
            + solid.weight[solid.nodes[node_place(solid, t, 1)]] * norm(n1)
            + solid.weight[solid.nodes[node_place(solid, t, 2)]] * norm(n2)
            + solid.weight[solid.nodes[node_place(solid, t, 3)]] * norm(n3)
        )
        at_rest = n0 if k == 0 else (n1 if k == 1 else (n2 if k == 2 else n3))
        length = norm(at_rest)
        share = ratios / (36.0 * volume * weight)  # of V grad N^2 = n^2 / (36 V)
        normal = at_rest
        if is_strained:
            n1, n2, n3, _ = normals(body, points, t)
            normal = n1 if k == 1 else (n2 if k == 2 else n3)
            if k == 0:
                normal = scale(-1.0, add(n1, add(n2, n3)))
            if averages_shear(solid):
                isotropic += _share_taken(solid, t) * share * length
        if has_stiffened:
            place = width_of(solid.shape) + t
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
                if not is_graded(solid) or solid.sites[node_place(solid, t, other)] < body.n_nodes:
                    n = _add_to_ring(solid, visits, n, t, other, normal, at_rest)
    if averages_shear(solid):
        isotropic += _averaged_shear(solid, n, has_stiffened) / weight
    for i in range(n):
        normal, other = vec3(solid.ring, i), solid.ring_nodes[i]
        length = norm(normal)
        if length > 0.0:
            c = (1.0 + _lam_of_averaged_shear(solid, other)) * dilatation[other] / (weight * length)
            stiffness = add_square(stiffness, c, normal)
    return NodeBounds((isotropic + largest_eigenvalue(stiffness)) / mass, isotropic / mass)


@inlined
def _share_taken(solid: Solid, t: int) -> float:
    """Return the stiffness of averaged shear that a tetrahedron takes back [Pa]."""
    total, sites = 0.0, solid.sites if is_graded(solid) else solid.nodes
    for k in range(4):
        site = sites[node_place(solid, t, k)]
        total += float(solid.stiffness_taken[site]) * _relative_shear(solid, site)
    return solid.law.shear_modulus * (0.25 * total * solid.law.shear_of_nodes)


@inlined
def _relative_shear(solid: Solid, node: int) -> float:
    """Return the shear modulus of the averages of a node over that of the law of the body."""
    if not is_graded(solid):
        return 1.0
    return shear_of_node(solid, node) / solid.law.shear_modulus


@inlined
def _lam_of_averaged_shear(solid: Solid, node: int) -> float:
    """Return mu and the part of lam of averaged shear of a node, over lam of its volume.

    It is limited as in tetrahedra; 0 where nothing is averaged.
    """
    law, lam = solid.law, modulus_of_node(solid, node)
    if law.shear_of_nodes == 0.0 or lam == 0.0:
        return 0.0
    mu, excess = shear_of_node(solid, node), law.excess
    if is_graded(solid):
        excess = solid.node_excess[node]
    return law.shear_of_nodes * (mu - min(excess, 2.0 / 3.0 * mu)) / lam


@inlined
def _averaged_shear(solid: Solid, n: int, has_stiffened: bool) -> float:
    """Return what the shear of averages adds to |N_b|, times the weight of the node.

    As for averaged volumes: F of node a changes by the sum of u_b C_b^T / V_a. At rest in any case,
    as the shear of tetrahedra.

    Args:
        solid: The ring of the node at rest, and what `dilatation_term` is at rest.
        n: Length of the ring.
        has_stiffened: Whether stiffness is that of `Solid.node_stiffness`.
    """
    law, total = solid.law, 0.0
    for i in range(n):
        node = solid.ring_nodes[i]
        stiffness = float(solid.node_stiffness[node]) if has_stiffened else 1.0
        if is_graded(solid):
            lam = modulus_of_node(solid, node)
            stiffness *= _relative_shear(solid, node) * law.lam_of_nodes / lam if lam > 0.0 else 0.0
        total += stiffness * solid.dilatation[node] * norm(vec3(solid.rest_ring, i))
    return total * law.shear_of_nodes * law.shear_modulus / law.lam_of_nodes


@inlined
def _stretched(body: Body, points: FloatArray, t: int, a: Vec3) -> Vec3:
    """Return F a of a tetrahedron with its nodes at `points`."""
    n1, n2, n3, volume = rest_normals(body, t)
    x0 = vec3(points, body.tetrahedra[t, 0])
    total = scale(dot(n1, a), sub(vec3(points, body.tetrahedra[t, 1]), x0))
    total = axpy(dot(n2, a), sub(vec3(points, body.tetrahedra[t, 2]), x0), total)
    total = axpy(dot(n3, a), sub(vec3(points, body.tetrahedra[t, 3]), x0), total)
    return scale(1.0 / (6.0 * volume), total)
