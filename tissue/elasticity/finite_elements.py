"""Tetrahedra as elements of a solid: their rest shapes, and a row of corners for each node.

The force on a node is the sum over its row, in order: a gather, no scatter, no race. After a cut
only the changed tetrahedra and the rows of touched nodes are written again.

With linear shape functions N_k and positions x_k the deformation gradient F is the sum of
x_k (grad N_k)^T. All that the law needs of the rest shape is the volume V and, for |F|^2, the six
numbers V grad N_i . grad N_j: with d_i = x_i - x_0,

    V |F|^2 = sum over i, j = 1..3 of (V grad N_i . grad N_j) d_i . d_j

Tetrahedra are stored in blocks of eight: block b holds tetrahedra 8 b to 8 b + 7, and the eight
values of each quantity stand in a row, so that one vector holds them.
"""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import kernel
from tissue.core.simd import WIDTH, aligned, filled
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, cross, dot, sub, vec3
from tissue.mesh.body import Body
from tissue.mesh.star import LARGEST_STAR, Visits, sorted_star

OWN_SHARE = 0.2
"""Share of the volume term beside springs that acts on each tetrahedron by itself. Where one
tetrahedron folds while its neighbours swell, averaged volumes do not change, and springs resist
little: at 0 some 4 % were inverted in a block at half its height, with this share none; springs
alone fold at 0.8 of the height. Bending locks a little: a bar of four cells deflects 0.68 of
theory, not 0.73."""

VOLUME, PER_VOLUME = 6, 7
"""Quantities of `Solid.shape`: V and 1/V. Before them are the gradient products 11, 22, 33, 12, 13
and 23."""

STAR_POOL_MARGIN = LARGEST_STAR + WIDTH
"""Free slots below which `build_stars` asks for a larger pool; more than any one row needs."""

LARGEST_RING = 3 * LARGEST_STAR + 1
"""Nodes of the tetrahedra around one node at most, itself among them."""


class EnergyDensity(Arrays):
    """Energy per volume at rest, stable neo-Hookean (Smith, de Goes and Kim 2018).

    W = mu/2 (|F|^2 - 3) - mu/2 log(|F|^2 + 1) + lam/2 (J - a)^2

    It is defined for J <= 0 as well: an inverted tetrahedron recovers. J of the last term is that
    of each tetrahedron, or the average over the tetrahedra around each node (Bonet and Burton
    1998), which does not lock where tissue is nearly incompressible, or a part of the term takes
    each.
    """

    mu: float
    """Shear modulus of the law [Pa], 0 where springs carry the shear."""
    lam_of_tetrahedra: float
    """The part of lam that acts on J of each tetrahedron [Pa]."""
    lam_of_nodes: float
    """The part of lam that acts on J averaged over the tetrahedra around each node [Pa]."""
    a: float
    """J at which the last term is 0: 1 + 3 mu / (4 lam), so that the body at rest is at rest."""


