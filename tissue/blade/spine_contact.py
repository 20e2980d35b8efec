"""Contact of the blade's blunt sides, its back and its two ends, with the skin: pressure, friction.

These sides push and do not cut. They are as thin as the blade, and meet the skin along a line. Each
is sampled at points b_k, each for a length l_k of it. A sample that has come through the skin from
outside presses on the point a_k of the skin ahead of it: a spring of stiffness K pushes a_k
along the outward direction d of that side,

    U = 1/2 K (d . (b - a))^2      N = K d . (b - a)

and friction, a spring of the same stiffness across d, yields at Coulomb's limit. A sample that
comes into the tissue otherwise, through the mouth of a cut, touches nothing.

The end at the tip is a point: where it presses harder than toughness times length it pierces, and
the point that holds it slips forward through the material, as those of the cutting edge do
(`tissue.blade.return_mapping`). It pays for the area; the mesh is opened where the edge follows.
"""

import math
from typing import NamedTuple

import numpy as np

from tissue.blade.edge import BladePose, Edge, pose_at
from tissue.blade.toughness import (
    SIDE,
    ToughnessLaw,
    skin_toughness_of,
    toughening_at,
    toughness_of,
)
from tissue.blade_shape import BladeShape
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, axpy, dot, scale, sub, vec3
from tissue.geometry.tetrahedron import Weights, interpolate
from tissue.material import Material
from tissue.mesh.body import Body

IDLE, AWAY, PRESSING, PIERCING = 0, 1, 2, 3
"""State of a sample: IDLE, of a side that does not go ahead, or in the tissue without touching it,
as in a cut; AWAY from the tissue, so that it meets the skin next; PRESSING on the skin; PIERCING,
through the skin and held by tissue that it has yet to part."""

BACK, HEEL_END, TIP_END = 0, 1, 2
"""The blunt sides."""

SPINE_SAMPLES_PER_NODE_SIZE = 4.0
"""Samples of a blunt side per mean node size."""

RESOLVED = 0.3
"""Half the width of a strip, per node size, that sinks in as far as a line load on a row of nodes.
Measured in blocks of two mesh sizes and at Poisson's ratios of 0.3 and 0.45, against a strip in a
mesh that resolves it: 0.31 to 0.33, and 0.25 to 0.28 in blocks of a lattice."""

SPREAD = math.log(5.0)
"""Logarithm of the factor by which that strip is wider where the load is borne by nodes whose mean
square distance from the line is the square of a node size. A node of a grid sinks in as far as a
line load seen from 0.2 cells (Peaceman 1978, Soc. Pet. Eng. J. 18:183), and two nodes that bear
shares p and 1 - p of it as from 0.2^(1 - 2 p (1 - p)) cells; a cell of a block is 1.41 node sizes.
The measured logarithms follow this within 0.05."""

STIFFEST = 8.0
"""Stiffness of a sample per Young's modulus and length, at most: of a blade that is as thick as the
elements are large. Higher: shorter steps."""


class StripLaw(Arrays):
    """Depth to which a blunt side sinks into the tissue between it and the nodes around it."""

    unit: float
    """Load per length and depth at which the logarithm is 1 [Pa]."""
    logarithm: float
    """Logarithm of the width that the mesh resolves where a row of nodes bears the load, over the
    thickness of the blade."""
    node_size: float
    """Mean node size of the body [m]."""
    most: float
    """Stiffness per length at most [Pa]."""


class SpineContacts(Arrays):
    """The samples of the back and the two ends of the blade, and where they touch the skin."""

    n_pressing: IntCell
    """Number of samples that press or pierce."""
    law: StripLaw
    """Depth to which the sides sink into the tissue that the mesh does not resolve."""
    state: IntArray
    """IDLE, AWAY, PRESSING or PIERCING, shape (n,)."""
    side: IntArray
    """BACK, HEEL_END or TIP_END, shape (n,)."""
    along: FloatArray
    """Distance of each sample from the tip along the edge [m], shape (n,)."""
    behind: FloatArray
    """Distance of each sample behind the edge [m], shape (n,)."""
    length: FloatArray
    """Length of the side that the sample stands for [m], shape (n,)."""
    stiffness: FloatArray
    """Stiffness of the sample's spring [N/m], which depends on where it touches; shape (n,)."""
    tetrahedron: IntArray
    """Tetrahedron of the point of the skin, shape (n,)."""
    weights: FloatArray
    """Barycentric weights of the point in it, shape (n, 4)."""
    rest: FloatArray
    """The point in the body at rest [m], shape (n, 3)."""
    held: FloatArray
    """Stretch of friction when the point was taken [m], in the plane of the blade and across it;
    shape (n, 2)."""
    energy: FloatArray
    """Energy stored in the sample when slip was applied last [J], shape (n,)."""
    relative: FloatArray
    """`ToughnessLaw.relative` of the tissue that each sample touches, shape (n, 4)."""
    material: IntArray
    """Row of that tissue among the materials of the body, shape (n,)."""
    friction: FloatArray
    """Its coefficient of friction, shape (n,)."""
    speed: FloatArray
    """Speed at which the tip's end moves outward in this step [m/s], shape (n,); 0 of other
    sides. It decides the toughness, as that of the edge does."""


