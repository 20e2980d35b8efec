"""`Geoms` and `GeomContacts`: rigid geoms and what touches them, as kernels read and write them."""

import math
from typing import Final

import numpy as np

from tissue.contact.geoms.geom import PLANE, Geom, half_thickness, planes_of, shape_number
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, norm, scale, store, sub, vec3
from tissue.geometry.rotations import ROTATION_TOLERANCE

NODE_CONTACT = -1
"""Entry of `GeomContacts.face` where a node touches."""

_WHOLE = ("geom", "face", "touches", "sticks", "is_held")

_OF_TISSUE: Final = -1.0
"""Friction of a geom that has none of its own."""

_NUMBERS = ("friction", "gap", "mobility", "slop")

_VECTORS = (
    *("weight", "response", "force", "reaction", "pressed"),
    *("anchor", "normal", "point", "impulse", "moment"),
)

_OF_ROWS = ("node", *_WHOLE, *_NUMBERS, *_VECTORS)
"""Fields of `GeomContacts` with a row for each contact."""

TAKEN: Final = 0

ORIGIN_NOT_FINITE: Final = 1

NO_ROTATION: Final = 2

TURNS_TOO_FAR: Final = 3

MOVES_TOO_FAR: Final = 4
"""Results of `lead_geoms`."""


class Geoms(Arrays):
    """The geoms, n of them, and how they move in a time step. Tissue frame."""

    shape: IntArray
    """Number of the shape of each, shape (n,)."""
    size: FloatArray
    """Sizes of each [m], shape (n, 3)."""
    friction: FloatArray
    """Coefficient of friction of each, shape (n,); negative: that of the tissue."""
    first_plane: IntArray
    """First row of each mesh in `plane`, and the end of the last; shape (n + 1,)."""
    plane: FloatArray
    """Sides of meshes: unit normal outwards, and distance [m]; shape (n_planes, 4)."""
    middle: FloatArray
    """Middle of a box around each, in its own frame [m], shape (n, 3)."""
    half: FloatArray
    """Half the sizes of that box [m], infinite for a plane; shape (n, 3)."""
    half_thickness: FloatArray
    """Depth of the deepest point of each [m], infinite for a plane; shape (n,)."""
    is_near: IntArray
    """1 if tissue may touch it in this time step, else 0; shape (n,)."""
    origin_t0: FloatArray
    """Origin of each at the begin of the time step [m], shape (n, 3)."""
    axes_t0: FloatArray
    """Axes of each then, row after row of the matrix with the axes as columns; shape (n, 9)."""
    shift: FloatArray
    """Displacement of the origin in the time step [m], shape (n, 3)."""
    turn: FloatArray
    """Rotation of the geom in the time step, as a rotation vector [rad], shape (n, 3)."""
    origin: FloatArray
    """Origin of each at the instant that was evaluated last [m], shape (n, 3)."""
    axes: FloatArray
    """Axes of each then, shape (n, 9)."""


