"""Which nodes and faces may touch a geom in a time step.

Contacts continue from the list before with their forces and anchors: both lists have the same
order, geom by geom, nodes before faces, each by its number.
"""

import math
from typing import Final

from tissue.contact.geometry.faces import NO_FACE, Faces
from tissue.contact.geoms.geom import PLANE
from tissue.contact.geoms.geom_arrays import (
    NODE_CONTACT,
    GeomContacts,
    Geoms,
    GeomSearch,
    motion_bound,
    place_geoms,
)
from tissue.contact.geoms.kinematic_contact import friction_of, note_velocities, weighted
from tissue.contact.geoms.signed_distance import Deepest, deepest_point, distance_to, is_flat_at
from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, norm, scale, store, sub, vec3
from tissue.mesh.body import Body
from tissue.mesh.bounding_boxes import largest_speed

_SLACK: Final = 0.1
"""Approach of nodes and geoms after which contacts are searched again, per mean
node size: 0.3 mm in an organ. The list reaches as far, and farther by what may come in one time
step (`MARGIN`). Smaller: slow hands take a search in each time step; larger: nodes are missed."""

_SLACK_OF_FACES: Final = 0.02
"""Approach where faces touch, whose deepest points move with the geoms: 60 um in an organ."""

_SAGITTA: Final = 0.02
"""Depth of a face in a geom between its corners over theirs, per mean node size, for
the face to need a contact of its own: 60 um in an organ. That contact is at a point of the material
and stays there until another one is as much deeper. Larger: sharp geoms sink in between nodes;
0: large spheres press on nodes and faces at once, and the point under a sphere runs to and fro as
its face tilts, which makes both tremble."""

_RECOVERY: Final = 1.0
"""Speed at which what was inside a geom as its contact began comes out, in node sizes a second.
Larger: more work on the tissue behind; 0: what overlaps does so for good."""

_STAYS: Final = 0.5
"""Share of `_SAGITTA` down to which a contact of a face stays that is there. 1: contacts come and
go, and their forces with them."""

_BEHIND: Final = 0.3
"""Cosine between the outward normals of tissue and geom above which the tissue is on the far side
of the geom, and is not pushed: further out is further in. Smaller: the walls of a deep groove
around a thin rod, which lean over it, pass through; 1: what has come round a thin rod is thrown
out by it."""

_LEAST_RISE: Final = 0.5
"""Least growth of the distance from a geom along the inward normal of a face, per distance, where
the geom presses on that face. Smaller: the face at the end of a bar that a rod lies across is
pushed along the rod, and the rod tears the end open; larger: faces next to an edge pass
through."""

POINTS_OF_FACE: Final = 3
"""Points at which one geom touches one face at most: a manifold, as a rod across a face has two."""

_STAYS_WITHIN: Final = 0.06
"""Largest depth of the deepest point of a face over that of a point of contact, per mean
node size. More: points that have long been left stay listed; less: the two ends of a rod across a
face press in turn."""

LIST_IS_FULL: Final = -1
"""Returned where the list has no room for all contacts."""

MARGIN: Final = 0.25
"""Approach of a node beyond that at its present speed until it is listed, per mean
node size: 0.8 mm in an organ. Larger: more is tested after each substep; smaller: lists last for
a shorter time, and what is thrown at a geom is noticed late, and put out of it then."""

LONGEST_EDGE: Final = 2.5
"""Longest edge of a face, per mean node size, across which a geom may touch a face whose corners
are all far from it. Smaller: a thin rod passes through the middle of a large face."""


