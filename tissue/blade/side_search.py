"""Which faces of the tissue are near the blade: found anew in each part of a step.

The cost is that of the tetrahedra in the box of the blade. A face that was known keeps its state; a
face that is new and already within the blade begins where it is (see `tissue.blade.side_contact`).
"""

import numpy as np

from tissue.blade.anchors import Edge
from tissue.blade.impulse_totals import RELEASED
from tissue.blade.side_contact import (
    LATE,
    POINTS,
    SPEED,
    STUCK_ALONG,
    STUCK_BEHIND,
    Flanks,
    blade_frame,
    depth,
    face_point,
    friction_at,
    in_blade,
)
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, axpy, cross, dot, norm, sub, vec3
from tissue.mesh.body import Body
from tissue.mesh.nonconforming import is_open
from tissue.mesh.point_location import TetrahedronGrid, cell_along
from tissue.mesh.star import Visits

_N_AROUND, _CELLS, COUNTS = 0, 1, 7
"""Places in `Flanks.searched`."""

_SIDE, _AREA, ENERGY = 0, 1, 2
"""Places in `Flanks.faces_before`."""

LEAST_COSINE = 0.5
"""Between the normals of a face and of the blade, for a face that is beside the blade. The edge
presses the others, such as the skin that it goes through. With 0.05 that skin, once tilted by three
degrees, was pressed aside whole: the force on a blade rose by a third to a half on its way."""


@kernel
def blade_box(flanks: Flanks, edge: Edge, when: float, margin: float) -> tuple[Vec3, Vec3]:
    """Lowest and highest corner of the box around the blade [m]."""
    tip, along, forward, normal, length = blade_frame(edge, when)
    low, high = tip, tip
    for corner in range(8):
        p = axpy(length if corner & 1 else 0.0, along, tip)
        p = axpy(-flanks.height if corner & 2 else 0.0, forward, p)
        p = axpy(flanks.half_thickness if corner & 4 else -flanks.half_thickness, normal, p)
        low = Vec3(min(low.x, p.x), min(low.y, p.y), min(low.z, p.z))
        high = Vec3(max(high.x, p.x), max(high.y, p.y), max(high.z, p.z))
    return (
        Vec3(low.x - margin, low.y - margin, low.z - margin),
        Vec3(high.x + margin, high.y + margin, high.z + margin),
    )


@kernel
def forget_faces(flanks: Flanks, totals: FloatArray) -> None:
    """Let go of all."""
    for i in range(flanks.count[0]):
        totals[RELEASED] += flanks.energy[i]
        flanks.place[flanks.face[i]] = -1
    flanks.count[0] = 0


@kernel
def forget_changed_faces(flanks: Flanks, dirty: IntArray, n: int) -> None:
    """Let the faces of the first `n` of `dirty`, tetrahedra that were cut, count as new."""
    forget_cells(flanks)
    for i in range(n):
        for f in range(4):
            flanks.place[4 * dirty[i] + f] = -1