class SpineSide(NamedTuple):
    """The axes of a sample."""

    at: Vec3
    """Position of the sample [m]."""
    outward: Vec3
    """Unit vector out of the blade."""
    beside: Vec3
    """Unit vector along the side, in the plane of the blade."""


class Press(NamedTuple):
    """Pressure of a sample on the point ahead of it."""

    depth: float
    """Depth of the point behind the sample [m], up to where it pierces; negative: no contact."""
    surplus: float
    """Depth beyond that [m]."""
    beside: float
    """Stretch of friction along the side, within its limit [m]."""
    across: float
    """Stretch of friction across the blade, within its limit [m]."""
    slide: float
    """Length of that stretch beyond the limit [m]."""


def no_spine_contacts() -> SpineContacts:
    """Return that the blade has no blunt sides: it is a line."""
    law = StripLaw(unit=1.0, logarithm=1.0, node_size=1.0, most=1.0)
    return _new_contacts(0.0, law, np.zeros((0, 5)))


def new_spine_contacts(
    shape: BladeShape, edge_length: float, material: Material, node_size: float
) -> SpineContacts:
    """Return the samples of a blade that touches nothing.

    Args:
        shape: Shape of the blade.
        edge_length: Length of its edge [m].
        material: The tissue.
        node_size: Mean node size of the body [m].
    """
    spacing = node_size / SPINE_SAMPLES_PER_NODE_SIZE
    law = strip_law_of(shape, material, node_size)
    per_length = strip_stiffness(law, 0.0)
    rows = []
    for side, size in ((BACK, edge_length), (HEEL_END, shape.height), (TIP_END, shape.height)):
        n = math.ceil(size / spacing)
        for i in range(n):
            place = (i + 0.5) / n * size
            along = place if side == BACK else (edge_length if side == HEEL_END else 0.0)
            behind = shape.height if side == BACK else place
            rows.append((side, along, behind, size / n, per_length * size / n))
    return _new_contacts(float(material.blade_friction), law, np.array(rows))


def strip_law_of(shape: BladeShape, material: Material, node_size: float) -> StripLaw:
    """Return the law of a blunt side as wide as the blade is thick.

    A strip of half the width a sinks into a half-space by 2 (1 - nu^2) / (pi E) ln(2 R / a) times
    the load per length, seen from a distance R (Johnson 1985, Contact Mechanics, section 2.7). The
    mesh gives that of a strip as wide as `RESOLVED` and `SPREAD` say; this is the rest.
    """
    return StripLaw(
        unit=float(0.5 * math.pi * material.young_modulus / (1.0 - material.poisson_ratio**2)),
        logarithm=float(math.log(RESOLVED * node_size / (0.5 * shape.thickness))),
        node_size=float(node_size),
        most=float(STIFFEST * material.young_modulus),
    )


@kernel
def strip_stiffness(law: StripLaw, mean_square: float) -> float:
    """Return the stiffness of a blunt side per length [Pa].

    Args:
        law: The law of the side.
        mean_square: Mean square distance across the blade of the nodes that bear the load [m2].
    """
    logarithm = law.logarithm + SPREAD * mean_square / law.node_size**2
    return law.unit / max(logarithm, law.unit / law.most)


@kernel
def fit_stiffness(spine: SpineContacts, body: Body, k: int, normal: Vec3) -> None:
    """Write the stiffness of sample `k` for the point of the skin that it touches now.

    `normal`: unit normal of the blade's plane.
    """
    point = touched_point(spine, body, body.positions, k)
    mean_square = 0.0
    for q in range(4):
        node = vec3(body.positions, body.tetrahedra[spine.tetrahedron[k], q])
        mean_square += spine.weights[k, q] * dot(sub(node, point), normal) ** 2
    stiffness = spine.relative[k, SIDE] * strip_stiffness(spine.law, mean_square)
    spine.stiffness[k] = stiffness * spine.length[k]


def _new_contacts(friction: float, law: StripLaw, rows: FloatArray) -> SpineContacts:
    n = len(rows)
    side, along, behind, length, stiffness = rows.T.copy()
    return SpineContacts(
        n_pressing=0,
        law=law,
        state=np.full(n, IDLE),
        side=side.astype(np.int64),
        along=along,
        behind=behind,
        length=length,
        stiffness=stiffness,
        tetrahedron=np.zeros(n, np.int64),
        weights=np.zeros((n, 4)),
        rest=np.zeros((n, 3)),
        held=np.zeros((n, 2)),
        energy=np.zeros(n),
        relative=np.ones((n, 4)),
        material=np.zeros(n, np.int64),
        friction=np.full(n, friction),
        speed=np.zeros(n),
    )


