"""The sheet: the surface that an incision leaves behind, and all that a cut step reads and writes.

Everything here is in the body at rest, where cracks are closed, tetrahedra are never inverted and
the sheet does not move: the path of the anchors is a path of material points (see anchors).
"""

from typing import NamedTuple

import numpy as np

from tissue.arrays import Arrays
from tissue.body import Body, grown
from tissue.geometry import normalised
from tissue.jit import kernel
from tissue.predicates import Lattice, nearest
from tissue.star import LARGEST_STAR, Visits
from tissue.types import BoolArray, FloatArray, IntArray
from tissue.vec3 import Vec3, add, cross, dot, scale, sub, vec3

CHANGES = 1 << 15
"""Changes that one pass of a cut step can note; see PASS_NODES."""

PASS_NODES = 256
"""Nodes that one pass of a cut step puts on the sheet at most; a step that needs more is done in
several passes. Un-gluing them notes some 50 tetrahedra each, which must fit into CHANGES."""

SPARE_NODES = 4 * PASS_NODES
"""Room for nodes that a pass leaves for un-gluing: no node falls into more than a few copies."""

CROSSINGS = 1 << 12
"""Edges that one pass can cross."""

HASH_SLOTS = 1 << 15
"""Slots of the table of edges seen; twice what one pass can meet."""


class Quality(Arrays):
    """When a node that is there is used in place of a new one (algorithms.md 3.5).

    It trades the path of the cut against the smallest element, hence against the time step. Without
    the guard one unlucky cut divides the time step by a hundred or more.
    """

    snap: float
    """A crossing nearer to a node than this share of the node's size moves to the node."""
    floor: float
    """... or nearer than this distance [m]."""
    guard: float
    """No split may leave an altitude smaller than this [m]; the nearest node is used instead."""
    crumb: float
    """A closed piece smaller than this [m3], made in one step, stays with its larger neighbour."""


class Sheet(Arrays):
    """What is known of the current incision. Entries count only where stamped with its number."""

    number: IntArray
    """Of the incision, shape (1,)."""
    node_stamp: IntArray
    """Shape (node capacity,)."""
    offset: FloatArray
    """Distance of an on-sheet node from the true sheet [m], -1 for others; (node capacity,)."""
    side: IntArray
    """Side of the sheet that a node was seen on, +1 or -1, 0 if not seen; (node capacity,)."""
    tetrahedron_stamp: IntArray
    """Shape (tetrahedron capacity,)."""
    tetrahedron_side: IntArray
    """Side that a tetrahedron was decided to be on, 0 if not decided; (tetrahedron capacity,)."""
    front: IntArray
    """Last node of the crack front at the tip and at the heel, or -1; shape (2,)."""


class Path(Arrays):
    """The way of the edge's samples through the material in one step. n samples."""

    t0: FloatArray
    """Rest positions at the start [m], shape (n, 3)."""
    t1: FloatArray
    """Rest positions at the end [m], shape (n, 3)."""
    lattice_t0: IntArray
    lattice_t1: IntArray
    forward: FloatArray
    """Unit vector in which the edge cuts, in the body at rest, shape (n, 3)."""
    sideways: FloatArray
    """Unit normal of the blade's flat, in the body at rest: the side +1; shape (1, 3)."""
    seed: IntArray
    """Tetrahedron at or beside the sample, shape (n,)."""
    member: BoolArray
    """Whether the sample is part of the chain at the end, shape (n,)."""
    known: BoolArray
    """Whether it ever was in this incision, so that its `t1` tells where it was; shape (n,)."""
    linked: BoolArray
    """Whether sample and next sample span a piece of the sheet, shape (n,)."""
    boxes: IntArray
    """Lowest and highest lattice point of the quad from each sample to the next, shape (n, 6)."""


class Change(Arrays):
    """What one pass of a cut step did."""

    flagged: IntArray
    """Nodes that came to lie on the sheet, shape (CHANGES,)."""
    dirty: IntArray
    """Tetrahedra that were split or got another node, shape (CHANGES,); may repeat."""
    faces: IntArray
    """Faces cut: tetrahedron, face, tetrahedron, face; shape (CHANGES, 4)."""
    counts: IntArray
    """How many of each, of splits, and whether there was too little room; shape (5,)."""
    area: FloatArray
    """Area of the faces cut, at rest, since the body was made [m2]; shape (1,)."""


N_FLAGGED, N_DIRTY, N_FACES, N_SPLITS, FULL = 0, 1, 2, 3, 4
"""Places in `Change.counts`."""