@kernel
def find_faces(
    flanks: Flanks,
    body: Body,
    visits: Visits,
    grid: TetrahedronGrid,
    edge: Edge,
    when: float,
    margin: float,
    totals: FloatArray,
) -> bool:
    """Find the open faces within `margin` [m] of the blade; return False if there is no room.

    Where there is none the old faces stay as they were.
    """
    low, high = blade_box(flanks, edge, when, margin)
    if _are_other_cells(flanks.searched, grid, low, high):
        flanks.searched[_N_AROUND] = _open_faces(flanks, body, visits, grid)
    if flanks.searched[_N_AROUND] < 0:
        return False
    frame = blade_frame(edge, when)
    n = 0
    for i in range(flanks.searched[_N_AROUND]):
        face = flanks.around[i]
        if _is_near(flanks, body, frame, face // 4, face % 4, margin):
            flanks.found[n] = face
            n += 1
    _take_over(flanks, body, frame, n, totals)
    return True


@kernel
def forget_cells(flanks: Flanks) -> None:
    """Let the faces around the blade be looked for anew: the mesh or the grid is another."""
    flanks.searched[_N_AROUND] = -1


@kernel
def _are_other_cells(searched: IntArray, grid: TetrahedronGrid, low: Vec3, high: Vec3) -> bool:
    """Write which cells the box from `low` to `high` [m] meets; return whether they were others.

    Or whether they list others now. A blade goes for many steps through the same cells.
    """
    are_others = searched[_N_AROUND] < 0
    for c in range(3):
        first, last = cell_along(grid, low[c], c), cell_along(grid, high[c], c)
        are_others = are_others or searched[_CELLS + c] != first or searched[_CELLS + 3 + c] != last
        searched[_CELLS + c], searched[_CELLS + 3 + c] = first, last
    for k in range(len(grid.counts)):
        are_others = are_others or searched[COUNTS + k] != grid.counts[k]
        searched[COUNTS + k] = grid.counts[k]
    return are_others


@kernel
def _open_faces(flanks: Flanks, body: Body, visits: Visits, grid: TetrahedronGrid) -> int:
    """Write the open faces in those cells to `flanks.around`; return how many, -1 without room."""
    visits.epoch += 1
    epoch, cells = visits.epoch, flanks.searched
    n = 0
    for i in range(cells[_CELLS], cells[_CELLS + 3] + 1):
        for j in range(cells[_CELLS + 1], cells[_CELLS + 4] + 1):
            for k in range(cells[_CELLS + 2], cells[_CELLS + 5] + 1):
                entry = grid.head[(i * grid.shape[1] + j) * grid.shape[2] + k]
                while entry >= 0:
                    t = grid.entry[entry]
                    entry = grid.following[entry]
                    if visits.tetrahedra[t] == epoch:
                        continue
                    visits.tetrahedra[t] = epoch
                    for f in range(4):
                        if is_open(body.links[t, f]):
                            if n == len(flanks.around):
                                return -1
                            flanks.around[n] = 4 * t + f
                            n += 1
    return n


@kernel
def _is_near(
    flanks: Flanks,
    body: Body,
    frame: tuple[Vec3, Vec3, Vec3, Vec3, float],
    t: int,
    f: int,
    margin: float,
) -> bool:
    """Whether the box of a face in the coordinates of the blade meets the blade."""
    low_a = low_s = low_z = np.inf
    high_a = high_s = high_z = -np.inf
    for k in range(3):
        at = in_blade(frame, vec3(body.positions, body.tetrahedra[t, flanks.outward[f, k]]))
        low_a, high_a = min(low_a, at.x), max(high_a, at.x)
        low_s, high_s = min(low_s, at.y), max(high_s, at.y)
        low_z, high_z = min(low_z, at.z), max(high_z, at.z)
    reach = flanks.half_thickness + margin
    return (
        low_a < frame[4] + margin
        and high_a > -margin
        and low_s < flanks.height + margin
        and high_s > -margin
        and low_z < reach
        and high_z > -reach
    )


@kernel
def _take_over(
    flanks: Flanks,
    body: Body,
    frame: tuple[Vec3, Vec3, Vec3, Vec3, float],
    n: int,
    totals: FloatArray,
) -> None:
    """Put the faces found in the place of those known, which keep their state."""
    for i in range(POINTS * flanks.count[0]):
        for c in range(4):
            flanks.before[i, c] = flanks.state[i, c]
    for i in range(flanks.count[0]):
        flanks.faces_before[i, _SIDE] = flanks.side[i]
        flanks.faces_before[i, _AREA] = flanks.area[i]
        flanks.faces_before[i, ENERGY] = flanks.energy[i]
    for i in range(n):
        flanks.known_as[i] = flanks.place[flanks.found[i]]
    forget_faces(flanks, totals)
    for i in range(n):
        row = flanks.count[0]
        face = flanks.found[i]
        _name_nodes(flanks, body, row, face)
        old = flanks.known_as[i]
        # What is pressed keeps its side and area: to measure a lip that trembles anew in each step
        # gave it energy, a tenth of what the blade did in an organ.
        if old >= 0 and flanks.faces_before[old, ENERGY] > 0.0:
            flanks.side[row] = flanks.faces_before[old, _SIDE]
            flanks.area[row] = flanks.faces_before[old, _AREA]
        elif not _measure(flanks, body, frame, row):
            continue
        is_known = old >= 0 and flanks.faces_before[old, _SIDE] == flanks.side[row]
        flanks.face[row] = face
        flanks.place[face] = row
        flanks.count[0] = row + 1
        for q in range(POINTS):
            if not is_known:
                _begin(flanks, body, frame, row, q)
                continue
            for c in range(4):
                flanks.state[POINTS * row + q, c] = flanks.before[POINTS * old + q, c]
        flanks.energy[row] = _energy(flanks, body, frame, row)
        totals[RELEASED] -= flanks.energy[row]


@kernel
def _name_nodes(flanks: Flanks, body: Body, row: int, face: int) -> None:
    """Write the nodes of a face to `row`."""
    for k in range(3):
        flanks.node[row, k] = body.tetrahedra[face // 4, flanks.outward[face % 4, k]]


@kernel
def _measure(
    flanks: Flanks, body: Body, frame: tuple[Vec3, Vec3, Vec3, Vec3, float], row: int
) -> bool:
    """Write side and area of the face in `row`; return whether it has a side."""
    a = vec3(body.positions, flanks.node[row, 0])
    b = vec3(body.positions, flanks.node[row, 1])
    c = vec3(body.positions, flanks.node[row, 2])
    area = cross(sub(b, a), sub(c, a))
    seen = dot(area, frame[3])
    if abs(seen) <= LEAST_COSINE * norm(area):
        return False
    flanks.side[row] = -1.0 if seen > 0.0 else 1.0
    flanks.area[row] = 0.5 * abs(seen) / POINTS
    return True


@kernel
def _begin(
    flanks: Flanks,
    body: Body,
    frame: tuple[Vec3, Vec3, Vec3, Vec3, float],
    row: int,
    q: int,
) -> None:
    """Begin a point that was not looked at before where it is."""
    state = flanks.state
    at = in_blade(frame, face_point(flanks, body.positions, row, q))
    at_row = POINTS * row + q
    state[at_row, LATE] = 0.0
    inside = depth(flanks, frame[4], row, q, at)
    if inside.z > 0.0:
        # The bevel's reach becomes where the point is.
        state[at_row, LATE] = flanks.side[row] * at.z - flanks.slope * at.y
    state[at_row, STUCK_ALONG] = at.x
    state[at_row, STUCK_BEHIND] = at.y
    state[at_row, SPEED] = 0.0


@kernel
def _energy(
    flanks: Flanks, body: Body, frame: tuple[Vec3, Vec3, Vec3, Vec3, float], row: int
) -> float:
    """Of a face against the blade [J], friction too."""
    stiffness = flanks.stiffness * flanks.area[row]
    energy = 0.0
    for q in range(POINTS):
        at = in_blade(frame, face_point(flanks, body.positions, row, q))
        pressed = depth(flanks, frame[4], row, q, at)
        if pressed.z > 0.0:
            held = friction_at(flanks, row, q, at, stiffness * pressed.z)
            energy += 0.5 * stiffness * (pressed.z * pressed.z + held.x * held.x + held.y * held.y)
    return energy
