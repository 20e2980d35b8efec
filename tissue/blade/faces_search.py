"""The search for the faces of the tissue near the blade, repeated in each part of a step.

The cost is that of the open faces in the cells of the grid that the box of the blade meets. They
are listed where the box comes to other cells; after that, what is cut or listed there. A face that
was known keeps its state; a face that is new and already within the blade begins where it is (see
`tissue.blade.faces_contact`).
"""

from tissue.blade.blade_state import BladeState
from tissue.blade.edge import BladePose, Edge, blade_coordinates, pose_at
from tissue.blade.faces_contact import (
    CLEARANCE,
    POINTS,
    SEARCH_MARGIN,
    FaceContacts,
    contact_point,
    friction_stretch,
    penetration,
)
from tissue.blade.known_faces import (
    continue_contact,
    copy_face,
    copy_point,
    note_divided,
)
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, lanes
from tissue.core.simd_rows import larger, larger_bits, points_of_column
from tissue.core.vec3 import add, axpy, cross, dot, norm, scale, sub, vec3
from tissue.geometry.aabb import Aabb, widened, with_point
from tissue.mesh.body import Body, is_open
from tissue.mesh.tetrahedron_grid import TETRAHEDRA_PER_LINE, TetrahedronGrid, cell_along

LEAST_COSINE = 0.5
"""Least cosine of the angle between the normals of blade and face for a face that is next to the
blade. Other faces, such as the skin that the edge goes through, are pressed by the edge. With 0.05
that skin, once tilted by three degrees, was pressed aside whole: the force on a blade rose by a
third to a half while it went in."""

BEYOND_PLANE = 0.3 / SEARCH_MARGIN
"""Distance by which the middle of a new face may lie beyond the plane of the blade, per `margin`: a
cut is snapped to nodes as far away. A face further beyond is skin, or the lip of an earlier cut,
with tissue between it and the blade; pressed from within, that bore up to 18 % of the work."""


_LISTED, _CHANGED = 1, 2
"""Values of `FaceContacts.is_around`: the open faces of a tetrahedron are listed, or were when it
changed."""


@kernel
def blade_box(sides: FaceContacts, edge: Edge, when: float) -> Aabb:
    """Return the box in which faces are listed [m]."""
    return _box_at(sides, pose_at(edge, when))


@kernel
def _box_at(sides: FaceContacts, pose: BladePose) -> Aabb:
    """Return the box around a blade and its margin [m]."""
    box = Aabb(pose.tip, pose.tip)
    half = sides.half_thickness
    for corner in range(8):
        p = axpy(pose.length if corner & 1 else 0.0, pose.along, pose.tip)
        p = axpy(-sides.height if corner & 2 else 0.0, pose.forward, p)
        p = axpy(half if corner & 4 else -half, pose.normal, p)
        box = with_point(box, p)
    return widened(box, sides.margin)


@kernel
def release_faces(blade: BladeState) -> None:
    """End all side contacts, and count their energy as released."""
    sides, totals = blade.sides, blade.totals
    for i in range(sides.n_faces):
        totals.released += sides.states.energy[i]
        sides.row_of_face[sides.face[i]] = -1
    sides.n_faces = 0