class Work(Arrays):
    """Scratch of a cut step."""

    active: IntArray
    """Active tetrahedra: those that the swept edge passes through; shape (CHANGES,)."""
    segments: IntArray
    """First and last segment of the edge that each may meet, shape (CHANGES, 2)."""
    n_active: IntArray
    """Shape (1,)."""
    previous: IntArray
    """Tetrahedra that were active or changed in the step before, shape (2 * CHANGES,)."""
    n_previous: IntArray
    """Shape (1,)."""
    around: IntArray
    """A star, shape (LARGEST_STAR,)."""
    around_too: IntArray
    """Another star, shape (LARGEST_STAR,)."""
    parents: IntArray
    """Tetrahedra being split, shape (LARGEST_STAR,)."""
    parent_links: IntArray
    """Shape (LARGEST_STAR, 4)."""
    children: IntArray
    """Shape (LARGEST_STAR, 3)."""
    place: IntArray
    """Where in `parents` a tetrahedron is, shape (tetrahedron capacity,)."""
    crossing: IntArray
    """Two nodes and a segment of each crossed edge, shape (CROSSINGS, 3)."""
    crossing_at: FloatArray
    """Where along the edge, from its first node, and along the segment; shape (CROSSINGS, 2)."""
    order: IntArray
    """Order in which crossings are handled, shape (CROSSINGS,)."""
    n_crossings: IntArray
    """Shape (1,)."""
    hash_keys: IntArray
    """Edges seen, shape (HASH_SLOTS,)."""
    hash_stamps: IntArray
    """Search that wrote each slot, shape (HASH_SLOTS,)."""


class Cut(Arrays):
    """All that a cut step reads and writes."""

    body: Body
    visits: Visits
    sheet: Sheet
    path: Path
    change: Change
    work: Work
    quality: Quality


def new_sheet(n_nodes: int, n_tetrahedra: int) -> Sheet:
    """Return a sheet with nothing on it."""
    return Sheet(
        number=np.ones(1, np.int64),
        node_stamp=np.zeros(n_nodes, np.int64),
        offset=np.full(n_nodes, -1.0),
        side=np.zeros(n_nodes, np.int64),
        tetrahedron_stamp=np.zeros(n_tetrahedra, np.int64),
        tetrahedron_side=np.zeros(n_tetrahedra, np.int64),
        front=np.full(2, -1, np.int64),
    )


def grown_sheet(sheet: Sheet, n_nodes: int, n_tetrahedra: int) -> Sheet:
    """Return the sheet with room for that many nodes and tetrahedra."""
    return sheet.replaced(
        node_stamp=grown(sheet.node_stamp, n_nodes),
        offset=grown(sheet.offset, n_nodes, -1.0),
        side=grown(sheet.side, n_nodes),
        tetrahedron_stamp=grown(sheet.tetrahedron_stamp, n_tetrahedra),
        tetrahedron_side=grown(sheet.tetrahedron_side, n_tetrahedra),
    )


def new_path(n: int) -> Path:
    """Return a path of `n` samples that spans nothing yet."""
    return Path(
        t0=np.zeros((n, 3)),
        t1=np.zeros((n, 3)),
        lattice_t0=np.zeros((n, 3), np.int64),
        lattice_t1=np.zeros((n, 3), np.int64),
        forward=np.zeros((n, 3)),
        sideways=np.zeros((1, 3)),
        seed=np.full(n, -1, np.int64),
        member=np.zeros(n, np.bool_),
        known=np.zeros(n, np.bool_),
        linked=np.zeros(n, np.bool_),
        boxes=np.zeros((n, 6), np.int64),
    )


def new_change() -> Change:
    """Return an empty list of changes."""
    return Change(
        flagged=np.zeros(CHANGES, np.int64),
        dirty=np.zeros(CHANGES, np.int64),
        faces=np.zeros((CHANGES, 4), np.int64),
        counts=np.zeros(5, np.int64),
        area=np.zeros(1),
    )


def new_work(n_tetrahedra: int) -> Work:
    """Return scratch for a body with room for that many tetrahedra."""
    return Work(
        active=np.zeros(CHANGES, np.int64),
        segments=np.zeros((CHANGES, 2), np.int64),
        n_active=np.zeros(1, np.int64),
        previous=np.zeros(2 * CHANGES, np.int64),
        n_previous=np.zeros(1, np.int64),
        around=np.zeros(LARGEST_STAR, np.int64),
        around_too=np.zeros(LARGEST_STAR, np.int64),
        parents=np.zeros(LARGEST_STAR, np.int64),
        parent_links=np.zeros((LARGEST_STAR, 4), np.int64),
        children=np.zeros((LARGEST_STAR, 3), np.int64),
        place=np.zeros(n_tetrahedra, np.int64),
        crossing=np.zeros((CROSSINGS, 3), np.int64),
        crossing_at=np.zeros((CROSSINGS, 2)),
        order=np.zeros(CROSSINGS, np.int64),
        n_crossings=np.zeros(1, np.int64),
        hash_keys=np.zeros(HASH_SLOTS, np.int64),
        hash_stamps=np.zeros(HASH_SLOTS, np.int64),
    )


@kernel
def begin_sheet(sheet: Sheet) -> None:
    """Forget the last incision and begin another."""
    sheet.number[0] += 1
    sheet.front[0] = -1
    sheet.front[1] = -1


@kernel
def clear_changes(change: Change) -> None:
    """Forget what the last pass did."""
    for i in range(len(change.counts)):
        change.counts[i] = 0


