"""Tetrahedra with moduli of their own: bodies of several materials, and of one that varies.

Each tetrahedron has the constants of its own law. A part of the volume term acts on volumes that
are averaged around nodes, which have one modulus each: the mean over the tetrahedra there, by
volume. Where labels meet, only the tetrahedra of one of them are averaged, that which bears most
there: Young's modulus times volume. Each of the others keeps its own share of the node,

    V_n K_n / 2 (J_n - 1)^2     becomes     sum of V_t / 4 K_t / 2 (J_t - 1)^2

So it is with shear, where a share of it is averaged (`tissue.elasticity.averaged_shear`). Strain
jumps at a border, and pressure may: so the energy is exact where the strain of each part is even,
in layers in series as in parallel. An average across the border would be right in one of the two.
Tetrahedra that average nothing are stiffer, and the step shorter: in the organ with ten labels of
one modulus 0.67 to 0.70 of that of one label without any average at borders, 0.79 to 0.86 so. With
an average of its own for each label around a node it would be 0.92.

Viscosity, which has no law of its own, is divided in the same way.
"""

from typing import Final, NamedTuple

from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes
from tissue.core.simd_blocks import gathered_like, load_block, splat, width_of
from tissue.elasticity.finite_elements import (
    BULK,
    EXPONENT,
    MU,
    N_MODULI,
    N_SHAPE,
    OWN_LAM,
    OWN_SHEAR,
    VISCOUS_LAM,
    VISCOUS_MU,
    VOLUME,
    YEOH_SECOND,
    YEOH_THIRD,
    Solid,
    averages_shear,
    is_graded,
    node_place,
    nothing_averaged,
    shape_place,
)
from tissue.elasticity.stars import is_averaged, tetrahedron_of_slot
from tissue.geometry.tetrahedron import tetrahedron_volume
from tissue.laws.kernels import LawOfBlock, same_law, stiffens
from tissue.mesh.body import Body

LEAST_LAM: Final = -2.0 / 3.0
"""lam over mu at which the bulk modulus is 0."""

NO_MODULUS: Final = 1.0
"""A modulus far below any [Pa], in place of 0 where springs alone are elastic."""


def graded_solid(solid: Solid) -> Solid:
    """Return the rows with room for moduli of each tetrahedron, with the same numbers."""
    in_blocks, n_nodes = len(solid.shape) // N_SHAPE, len(solid.first)
    sizes = {"graded": in_blocks, "graded_nodes": n_nodes + 2 * WIDTH}
    sizes["graded_terms"] = in_blocks * solid.n_terms
    sizes["graded_node_terms"] = len(solid.stiffness_taken) * solid.n_terms
    return solid.grown(sizes)


@inlined
def law_of_block(solid: Solid, block: int, like: Lanes) -> LawOfBlock:
    """Return the laws of the tetrahedra of a block; `like`: a vector of the type of numbers."""
    if not is_graded(solid):
        return same_law(solid.law, like)
    return LawOfBlock(
        solid.law,
        modulus_of(solid, block, MU),
        modulus_of(solid, block, EXPONENT),
        modulus_of(solid, block, YEOH_SECOND),
        modulus_of(solid, block, YEOH_THIRD),
    )


@inlined
def modulus_of(solid: Solid, block: int, which: int) -> Lanes:
    """Return a number of `Solid.moduli` of the tetrahedra of a block, where there are any."""
    return load_block(solid.moduli, width_of(solid.shape) * (N_MODULI * block + which))


@inlined
def own_lam_of(solid: Solid, block: int, like: Lanes) -> Lanes:
    """Return the modulus of J of each tetrahedron of a block by itself [Pa], as `law_of_block`."""
    if not is_graded(solid):
        return splat(solid.law.lam_of_tetrahedra, like)
    return modulus_of(solid, block, OWN_LAM)