class Solid(Arrays):
    """Every tetrahedron and the star of every node. Rows beyond the body's counts are spare."""

    law: EnergyDensity
    """The law of the tetrahedra."""
    nodes: SlotArray
    """Nodes of each tetrahedron, in blocks of four rows of eight (`node_place`)."""
    shape: FloatArray
    """V grad N_i . grad N_j for ij = 11, 22, 33, 12, 13, 23 [m], V [m3] and 1/V [1/m3] of each
    tetrahedron, in blocks of eight rows of eight (`shape_place`)."""
    first: IntArray
    """Where each node's row begins in the pool, shape (nodes,)."""
    room: IntArray
    """Slots reserved for each node's row, shape (nodes,)."""
    count: IntArray
    """Tetrahedra around each node, shape (nodes,). Its row is padded to a multiple of eight slots
    with places that always hold 0."""
    around: SlotArray
    """Place in `volume` of the tetrahedron of each slot, in order of tetrahedra; shape (pool,)."""
    corner: SlotArray
    """Place in `forces` of the force on the corner of each slot, shape (pool,)."""
    node_volume: FloatArray
    """A quarter of each tetrahedron around the node, at rest [m3], shape (nodes,)."""
    weight: FloatArray
    """Weight of each node in the bound on frequencies [1/kg^0.5] (`frequency_bound`), shape
    (nodes,)."""
    dilatation: FloatArray
    """Term of the averaged volume of each node in that bound [N/m3/kg^0.5], shape (nodes,)."""
    frequency_squared: FloatArray
    """Bound on the square of the local angular frequency [1/s2], shape (nodes,)."""
    ring: FloatArray
    """Scratch of `frequency_bound`: sums at the nodes of a star, shape (LARGEST_RING, 3)."""
    ring_nodes: IntArray
    """Scratch of `frequency_bound`: the nodes of a star, shape (LARGEST_RING,)."""
    listed: IntArray
    """Nodes whose bound was written by the last call of `frequency_bound`, shape (nodes,)."""
    raised: IntArray
    """Scratch of `frequency_refinement`: nodes given a larger weight, shape (nodes,)."""
    used: IntCell
    """Number of slots of the pool in use."""
    every: IntArray
    """The list 0, 1, 2 ... of all blocks, of all nodes, or of all tetrahedra."""
    volume: FloatArray
    """Scratch: signed volume of tetrahedron t now [m3] at 8 + t; the first eight are 0."""
    growth: FloatArray
    """Scratch of `strained_frequency` and of energies: growth of the faces of tetrahedron t, at
    8 + t."""
    tested_growth: FloatArray
    """Growth of the faces of tetrahedron t at which its nodes were slow enough, at 8 + t
    (`strained_frequency`); 1 where it was not tested."""
    strained_dilatation: FloatArray
    """Scratch of `strained_frequency`: `dilatation` as the body is deformed, shape (nodes,)."""
    strained_frequency_squared: FloatArray
    """Scratch of `strained_frequency`: `frequency_squared` as it is deformed, shape (nodes,)."""
    dilatation_test: IntArray
    """Test in which `strained_dilatation` was written, shape (nodes,)."""
    frequency_test: IntArray
    """Test in which `strained_frequency_squared` was written, shape (nodes,)."""
    test: IntCell
    """Number of the test of strained frequencies."""
    pressure: FloatArray
    """Scratch: lam (J - a) of each node [Pa], tension is positive; shape (nodes,)."""
    forces: FloatArray
    """Scratch: force on each corner of each tetrahedron [N], in blocks of four times three rows of
    eight, x, y and z (`corner_place`); the first block is 0."""


def neo_hookean(mu: float, lam: float, *, averaged: bool = True) -> EnergyDensity:
    """Return the law with the small-strain moduli `mu` and `lam` (Lame's) [Pa].

    Args:
        mu: Shear modulus.
        lam: Lame's first constant.
        averaged: Whether volume is kept on average around each node, or in each tetrahedron.
    """
    modulus = lam + 5.0 / 6.0 * mu
    a = 1.0 + mu / modulus  # 3/4 of the law's own mu, which is 4/3 of the small-strain one
    return _law(4.0 / 3.0 * mu, modulus, a, averaged)


def volume_term(modulus: float, *, averaged: bool = True) -> EnergyDensity:
    """Return the law that only resists changes of volume, by that modulus [Pa]: beside springs.

    Args:
        modulus: What springs leave to it, lam - mu.
        averaged: Whether all but `OWN_SHARE` of it acts on averaged volumes; if not, none of it.
    """
    return _law(0.0, modulus, 1.0, averaged, OWN_SHARE)


def _law(mu: float, lam: float, a: float, averaged: bool, own_share: float = 0.0) -> EnergyDensity:
    own = own_share * lam if averaged else lam
    return EnergyDensity(mu=mu, lam_of_tetrahedra=own, lam_of_nodes=lam - own, a=a)