@kernel
def find_geom_contacts(
    search: GeomSearch, contacts: GeomContacts, faces: Faces, body: Body, dt: float
) -> int:
    """List the contacts of a time step, if those of the last do not do; or return LIST_IS_FULL.

    Args:
        search: Scratch.
        contacts: Impulses are set to zero. The list in use may become the other one.
        faces: Skin and lips.
        body: Where the nodes are, and how fast.
        dt: Length of the time step [s].
    """
    geoms, capacity = contacts.geoms, len(contacts.geom) // 2
    search.seconds, search.fastest = dt, largest_speed(body)
    if _does_last_list(search, contacts, body):
        return contacts.n_contacts
    place_geoms(geoms, 0.0)
    search.search += 1
    search.n_listed, search.n_of_faces, search.next_old = 0, 0, contacts.first
    contacts.are_coupled = 0
    to = capacity if contacts.first == 0 else 0
    for g in range(len(geoms.shape)):
        if geoms.is_near[g] == 0:
            continue
        _find_near_nodes(search, geoms, body, g)
        # No point of a face is deeper in a plane than its corners.
        if geoms.shape[g] != PLANE:
            _find_near_faces(search, faces, body)
        for i in range(search.n_near):
            node = search.near[i]
            if body.fixed[node] or not _may_node_touch(search, geoms, body, g, node):
                continue
            if search.n_listed == capacity:
                search.is_due = 1
                return LIST_IS_FULL
            _list_node(search, contacts, body, g, node, to)
        for i in range(search.n_touched):
            if search.n_listed + POINTS_OF_FACE >= capacity:  # one row is scratch
                search.is_due = 1
                return LIST_IS_FULL
            _list_face(search, contacts, faces, body, g, search.touched[i], to)
    contacts.first, contacts.n_contacts = to, search.n_listed
    search.is_due = search.is_first = 0
    return search.n_listed


@kernel
def _does_last_list(search: GeomSearch, contacts: GeomContacts, body: Body) -> bool:
    """Whether the list of the last search does for this time step too; begin the step if so."""
    geoms, motion = contacts.geoms, search.fastest * search.seconds
    shift = 0.0
    for g in range(len(geoms.shape)):
        if geoms.is_near[g] == 1:
            shift = max(shift, motion_bound(geoms, g))
    motion += shift
    slack = (_SLACK_OF_FACES if search.n_of_faces > 0 else _SLACK) * search.node_size
    if search.is_due == 1 or search.moved + max(motion - search.covered, 0.0) > slack:
        search.moved = search.covered = motion
        return False
    search.moved += motion
    nothing = Vec3(0.0, 0.0, 0.0)
    for c in range(contacts.first, contacts.first + contacts.n_contacts):
        store(contacts.impulse, c, nothing)
        store(contacts.moment, c, nothing)
        least = 0.0 if contacts.face[c] == NODE_CONTACT else _SAGITTA * search.node_size
        recovered = contacts.slop[c] - _RECOVERY * search.node_size * search.seconds
        contacts.slop[c] = max(least, recovered)
        note_velocities(contacts, body, c)
    return True


@kernel
def _may_node_touch(search: GeomSearch, geoms: Geoms, body: Body, g: int, node: int) -> bool:
    """Whether a node may touch geom `g` before the next search, with the outside of the tissue."""
    found, outward = distance_to(geoms, g, vec3(body.positions, node)), vec3(search.normal, node)
    is_behind = dot(outward, found.normal) > _BEHIND * norm(outward)
    return bool(found.distance <= _reach_of(search, geoms, g) and not is_behind)


@kernel
def _list_node(
    search: GeomSearch, contacts: GeomContacts, body: Body, g: int, node: int, to: int
) -> None:
    """Add a node to the new list, which begins at row `to`."""
    c = to + search.n_listed
    contacts.geom[c], contacts.face[c] = g, NODE_CONTACT
    for q in range(3):
        contacts.node[c, q] = node
    store(contacts.weight, c, Vec3(1.0, 0.0, 0.0))
    if search.listed[node] == search.search:
        contacts.are_coupled = 1
    search.listed[node] = search.search
    _go_on(search, contacts, body, c, _old_row(search, contacts, c), 0.0)