class GeomContacts(Arrays):
    """Where tissue touches geoms: two lists, that in use and room for the next."""

    first: IntCell
    """First row of the list in use: 0, or the capacity."""
    n_contacts: IntCell
    """Number of contacts in the list in use, touching or near."""
    are_coupled: IntCell
    """1 if a node may be in more than one contact, so that they are solved together."""
    work: FloatCell
    """Work of the geoms on the tissue since it was last set to 0 [J]."""
    dissipated: FloatCell
    """The part of it that friction and impacts took since it was last set to 0 [J]."""
    geoms: Geoms
    """The geoms."""
    geom: IntArray
    """Geom of each contact, shape (2 * capacity,)."""
    face: IntArray
    """Place of the face of each, or NODE_CONTACT; shape (2 * capacity,)."""
    node: IntArray
    """Nodes of each: the corners of a face, or three times the same; shape (2 * capacity, 3)."""
    weight: FloatArray
    """Weight of each node, which add up to 1; shape (2 * capacity, 3)."""
    friction: FloatArray
    """Coefficient of friction of each, shape (2 * capacity,)."""
    touches: IntArray
    """1 if it pressed after the last substep, else 0; shape (2 * capacity,)."""
    sticks: IntArray
    """1 if it pressed within the cone of friction then, else 0; shape (2 * capacity,)."""
    force: FloatArray
    """Mean force on the tissue in the last substep [N], shape (2 * capacity, 3)."""
    pressed: FloatArray
    """Impulse on the tissue in the stages of this substep [N s], shape (2 * capacity, 3)."""
    anchor: FloatArray
    """Where a node that sticks is held, in the frame of the geom [m], shape (2 * capacity, 3)."""
    is_held: IntArray
    """1 if there is an anchor, else 0; shape (2 * capacity,)."""
    normal: FloatArray
    """Unit normal out of the geom, shape (2 * capacity, 3)."""
    point: FloatArray
    """Where it is, before the correction after a substep [m], shape (2 * capacity, 3)."""
    gap: FloatArray
    """Distance of the point outside the geom and the slop then [m], shape (2 * capacity,)."""
    mobility: FloatArray
    """Velocity of the point per impulse [1/kg], 0 where it may touch nothing in the next
    substep or all its nodes are fixed; shape (2 * capacity,)."""
    response: FloatArray
    """Weight of each node over its mass, 0 for a fixed one [1/kg], where `mobility` was noted since
    masses changed; shape (2 * capacity, 3)."""
    slop: FloatArray
    """Depth of the point up to which it is not pushed out [m], shape (2 * capacity,)."""
    velocity: FloatArray
    """Velocity of each listed node after the last substep [m/s], shape (n_nodes, 3)."""
    resistance: FloatArray
    """Mean force of the rest of the tissue on it in the substep [N], shape (n_nodes, 3)."""
    reaction: FloatArray
    """Force on the tissue in the stage evaluated last [N], shape (2 * capacity, 3)."""
    acceleration: FloatArray
    """Acceleration of each listed node that touches, then [m/s2], shape (n_nodes, 3)."""
    is_noted: IntArray
    """1 for a node whose acceleration is recorded, scratch; shape (n_nodes,)."""
    displacement: FloatArray
    """Correction of each listed node after the last substep [m], shape (n_nodes, 3)."""
    half_work: FloatArray
    """Half of the work of the tissue on that path, by its force before [J], shape (n_nodes,)."""
    impulse: FloatArray
    """Impulse on the tissue in this time step [N s], shape (2 * capacity, 3)."""
    moment: FloatArray
    """Angular impulse on it about the origin [N m s], shape (2 * capacity, 3)."""


@inlined
def n_corners(contacts: GeomContacts, c: int) -> int:
    """Return the number of different nodes of contact `c`: one, or the corners of a face."""
    return 1 if contacts.face[c] == NODE_CONTACT else 3


class GeomSearch(Arrays):
    """Scratch of the search, and how long its list will do."""

    stamp: IntCell
    """Number of the geom that was searched last, counted since the start."""
    search: IntCell
    """Number of the last search."""
    is_first: IntCell
    """1 until the first search has ended."""
    is_due: IntCell
    """1 if the next time step must search, whatever has moved: the mesh changed, or a geom did."""
    n_listed: IntCell
    """Rows of the new list so far."""
    n_of_faces: IntCell
    """Number of rows of faces."""
    next_old: IntCell
    """Row of the old list that has not been passed yet."""
    n_near: IntCell
    """Number of nodes near the geom."""
    n_touched: IntCell
    """Number of faces near the geom."""
    seconds: FloatCell
    """Length of the time step [s]."""
    moved: FloatCell
    """Largest approach of nodes and geoms since the last search [m]."""
    covered: FloatCell
    """Largest approach in the time step of the last search [m]."""
    fastest: FloatCell
    """Speed of the fastest node [m/s]."""
    near: IntArray
    """Nodes near the geom, shape (node capacity,)."""
    near_at: IntArray
    """Stamp of the geom that each node was near last, shape (node capacity,)."""
    touched: IntArray
    """Places of faces with a corner near the geom, shape (face capacity,)."""
    listed: IntArray
    """Number of the search in which each node was listed last, shape (node capacity,)."""
    normal: FloatArray
    """Normal of the skin at each node near the geom, of any length; shape (node capacity, 3)."""
    node_size: float
    """Mean node size [m]."""


