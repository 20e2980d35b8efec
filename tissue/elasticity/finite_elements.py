"""Tetrahedra as elements of a solid: their rest shapes, and a row of corners for each node.

The force on a node is the sum over its row, in order: a gather, no scatter, no race. After a cut
only the changed tetrahedra and the rows of touched nodes are written again.

With linear shape functions N_k and displacements u_k the gradient of the displacement is
H = sum of u_k (grad N_k)^T, and the deformation gradient F = 1 + H. Displacements, and not
positions, keep the digits: where nothing is displaced, H and the forces are zero in any precision.

Tetrahedra are stored in blocks of as many as a vector holds, eight in double precision and sixteen
in single: block b of width w holds tetrahedra w b to w b + w - 1, and the values of each quantity
stand in a row. The state, positions and velocities, is always double.
"""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH
from tissue.core.simd_blocks import width_of
from tissue.core.simd_points import row_of_lane
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell
from tissue.laws.energy_density import EnergyDensity
from tissue.mesh.star import LARGEST_STAR

N_RELAXED = 7
"""Numbers of the stress that has relaxed in a tetrahedron (`relaxed_stress`)."""

(
    MU,
    OWN_LAM,
    OWN_SHEAR,
    EXPONENT,
    YEOH_SECOND,
    YEOH_THIRD,
    BULK,
    VISCOUS_MU,
    VISCOUS_LAM,
    N_MODULI,
) = range(10)
"""Places of the numbers of a tetrahedron in `Solid.moduli`, and how many these are."""

VOLUME, N_SHAPE = 9, 10
"""Place of V among the quantities of `Solid.shape`, and how many these are. Before it are grad N_1,
grad N_2 and grad N_3; grad N_0 is minus their sum."""

LARGEST_RING = 3 * LARGEST_STAR + 1
"""Nodes of the tetrahedra around one node at most, itself among them."""

_NO_TERMS = np.zeros((0, 1))
"""The terms of tissue whose stress does not relax."""


