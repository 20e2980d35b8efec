"""Elasto-plastic edge anchors: the springs between the cutting edge and the material.

The cutting edge is sampled at points b_k, each for a length l_k of edge. A sample in the tissue is
anchored at a material point a_k, and a spring K (b_k - a_k) pulls the two together: the tissue
dents first. Where the pull exceeds toughness times length, the anchor slips forward through the
material until it does not (`tissue.blade.return_mapping`). The path of the anchors is the path of
the cut, and the work of slipping is the toughness times the area at rest.
"""

import numpy as np

from tissue.blade.body_sheets import BodySheets, new_body_sheets
from tissue.blade.coarse_hold import CoarseHold, new_coarse_hold, weights_of
from tissue.blade.edge import BladePose, Edge, pose_at, sample_displacement, sample_point
from tissue.blade.toughness import (
    ANCHOR,
    ToughnessLaw,
    skin_toughness_of,
    toughening_at,
    toughness_of,
)
from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd_rows import natural
from tissue.core.structs import Arrays
from tissue.core.vec3 import Vec3, axpy, dot, norm, scale, store, sub, vec3
from tissue.geometry.tetrahedron import interpolate
from tissue.material import Material
from tissue.mesh.body import Body
from tissue.mesh.interfaces import NO_LAYER

ANCHOR_STIFFNESS = 4.0
"""Stiffness of an anchor per Young's modulus and length of edge, at least. It stands for the tissue
that is closer to the edge than the mesh resolves; between 4 and 12 the cutting force does not
change."""

LONGEST_STRETCH = 0.3
"""Stretch of an anchor where it slips, per mean node size, at most, under a law that stiffens: the
tissue that it stands for has stiffened there. At 4 times Young's modulus an edge in liver of
164 J/m2 was 8.6 mm ahead of its material, whatever the tissue did; a shorter stretch takes shorter
steps."""

LARGEST_STIFFNESS = 64.0
"""Stiffness of such an anchor per Young's modulus and length of edge, at most: about as much as the
laws can stiffen (`tissue.laws.kernels.LARGEST_EXPONENT`)."""

FREE, ANCHORED, RETRACTED, LEFT = 0, 1, 2, 3
"""State of a sample: FREE, outside the tissue; ANCHORED, pulling on it; RETRACTED, backed off from
where it cut last; LEFT, out through the skin ahead in this step."""


