"""A bound on the angular frequencies of a solid at rest, node by node: what limits the time step.

Each energy is a square |sum of L_a u_a|^2 over the nodes a of a tetrahedron, or, where volumes are
averaged, over those of all tetrahedra around a node. For any positive numbers r_a

    |sum L_a u_a|^2 <= (sum r_a) (sum |L_a u_a|^2 / r_a)                     (Cauchy and Schwarz)

Added up over all energies that leaves a 3 x 3 matrix N_b at each node b, and the energy is at most
sum u_b . N_b u_b: no mode is faster than the largest w^2 = |N_b| / m_b. It is Irons' theorem for
point masses, with the mass of a node shared among the elements around it.

With r_a = |L_a| / sqrt(m_a) the bound is 10 to 45 % above the truth on meshes after cuts;
`tissue.elasticity.frequency_refinement` finds better numbers where it is highest. That of each
tetrahedron by itself
with a quarter of its own mass, 2 c_p sqrt(sum of 1 / altitude^2), is up to 7 times above: a sliver
has next to no mass, but it shares its nodes with tetrahedra that have.

A fixed node does not move: it counts as infinitely heavy.
"""

import math

from tissue.core.array_types import IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.vec3 import Vec3, add, axpy, norm, scale, store, vec3
from tissue.elasticity.finite_elements import (
    Solid,
    corner_of_slot,
    node_place,
    rest_normals,
    tetrahedron_of_slot,
)
from tissue.geometry.tetrahedron import add_square, largest_eigenvalue, nothing_symmetric
from tissue.mesh.body import Body
from tissue.mesh.star import Visits

STALE = 2.0
"""Mass over the one that its weight is of, or the inverse, at which a node gets another weight. Any
weight is right, that of the mass now is near the best; but another weight changes the bound two
rings further. Nodes that were split again and again made the bound twice too high without."""


