"""`Geoms` and `GeomContacts`: rigid geoms and what touches them, as kernels read and write them."""

import numpy as np

from tissue.contact.geoms.geom import Geom, half_thickness, planes_of, shape_number
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.structs import Arrays, FloatCell, IntCell

NODE_CONTACT = -1
"""Entry of `GeomContacts.face` where a node touches."""


class Geoms(Arrays):
    """The geoms, n of them, and how they move in a time step. Tissue frame."""

    shape: IntArray
    """Number of the shape of each, shape (n,)."""
    size: FloatArray
    """Sizes of each [m], shape (n, 3)."""
    friction: FloatArray
    """Coefficient of friction of each, shape (n,)."""
    first_plane: IntArray
    """First row of each mesh in `plane`, and the end of the last; shape (n + 1,)."""
    plane: FloatArray
    """Sides of meshes: unit normal outwards, and distance [m]; shape (n_planes, 4)."""
    middle: FloatArray
    """Middle of a box around each, in its own frame [m], shape (n, 3)."""
    half: FloatArray
    """Half the sizes of that box [m], infinite for a plane; shape (n, 3)."""
    half_thickness: FloatArray
    """How deep the deepest point of each is in it [m], infinite for a plane; shape (n,)."""
    is_near: IntArray
    """1 if tissue may touch it in this time step, else 0; shape (n,)."""
    origin_t0: FloatArray
    """Origin of each at the begin of the time step [m], shape (n, 3)."""
    axes_t0: FloatArray
    """Its axes then, row after row of the matrix with the axes as columns; shape (n, 9)."""
    way: FloatArray
    """How far the origin moves in the time step [m], shape (n, 3)."""
    turn: FloatArray
    """By which angles the geom turns in it, as a rotation vector [rad], shape (n, 3)."""
    origin: FloatArray
    """Origin of each at the instant that was asked for last [m], shape (n, 3)."""
    axes: FloatArray
    """Its axes then, shape (n, 9)."""


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
    """Its nodes: the corners of a face, or three times the same; shape (2 * capacity, 3)."""
    weight: FloatArray
    """Weight of each node, which add up to 1; shape (2 * capacity, 3)."""
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
    """How far the point is outside the geom and the slop then [m], shape (2 * capacity,)."""
    mobility: FloatArray
    """How much velocity the point gets per impulse [1/kg], 0 where it may touch nothing in the next
    substep or all its nodes are fixed; shape (2 * capacity,)."""
    slop: FloatArray
    """How deep the point may be in the geom without being pushed out [m], shape (2 * capacity,)."""
    velocity: FloatArray
    """Velocity of each listed node after the last substep [m/s], shape (n_nodes, 3)."""
    resistance: FloatArray
    """Mean force of the rest of the tissue on it in the substep [N], shape (n_nodes, 3)."""
    reaction: FloatArray
    """Force on the tissue in the stage asked for last [N], shape (2 * capacity, 3)."""
    acceleration: FloatArray
    """Acceleration of each listed node that touches, then [m/s2], shape (n_nodes, 3)."""
    is_noted: IntArray
    """1 for a node whose acceleration is noted, scratch; shape (n_nodes,)."""
    displacement: FloatArray
    """By how much each listed node was corrected after the last substep [m], shape (n_nodes, 3)."""
    half_work: FloatArray
    """Half of the work of the tissue on that way, by its force before [J], shape (n_nodes,)."""
    impulse: FloatArray
    """Impulse on the tissue in this time step [N s], shape (2 * capacity, 3)."""
    moment: FloatArray
    """Angular impulse on it about the origin [N m s], shape (2 * capacity, 3)."""


_WHOLE = ("geom", "face", "touches", "sticks", "is_held")
_NUMBERS = ("gap", "mobility", "slop")
_VECTORS = (
    "weight",
    "force",
    "reaction",
    "pressed",
    "anchor",
    "normal",
    "point",
    "impulse",
    "moment",
)
_OF_ROWS = ("node", *_WHOLE, *_NUMBERS, *_VECTORS)
"""Fields of `GeomContacts` with a row for each contact."""


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
    of_three = ("origin_t0", "way", "turn", "origin")
    return Geoms(
        shape=np.array([shape_number(geom) for geom in geoms], np.int64),
        size=size,
        friction=np.array([float(geom.friction) for geom in geoms]),
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