class Solid(Arrays, two_precisions=True):
    """Every tetrahedron and the star of every node. Rows beyond the body's counts are spare."""

    law: EnergyDensity
    """The law of the tetrahedra."""
    nodes: SlotArray = sized((4, "in_blocks"), is_for_vectors=True)
    """Nodes of each tetrahedron, in blocks of four rows (`node_place`)."""
    shape: FloatArray = sized((N_SHAPE, "in_blocks"), is_for_vectors=True)
    """grad N_1, grad N_2, grad N_3 [1/m] and V [m3] of each tetrahedron, in blocks of ten rows
    (`shape_place`). Its precision is that of all scratch but the node's own."""
    moduli: FloatArray = sized((N_MODULI, "graded"), fill=1.0, is_for_vectors=True)
    """Moduli and other numbers of the law of each tetrahedron, in blocks of nine rows
    (`tissue.elasticity.graded`); empty where the whole body has the same."""
    node_label: IntArray = sized("graded_nodes")
    """Label whose tetrahedra are averaged around each node, shape (nodes,), as of the moduli of
    nodes that follow; empty where `moduli` is."""
    sites: SlotArray = sized((4, "graded"), is_for_vectors=True)
    """Where what is averaged at each corner of each tetrahedron is: its node, or where another
    label is averaged there the last row, which is 0. In blocks as `nodes`; empty where `moduli`
    is."""
    node_modulus: FloatArray = sized("graded_nodes")
    """`EnergyDensity.lam_of_nodes` of each node [Pa]."""
    node_shear: FloatArray = sized("graded_nodes")
    """`EnergyDensity.shear_modulus` [Pa]."""
    node_mu: FloatArray = sized("graded_nodes")
    """`EnergyDensity.mu` [Pa]."""
    node_exponent: FloatArray = sized("graded_nodes", fill=1.0)
    """`EnergyDensity.exponent`, which is never 0 under that law."""
    node_second: FloatArray = sized("graded_nodes")
    """`EnergyDensity.second`."""
    node_third: FloatArray = sized("graded_nodes")
    """`EnergyDensity.third`."""
    node_excess: FloatArray = sized("graded_nodes")
    """`EnergyDensity.excess` [Pa]."""
    node_viscous_mu: FloatArray = sized("graded_nodes")
    """Shear modulus of averaged rates, over the retardation time of the body [Pa]."""
    node_viscous_lam: FloatArray = sized("graded_nodes")
    """lam of averaged rates [Pa]."""
    retardation_time: float
    """Retardation time of the body, to which `moduli` refer [s]."""
    n_terms: IntCell
    """Number of terms of the Prony series; 0 where no stress relaxes."""
    relaxing_shares: FloatArray
    """g of each term, for all materials of the first term, then of the second, and so on; of one
    alone where the whole body has the same moduli. Shape (n_terms * materials,)."""
    relaxation_times: FloatArray
    """tau of each [s], in the same order."""
    relaxation_weights: FloatArray
    """Scratch of `viscoelasticity`: how far each goes to its limit in a step."""
    series: SlotArray = sized("graded_terms", is_for_vectors=True)
    """Place of each term of each tetrahedron in these three, in blocks of as many rows as there are
    terms; empty where `moduli` is."""
    node_series: SlotArray = sized("graded_node_terms", is_for_vectors=True)
    """The same of the averaged shear of each node."""
    relaxed: FloatArray = sized((N_RELAXED, "relaxing"), is_for_vectors=True)
    """Stress that has relaxed in each tetrahedron [Pa], the sum of all terms, in blocks of seven
    rows; empty where no stress relaxes."""
    relaxed_terms: FloatArray = sized((N_RELAXED, "relaxing_terms"), is_for_vectors=True)
    """The same of each term, in blocks of seven rows for each term."""
    node_relaxed: FloatArray = sized((N_RELAXED, "averaging_relaxing"), is_for_vectors=True)
    """Stress that has relaxed in the averaged shear of each node, as `relaxed`; its pressure is
    0."""
    node_relaxed_terms: FloatArray = sized(
        (N_RELAXED, "averaging_relaxing_terms"), is_for_vectors=True
    )
    """The same of each term."""
    first: IntArray = sized("nodes")
    """Where each node's row begins in the pool, shape (nodes,)."""
    room: IntArray = sized("nodes")
    """Slots reserved for each node's row, shape (nodes,)."""
    count: IntArray = sized("nodes")
    """Tetrahedra around each node, shape (nodes,). Its row is padded to a multiple of eight slots
    with places that always hold 0."""
    around: SlotArray = sized("pool")
    """Place in `dilated` of the tetrahedron of each slot, in order of tetrahedra; one that always
    holds 0 where it is not averaged around the node. Shape (pool,)."""
    corner: SlotArray = sized("pool")
    """Row of `forces` with the force on the corner of each slot, shape (pool,)."""
    node_volume: FloatArray = sized("padded_nodes")
    """A quarter of each tetrahedron that is averaged around the node, at rest [m3], shape
    (nodes,)."""
    weight: FloatArray = sized("nodes")
    """Weight of each node in the bound on frequencies [1/kg^0.5] (`frequency.at_rest`), shape
    (nodes,)."""
    dilatation: FloatArray = sized("nodes")
    """Term of the averaged volume of each node in that bound [N/m3/kg^0.5], shape (nodes,)."""
    frequency_squared: FloatArray = sized("nodes")
    """Bound on the square of the local angular frequency [1/s2], shape (nodes,)."""
    ring: FloatArray = sized(LARGEST_RING, 3)
    """Scratch of `frequency.at_rest`: sums at the nodes of a star, shape (LARGEST_RING, 3)."""
    rest_ring: FloatArray = sized(LARGEST_RING, 3)
    """Scratch of `frequency.at_rest`: the same at rest, shape (LARGEST_RING, 3)."""
    ring_nodes: IntArray = sized(LARGEST_RING)
    """Scratch of `frequency.at_rest`: the nodes of a star, shape (LARGEST_RING,)."""
    listed: IntArray = sized("nodes")
    """Nodes whose bound was written by the last call of `frequency.at_rest`, shape (nodes,)."""
    raised: IntArray = sized("nodes")
    """Scratch of `frequency.at_rest`: nodes given a larger weight, shape (nodes,)."""
    used: IntCell
    """Number of slots of the pool in use."""
    every: IntArray
    """The list 0, 1, 2 ... of all blocks, of all nodes, or of all tetrahedra."""
    displacement: FloatArray = sized("nodes", 4, is_for_vectors=True)
    """Scratch: displacements of the nodes [m], shape (nodes, 4), the last column 0."""
    gradient: FloatArray = sized((9, "in_blocks_of_singles"), is_for_vectors=True)
    """Scratch, in single precision: H of each tetrahedron, in blocks of nine rows, xx, xy, xz and
    so on."""
    gradient_rows: FloatArray = sized("averaged_behind_a_block", 16, is_for_vectors=True)
    """Scratch: V H of tetrahedron t [m3], as xx, xy, xz and so on, V (J - 1) and V q, behind a
    first block of zeros; empty where no shear is averaged (`tissue.elasticity.averaged_shear`)."""
    node_gradient: FloatArray = sized("averaging_nodes", 16, is_for_vectors=True)
    """Scratch: H, J - 1 and q averaged around each node."""
    node_stress: FloatArray = sized("averaging_nodes", 16, is_for_vectors=True)
    """Scratch: the stress and the pressure that these give, and the shear modulus that tetrahedra
    take back [Pa]."""
    node_stiffness: FloatArray = sized("averaging_nodes", is_for_vectors=True)
    """Scratch, under laws that stiffen: a bound on the shear modulus there over that at rest."""
    stiffness_taken: FloatArray = sized("averaging_nodes", is_for_vectors=True)
    """Scratch: a bound on the shear that tetrahedra take back there, over what is averaged."""
    dilated: FloatArray = sized("behind_a_block", is_for_vectors=True)
    """Scratch: V (J - 1) of tetrahedron t [m3], behind a first block of zeros."""
    growth: FloatArray = sized("behind_a_block", is_for_vectors=True)
    """Scratch of `frequency.quick` and of energies: growth of the faces of tetrahedron t,
    behind a first block."""
    tested_growth: FloatArray = sized("behind_a_block", fill=1.0, is_for_vectors=True)
    """Growth of the faces of tetrahedron t when the bound was last evaluated at its nodes, behind a
    first block (`frequency.strained`); 1 where it was not."""
    tested_bound: FloatArray = sized("behind_a_block", is_for_vectors=True)
    """Bound on w^2 at the nodes of tetrahedron t that was found then [1/s2], behind a first
    block; 0 where it was not evaluated."""
    inverse_bound: FloatArray = sized("behind_a_block", is_for_vectors=True)
    """One over the highest bound on w^2 at rest at the nodes of tetrahedron t [s2], behind a first
    block. Where a node has got mass since, it is smaller than that."""
    shear_share: FloatArray = sized("behind_a_block", is_for_vectors=True)
    """Share of that bound that the shear part of the law alone would have [1]."""
    strained_bound: FloatArray = sized("behind_a_block", is_for_vectors=True)
    """Scratch of `frequency.quick`: a quick bound on w^2 of tetrahedron t [1/s2], behind a first
    block."""
    fast_blocks: IntArray = sized("blocks")
    """Scratch of `frequency.quick`: blocks with a tetrahedron that may be too fast."""
    stiffening: FloatArray = sized("behind_a_block", is_for_vectors=True)
    """Scratch, behind a first block: under laws that stiffen g of tetrahedron t, its shear modulus
    over that at rest (`tissue.laws.kernels`), else s [Pa] (`neo_hookean`)."""
    stiffening_slope: FloatArray = sized("behind_a_block", is_for_vectors=True)
    """Scratch of `frequency.quick`, under laws that stiffen: how fast that rises."""
    stiffness: FloatArray = sized("behind_a_block", is_for_vectors=True)
    """Scratch of `frequency.quick`, under laws that stiffen: a bound on the stiffness of the
    shear part over that at rest."""
    tested_stiffness: FloatArray = sized("behind_a_block", fill=1.0, is_for_vectors=True)
    """`stiffness` at the test of `tested_growth`."""
    shear_frequency_squared: FloatArray = sized("nodes")
    """The part of `frequency_squared` that the shear part of the law alone would have [1/s2],
    under laws that stiffen; shape (nodes,)."""
    strained_dilatation: FloatArray = sized("nodes")
    """Scratch of `frequency.strained`: `dilatation` as the body is deformed, shape (nodes,)."""
    strained_frequency_squared: FloatArray = sized("nodes")
    """Scratch of `frequency.strained`: `frequency_squared` as it is deformed, shape (nodes,)."""
    dilatation_test: IntArray = sized("nodes")
    """Test in which `strained_dilatation` was written, shape (nodes,)."""
    frequency_test: IntArray = sized("nodes")
    """Test in which `strained_frequency_squared` was written, shape (nodes,)."""
    test: IntCell
    """Number of the test of strained frequencies."""
    are_gradients_known: IntCell
    """1 where `gradient` and `dilated` are those at the body's positions, for the next step."""
    is_bound_current: IntCell
    """1 where no tetrahedron has changed since `strained_frequency` was run for the next step."""
    fastest: IntCell
    """Tetrahedron that set the number of steps in the last test, or -1 where none did."""
    pressure: FloatArray = sized("padded_nodes", 4, is_for_vectors=True)
    """Scratch: lam (J - 1) of each node [Pa], tension is positive, four times in a row
    (`values_of_rows`); shape (nodes, 4)."""
    forces: FloatArray = sized((16, "behind_a_block"), 4, is_for_vectors=True)
    """Scratch: force on each corner of each tetrahedron [N], as rows x, y, z, z, shape (rows, 4):
    a block of rows that are 0, then for each block its corners 0, 1, 2 and 3 (`corner_row`)."""