@kernel
def measure_tip_speeds(spine: SpineContacts, edge: Edge, dt: float) -> None:
    """Write the outward speed of each sample of the tip's end in a time step of `dt` [s]."""
    before, after = pose_at(edge, 0.0), pose_at(edge, 1.0)
    along = pose_at(edge, 0.5).along
    for k in range(len(spine.state)):
        if spine.side[k] == TIP_END:
            moved = sub(spine_side(spine, after, k).at, spine_side(spine, before, k).at)
            spine.speed[k] = max(-dot(moved, along), 0.0) / dt if dt > 0.0 else 0.0


@kernel
def spine_side(spine: SpineContacts, pose: BladePose, k: int) -> SpineSide:
    """Return where sample `k` is, and its axes."""
    at = axpy(-spine.behind[k], pose.forward, axpy(spine.along[k], pose.along, pose.tip))
    if spine.side[k] == BACK:
        return SpineSide(at, scale(-1.0, pose.forward), pose.along)
    if spine.side[k] == HEEL_END:
        return SpineSide(at, pose.along, pose.forward)
    return SpineSide(at, scale(-1.0, pose.along), pose.forward)


@kernel
def touched_point(spine: SpineContacts, body: Body, positions: FloatArray, k: int) -> Vec3:
    """Return the point that sample `k` touches, with the nodes at `positions` [m]."""
    w = spine.weights
    weights = Weights(w[k, 0], w[k, 1], w[k, 2], w[k, 3])
    return interpolate(weights, positions, body.tetrahedra, spine.tetrahedron[k])


@kernel
def press_of(
    spine: SpineContacts,
    k: int,
    side: SpineSide,
    normal: Vec3,
    point: Vec3,
    law: ToughnessLaw,
) -> Press:
    """Return how sample `k` presses.

    Args:
        spine: The samples.
        k: Which of them.
        side: Its axes.
        normal: Normal of the blade's plane.
        point: The point that it touches [m].
        law: Toughness of the tissue.
    """
    stretch = sub(side.at, point)
    depth = dot(stretch, side.outward)
    surplus = 0.0
    if spine.side[k] == TIP_END:
        surplus = max(depth - piercing_depth(spine, k, law), 0.0)
    if spine.state[k] == PIERCING or depth <= 0.0:
        return Press(depth - surplus, surplus, 0.0, 0.0, 0.0)
    beside = spine.held[k, 0] + dot(stretch, side.beside)
    across = spine.held[k, 1] + dot(stretch, normal)
    size = np.sqrt(beside * beside + across * across)
    most = spine.friction[k] * (depth - surplus)
    if size <= most:
        return Press(depth - surplus, surplus, beside, across, 0.0)
    return Press(depth - surplus, surplus, beside * most / size, across * most / size, size - most)


@kernel
def piercing_depth(spine: SpineContacts, k: int, law: ToughnessLaw) -> float:
    """Return the depth at which sample `k` of the tip's end pierces [m]."""
    depth: float = tip_toughness(spine, k, law) * spine.length[k] / spine.stiffness[k]
    return depth


@kernel
def tip_toughness(spine: SpineContacts, k: int, law: ToughnessLaw) -> float:
    """Return the energy per area at which sample `k` of the tip's end pierces [J/m2]."""
    relative = spine.relative
    toughening = toughening_at(law, spine.material[k], spine.speed[k])
    if spine.state[k] == PIERCING:
        toughness: float = toughness_of(law, relative, k, toughening)
    else:
        toughness = skin_toughness_of(law, relative, k, toughening)
    return toughness


@kernel
def press_energy(spine: SpineContacts, k: int, press: Press) -> float:
    """Return the energy stored in sample `k` [J], with what a surplus is about to spend."""
    if press.depth <= 0.0:
        return 0.0
    friction = np.sqrt(press.beside * press.beside + press.across * press.across)
    squares = press.depth * press.depth + friction * friction
    surplus = press.depth * press.surplus + friction * press.slide
    energy: float = spine.stiffness[k] * (0.5 * squares + surplus)
    return energy


@kernel
def press_force(spine: SpineContacts, k: int, side: SpineSide, normal: Vec3, press: Press) -> Vec3:
    """Return the force of a sample on the tissue [N].

    Args:
        spine: The samples.
        k: Which of them.
        side: Its axes.
        normal: Normal of the blade's plane.
        press: How it presses.
    """
    if press.depth <= 0.0:
        return Vec3(0.0, 0.0, 0.0)
    force = scale(press.depth, side.outward)
    force = axpy(press.across, normal, axpy(press.beside, side.beside, force))
    return scale(spine.stiffness[k], force)


@kernel
def spine_energy(spine: SpineContacts, body: Body, pose: BladePose, law: ToughnessLaw) -> float:
    """Return the energy stored in the blunt sides with the body where it is [J]."""
    energy = 0.0
    if spine.n_pressing > 0:
        for k in range(len(spine.state)):
            if spine.state[k] >= PRESSING:
                side = spine_side(spine, pose, k)
                point = touched_point(spine, body, body.positions, k)
                press = press_of(spine, k, side, pose.normal, point, law)
                energy += press_energy(spine, k, press)
    return energy