def new_geoms(geoms: list[Geom]) -> Geoms:
    """Return geoms at the origin, at rest.

    Raises:
        ValueError: see `planes_of`.
    """
    planes, n = [planes_of(geom) for geom in geoms], len(geoms)
    boxes = [geom.box() for geom in geoms]
    size = np.zeros((n, 3))
    for row, geom in zip(size, geoms, strict=True):
        row[: len(geom.size)] = geom.size
    of_three = ("origin_t0", "shift", "turn", "origin")
    return Geoms(
        shape=np.array([shape_number(geom) for geom in geoms], np.int64),
        size=size,
        friction=np.array([_OF_TISSUE if g.friction is None else float(g.friction) for g in geoms]),
        first_plane=np.cumsum([0, *(len(rows) for rows in planes)], dtype=np.int64),
        plane=np.concatenate([np.zeros((0, 4)), *planes]),
        middle=np.array([middle for middle, _ in boxes]).reshape(n, 3),
        half=np.array([half for _, half in boxes]).reshape(n, 3),
        half_thickness=np.array([half_thickness(geom) for geom in geoms]),
        is_near=np.ones(n, np.int64),
        axes_t0=np.tile(np.eye(3).ravel(), (n, 1)),
        axes=np.tile(np.eye(3).ravel(), (n, 1)),
        **{name: np.zeros((n, 3)) for name in of_three},
    )


def new_geom_contacts(geoms: Geoms, capacity: int, n_nodes: int) -> GeomContacts:
    """Return no contacts, with room for that many, of a body with room for `n_nodes`."""
    rows = 2 * capacity
    return GeomContacts(
        first=0,
        n_contacts=0,
        are_coupled=0,
        work=0.0,
        dissipated=0.0,
        geoms=geoms,
        node=np.zeros((rows, 3), np.int64),
        **{name: np.zeros(rows) for name in _NUMBERS},
        **{name: np.zeros(rows, np.int64) for name in _WHOLE},
        **{name: np.zeros((rows, 3)) for name in _VECTORS},
        velocity=np.zeros((n_nodes, 3)),
        resistance=np.zeros((n_nodes, 3)),
        acceleration=np.zeros((n_nodes, 3)),
        displacement=np.zeros((n_nodes, 3)),
        half_work=np.zeros(n_nodes),
        is_noted=np.zeros(n_nodes, np.int64),
    )


def grown_geom_contacts(contacts: GeomContacts, capacity: int, n_nodes: int) -> GeomContacts:
    """Return the contacts with room for that many; the first list is the one in use."""
    larger, n = new_geom_contacts(contacts.geoms, capacity, n_nodes), contacts.n_contacts
    for name in ("velocity", "displacement", "half_work"):
        of_nodes = getattr(contacts, name)
        getattr(larger, name)[: len(of_nodes)] = of_nodes
    used = slice(contacts.first, contacts.first + n)
    for name in _OF_ROWS:
        getattr(larger, name)[:n] = getattr(contacts, name)[used]
    for name in ("n_contacts", "are_coupled", "work", "dissipated"):
        setattr(larger, name, getattr(contacts, name))
    return larger


@kernel
def place_geoms(geoms: Geoms, when: float) -> None:
    """Write where all geoms are at a fraction of the time step."""
    for g in range(len(geoms.shape)):
        store(geoms.origin, g, axpy(when, vec3(geoms.shift, g), vec3(geoms.origin_t0, g)))
        turn = scale(when, vec3(geoms.turn, g))
        angle = norm(turn)
        for k in range(3):
            column = _column(geoms.axes_t0, g, k)
            if angle > 0.0:
                column = _turned(column, scale(1.0 / angle, turn), angle)
            geoms.axes[g, k] = column.x
            geoms.axes[g, 3 + k] = column.y
            geoms.axes[g, 6 + k] = column.z


@kernel
def lead_geoms(
    geoms: Geoms, origins: FloatArray, axes: FloatArray, largest_turn: float, farthest: float
) -> tuple[int, int]:
    """Set the motion of all geoms to their poses at the end of the next time step.

    Args:
        geoms: `shift` and `turn` are written, where all is well.
        origins: Their origins then [m], shape (n, 3).
        axes: Their axes then, as rows of numbers, shape (n, 9).
        largest_turn: Angle by which one may turn [rad].
        farthest: How far a point of one may move, per half its thickness.

    Returns:
        TAKEN or what is wrong, and with which geom.
    """
    for g in range(len(geoms.shape)):
        columns = _column(axes, g, 0), _column(axes, g, 1), _column(axes, g, 2)
        sums = origins[g, 0] + origins[g, 1] + origins[g, 2]
        if not math.isfinite(sums):
            return ORIGIN_NOT_FINITE, g
        for i in range(3):
            for j in range(3):
                product = dot(columns[i], columns[j]) - (1.0 if i == j else 0.0)
                if not abs(product) <= ROTATION_TOLERANCE:
                    return NO_ROTATION, g
        if dot(cross(columns[0], columns[1]), columns[2]) < 0.0:
            return NO_ROTATION, g
        turn = _rotation_vector(geoms.axes_t0, axes, g)
        if norm(turn) > largest_turn:
            return TURNS_TOO_FAR, g
        store(geoms.turn, g, turn)
        store(geoms.shift, g, sub(vec3(origins, g), vec3(geoms.origin_t0, g)))
        if motion_bound(geoms, g) > farthest * geoms.half_thickness[g]:
            return MOVES_TOO_FAR, g
    return TAKEN, 0


