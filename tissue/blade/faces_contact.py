"""The law of contact between the side faces of the blade and the tissue: pressure and friction.

The blade is the set of points whose distance z from its plane is below a profile of their distance
s behind the edge and a from the tip: the least of the two bevels (slope s), half the thickness, the
back and the two ends, all of them planes. Open faces of the tissue (skin, and lips of cuts) touch
it in three contact points each; a point that is within the blade is pressed outwards by

    U = 1/2 k A (profile(a, s) - z)^2      N = k A (profile - z)

with A the area that the point stands for, seen along the normal of the blade. The force on the
tissue is -dU/dx: outwards, and forwards where the profile rises, so that a wedge pays for what it
parts. Friction is a spring of the same stiffness along the face that yields at Coulomb's limit
(stiction below it), plus a viscous part. Pressure and friction act at one point, on the tissue and
on the blade: action is reaction.

A cut opens in the mesh up to an element behind the edge, where the blade has its full thickness. At
a point that is within the blade when it is first found, the profile begins at the point and rises
from there with the slope of the bevel. Otherwise the blade would push at once with its full depth.
"""

from typing import NamedTuple

import numpy as np

from tissue.blade.edge import BladeCoordinates, BladePose
from tissue.blade_shape import BladeShape
from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd_rows import natural
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, axpy, dot, scale, vec3
from tissue.material import Material
from tissue.mesh.body import grown
from tissue.mesh.faces import OUTWARD

FACE_STIFFNESS = 2.0
"""Stiffness of a side face of the blade, as pressure per depth, over Young's modulus per node size.
It stands for the tissue that is closer to the face than the mesh resolves. With 4 the Runge-Kutta
steps of a fine mesh were half as many again."""

POINTS = 3
"""Contact points of a face, each for a third of its area: exact for linear pressure."""
CORNER, OTHER = 2.0 / 3.0, 1.0 / 6.0
"""Weights of a contact point: of its own corner, and of the other two."""

END_SLOPE = 0.5
"""Slope of the blade's back and ends against its plane. Steeper ends would release the tissue
within one step, and need shorter steps."""

SEARCH_MARGIN = 0.5
"""Distance from the blade up to which faces are found, per mean node size: twice as far as the
blade moves between two searches."""

CLEARANCE = 1e-9
"""Distance beyond which a face is surely out of reach of the blade [m]: above any rounding."""

_FACES_AT_FIRST = 64
"""Room for faces at first; it doubles when it is used up."""


class ContactStates(Arrays):
    """State of the faces that are near the blade, and of their contact points."""

    side: FloatArray
    """Side of the blade that the tissue is on: 1 along the blade's normal, or -1; (capacity,)."""
    area: FloatArray
    """Area of each contact point, seen along the normal of the blade [m2]; shape (capacity,)."""
    energy: FloatArray
    """Energy stored between face and blade, by pressure and friction [J]; shape (capacity,)."""
    bevel_shift: FloatArray
    """Height by which the bevel is shifted, for points first found within the blade [m]; shape
    (capacity, 3)."""
    stuck_along: FloatArray
    """Distance from the tip at which friction would be zero [m], shape (capacity, 3)."""
    stuck_behind: FloatArray
    """Distance behind the edge at which friction would be zero [m], shape (capacity, 3)."""
    sliding_speed: FloatArray
    """Speed of the point when sliding was applied last [m/s], shape (capacity, 3)."""