def no_solid(
    law: EnergyDensity,
    n_nodes: int,
    n_tetrahedra: int,
    pool: int,
    *,
    series: tuple[FloatArray, FloatArray] = (_NO_TERMS, _NO_TERMS),
    is_single: bool = False,
    is_graded: bool = False,
    retardation_time: float = 0.0,
) -> Solid:
    """Return empty rows with room for that many nodes, tetrahedra and slots.

    Args:
        law: The law of the tetrahedra.
        n_nodes: Number of nodes.
        n_tetrahedra: Number of tetrahedra.
        pool: Number of slots.
        series: g and tau [s] of each term of the Prony series of each material, shape (n_terms,
            n_materials); no term where no stress relaxes.
        is_single: Whether forces are computed in single precision.
        is_graded: Whether tetrahedra have moduli of their own.
        retardation_time: Of the body [s].
    """
    real = np.float32 if is_single else np.float64
    shares, times = series
    return Solid.new(
        _sizes(law, n_nodes, n_tetrahedra, pool, len(shares), is_single, is_graded),
        real=real,
        law=law,
        retardation_time=float(retardation_time),
        n_terms=len(shares),
        relaxing_shares=shares.ravel(),
        relaxation_times=times.ravel(),
        relaxation_weights=np.zeros(shares.size),
        every=np.arange(max(n_nodes, n_tetrahedra) + 2 * WIDTH),
        fastest=-1,
    )