def no_solid(law: EnergyDensity, n_nodes: int, n_tetrahedra: int, pool: int) -> Solid:
    """Return empty rows with room for that many nodes, tetrahedra and slots."""
    capacity = WIDTH * n_blocks(n_tetrahedra)
    shape = aligned(8 * capacity)
    shape[:] = 1.0  # for tetrahedra not in use: any value that avoids division by 0
    tested_growth = aligned(WIDTH + capacity)
    tested_growth[:] = 1.0
    return Solid(
        law=law,
        nodes=aligned(4 * capacity, np.int32),
        shape=shape,
        first=np.zeros(n_nodes, dtype=np.int64),
        room=np.zeros(n_nodes, dtype=np.int64),
        count=np.zeros(n_nodes, dtype=np.int64),
        around=np.zeros(pool, dtype=np.int32),
        corner=np.zeros(pool, dtype=np.int32),
        node_volume=np.zeros(n_nodes),
        weight=np.zeros(n_nodes),
        dilatation=np.zeros(n_nodes),
        frequency_squared=np.zeros(n_nodes),
        ring=np.zeros((LARGEST_RING, 3)),
        ring_nodes=np.zeros(LARGEST_RING, dtype=np.int64),
        listed=np.zeros(n_nodes, dtype=np.int64),
        raised=np.zeros(n_nodes, dtype=np.int64),
        used=0,
        every=np.arange(max(n_nodes, n_tetrahedra)),
        volume=aligned(WIDTH + capacity),
        growth=aligned(WIDTH + capacity),
        tested_growth=tested_growth,
        strained_dilatation=np.zeros(n_nodes),
        strained_frequency_squared=np.zeros(n_nodes),
        dilatation_test=np.zeros(n_nodes, dtype=np.int64),
        frequency_test=np.zeros(n_nodes, dtype=np.int64),
        test=0,
        pressure=np.zeros(n_nodes),
        forces=aligned(4 * 3 * (WIDTH + capacity)),
    )


def grown_solid(solid: Solid, n_nodes: int, n_tetrahedra: int, pool: int) -> Solid:
    """Return the rows with room for that many nodes, tetrahedra and slots."""
    larger = no_solid(solid.law, n_nodes, n_tetrahedra, pool)
    for name in set(Solid.__annotations__) - {"law", "every", "used", "test"}:
        old = getattr(solid, name)
        getattr(larger, name)[: len(old)] = old
    larger.used, larger.test = solid.used, solid.test
    return larger


def room_for_stars(n_nodes: int, n_tetrahedra: int) -> int:
    """Return the slots that rows of that many nodes and tetrahedra take, twice over."""
    return 2 * (4 * n_tetrahedra + WIDTH * n_nodes) + STAR_POOL_MARGIN


@kernel
def n_blocks(n_tetrahedra: int) -> int:
    """Return how many blocks hold that many tetrahedra."""
    return (n_tetrahedra + WIDTH - 1) // WIDTH