class Anchors(Arrays):
    """The samples of the edge, from the tip to the heel, and the material points that hold them."""

    state: IntArray
    """FREE, ANCHORED, RETRACTED or LEFT, shape (n,)."""
    tetrahedron: IntArray
    """Tetrahedron that holds the anchor, shape (n,)."""
    rest: FloatArray
    """The anchor's material point: its position in the body at rest [m], shape (n, 3)."""
    weights: FloatArray
    """Barycentric weights of the material point in its tetrahedron, shape (n, 4)."""
    nodes: IntArray
    """Nodes of the tetrahedron when the anchor was set in it, shape (n, 4)."""
    coarse: CoarseHold
    """Hold of the anchors in the mesh before it was refined."""
    slipped: BoolArray
    """Whether the anchor has cut since it was set, shape (n,)."""
    at_skin: BoolArray
    """Whether the anchor is at the skin, which the edge has yet to break; shape (n,)."""
    at_core: BoolArray
    """Whether a rigid core holds the anchor, which does not slip then; shape (n,)."""
    is_new: BoolArray
    """Whether the anchor was set since the path was traced last; shape (n,)."""
    pulls: BoolArray
    """Whether the energy of the anchor is in the account: the edge was not behind it where slip was
    applied last, or where the anchor was set; shape (n,)."""
    offset: FloatArray
    """Distance along the normal of the blade by which the edge has moved aside of the anchor while
    it was behind it [m], shape (n,): the plastic part of the stretch across the blade. Else an edge
    that comes back next to where it cut would pull at once, with energy out of nothing."""
    stretch: FloatArray
    """Vector from the anchor to the point that pulled on it where its account began
    (`begin_account`) [m], shape (n, 3)."""
    impulse: FloatArray
    """Impulse of the anchor on the tissue since then [N s], shape (n, 3)."""
    toughening: FloatArray
    """Share by which the tissue is tougher than in a slow cut, by the forward speed of the sample
    of the edge in this step (`toughening_at`), shape (n,). With the speed of the anchor itself,
    from one short step to the next, the anchor would stick and slip by turns."""
    rest_share: FloatArray
    """Area at rest over area as it is, of what the anchor cuts next; shape (n,). Toughness is an
    energy per area at rest (Rivlin and Thomas 1953), and tissue ahead of an edge is squeezed."""
    rest_area: FloatArray
    """`rest_share` along the normal of that area at rest, shape (n, 3); 0 before the first slip."""
    slips: BoolArray
    """Whether the anchor slipped when slip was applied last, shape (n,)."""
    cut: FloatArray
    """Area at rest that the anchor has cut in this step [m2], shape (n,)."""
    length: FloatArray
    """Length of edge that the sample stands for [m], shape (n,): up to halfway to the next ones, or
    to the skin (`tissue.blade.held_length`)."""
    stiffness: FloatArray
    """Stiffness of the anchor's spring [N/m], shape (n,)."""
    spacing: float
    """Distance between samples next to each other [m]."""
    modulus: float
    """Stiffness of the springs per length of edge in the first material [Pa]."""
    relative: FloatArray
    """`ToughnessLaw.relative` of the tissue that each anchor is in, shape (n, 4)."""
    layer: IntArray
    """Row of `Interfaces` of the layer that each sample follows, or NO_LAYER; shape (n,)."""
    layer_cosine: FloatArray
    """Cosine of the angle between that layer and the blade; 0 as long as the cut is on its way to
    the layer; shape (n,)."""
    sheets: BodySheets
    """The sheet that each sample holds, of its run of samples (`find_sheets`)."""


def anchor_stiffness(
    material: Material, toughness: float, node_size: float, young_modulus: float | None = None
) -> float:
    """Return the stiffness of anchors per length of edge [Pa].

    Args:
        material: The tissue.
        toughness: Energy per area at which anchors slip [J/m2], the highest there is.
        node_size: Mean node size of the body [m].
        young_modulus: Its stiffness [Pa]; None for that of the material.
    """
    modulus = material.young_modulus if young_modulus is None else young_modulus
    least = ANCHOR_STIFFNESS * modulus
    if not material.stiffens:
        return least
    most = LARGEST_STIFFNESS * modulus
    return min(max(least, toughness / (LONGEST_STRETCH * node_size)), most)


def new_anchors(n: int, edge_length: float, stiffness: float) -> Anchors:
    """Return `n` free samples, equally spaced along an edge.

    Args:
        n: Number of samples.
        edge_length: Length of the edge [m].
        stiffness: Stiffness of the anchors per length of edge [Pa].
    """
    spacing = edge_length / (n - 1)
    length = np.full(n, spacing)
    length[[0, -1]] *= 0.5
    return Anchors(
        state=np.zeros(n, dtype=np.int64),
        tetrahedron=np.zeros(n, dtype=np.int64),
        rest=np.zeros((n, 3)),
        weights=np.zeros((n, 4)),
        nodes=np.zeros((n, 4), dtype=np.int64),
        coarse=new_coarse_hold(n),
        slipped=np.zeros(n, dtype=np.bool_),
        at_skin=np.zeros(n, dtype=np.bool_),
        at_core=np.zeros(n, dtype=np.bool_),
        is_new=np.zeros(n, dtype=np.bool_),
        pulls=np.zeros(n, dtype=np.bool_),
        offset=np.zeros(n),
        stretch=np.zeros((n, 3)),
        impulse=np.zeros((n, 3)),
        toughening=np.zeros(n),
        rest_share=np.ones(n),
        rest_area=np.zeros((n, 3)),
        slips=np.zeros(n, dtype=np.bool_),
        cut=np.zeros(n),
        length=length,
        stiffness=stiffness * length,
        spacing=float(spacing),
        modulus=float(stiffness),
        relative=np.ones((n, 4)),
        layer=np.full(n, NO_LAYER),
        layer_cosine=np.ones(n),
        sheets=new_body_sheets(n),
    )