@inlined
def shear_modulus_of(solid: Solid, block: int, like: Lanes) -> Lanes:
    """Return the shear moduli at small strain of a block [Pa], as `law_of_block`."""
    if not is_graded(solid):
        return splat(solid.law.shear_modulus, like)
    mu = modulus_of(solid, block, MU)
    return mu if stiffens(solid.law) else splat(0.75, like) * mu


@inlined
def own_share_of(solid: Solid, block: int, like: Lanes) -> Lanes:
    """Return the share of the shear that is not averaged, of a block, as `law_of_block`."""
    if not is_graded(solid):
        return splat(1.0 - solid.law.shear_of_nodes, like)
    return modulus_of(solid, block, OWN_SHEAR)


@inlined
def own_share_of_one(solid: Solid, t: int) -> float:
    """Return the share of the shear that is not averaged of a tetrahedron."""
    if not is_graded(solid):
        return 1.0 - solid.law.shear_of_nodes
    share: float = solid.moduli[_place(solid, t, OWN_SHEAR)]
    return share


@inlined
def law_of_nodes(solid: Solid, first: int, like: Lanes) -> LawOfBlock:
    """Return the laws of the averages of a vector of nodes; `like`: of the type of numbers."""
    if not is_graded(solid):
        return same_law(solid.law, like)
    return LawOfBlock(
        solid.law,
        of_nodes(solid, solid.node_mu, first, like),
        of_nodes(solid, solid.node_exponent, first, like),
        of_nodes(solid, solid.node_second, first, like),
        of_nodes(solid, solid.node_third, first, like),
    )


@inlined
def of_nodes(solid: Solid, values: FloatArray, first: int, like: Lanes) -> Lanes:
    """Return the values of a vector of nodes, of those that bodies with moduli of their own have.

    Args:
        solid: For the numbers of nodes.
        values: One of its arrays.
        first: The first node.
        like: A vector of the type of numbers.
    """
    return gathered_like(like, values, solid.every, first)


@inlined
def shear_of_nodes(solid: Solid, first: int, like: Lanes) -> Lanes:
    """Return the shear moduli of the averages of a vector of nodes [Pa], as `law_of_nodes`."""
    if not is_graded(solid):
        return splat(solid.law.shear_modulus, like)
    return of_nodes(solid, solid.node_shear, first, like)


@inlined
def lam_of_nodes(solid: Solid, first: int, like: Lanes) -> Lanes:
    """Return the moduli of the averaged volumes of a vector of nodes [Pa], as `law_of_nodes`."""
    if not is_graded(solid):
        return splat(solid.law.lam_of_nodes, like)
    return of_nodes(solid, solid.node_modulus, first, like)


@inlined
def modulus_of_node(solid: Solid, node: int) -> float:
    """Return the modulus of the averaged volume of a node [Pa]."""
    if not is_graded(solid):
        return solid.law.lam_of_nodes
    modulus: float = solid.node_modulus[node]
    return modulus


@inlined
def shear_of_node(solid: Solid, node: int) -> float:
    """Return the shear modulus of the averages of a node [Pa]."""
    if not is_graded(solid):
        return solid.law.shear_modulus
    modulus: float = solid.node_shear[node]
    return modulus


@inlined
def own_moduli(solid: Solid, body: Body, t: int) -> tuple[float, float]:
    """Return mu and lam of a tetrahedron by itself at small strain [Pa], lam not too low."""
    row, materials = body.material[t], body.materials
    share = solid.moduli[_place(solid, t, OWN_SHEAR)]
    lam = solid.moduli[_place(solid, t, OWN_LAM)] - share * materials.excess[row]
    mu = share * materials.shear_modulus[row]
    return mu, max(lam, LEAST_LAM * mu)


