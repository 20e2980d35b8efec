"""Stages of the blade in a step, each one call of a kernel that takes one struct.

A call from Python takes 0.4 us for each struct that it passes, measured on a busy core. There
searches, path and report took 83 us of a frame with a call for each function, and 44 us so.
"""

from typing import Final

from tissue.blade.blade_state import BladeState
from tissue.blade.edge import Edge, motion_at, pose_at
from tissue.blade.edge_anchors import anchored_length, is_engaged
from tissue.blade.edge_search import (
    anchor_beside,
    anchor_entering,
    any_free_in_box,
    free_retracted,
)
from tissue.blade.faces_search import blade_box, find_faces, release_faces
from tissue.blade.forces import clear_blade_forces
from tissue.blade.held_length import measure_held_lengths
from tissue.blade.path_tracing import trace_path
from tissue.blade.spine_search import release_spine, update_spine
from tissue.blade.wrench import WrenchReport, write_means, write_report
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.core.vec3 import vec3
from tissue.cutting.blade_path import Path, path_travel
from tissue.geometry.aabb import box_between, overlap
from tissue.mesh.body import Body
from tissue.mesh.star import Visits
from tissue.mesh.tetrahedron_grid import TetrahedronGrid, fits, list_appended, list_moved

NOT_SEARCHED: Final = 0
"""There was no search: the blade is far, or no sample of the edge can have entered."""
SEARCHED: Final = 1
"""The tetrahedra were listed in the grid, and searched."""
GRID_IS_FULL: Final = 2
"""The grid must be built again; then call again."""
NO_ROOM_FOR_FACES: Final = 3
"""The side contacts need more room; then call again."""

NOT_ENGAGED: Final = -1.0
"""Returned for the length of a path where no sample of the edge is in the tissue."""


class BladeContext(Arrays):
    """Everything that searches and reports of the blade read and write."""

    blade: BladeState
    """Anchors, side contacts and totals."""
    body: Body
    """The tissue."""
    visits: Visits
    """Scratch for searches."""
    path: Path
    """Path of the edge through the material."""
    grid: TetrahedronGrid
    """Lists where the tetrahedra are."""
    report: WrenchReport
    """Wrench, stiffness and contacts."""
    bounds: FloatArray
    """Lowest and highest corner of a box around the tissue [m], shape (2, 3)."""
    slit_reach: float
    """Distance from a cut face up to which a point is in the slit [m]
    (`tissue.blade.edge_search.is_in_slit`)."""
    cut_margin: float
    """Distance outside the skin at which the cut surface begins and ends [m]."""


@kernel
def _list_tetrahedra(context: BladeContext, nodes: IntArray, n: int) -> bool:
    """List in the grid where the tetrahedra are now; return whether there was room."""
    body, grid = context.body, context.grid
    if not fits(grid, body):
        return False
    around = context.blade.queue
    if not list_moved(body, context.visits, grid, nodes, n, around):
        return False
    return list_appended(body, body.positions, grid)


@kernel
def release_sides(blade: BladeState) -> None:
    """End all contacts of the side faces, the back and the ends; count their energy as released."""
    release_faces(blade)
    release_spine(blade)


@kernel
def update_faces(context: BladeContext, edge: Edge, when: float, nodes: IntArray, n: int) -> int:
    """Find the faces of the tissue that the side faces may touch, and skin before blunt sides.

    Args:
        context: The contacts of both and the grid are written.
        edge: The cutting edge over the time step.
        when: Instant, as a fraction of the time step.
        nodes: Nodes, of which the first `n` are all that moved since the last search.
        n: How many these are.
    """
    blade = context.blade
    if not overlap(blade_box(blade.sides, edge, when), box_between(context.bounds)):
        release_sides(blade)
        return NOT_SEARCHED
    if not _list_tetrahedra(context, nodes, n):
        return GRID_IS_FULL
    if not find_faces(blade, context.body, context.grid, edge, when):
        return NO_ROOM_FOR_FACES
    update_spine(blade, context.body, context.grid, motion_at(edge, when))
    return SEARCHED


@kernel
def update_anchors(
    context: BladeContext,
    external: FloatArray,
    edge: Edge,
    when: float,
    nodes: IntArray,
    n: int,
    is_again: bool,
) -> int:
    """Anchor the samples of the edge that entered the tissue, and free those that left it.

    Args:
        context: The anchors and the grid are written.
        external: Forces on the nodes [N], shape (capacity, 3); those of the blade are cleared.
        edge: The cutting edge over the time step.
        when: Instant, as a fraction of the time step.
        nodes: Nodes, of which the first `n` are all that moved since the last search.
        n: How many these are.
        is_again: Whether the grid was full in a first call and is new now.
    """
    blade, body, path = context.blade, context.body, context.path
    low, high = vec3(context.bounds, 0), vec3(context.bounds, 1)
    if not is_again:
        clear_blade_forces(blade, body, external)
        pose = pose_at(edge, when)
        free_retracted(blade, body, context.visits, path, pose)
        anchor_beside(blade, body, context.visits, pose, context.slit_reach)
        if not any_free_in_box(blade.anchors, pose, low, high):
            measure_held_lengths(blade, body, pose)
            return NOT_SEARCHED
    if not _list_tetrahedra(context, nodes, n):
        return GRID_IS_FULL
    anchor_entering(blade, body, context.grid, edge, when, context.slit_reach, low, high)
    measure_held_lengths(blade, body, pose_at(edge, when))
    return SEARCHED


@kernel
def trace(context: BladeContext, edge: Edge, when: float) -> float:
    """Trace the path of the edge; return the largest displacement of a sample [m].

    `NOT_ENGAGED` where the edge is not in the tissue.
    """
    anchors, path = context.blade.anchors, context.path
    if not is_engaged(anchors):
        return NOT_ENGAGED
    trace_path(context.blade, context.body, edge, when, context.cut_margin, path)
    return path_travel(path)


@kernel
def report_step(context: BladeContext, edge: Edge, dt: float) -> None:
    """Write what a time step of `dt` [s] came to."""
    report, blade, body = context.report, context.blade, context.body
    write_report(report, blade, body, edge)
    write_means(report, blade.totals, edge.tip_t1, dt)
    amounts = report.amounts
    amounts[0], amounts[1], amounts[2] = report.n_contacts, body.n_nodes, body.n_tetrahedra
    amounts[3], amounts[4] = context.path.seed[0], anchored_length(blade.anchors)
    amounts[5], amounts[6] = blade.totals.work_of_blade, blade.totals.work_of_cutting
    for corner in range(2):
        for axis in range(3):
            report.bounds[corner, axis] = context.bounds[corner, axis]