@kernel
def measure_toughening(
    anchors: Anchors, body: Body, edge: Edge, dt: float, law: ToughnessLaw
) -> None:
    """Write the toughening at the forward speed of each sample in a time step.

    Args:
        anchors: Written; a number means nothing where a sample has no anchor.
        body: The tissue, whose material at the anchor decides.
        edge: The cutting edge over the time step.
        dt: Length of the time step [s].
        law: Toughness of the tissue.
    """
    n = len(anchors.state)
    forward = pose_at(edge, 0.5).forward
    for k in range(n):
        moved = sample_displacement(edge, k, n)
        speed = max(dot(moved, forward), 0.0) / dt if dt > 0.0 else 0.0
        material = body.material[anchors.tetrahedron[k]]
        anchors.toughening[k] = toughening_at(law, material, speed)


@kernel
def anchor_position(anchors: Anchors, body: Body, positions: FloatArray, k: int) -> Vec3:
    """Return the material point of anchor `k` in the deformed body, nodes at `positions` [m]."""
    w = weights_of(anchors.weights, k)
    p = interpolate(w, positions, body.tetrahedra, anchors.tetrahedron[k])
    coarse = anchors.coarse
    share = coarse.share[k]
    if share == 0.0:
        return p
    q = interpolate(weights_of(coarse.weights, k), positions, coarse.nodes, k)
    return axpy(share, sub(q, p), p)


@kernel
def pulling_point(anchors: Anchors, pose: BladePose, k: int) -> Vec3:
    """Return the point of the blade that pulls on anchor `k` [m]: its sample, or next to that."""
    b = sample_point(pose, k, len(anchors.state))
    offset = anchors.offset[k]
    if offset == 0.0:
        return b
    return axpy(-offset, pose.normal, b)


@inlined
def n_holding_nodes(anchors: Anchors, k: int) -> int:
    """Return the number of nodes that hold anchor `k`: 4, or 8 where the mesh was just refined."""
    return 4 if anchors.coarse.share[k] == 0.0 else 8


@inlined
def holding_node(anchors: Anchors, body: Body, k: int, i: int) -> int:
    """Return node `i` of those that hold anchor `k`."""
    if i < 4:
        return body.tetrahedra[natural(anchors.tetrahedron[k]), natural(i)]  # type: ignore[no-any-return]
    return anchors.coarse.nodes[k, natural(i - 4)]  # type: ignore[no-any-return]


@inlined
def holding_weight(anchors: Anchors, k: int, i: int) -> float:
    """Return the weight of node `i` of those that hold anchor `k`."""
    share: float = anchors.coarse.share[k]
    if i < 4:
        return (1.0 - share) * anchors.weights[k, natural(i)]  # type: ignore[no-any-return]
    return share * anchors.coarse.weights[k, natural(i - 4)]  # type: ignore[no-any-return]


@kernel
def held_toughness(anchors: Anchors, k: int, law: ToughnessLaw) -> float:
    """Return the energy per area as it is now at which anchor `k` slips [J/m2]."""
    share: float = anchors.rest_share[k]
    relative, toughening = anchors.relative, anchors.toughening[k]
    if anchors.at_skin[k]:
        return share * skin_toughness_of(law, relative, k, toughening)
    return share * toughness_of(law, relative, k, toughening)


@inlined
def anchor_modulus(anchors: Anchors, k: int) -> float:
    """Return the stiffness of anchor `k` per length of edge [Pa]."""
    modulus: float = anchors.relative[k, ANCHOR] * anchors.modulus
    return modulus


