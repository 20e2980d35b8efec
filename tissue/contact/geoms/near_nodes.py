"""Which nodes and faces are near a geom, by boxes; and how the search remembers them."""

from typing import Final

from tissue.contact.faces import NO_FACE, Faces
from tissue.contact.geoms.geom import PLANE
from tissue.contact.geoms.geom_arrays import Geoms
from tissue.contact.geoms.geom_motion import way_of
from tissue.contact.geoms.signed_distance import distance_to
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, axpy, cross, store, sub, vec3
from tissue.mesh.body import Body

MARGIN: Final = 0.25
"""How much nearer a node may come than it would at its present speed until it is listed, per mean
node size: 0.8 mm in an organ. Larger: more is looked at after each substep; smaller: lists last for
a shorter time, and what is thrown at a geom is noticed late, and put out of it then."""

LONGEST_EDGE: Final = 2.5
"""Longest edge of a face, per mean node size, across which a geom may touch a face whose corners
are all far from it. Smaller: a thin rod passes through the middle of a large face."""


class GeomSearch(Arrays):
    """Scratch of the search, and how long its list will do."""

    stamp: IntCell
    """Number of the geom that was looked at last, counted since the start."""
    search: IntCell
    """Number of the last search."""
    is_first: IntCell
    """1 until the first search has ended."""
    is_due: IntCell
    """1 if the next time step must search, whatever has moved: the mesh changed, or a geom did."""
    n_listed: IntCell
    """Rows of the new list so far."""
    n_of_faces: IntCell
    """How many of them are of faces."""
    next_old: IntCell
    """Row of the old list that has not been passed yet."""
    n_near: IntCell
    """Number of nodes near the geom."""
    n_touched: IntCell
    """Number of faces near the geom."""
    seconds: FloatCell
    """Length of the time step [s]."""
    moved: FloatCell
    """How far nodes and geoms have moved towards each other since the last search, at most [m]."""
    covered: FloatCell
    """How far they moved so in the time step that the last search was for [m]."""
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


@kernel
def find_near_nodes(search: GeomSearch, geoms: Geoms, body: Body, g: int) -> None:
    """Write the nodes that geom `g`, or a face around them, may touch before the next search."""
    is_plane = geoms.shape[g] == PLANE
    reach = reach_of(search, geoms, g)
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
def find_near_faces(search: GeomSearch, faces: Faces, body: Body) -> None:
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
def reach_of(search: GeomSearch, geoms: Geoms, g: int) -> float:
    """Return how far from geom `g` a node is at most that it may touch before the next search."""
    speed = search.fastest * search.seconds + way_of(geoms, g)
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