@inlined
def _place(solid: Solid, t: int, which: int) -> int:
    """Return where a number of a tetrahedron is in `Solid.moduli`."""
    width = width_of(solid.shape)
    place: int = width * (N_MODULI * (t // width) + which) + t % width
    return place


@kernel
def write_moduli(solid: Solid, body: Body, nodes: IntArray, n: int) -> None:
    """Write the moduli of the first `n` of `nodes`, and of all tetrahedra around them.

    Args:
        solid: Written, if tetrahedra have moduli of their own; its rows are up to date.
        body: The materials.
        nodes: The nodes.
        n: How many of them.
    """
    if not is_graded(solid):
        return
    for i in range(n):
        _write_node(solid, body, nodes[i])
    for i in range(n):
        node = nodes[i]
        for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
            _write_tetrahedron(solid, body, tetrahedron_of_slot(solid, slot))


@kernel
def _write_node(solid: Solid, body: Body, node: int) -> None:
    """Write the moduli of the averages of a node: the mean over its tetrahedra, by volume."""
    begin, width = solid.first[node], width_of(solid.shape)
    end = begin + solid.count[node]
    if begin == end:
        return
    chosen = _leading_slot(solid, body, begin, end)
    first = body.material[tetrahedron_of_slot(solid, chosen)]
    label, total, is_even = body.materials.label[first], 0.0, True
    for slot in range(begin, end):
        t = tetrahedron_of_slot(solid, slot)
        solid.around[slot] = 0
        if body.materials.label[body.material[t]] == label:
            solid.around[slot] = width + t
            total += 0.25 * tetrahedron_volume(body.rest, body.tetrahedra, t)
            is_even = is_even and body.material[t] == first
    solid.node_label[node], solid.node_volume[node] = label, total
    if averages_shear(solid):
        _write_series(solid, body, solid.node_series, node, first)
    _clear_node(solid, node)
    if is_even:  # without rounding
        _add_to_node(solid, body, node, first, 1.0)
        return
    for slot in range(begin, end):
        if is_averaged(solid, slot):
            t = tetrahedron_of_slot(solid, slot)
            volume = 0.25 * solid.shape[shape_place(solid, t, VOLUME)]
            _add_to_node(solid, body, node, body.material[t], volume / total)


@kernel
def _leading_slot(solid: Solid, body: Body, begin: int, end: int) -> int:
    """Return a slot of the label that is averaged around a node: that which bears most there.

    Args:
        solid: The rows.
        body: The materials.
        begin: First slot of the row of the node.
        end: End of it.
    """
    materials, leading, most = body.materials, begin, -1.0
    for one in range(begin, end):
        row, borne = body.material[tetrahedron_of_slot(solid, one)], 0.0
        label, is_first = materials.label[row], True
        for slot in range(begin, end):
            t = tetrahedron_of_slot(solid, slot)
            if materials.label[body.material[t]] == label:
                is_first = is_first and slot >= one
                modulus = materials.young_modulus[body.material[t]]
                borne += modulus * solid.shape[shape_place(solid, t, VOLUME)]
            if not is_first:
                break
        is_lower = (
            borne == most
            and label < materials.label[body.material[tetrahedron_of_slot(solid, leading)]]
        )
        if is_first and (borne > most or is_lower):
            leading, most = one, borne
    return leading


@kernel
def _clear_node(solid: Solid, node: int) -> None:
    """Set the moduli of a node to 0."""
    solid.node_modulus[node] = solid.node_shear[node] = solid.node_mu[node] = 0.0
    solid.node_exponent[node] = solid.node_second[node] = solid.node_third[node] = 0.0
    solid.node_viscous_mu[node] = solid.node_viscous_lam[node] = solid.node_excess[node] = 0.0


@kernel
def _add_to_node(solid: Solid, body: Body, node: int, row: int, share: float) -> None:
    """Add a share of the moduli of a material to those of a node.

    Args:
        solid: Written.
        body: The materials.
        node: The node.
        row: The material.
        share: Its share.
    """
    materials, viscous = body.materials, _viscous_moduli(solid, body, row)
    solid.node_modulus[node] += share * materials.lam_of_nodes[row]
    solid.node_shear[node] += share * materials.shear_modulus[row]
    solid.node_mu[node] += share * materials.mu[row]
    solid.node_exponent[node] += share * materials.exponent[row]
    solid.node_second[node] += share * materials.second[row]
    solid.node_third[node] += share * materials.third[row]
    solid.node_excess[node] += share * materials.excess[row]
    solid.node_viscous_mu[node] += share * viscous.mean_mu
    solid.node_viscous_lam[node] += share * viscous.mean_lam


class _ViscousModuli(NamedTuple):
    """Moduli of viscous stress over the retardation time of the body [Pa]."""

    own_mu: float
    """mu of each tetrahedron by itself."""
    own_lam: float
    """lam of each tetrahedron by itself."""
    mean_mu: float
    """mu of averages."""
    mean_lam: float
    """lam of averages."""


@kernel
def _viscous_moduli(solid: Solid, body: Body, row: int) -> _ViscousModuli:
    """Return the moduli of viscous stress of a material."""
    if solid.retardation_time == 0.0:
        return _ViscousModuli(0.0, 0.0, 0.0, 0.0)
    materials, share = body.materials, solid.law.shear_of_nodes
    mu, of_averages = materials.shear_modulus[row], materials.lam_of_nodes[row]
    own_mu, excess = (1.0 - share) * mu, materials.excess[row]
    own = materials.lam_of_tetrahedra[row] - (1.0 - share) * excess
    own_lam = own if of_averages == 0.0 else max(own, LEAST_LAM * own_mu)
    mean_lam = of_averages - share * excess + (own - own_lam)
    ratio = materials.retardation_time[row] / solid.retardation_time
    return _ViscousModuli(ratio * own_mu, ratio * own_lam, ratio * share * mu, ratio * mean_lam)


@kernel
def _write_tetrahedron(solid: Solid, body: Body, t: int) -> None:
    """Write the moduli of a tetrahedron whose nodes are up to date."""
    row, materials, share = body.material[t], body.materials, solid.law.shear_of_nodes
    mixed = 0.0
    for k in range(4):
        node = solid.nodes[node_place(solid, t, k)]
        is_own = solid.node_label[node] == materials.label[row]
        solid.sites[node_place(solid, t, k)] = node if is_own else nothing_averaged(solid)
        mixed += 0.0 if is_own else 0.25
    of_averages, own = materials.lam_of_nodes[row], materials.lam_of_tetrahedra[row]
    viscous = _viscous_moduli(solid, body, row)
    modulus = max(own + of_averages, NO_MODULUS)
    bulk = modulus - materials.excess[row] + materials.shear_modulus[row] * 2.0 / 3.0
    solid.moduli[_place(solid, t, MU)] = materials.mu[row]
    solid.moduli[_place(solid, t, OWN_LAM)] = own + mixed * of_averages
    solid.moduli[_place(solid, t, OWN_SHEAR)] = 1.0 - share * (1.0 - mixed)
    solid.moduli[_place(solid, t, EXPONENT)] = materials.exponent[row]
    solid.moduli[_place(solid, t, YEOH_SECOND)] = materials.second[row]
    solid.moduli[_place(solid, t, YEOH_THIRD)] = materials.third[row]
    solid.moduli[_place(solid, t, BULK)] = 0.5 * bulk / modulus**2
    solid.moduli[_place(solid, t, VISCOUS_MU)] = viscous.own_mu + mixed * viscous.mean_mu
    solid.moduli[_place(solid, t, VISCOUS_LAM)] = viscous.own_lam + mixed * viscous.mean_lam
    _write_series(solid, body, solid.series, t, row)


@kernel
def _write_series(solid: Solid, body: Body, series: SlotArray, i: int, row: int) -> None:
    """Write where the Prony series of a material is, of a tetrahedron or a node.

    Materials of one label, of which a node may have several, have one series.

    Args:
        solid: For the number of terms.
        body: The materials.
        series: `Solid.series`, or `Solid.node_series`; written.
        i: The tetrahedron, or the node.
        row: The material.
    """
    width, n_terms = width_of(solid.shape), solid.n_terms
    for term in range(n_terms):
        at = width * (n_terms * (i // width) + term) + i % width
        series[at] = len(body.materials.label) * term + row