@kernel
def _list_face(
    search: GeomSearch,
    contacts: GeomContacts,
    faces: Faces,
    body: Body,
    g: int,
    place: int,
    to: int,
) -> None:
    """Add a face to the new list, which begins at row `to`, if it may touch between its corners."""
    geoms = contacts.geoms
    i, j, k = faces.node[place, 0], faces.node[place, 1], faces.node[place, 2]
    a, b, c = vec3(body.positions, i), vec3(body.positions, j), vec3(body.positions, k)
    at_a, at_b, at_c = distance_to(geoms, g, a), distance_to(geoms, g, b), distance_to(geoms, g, c)
    outward = cross(sub(b, a), sub(c, a))
    area = norm(outward)
    if is_flat_at(at_a, at_b, at_c) or area == 0.0:
        return
    reach, least = _reach_of(search, geoms, g), _SAGITTA * search.node_size
    nearest = min(at_a.distance, at_b.distance, at_c.distance)
    # No point of a face is nearer than its nearest corner by more than its longest edge.
    if nearest - max(norm(sub(b, a)), norm(sub(c, b)), norm(sub(a, c))) > reach:
        return
    deepest = deepest_point(geoms, g, a, b, c)
    inward = scale(-1.0 / area, outward)
    if deepest.distance > reach or not _leads_out(search, contacts, g, deepest, inward, (a, b, c)):
        return
    sagitta = nearest - deepest.distance
    row = to + search.n_listed
    _name_face(contacts, faces, g, place, row)
    old = _old_row(search, contacts, row)
    if sagitta < (least if old < 0 else _STAYS * least):
        return
    contacts.are_coupled = 1
    nearest, n = math.inf, 0
    while old >= 0 and n < POINTS_OF_FACE:
        distance = distance_to(geoms, g, weighted(contacts, old, body.positions)).distance
        if distance <= deepest.distance + _STAYS_WITHIN * search.node_size:
            _name_face(contacts, faces, g, place, row)
            store(contacts.weight, row, vec3(contacts.weight, old))
            store(contacts.normal, row, inward)
            _go_on(search, contacts, body, row, old, least)
            nearest, n, row = min(nearest, distance), n + 1, row + 1
        search.next_old += 1
        _name_face(contacts, faces, g, place, row)
        old = _old_row(search, contacts, row)
    if nearest - deepest.distance > least and n < POINTS_OF_FACE:
        store(contacts.weight, row, deepest.weights)
        store(contacts.normal, row, inward)
        _go_on(search, contacts, body, row, -1, least)


@kernel
def _leads_out(
    search: GeomSearch,
    contacts: GeomContacts,
    g: int,
    deepest: Deepest,
    inward: Vec3,
    corners: tuple[Vec3, Vec3, Vec3],
) -> bool:
    """Whether the deepest point of a face gets out of geom `g` along the face's inward normal.

    The normal of the geom does not show it: at an edge of the distance it is that of one side
    alone.
    """
    a, b, c = corners
    w, step = deepest.weights, _SAGITTA * search.node_size
    x = add(add(scale(w.x, a), scale(w.y, b)), scale(w.z, c))
    ahead = distance_to(contacts.geoms, g, axpy(step, inward, x)).distance
    return bool(ahead - deepest.distance >= _LEAST_RISE * step)


@kernel
def _name_face(contacts: GeomContacts, faces: Faces, g: int, place: int, row: int) -> None:
    """Write which geom and which face touch in a row."""
    contacts.geom[row], contacts.face[row] = g, place
    for q in range(3):
        contacts.node[row, q] = faces.node[place, q]


@kernel
def _old_row(search: GeomSearch, contacts: GeomContacts, c: int) -> int:
    """Return the row of the list in use with the contact that row `c` of the new one is, or -1."""
    end = contacts.first + contacts.n_contacts
    while search.next_old < end and _is_before(contacts, search.next_old, c):
        search.next_old += 1
    old = search.next_old
    return old if old < end and not _is_before(contacts, c, old) else -1


@kernel
def _go_on(
    search: GeomSearch, contacts: GeomContacts, body: Body, c: int, old: int, slop: float
) -> None:
    """Continue contact `c` as row `old`, or begin it without a force where that is -1.

    Args:
        search: Written.
        contacts: Row `c` is written.
        body: Where the nodes are, and how fast.
        c: The contact.
        old: The same contact in the list in use.
        slop: How deep it may be [m]. What is deeper as it begins comes out slowly.
    """
    nothing = Vec3(0.0, 0.0, 0.0)
    search.n_listed += 1
    search.n_of_faces += contacts.face[c] != NODE_CONTACT
    store(contacts.force, c, nothing)
    store(contacts.impulse, c, nothing)
    store(contacts.moment, c, nothing)
    store(contacts.pressed, c, nothing)
    contacts.friction[c] = friction_of(contacts, body, c)
    contacts.is_held[c] = contacts.touches[c] = contacts.sticks[c] = 0
    distance = distance_to(
        contacts.geoms, contacts.geom[c], weighted(contacts, c, body.positions)
    ).distance
    contacts.slop[c] = max(slop, -distance) if search.is_first == 1 else slop
    if old >= 0:
        recovered = contacts.slop[old] - _RECOVERY * search.node_size * search.seconds
        contacts.slop[c] = max(slop, min(recovered, -distance))
        store(contacts.force, c, vec3(contacts.force, old))
        contacts.touches[c], contacts.sticks[c] = contacts.touches[old], contacts.sticks[old]
        if contacts.face[c] == NODE_CONTACT:
            store(contacts.normal, c, vec3(contacts.normal, old))
        store(contacts.anchor, c, vec3(contacts.anchor, old))
        contacts.is_held[c] = contacts.is_held[old]
    else:
        # What a node was displaced by when it was listed before has long passed.
        for q in range(3):
            store(contacts.displacement, contacts.node[c, q], nothing)
            contacts.half_work[contacts.node[c, q]] = 0.0
    note_velocities(contacts, body, c)