@kernel
def node_place(t: int, k: int) -> int:
    """Return where node `k` of tetrahedron `t` is in `nodes`."""
    return WIDTH * (4 * (t // WIDTH) + k) + t % WIDTH


@kernel
def shape_place(t: int, which: int) -> int:
    """Return where quantity `which` of tetrahedron `t` is in `shape`."""
    return WIDTH * (8 * (t // WIDTH) + which) + t % WIDTH


@kernel
def corner_place(t: int, k: int) -> int:
    """Return where x of the force on corner `k` of tetrahedron `t` is in `forces`."""
    return 3 * WIDTH * (4 * (1 + t // WIDTH) + k) + t % WIDTH


@kernel
def build_tetrahedra(solid: Solid, body: Body, tetrahedra: IntArray, n: int) -> None:
    """Write the rest shapes of the first `n` of `tetrahedra`."""
    for i in range(n):
        t = tetrahedra[i]
        for k in range(4):
            solid.nodes[node_place(t, k)] = body.tetrahedra[t, k]
        n1, n2, n3, volume = rest_normals(body, t)
        per = 1.0 / (36.0 * volume)
        solid.shape[shape_place(t, 0)] = per * dot(n1, n1)
        solid.shape[shape_place(t, 1)] = per * dot(n2, n2)
        solid.shape[shape_place(t, 2)] = per * dot(n3, n3)
        solid.shape[shape_place(t, 3)] = per * dot(n1, n2)
        solid.shape[shape_place(t, 4)] = per * dot(n1, n3)
        solid.shape[shape_place(t, 5)] = per * dot(n2, n3)
        solid.shape[shape_place(t, VOLUME)] = volume
        solid.shape[shape_place(t, PER_VOLUME)] = 1.0 / volume


@kernel
def rest_normals(body: Body, t: int) -> tuple[Vec3, Vec3, Vec3, float]:
    """Return 6 V grad N of nodes 1, 2 and 3 of a tetrahedron at rest [m2], and V [m3]."""
    return normals(body, body.rest, t)


@kernel
def normals(body: Body, points: FloatArray, t: int) -> tuple[Vec3, Vec3, Vec3, float]:
    """Return twice the area vectors of the faces opposite nodes 1, 2 and 3, and the volume.

    Args:
        body: For the nodes of the tetrahedron.
        points: Where the nodes are [m].
        t: The tetrahedron.
    """
    x0 = vec3(points, body.tetrahedra[t, 0])
    d1 = sub(vec3(points, body.tetrahedra[t, 1]), x0)
    d2 = sub(vec3(points, body.tetrahedra[t, 2]), x0)
    d3 = sub(vec3(points, body.tetrahedra[t, 3]), x0)
    n1 = cross(d2, d3)
    return n1, cross(d3, d1), cross(d1, d2), dot(d1, n1) / 6.0


@kernel
def build_stars(
    solid: Solid, body: Body, visits: Visits, nodes: IntArray, n: int, around: IntArray
) -> int:
    """Write the rows of the first `n` of `nodes`; return how many were written.

    If fewer than `n` were, the pool is full: enlarge it and continue from there.

    Args:
        solid: Rows are written; the shapes of the tetrahedra around the nodes are up to date.
        body: The body.
        visits: For searches.
        nodes: The nodes.
        n: How many of them.
        around: Scratch, shape (LARGEST_STAR,).
    """
    for i in range(n):
        if solid.used + STAR_POOL_MARGIN > len(solid.corner):
            return i
        _build_star(solid, body, visits, nodes[i], around)
    return n


@kernel
def _build_star(solid: Solid, body: Body, visits: Visits, node: int, around: IntArray) -> None:
    n = sorted_star(body, visits, node, around)
    if n > solid.room[node]:
        solid.first[node] = solid.used
        solid.room[node] = filled(n)
        solid.used += solid.room[node]
    first = solid.first[node]
    solid.count[node] = n
    for slot in range(first + n, first + filled(n)):
        solid.around[slot] = solid.corner[slot] = 0
    volume = 0.0
    for i in range(n):
        t = around[i]
        k = 0
        while body.tetrahedra[t, k] != node:
            k += 1
        solid.around[first + i] = WIDTH + t
        solid.corner[first + i] = corner_place(t, k)
        volume += 0.25 * solid.shape[shape_place(t, VOLUME)]
    solid.node_volume[node] = volume


@kernel
def tetrahedron_of_slot(solid: Solid, slot: int) -> int:
    """Return the tetrahedron of a slot of a row."""
    t: int = solid.around[slot] - WIDTH
    return t


@kernel
def corner_of_slot(solid: Solid, slot: int) -> int:
    """Return which of the four corners of its tetrahedron a slot of a row is."""
    corner: int = solid.corner[slot] // (3 * WIDTH) % 4
    return corner