class FaceContacts(Arrays):
    """The faces of the tissue that are near the side faces of the blade, and the law of contact."""

    n_faces: IntCell
    """Number of faces."""
    n_around: IntCell
    """Number of faces in `around`; -1 where they must be listed again."""
    half_thickness: float
    """Half the thickness of the blade [m]; 0 for a blade that is a line."""
    slope: float
    """Slope of the bevels against the blade's plane."""
    height: float
    """Distance from the edge to the back of the blade [m]."""
    stiffness: float
    """Pressure per depth [Pa/m]."""
    margin: float
    """Distance from the blade up to which faces are in contact or may soon be [m]."""
    face: IntArray
    """Each face, as 4 * tetrahedron + corner opposite; shape (capacity,)."""
    node: IntArray
    """Nodes of each face, shape (capacity, 3)."""
    friction: FloatArray
    """Coulomb's coefficient of the tetrahedron behind each face, shape (capacity,)."""
    viscosity: FloatArray
    """Shear stress per sliding speed of that tetrahedron [Pa s/m], shape (capacity,)."""
    of_materials: FloatArray
    """These two of each material of the body, shape (n_materials, 2)."""
    states: ContactStates
    """State of each face."""
    row_of_face: IntArray
    """Row of each face of each tetrahedron, or -1; shape (4 * n_tets,)."""
    around: IntArray
    """Open faces in the cells of the grid that the blade's box met last, in order of their numbers;
    shape (capacity,)."""
    node_around: IntArray
    """Their nodes, of which the first three columns are used, shape (capacity, 4)."""
    is_around: SlotArray
    """1 for each tetrahedron whose open faces are in `around`; shape (n_tets,)."""
    cells: IntArray
    """First cell along each axis that the blade's box met last, then the last; shape (6,)."""
    found: IntArray
    """Scratch: rows of `around` that a search found, in order; shape (capacity,)."""
    row_before: IntArray
    """Scratch: the row that each face found had before, or -1; shape (capacity,)."""
    states_before: ContactStates
    """Scratch: state of each row before a search."""
    divided: IntArray
    """Scratch: rows that a cut divided (`tissue.blade.divided_faces`), shape (capacity,)."""
    node_before: IntArray
    """Scratch: nodes of each of these, shape (capacity, 3)."""
    outward: IntArray
    """`faces.OUTWARD`."""


def new_face_contacts(
    shape: BladeShape | None, material: Material, node_size: float, n_tetrahedra: int
) -> FaceContacts:
    """Return the contacts of a blade that touches nothing; None is a line without side faces."""
    thin = shape is None
    return FaceContacts(
        n_faces=0,
        n_around=-1,
        half_thickness=0.0 if shape is None else float(0.5 * shape.thickness),
        slope=1.0 if shape is None else float(shape.slope),
        height=0.0 if shape is None else float(shape.height),
        stiffness=float(FACE_STIFFNESS * material.young_modulus / node_size),
        margin=float(SEARCH_MARGIN * node_size),
        row_of_face=np.full(0 if thin else 4 * n_tetrahedra, -1, np.int64),
        is_around=np.zeros(0 if thin else n_tetrahedra, np.int32),
        cells=np.full(6, -1, np.int64),
        outward=OUTWARD,
        of_materials=np.array([[material.blade_friction, material.blade_viscosity]]),
        **_rows(0 if thin else _FACES_AT_FIRST),
    )


def _rows(capacity: int) -> dict[str, np.ndarray | ContactStates]:
    return {
        "face": np.zeros(capacity, np.int64),
        "node": np.zeros((capacity, 3), np.int64),
        "friction": np.zeros(capacity),
        "viscosity": np.zeros(capacity),
        "states": _new_states(capacity),
        "around": np.zeros(capacity, np.int64),
        "node_around": np.zeros((capacity, 4), np.int64),
        "found": np.zeros(capacity, np.int64),
        "row_before": np.zeros(capacity, np.int64),
        "divided": np.zeros(capacity, np.int64),
        "node_before": np.zeros((capacity, 3), np.int64),
        "states_before": _new_states(capacity),
    }


def _new_states(capacity: int) -> ContactStates:
    of_points = ("bevel_shift", "stuck_along", "stuck_behind", "sliding_speed")
    return ContactStates(
        side=np.zeros(capacity),
        area=np.zeros(capacity),
        energy=np.zeros(capacity),
        **{name: np.zeros((capacity, POINTS)) for name in of_points},
    )