@kernel
def _is_before(contacts: GeomContacts, one: int, other: int) -> bool:
    """Whether contact `one` comes before `other` in a list."""
    geom, face, node = contacts.geom, contacts.face, contacts.node
    if geom[one] != geom[other]:
        return bool(geom[one] < geom[other])
    if face[one] != face[other]:
        return bool(face[one] < face[other])
    return bool(node[one, 0] < node[other, 0])


@kernel
def _find_near_nodes(search: GeomSearch, geoms: Geoms, body: Body, g: int) -> None:
    """Write the nodes that geom `g`, or a face around them, may touch before the next search."""
    is_plane = geoms.shape[g] == PLANE
    reach = _reach_of(search, geoms, g)
    around = reach if is_plane else reach + LONGEST_EDGE * search.node_size
    search.stamp += 1
    search.n_near = search.n_touched = 0
    low, high = _box(geoms, g)
    low = Vec3(low.x - around, low.y - around, low.z - around)
    high = Vec3(high.x + around, high.y + around, high.z + around)
    for node in range(body.n_nodes):
        x = vec3(body.positions, node)
        if is_plane:
            if distance_to(geoms, g, x).distance > around:
                continue
        elif not (low.x <= x.x <= high.x and low.y <= x.y <= high.y and low.z <= x.z <= high.z):
            continue
        search.near[search.n_near] = node
        search.n_near += 1
        search.near_at[node] = search.stamp
        store(search.normal, node, Vec3(0.0, 0.0, 0.0))


@kernel
def _find_near_faces(search: GeomSearch, faces: Faces, body: Body) -> None:
    """Write the faces with a corner near the geom, and the normals of the near nodes."""
    if search.n_near == 0:
        return
    near_at, stamp = search.near_at, search.stamp
    for place in range(faces.n_places):
        if faces.face[place] == NO_FACE:
            continue
        i, j, k = faces.node[place, 0], faces.node[place, 1], faces.node[place, 2]
        if near_at[i] != stamp and near_at[j] != stamp and near_at[k] != stamp:
            continue
        a = vec3(body.positions, i)
        area = cross(sub(vec3(body.positions, j), a), sub(vec3(body.positions, k), a))
        for q in range(3):
            node = faces.node[place, q]
            store(search.normal, node, axpy(1.0, area, vec3(search.normal, node)))
        if not (body.fixed[i] and body.fixed[j] and body.fixed[k]):
            search.touched[search.n_touched] = place
            search.n_touched += 1


@kernel
def _reach_of(search: GeomSearch, geoms: Geoms, g: int) -> float:
    """Return how far from geom `g` a node is at most that it may touch before the next search."""
    speed = search.fastest * search.seconds + motion_bound(geoms, g)
    return float(MARGIN * search.node_size + speed)


@kernel
def _box(geoms: Geoms, g: int) -> tuple[Vec3, Vec3]:
    """Return lowest and highest corner of a box around geom `g`, in the frame of the tissue."""
    axes, middle, half = geoms.axes, vec3(geoms.middle, g), vec3(geoms.half, g)
    x = _row(axes, g, 0, middle, half)
    y = _row(axes, g, 3, middle, half)
    z = _row(axes, g, 6, middle, half)
    o = vec3(geoms.origin, g)
    low = Vec3(o.x + x[0] - x[1], o.y + y[0] - y[1], o.z + z[0] - z[1])
    return low, Vec3(o.x + x[0] + x[1], o.y + y[0] + y[1], o.z + z[0] + z[1])


@kernel
def _row(axes: FloatArray, g: int, k: int, middle: Vec3, half: Vec3) -> tuple[float, float]:
    """Return the middle of a box along an axis of the tissue, and half its size there."""
    a, b, c = axes[g, k], axes[g, k + 1], axes[g, k + 2]
    at = a * middle.x + b * middle.y + c * middle.z
    return at, abs(a) * half.x + abs(b) * half.y + abs(c) * half.z