@kernel
def note_dirty(change: Change, t: int) -> None:
    """Note that tetrahedron `t` was changed."""
    if change.counts[N_DIRTY] < len(change.dirty):
        change.dirty[change.counts[N_DIRTY]] = t
        change.counts[N_DIRTY] += 1


@kernel
def touch(sheet: Sheet, node: int) -> None:
    """Make sure that the entries of `node` belong to the current incision."""
    if sheet.node_stamp[node] != sheet.number[0]:
        sheet.node_stamp[node] = sheet.number[0]
        sheet.offset[node] = -1.0
        sheet.side[node] = 0


@kernel
def on_sheet(sheet: Sheet, node: int) -> bool:
    """Whether `node` lies on the sheet of the current incision."""
    return sheet.node_stamp[node] == sheet.number[0] and sheet.offset[node] >= 0.0


@kernel
def side_of(sheet: Sheet, node: int) -> int:
    """Side that `node` was seen on in this incision, or 0."""
    if sheet.node_stamp[node] != sheet.number[0]:
        return 0
    return sheet.side[node]


@kernel
def see_side(sheet: Sheet, node: int, side: int, again: bool) -> None:
    """Note the side that `node` was seen on; `again`: even if it was seen before."""
    touch(sheet, node)
    if again or sheet.side[node] == 0:
        sheet.side[node] = side


@kernel
def decided_side(sheet: Sheet, t: int) -> int:
    """Side that tetrahedron `t` was decided to be on in this incision, or 0."""
    if sheet.tetrahedron_stamp[t] != sheet.number[0]:
        return 0
    return sheet.tetrahedron_side[t]


@kernel
def decide_side(sheet: Sheet, t: int, side: int) -> None:
    """Decide that tetrahedron `t` is on that side."""
    sheet.tetrahedron_stamp[t] = sheet.number[0]
    sheet.tetrahedron_side[t] = side


SAME_WAY = 0.7
"""Cosine of the angle between path and blade up to which the path tells how the sheet lies."""


class Plane(NamedTuple):
    """The sheet near a point: a point on it and its unit normal, towards side +1."""

    point: Vec3
    normal: Vec3


@kernel
def plane_at(path: Path, k: int, p: Vec3) -> Plane:
    """The sheet at the point of segment `k` of the edge that is nearest to `p` [m]."""
    tip = vec3(path.t1, k)
    along = sub(vec3(path.t1, k + 1), tip)
    squared = dot(along, along)
    u = 0.0
    if squared > 0.0:
        u = min(1.0, max(0.0, dot(sub(p, tip), along) / squared))
    normal = normalised(cross(vec3(path.forward, k), along))
    # Where anchors are in disorder the normal of the path means nothing; that of the blade does.
    sideways = vec3(path.sideways, 0)
    if dot(normal, sideways) < SAME_WAY:
        normal = sideways
    return Plane(add(tip, scale(u, along)), normal)


@kernel
def plane_near(path: Path, p: Vec3) -> Plane:
    """The sheet at the point of the edge that is nearest to `p` [m]."""
    best = np.inf
    plane = Plane(p, Vec3(0.0, 0.0, 0.0))
    for k in range(len(path.linked) - 1):
        if path.linked[k]:
            there = plane_at(path, k, p)
            d = sub(p, there.point)
            if dot(d, d) < best:
                best = dot(d, d)
                plane = there
    return plane


@kernel
def flag(cut: Cut, node: int) -> None:
    """Let `node` lie on the sheet."""
    sheet = cut.sheet
    touch(sheet, node)
    if sheet.offset[node] < 0.0:
        p = vec3(cut.body.rest, node)
        plane = plane_near(cut.path, p)
        sheet.offset[node] = abs(dot(sub(p, plane.point), plane.normal))
    change = cut.change
    if change.counts[N_FLAGGED] < len(change.flagged):
        change.flagged[change.counts[N_FLAGGED]] = node
        change.counts[N_FLAGGED] += 1


@kernel
def put_on_lattice(path: Path, lattice: Lattice) -> None:
    """Round the path to the lattice and box its quads, once for all decisions of the step."""
    for k in range(len(path.linked)):
        a = nearest(lattice, vec3(path.t0, k))
        b = nearest(lattice, vec3(path.t1, k))
        path.lattice_t0[k, 0] = a.x
        path.lattice_t0[k, 1] = a.y
        path.lattice_t0[k, 2] = a.z
        path.lattice_t1[k, 0] = b.x
        path.lattice_t1[k, 1] = b.y
        path.lattice_t1[k, 2] = b.z
    for k in range(len(path.linked) - 1):
        for c in range(3):
            path.boxes[k, c] = min(
                min(path.lattice_t0[k, c], path.lattice_t0[k + 1, c]),
                min(path.lattice_t1[k, c], path.lattice_t1[k + 1, c]),
            )
            path.boxes[k, 3 + c] = max(
                max(path.lattice_t0[k, c], path.lattice_t0[k + 1, c]),
                max(path.lattice_t1[k, c], path.lattice_t1[k + 1, c]),
            )