@kernel
def _rotation_vector(before: FloatArray, after: FloatArray, g: int) -> Vec3:
    """Return axis times angle of the rotation from one set of axes to another [rad].

    A turn by pi has no direction: its axis is then any one.
    """
    skew, trace = Vec3(0.0, 0.0, 0.0), 0.0
    for k in range(3):
        a, b = _column(before, g, k), _column(after, g, k)
        skew = axpy(0.5, cross(a, b), skew)
        trace += dot(a, b)
    sine, cosine = norm(skew), 0.5 * (trace - 1.0)
    angle = math.atan2(sine, cosine)
    if sine == 0.0:
        return Vec3(angle, 0.0, 0.0)
    return scale(angle / sine, skew)


@inlined
def _column(axes: FloatArray, g: int, k: int) -> Vec3:
    """Return axis `k` of geom `g`."""
    return Vec3(axes[g, k], axes[g, 3 + k], axes[g, 6 + k])


@inlined
def _turned(a: Vec3, axis: Vec3, angle: float) -> Vec3:
    """Return a vector turned about a unit axis: Rodrigues' formula."""
    c, s = math.cos(angle), math.sin(angle)
    return add(axpy(s, cross(axis, a), scale(c, a)), scale((1.0 - c) * dot(axis, a), axis))


@inlined
def to_geom(geoms: Geoms, g: int, x: Vec3) -> Vec3:
    """Return a point in the frame of geom `g`."""
    return _turned_to_geom(geoms.axes, g, sub(x, vec3(geoms.origin, g)))


@inlined
def _turned_to_geom(axes: FloatArray, g: int, a: Vec3) -> Vec3:
    """Return a vector in the frame of geom `g`."""
    return Vec3(
        axes[g, 0] * a.x + axes[g, 3] * a.y + axes[g, 6] * a.z,
        axes[g, 1] * a.x + axes[g, 4] * a.y + axes[g, 7] * a.z,
        axes[g, 2] * a.x + axes[g, 5] * a.y + axes[g, 8] * a.z,
    )


@inlined
def turned_from_geom(axes: FloatArray, g: int, a: Vec3) -> Vec3:
    """Return a vector of the frame of geom `g` in that of the tissue."""
    return Vec3(
        axes[g, 0] * a.x + axes[g, 1] * a.y + axes[g, 2] * a.z,
        axes[g, 3] * a.x + axes[g, 4] * a.y + axes[g, 5] * a.z,
        axes[g, 6] * a.x + axes[g, 7] * a.y + axes[g, 8] * a.z,
    )


@inlined
def geom_motion_at(geoms: Geoms, g: int, x: Vec3) -> Vec3:
    """Return how far geom `g` would move in a whole time step where point `x` is now [m]."""
    return add(vec3(geoms.shift, g), cross(vec3(geoms.turn, g), sub(x, vec3(geoms.origin, g))))


@kernel
def motion_bound(geoms: Geoms, g: int) -> float:
    """Return how far a point of geom `g` moves in the time step at most [m]."""
    turn, shift = norm(vec3(geoms.turn, g)), norm(vec3(geoms.shift, g))
    if turn == 0.0 or geoms.shape[g] == PLANE:
        return float(shift)
    return float(shift + turn * (norm(vec3(geoms.middle, g)) + norm(vec3(geoms.half, g))))


@kernel
def largest_motion(geoms: Geoms) -> float:
    """Return how far a point of a geom moves in the time step at most, per half its thickness."""
    largest = 0.0
    for g in range(len(geoms.shape)):
        largest = max(largest, motion_bound(geoms, g) / geoms.half_thickness[g])
    return largest