@kernel
def bound_solid_frequencies(
    solid: Solid, body: Body, visits: Visits, nodes: IntArray, n: int
) -> int:
    """Write the bound on w^2 at the first `n` of `nodes`, and at others that feel them, anew.

    Return at how many; they are listed in `solid.listed`. The rows and the masses of `nodes` must
    be up to date.
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
    """Write the bound of the first `n` of `listed`, and of their neighbours, anew.

    The neighbours are appended; return how many it lists now. What depends on a weight that changed
    is within the first `n`.
    """
    if solid.law.lam_of_nodes != 0.0:
        for i in range(n):
            _measure_dilatation(solid, body, visits, listed[i])
    n = with_neighbours(solid, visits, listed, n)
    for i in range(n):
        solid.frequency_squared[listed[i]] = _bound(solid, body, visits, listed[i])
    return n


@kernel
def _reweighted(solid: Solid, body: Body, node: int) -> bool:
    """Return whether the node got another weight."""
    if body.fixed[node]:
        return False
    mass = body.masses[node]
    if mass <= STALE * solid.weighed[node] and solid.weighed[node] <= STALE * mass:
        return False
    solid.weighed[node] = mass
    solid.weight[node] = 1.0 / math.sqrt(mass)
    return True


@kernel
def with_these(visits: Visits, listed: IntArray, n_listed: int, nodes: IntArray, n: int) -> int:
    """Add the first `n` of `nodes` to a list unless they are there; return how many it has."""
    _mark_listed(visits, listed, n_listed)
    for i in range(n):
        n_listed = _list(visits, listed, n_listed, nodes[i])
    return n_listed


@kernel
def with_neighbours(solid: Solid, visits: Visits, listed: IntArray, n: int) -> int:
    """Add the neighbours of the first `n` nodes, all there are, to a list; return how many then."""
    _mark_listed(visits, listed, n)
    n_listed = n
    for i in range(n):
        node = listed[i]
        for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
            t = tetrahedron_of_slot(solid, slot)
            for k in range(4):
                n_listed = _list(visits, listed, n_listed, solid.nodes[node_place(t, k)])
    return n_listed


@kernel
def _mark_listed(visits: Visits, listed: IntArray, n: int) -> None:
    visits.epoch += 1
    for i in range(n):
        visits.nodes[listed[i]] = visits.epoch


@kernel
def _list(visits: Visits, listed: IntArray, n: int, node: int) -> int:
    """Add a node to a list of `n` unless it is marked; return how many it has."""
    if visits.nodes[node] == visits.epoch:
        return n
    visits.nodes[node] = visits.epoch
    listed[n] = node
    return n + 1


@kernel
def _measure_dilatation(solid: Solid, body: Body, visits: Visits, node: int) -> None:
    """Write the sum of r_b of the averaged volume of a node, per what |L_b| is without lam.

    The averaged volume V_a J changes by the sum of C_b . u_b, C_b = sum of V grad N_b / 4 over the
    tetrahedra around node a. Its energy is lam / (2 V_a) times the square of that.
    """
    visits.epoch += 1
    n = 0
    for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
        t = tetrahedron_of_slot(solid, slot)
        n1, n2, n3, _ = rest_normals(body, t)
        n = _add_to_ring(solid, visits, n, t, 0, scale(-1.0, add(n1, add(n2, n3))))
        n = _add_to_ring(solid, visits, n, t, 1, n1)
        n = _add_to_ring(solid, visits, n, t, 2, n2)
        n = _add_to_ring(solid, visits, n, t, 3, n3)
    total = 0.0
    for i in range(n):
        total += solid.weight[solid.ring_nodes[i]] * norm(vec3(solid.ring, i))
    solid.dilatation[node] = solid.law.lam_of_nodes / solid.node_volume[node] * total


@inlined
def _add_to_ring(solid: Solid, visits: Visits, n: int, t: int, k: int, normal: Vec3) -> int:
    """Add a share of V grad N / 4 to node `k` of a tetrahedron; return the nodes listed so far."""
    node = solid.nodes[node_place(t, k)]
    if visits.nodes[node] != visits.epoch:
        visits.nodes[node] = visits.epoch
        visits.place[node] = n
        solid.ring_nodes[n] = node
        store(solid.ring, n, Vec3(0.0, 0.0, 0.0))
        n += 1
    at = visits.place[node]
    store(solid.ring, at, axpy(1.0 / 24.0, normal, vec3(solid.ring, at)))
    return n


@kernel
def _bound(solid: Solid, body: Body, visits: Visits, node: int) -> float:
    """Return |N_b| / m_b of a node, its bound on w^2 [1/s2]."""
    weight = solid.weight[node]
    if weight == 0.0:
        return 0.0
    mu = 0.75 * solid.law.mu
    # What of lam is not averaged, at small strain. Where it is negative, less of it is still above.
    lam = max(solid.law.lam_of_tetrahedra - 5.0 / 6.0 * mu, -2.0 / 3.0 * mu)
    averaged = solid.law.lam_of_nodes != 0.0
    isotropic, stiffness = 0.0, nothing_symmetric()
    visits.epoch += 1
    n = 0
    for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
        t = tetrahedron_of_slot(solid, slot)
        n1, n2, n3, volume = rest_normals(body, t)
        n0 = scale(-1.0, add(n1, add(n2, n3)))
        ratios = (
            solid.weight[solid.nodes[node_place(t, 0)]] * norm(n0)
            + solid.weight[solid.nodes[node_place(t, 1)]] * norm(n1)
            + solid.weight[solid.nodes[node_place(t, 2)]] * norm(n2)
            + solid.weight[solid.nodes[node_place(t, 3)]] * norm(n3)
        )
        k = corner_of_slot(solid, slot)
        normal = n0 if k == 0 else (n1 if k == 1 else (n2 if k == 2 else n3))
        length = norm(normal)
        share = ratios / (36.0 * volume * weight)  # of V grad N^2 = n^2 / (36 V)
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
            c = solid.dilatation[solid.ring_nodes[i]] / (weight * length)
            stiffness = add_square(stiffness, c, normal)
    return (isotropic + largest_eigenvalue(stiffness)) / body.masses[node]