def _sizes(
    law: EnergyDensity,
    n_nodes: int,
    n_tetrahedra: int,
    pool: int,
    n_terms: int,
    is_single: bool,
    is_graded: bool,
) -> dict[str, int]:
    """Return the sizes of the arrays of `Solid` for that much."""
    width = 2 * WIDTH if is_single else WIDTH
    blocks = (n_tetrahedra + width - 1) // width
    averages = law.shear_of_nodes != 0.0
    averaging = n_nodes + 2 * WIDTH if averages else 0
    return {
        "nodes": n_nodes,
        "graded": width * blocks if is_graded else 0,
        "graded_nodes": n_nodes + 2 * WIDTH if is_graded else 0,
        "padded_nodes": n_nodes + 2 * WIDTH,
        "averaging_nodes": averaging,
        "averaging_relaxing": averaging if n_terms else 0,
        "averaging_relaxing_terms": averaging * n_terms,
        "averaged_behind_a_block": width * (1 + blocks) if averages else 0,
        "pool": pool,
        "graded_terms": width * blocks * n_terms if is_graded else 0,
        "graded_node_terms": averaging * n_terms if is_graded else 0,
        "blocks": blocks,
        "in_blocks": width * blocks,
        "in_blocks_of_singles": width * blocks if is_single else 0,
        "relaxing": width * blocks if n_terms else 0,
        "relaxing_terms": width * blocks * n_terms,
        "behind_a_block": width * (1 + blocks),
    }


def grown_solid(solid: Solid, n_nodes: int, n_tetrahedra: int, pool: int) -> Solid:
    """Return the rows with room for that many nodes, tetrahedra and slots."""
    is_single = solid.shape.dtype == np.float32
    n_terms = solid.n_terms
    sizes = _sizes(
        solid.law, n_nodes, n_tetrahedra, pool, n_terms, is_single, bool(is_graded(solid))
    )
    larger = solid.grown(sizes)
    larger.sites[larger.sites == nothing_averaged(solid)] = nothing_averaged(larger)
    return larger.replaced(every=np.arange(max(n_nodes, n_tetrahedra) + 2 * WIDTH))


@inlined
def nothing_averaged(solid: Solid) -> int:
    """Return the row of nodes that has no averages: the last one, behind those of any vector."""
    return len(solid.node_volume) - 1


@kernel
def n_blocks(solid: Solid, n_tetrahedra: int) -> int:
    """Return how many blocks hold that many tetrahedra."""
    width = width_of(solid.shape)
    return (n_tetrahedra + width - 1) // width


@inlined
def node_place(solid: Solid, t: int, k: int) -> int:
    """Return where node `k` of tetrahedron `t` is in `nodes`."""
    width = width_of(solid.shape)
    place: int = width * (4 * (t // width) + k) + t % width
    return place


@kernel
def shape_place(solid: Solid, t: int, which: int) -> int:
    """Return where quantity `which` of tetrahedron `t` is in `shape`."""
    width = width_of(solid.shape)
    place: int = width * (N_SHAPE * (t // width) + which) + t % width
    return place


@kernel
def corner_row(solid: Solid, t: int, k: int) -> int:
    """Return the row of `forces` with the force on corner `k` of tetrahedron `t`."""
    width = width_of(solid.shape)
    row: int = width * (4 * (1 + t // width) + k) + row_of_lane(t % width, width)
    return row


@inlined
def is_graded(solid: Solid) -> bool:
    """Return whether tetrahedra have moduli of their own."""
    return len(solid.node_label) > 0


@inlined
def averages_shear(solid: Solid) -> bool:
    """Return whether a share of the shear acts on gradients averaged around nodes."""
    return solid.law.shear_of_nodes != 0.0