def with_more_faces(sides: FaceContacts) -> FaceContacts:
    """Return the side contacts with room for twice as many faces."""
    n = 2 * len(sides.face)
    lists = ("face", "node", "around", "node_around", "found", "row_before")
    names = (*lists, "friction", "viscosity", "divided", "node_before")
    arrays = {name: grown(getattr(sides, name), n) for name in names}
    states = {name: grown(getattr(sides.states, name), n) for name in ContactStates.__annotations__}
    return sides.replaced(**arrays, states=ContactStates(**states), states_before=_new_states(n))


def grown_face_contacts(sides: FaceContacts, n_tetrahedra: int) -> FaceContacts:
    """Return the side contacts with room for that many tetrahedra."""
    if sides.half_thickness == 0.0:
        return sides
    return sides.replaced(
        row_of_face=grown(sides.row_of_face, 4 * n_tetrahedra, -1),
        is_around=grown(sides.is_around, n_tetrahedra),
    )


class FaceCorners(NamedTuple):
    """The corners of a face."""

    first: Vec3
    """Position of the first corner [m]."""
    second: Vec3
    """Position of the second [m]."""
    third: Vec3
    """Position of the third [m]."""


class Profile(NamedTuple):
    """The blade's outline at a point, on the tissue's side."""

    slope_along: float
    """Slope of the outline along the edge."""
    slope_behind: float
    """Slope of the outline with the distance behind the edge."""
    height: float
    """Distance from the blade's plane to the outline [m]."""


class Penetration(NamedTuple):
    """Depth of a contact point within the blade."""

    slope_along: float
    """Slope of the blade's outline along the edge."""
    slope_behind: float
    """Slope of the blade's outline with the distance behind the edge."""
    depth: float
    """Depth of the point below the outline [m]; negative outside."""


class FrictionStretch(NamedTuple):
    """Stretch of the friction spring at a contact point."""

    along: float
    """Stretch along the edge, up to the friction limit [m]."""
    behind: float
    """Stretch away from the edge, up to the friction limit [m]."""
    surplus: float
    """Length of the stretch beyond the friction limit [m]."""


class ContactForces(NamedTuple):
    """Forces of the blade on the tissue at a contact point."""

    normal: Vec3
    """Pressing force [N]."""
    friction: Vec3
    """Friction [N]."""


@kernel
def blade_profile(
    sides: FaceContacts, length: float, bevel_shift: float, at: BladeCoordinates
) -> Profile:
    """Return the outline of a blade whose edge is of that length [m], at a point.

    `bevel_shift` [m] is the height by which the bevel is shifted there.
    """
    best = Profile(0.0, sides.slope, sides.slope * at.behind + bevel_shift)
    if sides.half_thickness < best.height:
        best = Profile(0.0, 0.0, sides.half_thickness)
    back = END_SLOPE * (sides.height - at.behind)
    if back < best.height:
        best = Profile(0.0, -END_SLOPE, back)
    tip = END_SLOPE * at.along
    if tip < best.height:
        best = Profile(END_SLOPE, 0.0, tip)
    heel = END_SLOPE * (length - at.along)
    if heel < best.height:
        best = Profile(-END_SLOPE, 0.0, heel)
    return best


@kernel
def contact_point(sides: FaceContacts, positions: FloatArray, i: int, q: int) -> Vec3:
    """Return the position of contact point `q` of row `i`, with the nodes at `positions` [m]."""
    node = sides.node
    p = scale(CORNER, vec3(positions, node[i, q]))
    p = axpy(OTHER, vec3(positions, node[i, (q + 1) % 3]), p)
    return axpy(OTHER, vec3(positions, node[i, (q + 2) % 3]), p)


@inlined
def corners_of(sides: FaceContacts, positions: FloatArray, i: int) -> FaceCorners:
    """Return the corners of row `i`, with the nodes at `positions` [m]."""
    node = sides.node
    a, b, c = natural(node[i, 0]), natural(node[i, 1]), natural(node[i, 2])
    return FaceCorners(vec3(positions, a), vec3(positions, b), vec3(positions, c))