@kernel
def forget_changed_faces(sides: FaceContacts, body: Body, changed: IntArray, n: int) -> None:
    """Treat the faces of the first `n` of `changed`, tetrahedra that were cut, as new.

    Those that are listed are listed again: other faces of them may be open, with other nodes.
    """
    listed = sides.is_around
    if n == len(changed):  # there may be more
        forget_cells(sides)
    for i in range(n):
        t = changed[i]
        for f in range(4):
            sides.row_of_face[4 * t + f] = -1
        if listed[t] == _LISTED:
            listed[t] = _CHANGED
    if sides.n_around < 0:
        return
    kept = 0
    for i in range(sides.n_around):
        if listed[sides.around[i] // 4] == _LISTED:
            _move_row(sides, i, kept)
            kept += 1
    sides.n_around = kept
    for i in range(n):
        if listed[changed[i]] == _CHANGED and not _list_open_faces_of(sides, body, changed[i]):
            forget_cells(sides)
            return


@kernel
def forget_cells(sides: FaceContacts) -> None:
    """List the faces around the blade again at the next search: the mesh or the grid changed."""
    sides.n_around = -1


@kernel
def find_faces(
    blade: BladeState,
    body: Body,
    grid: TetrahedronGrid,
    edge: Edge,
    when: float,
) -> bool:
    """Find the open faces near the blade; return False if there is no room for them.

    Where there is no room the contacts stay as they were.

    Args:
        blade: Its side contacts are written.
        body: The tissue.
        grid: Grid that lists the tetrahedra; its log is read.
        edge: The cutting edge over the time step.
        when: Instant, as a fraction of the time step.
    """
    sides, pose = blade.sides, pose_at(edge, when)
    are_others = _are_other_cells(sides, grid, _box_at(sides, pose))
    if sides.n_around < 0 or are_others or grid.n_logged > len(grid.log):
        _list_open_faces(sides, body, grid)
    else:
        _list_logged(sides, body, grid)
    grid.n_logged = 0
    if sides.n_around < 0:
        return False
    n = 0
    for i in range(0, sides.n_around, WIDTH):
        near = _near_plane(sides, body.positions, pose, i)
        for k in range(i, min(i + WIDTH, sides.n_around)):
            if near >> (k - i) & 1 == 1 and _is_near(sides, body.positions, pose, k):
                sides.found[n] = k
                n += 1
    _replace_faces(blade, body, pose, n)
    return True


@kernel
def _are_other_cells(sides: FaceContacts, grid: TetrahedronGrid, box: Aabb) -> bool:
    """Write which cells `box` [m] overlaps; return whether they are others than before.

    A blade often stays within the same cells for many steps.
    """
    cells = sides.cells
    are_others = False
    for c in range(3):
        first, last = cell_along(grid, box.low[c], c), cell_along(grid, box.high[c], c)
        are_others = are_others or cells[c] != first or cells[3 + c] != last
        cells[c], cells[3 + c] = first, last
    return are_others


@kernel
def _list_open_faces(sides: FaceContacts, body: Body, grid: TetrahedronGrid) -> None:
    """List the open faces in those cells; `sides.n_around` is -1 where there is no room."""
    cells, listed = sides.cells, sides.is_around
    for t in range(len(listed)):
        listed[t] = 0
    for i in range(cells[0], cells[3] + 1):
        for j in range(cells[1], cells[4] + 1):
            for k in range(cells[2], cells[5] + 1):
                cell = (i * grid.shape[1] + j) * grid.shape[2] + k
                line, n_in_line = grid.head[cell, 0], grid.head[cell, 1]
                while line >= 0:
                    for at in range(1, n_in_line + 1):
                        listed[grid.lines[line, at]] = _LISTED
                    line, n_in_line = grid.lines[line, 0], TETRAHEDRA_PER_LINE
    sides.n_around = 0
    for t in range(body.n_tetrahedra):
        if listed[t] == _LISTED and not _list_open_faces_of(sides, body, t):
            forget_cells(sides)
            return


@kernel
def _list_logged(sides: FaceContacts, body: Body, grid: TetrahedronGrid) -> None:
    """List the open faces of tetrahedra that were listed in those cells since the last search."""
    for i in range(grid.n_logged):
        t = grid.log[i]
        is_new = sides.is_around[t] == 0 and _is_in_cells(sides, grid, t)
        if is_new and not _list_open_faces_of(sides, body, t):
            forget_cells(sides)
            return


@kernel
def _is_in_cells(sides: FaceContacts, grid: TetrahedronGrid, t: int) -> bool:
    """Return whether a tetrahedron is listed in one of those cells."""
    for c in range(3):
        if grid.cells[t, c] > sides.cells[3 + c] or grid.cells[t, 3 + c] < sides.cells[c]:
            return False
    return True


@kernel
def _list_open_faces_of(sides: FaceContacts, body: Body, t: int) -> bool:
    """List the open faces of a tetrahedron; return whether there was room.

    The list rises: its order is that of the sums of the forces of faces. The grid lists tetrahedra
    in an order that depends on when each was listed.
    """
    sides.is_around[t] = _LISTED
    for f in range(4):
        if is_open(body.links[t, f]):
            i = sides.n_around
            if i == len(sides.around):
                return False
            while i > 0 and sides.around[i - 1] > 4 * t + f:
                _move_row(sides, i - 1, i)
                i -= 1
            sides.around[i] = 4 * t + f
            for corner in range(3):
                sides.node_around[i, corner] = body.tetrahedra[t, sides.outward[f, corner]]
            sides.n_around += 1
    return True


@kernel
def _move_row(sides: FaceContacts, i: int, j: int) -> None:
    """Move a listed face from row `i` to row `j`."""
    sides.around[j] = sides.around[i]
    for corner in range(3):
        sides.node_around[j, corner] = sides.node_around[i, corner]


@inlined
def _near_plane(sides: FaceContacts, x: FloatArray, pose: BladePose, i: int) -> int:
    """Return a bit for each of eight faces from `i` on: whether it may be near the blade's plane.

    A blade is thin: most faces are next to it.
    """
    first = _across(sides, x, pose, i, 0)
    second = _across(sides, x, pose, i, 1)
    third = _across(sides, x, pose, i, 2)
    reach = lanes(sides.half_thickness + sides.margin + CLEARANCE)
    none = lanes(0.0)
    highest = larger(first, larger(second, third))
    lowest = larger(none - first, larger(none - second, none - third))  # with the other sign
    return larger_bits(highest + reach, none) & larger_bits(lowest + reach, none)


@inlined
def _across(sides: FaceContacts, x: FloatArray, pose: BladePose, i: int, corner: int) -> Lanes:
    """Return how far a corner of eight faces from `i` on is from the blade's plane [m]."""
    px, py, pz = points_of_column(x, sides.node_around, i, corner)
    tip, normal = pose.tip, pose.normal
    along_x = (px - lanes(tip.x)) * lanes(normal.x)
    along_y = (py - lanes(tip.y)) * lanes(normal.y)
    return along_x + along_y + (pz - lanes(tip.z)) * lanes(normal.z)


@kernel
def _is_near(sides: FaceContacts, x: FloatArray, pose: BladePose, i: int) -> bool:
    """Return whether the box of face `i` of `around`, in the axes of the blade, meets the blade."""
    a = sub(vec3(x, sides.node_around[i, 0]), pose.tip)
    b = sub(vec3(x, sides.node_around[i, 1]), pose.tip)
    c = sub(vec3(x, sides.node_around[i, 2]), pose.tip)
    margin = sides.margin
    reach = sides.half_thickness + margin
    return (
        _meets(dot(a, pose.normal), dot(b, pose.normal), dot(c, pose.normal), -reach, reach)
        and _meets(
            -dot(a, pose.forward),
            -dot(b, pose.forward),
            -dot(c, pose.forward),
            -margin,
            sides.height + margin,
        )
        and _meets(
            dot(a, pose.along),
            dot(b, pose.along),
            dot(c, pose.along),
            -margin,
            pose.length + margin,
        )
    )


@inlined
def _meets(a: float, b: float, c: float, low: float, high: float) -> bool:
    """Return whether the interval of three numbers meets that from `low` to `high`."""
    return min(a, min(b, c)) < high and max(a, max(b, c)) > low


@kernel
def _replace_faces(blade: BladeState, body: Body, pose: BladePose, n: int) -> None:
    """Replace the faces in contact by the first `n` found; those known keep their state.

    Parts of a face that a cut divided continue it.
    """
    sides = blade.sides
    states, before = sides.states, sides.states_before
    for i in range(sides.n_faces):
        copy_face(states, before, i, i)
        for q in range(POINTS):
            copy_point(states, before, i, i, q)
    for i in range(n):
        sides.row_before[i] = sides.row_of_face[sides.around[sides.found[i]]]
    n_divided = note_divided(sides)
    release_faces(blade)
    for i in range(n):
        row = sides.n_faces
        face = sides.around[sides.found[i]]
        for corner in range(3):
            sides.node[row, corner] = sides.node_around[sides.found[i], corner]
        material = body.material[face // 4]
        sides.friction[row] = sides.of_materials[material, 0]
        sides.viscosity[row] = sides.of_materials[material, 1]
        old = sides.row_before[i]
        is_part = old < 0 and continue_contact(blade, body, row, n_divided)
        # A face in contact keeps its side and area: measuring a trembling lip again in each step
        # gave it energy, a tenth of the work of the blade in an organ.
        if old >= 0 and before.energy[old] > 0.0:
            copy_face(before, states, old, row)
        elif not (is_part or _measure_face(sides, body, pose, row)):
            continue
        is_known = old >= 0 and before.side[old] == states.side[row]
        sides.face[row] = face
        sides.row_of_face[face] = row
        sides.n_faces = row + 1
        for q in range(POINTS):
            if is_known:
                copy_point(before, states, old, row, q)
            elif not is_part:
                _begin_point(sides, body, pose, row, q)
        states.energy[row] = _face_energy(sides, body, pose, row)
        blade.totals.released -= states.energy[row]


@kernel
def _measure_face(sides: FaceContacts, body: Body, pose: BladePose, row: int) -> bool:
    """Write side and area of the face in `row`; return whether it is next to a side."""
    a = vec3(body.positions, sides.node[row, 0])
    b = vec3(body.positions, sides.node[row, 1])
    c = vec3(body.positions, sides.node[row, 2])
    area = cross(sub(b, a), sub(c, a))
    seen = dot(area, pose.normal)
    if abs(seen) <= LEAST_COSINE * norm(area):
        return False
    side = -1.0 if seen > 0.0 else 1.0
    middle = scale(1.0 / 3.0, add(a, add(b, c)))
    if side * dot(sub(middle, pose.tip), pose.normal) < -BEYOND_PLANE * sides.margin:
        return False
    sides.states.side[row] = side
    sides.states.area[row] = 0.5 * abs(seen) / POINTS
    return True


@kernel
def _begin_point(sides: FaceContacts, body: Body, pose: BladePose, row: int, q: int) -> None:
    """Begin a contact point of a new face where it is."""
    states = sides.states
    at = blade_coordinates(pose, contact_point(sides, body.positions, row, q))
    states.bevel_shift[row, q] = 0.0
    if penetration(sides, pose.length, row, q, at).depth > 0.0:
        # The outline of the bevel is moved to where the point is.
        states.bevel_shift[row, q] = states.side[row] * at.across - sides.slope * at.behind
    states.stuck_along[row, q] = at.along
    states.stuck_behind[row, q] = at.behind
    states.sliding_speed[row, q] = 0.0


@kernel
def _face_energy(sides: FaceContacts, body: Body, pose: BladePose, row: int) -> float:
    """Return the energy between a face and the blade, by pressure and friction [J]."""
    stiffness = sides.stiffness * sides.states.area[row]
    energy = 0.0
    for q in range(POINTS):
        at = blade_coordinates(pose, contact_point(sides, body.positions, row, q))
        depth = penetration(sides, pose.length, row, q, at).depth
        if depth > 0.0:
            held = friction_stretch(sides, row, q, at, stiffness * depth)
            energy += (
                0.5
                * stiffness
                * (depth * depth + held.along * held.along + held.behind * held.behind)
            )
    return energy