@kernel
def surplus_stretch(
    anchors: Anchors, k: int, stretch: Vec3, pose: BladePose, law: ToughnessLaw
) -> Vec3:
    """Return the part of an anchor's stretch that is beyond its yield limit [m].

    The surplus is in the plane of the blade, along the stretch; zero below the limit, and where a
    rigid core holds the anchor.

    Args:
        anchors: The samples.
        k: The anchor.
        stretch: Vector from the anchor to its sample of the edge [m].
        pose: Pose of the blade.
        law: Toughness of the tissue.
    """
    in_plane = axpy(-dot(stretch, pose.normal), pose.normal, stretch)
    distance = norm(in_plane)
    if distance == 0.0 or dot(stretch, pose.forward) < 0.0 or anchors.at_core[k]:
        return scale(0.0, stretch)
    across = dot(in_plane, pose.forward) / distance
    surplus = distance - held_toughness(anchors, k, law) * across / anchor_modulus(anchors, k)
    return scale(max(surplus, 0.0) / distance, in_plane)


@kernel
def stored_energy(
    anchors: Anchors, k: int, stretch: Vec3, pose: BladePose, law: ToughnessLaw
) -> float:
    """Return the energy stored in one anchor [J].

    It is the energy of its spring up to the yield limit, and that of the surplus at the force of
    the limit. The latter is spent when the anchor slips, and recoverable until then.

    Args:
        anchors: The samples.
        k: The anchor.
        stretch: Vector from the anchor to its sample of the edge [m].
        pose: Pose of the blade.
        law: Toughness of the tissue.
    """
    surplus = surplus_stretch(anchors, k, stretch, pose, law)
    stiffness: float = anchors.stiffness[k]
    return energy_of_spring(stiffness, stretch, surplus)


@kernel
def begin_account(anchors: Anchors, k: int, stretch: Vec3, pose: BladePose) -> None:
    """Store the stretch of an anchor [m], from where its work is counted next."""
    anchors.pulls[k] = dot(stretch, pose.forward) >= 0.0
    store(anchors.stretch, k, stretch)
    store(anchors.impulse, k, Vec3(0.0, 0.0, 0.0))


@kernel
def energy_given(
    anchors: Anchors, k: int, stretch: Vec3, pose: BladePose, law: ToughnessLaw, seconds: float
) -> float:
    """Return what an anchor held when its account began and the work done on it since then [J].

    The work is that of the mean force over the change of its stretch. Where an anchor begins or
    ends to pull within a step, the stages of the integrator saw it pull in some of them alone, and
    neither what it held before nor what it holds afterwards is what it gave.

    Args:
        anchors: The samples.
        k: The anchor.
        stretch: Vector from the anchor to the point of the blade that pulls on it now [m].
        pose: Pose of the blade.
        law: Toughness of the tissue.
        seconds: Time since the account began [s].
    """
    before = vec3(anchors.stretch, k)
    energy = stored_energy(anchors, k, before, pose, law) if anchors.pulls[k] else 0.0
    if seconds == 0.0:
        return energy
    return energy + dot(vec3(anchors.impulse, k), sub(stretch, before)) / seconds


@inlined
def energy_of_spring(stiffness: float, stretch: Vec3, surplus: Vec3) -> float:
    """Return the energy of a spring [J] from its stretch and the surplus of that [m]."""
    held = sub(stretch, surplus)
    return stiffness * (0.5 * dot(held, held) + dot(held, surplus))


@kernel
def anchors_energy(anchors: Anchors, body: Body, pose: BladePose, law: ToughnessLaw) -> float:
    """Return the energy stored in all anchors [J]."""
    n = len(anchors.state)
    energy = 0.0
    for k in range(n):
        if anchors.state[k] == ANCHORED:
            a = anchor_position(anchors, body, body.positions, k)
            stretch = sub(pulling_point(anchors, pose, k), a)
            if dot(stretch, pose.forward) >= 0.0:
                energy += stored_energy(anchors, k, stretch, pose, law)
    return energy


@kernel
def anchored_length(anchors: Anchors) -> float:
    """Return the length of edge that pulls on the tissue [m]."""
    length = 0.0
    for k in range(len(anchors.state)):
        if anchors.state[k] == ANCHORED:
            length += anchors.length[k]
    return length


@kernel
def is_engaged(anchors: Anchors) -> bool:
    """Return whether any sample is in the tissue, pulling or backed off."""
    engaged = False
    for k in range(len(anchors.state)):
        engaged = engaged or anchors.state[k] != FREE
    return engaged
