"""All that a cut step reads and writes: body, path and sheet, what it changed, and its scratch."""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.core.vec3 import dot, sub, vec3
from tissue.cutting.blade_path import Path, plane_near
from tissue.cutting.cut_surface import Sheet, on_sheet, put_on_sheet
from tissue.mesh.body import Body
from tissue.mesh.changes import CHANGES, Change
from tissue.mesh.star import LARGEST_STAR, Visits

CROSSINGS = 1 << 12
"""Edges that one pass can cross."""

HASH_SLOTS = 1 << 15
"""Slots of the table of edges seen; twice what one pass can meet."""


class Quality(Arrays):
    """When a node that is there is used in place of a new one.

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
def flag(cut: Cut, node: int) -> None:
    """Let `node` lie on the sheet."""
    sheet = cut.sheet
    if not on_sheet(sheet, node):
        p = vec3(cut.body.rest, node)
        plane = plane_near(cut.path, p)
        offset = abs(dot(sub(p, plane.point), plane.normal))
        put_on_sheet(sheet, node, offset)
        cut.body.off_path[node] = max(cut.body.off_path[node], offset)
    change = cut.change
    if change.n_flagged < len(change.flagged):
        change.flagged[change.n_flagged] = node
        change.n_flagged += 1