@inlined
def point_near_first(corners: FaceCorners) -> Vec3:
    """Return the contact point at the first of these corners [m]: `contact_point`, bit by bit."""
    return axpy(OTHER, corners.third, axpy(OTHER, corners.second, scale(CORNER, corners.first)))


@inlined
def turned(corners: FaceCorners) -> FaceCorners:
    """Return the corners with the second one first."""
    return FaceCorners(corners.second, corners.third, corners.first)


@inlined
def is_clear(sides: FaceContacts, pose: BladePose, corners: FaceCorners, i: int) -> bool:
    """Return whether face `i` is farther from the blade's plane than the blade is thick anywhere.

    `corners`: where its corners are [m].
    """
    normal = pose.normal
    side = sides.states.side[i]
    reach = side * dot(pose.tip, normal) + sides.half_thickness + CLEARANCE
    return bool(
        side * dot(corners.first, normal) > reach
        and side * dot(corners.second, normal) > reach
        and side * dot(corners.third, normal) > reach
    )


@kernel
def penetration(
    sides: FaceContacts, length: float, i: int, q: int, at: BladeCoordinates
) -> Penetration:
    """Return the depth of a contact point within the blade.

    Args:
        sides: The side contacts.
        length: Length of the edge [m].
        i: Row of the face.
        q: Contact point of the face.
        at: Position of the contact point.
    """
    outline = blade_profile(sides, length, sides.states.bevel_shift[i, q], at)
    depth = outline.height - sides.states.side[i] * at.across
    return Penetration(outline.slope_along, outline.slope_behind, depth)


@kernel
def friction_stretch(
    sides: FaceContacts, i: int, q: int, at: BladeCoordinates, normal_force: float
) -> FrictionStretch:
    """Return the stretch of the friction spring at a contact point, cut off at the friction limit.

    Args:
        sides: The side contacts.
        i: Row of the face.
        q: Contact point of the face.
        at: Position of the contact point.
        normal_force: Force that presses the point [N].
    """
    states = sides.states
    da = at.along - states.stuck_along[i, q]
    ds = at.behind - states.stuck_behind[i, q]
    stretch = np.sqrt(da * da + ds * ds)
    viscous = sides.viscosity[i] * states.area[i] * states.sliding_speed[i, q]
    limit = sides.friction[i] * normal_force + viscous
    most = limit / (sides.stiffness * states.area[i])
    if stretch <= most:
        return FrictionStretch(da, ds, 0.0)
    return FrictionStretch(da * most / stretch, ds * most / stretch, stretch - most)


@kernel
def contact_forces(
    sides: FaceContacts, pose: BladePose, i: int, q: int, at: BladeCoordinates, inside: Penetration
) -> ContactForces:
    """Return the forces of the blade on the tissue at a contact point that is within it.

    Args:
        sides: The side contacts.
        pose: Pose of the blade.
        i: Row of the face.
        q: Contact point of the face.
        at: Position of the contact point.
        inside: Depth of the point within the blade.
    """
    stiffness = sides.stiffness * sides.states.area[i]
    push = stiffness * inside.depth
    outward = axpy(-inside.slope_along, pose.along, scale(sides.states.side[i], pose.normal))
    outward = axpy(inside.slope_behind, pose.forward, outward)
    held = friction_stretch(sides, i, q, at, push)
    friction = axpy(
        -stiffness * held.along, pose.along, scale(stiffness * held.behind, pose.forward)
    )
    return ContactForces(scale(push, outward), friction)


@kernel
def faces_energy(sides: FaceContacts) -> float:
    """Return the energy stored in the side contacts when sliding was applied last [J]."""
    energy = 0.0
    for i in range(sides.n_faces):
        energy += sides.states.energy[i]
    return energy
