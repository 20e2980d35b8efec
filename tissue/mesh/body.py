"""The arrays of a tetrahedral body, how they grow, and how to walk from tetrahedron to tetrahedron.

Face `f` of a tetrahedron lies opposite its local node `f`. `links[t, f]` names what is behind it:
4 * neighbour + the neighbour's local face, or OUTER where the body ends, or CUT where a blade went,
or a number below both where faces of two sizes meet (`tissue.mesh.nonconforming`).
Nodes and tetrahedra keep their numbers; both are only ever appended.
"""

from typing import NamedTuple

import numpy as np

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import room_for_points
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3
from tissue.geometry.exact_predicates import Lattice, lattice_around
from tissue.geometry.tetrahedron import barycentric_in, smallest_weight
from tissue.material import Material
from tissue.mesh.interfaces import Interfaces, no_interfaces
from tissue.mesh.material_table import MaterialArrays
from tissue.mesh.nonconforming import HANGING, SMALL_FACES, Hanging, grown_hanging, nothing_hanging
from tissue.types import TetrahedralMesh

OUTER = -1
"""Link of a face on the skin."""
CUT = -2
"""Link of a face that a blade made."""

INSIDE_TOLERANCE = 1e-9
"""Distance below 0 of a barycentric weight of a point that counts as inside: rounding."""

LONGEST_WALK = 128
"""Tetrahedra that `walk` passes through at most. A step of the edge passes through two or three."""


class Body(Arrays):
    """Every node and tetrahedron. Rows beyond `n_nodes` and `n_tetrahedra` are room to grow."""

    rest: FloatArray = sized("nodes", 3)
    """Rest positions [m], shape (capacity, 3)."""
    lattice_rest: IntArray = sized("nodes", 3)
    """Rest positions on the lattice, shape (capacity, 3)."""
    positions: FloatArray = sized("nodes", 3)
    """Positions now [m], shape (capacity, 3)."""
    velocities: FloatArray = sized("nodes", 3)
    """Velocities [m/s], shape (capacity, 3)."""
    masses: FloatArray = sized("nodes")
    """Masses that are moved [kg]: a quarter of each tetrahedron around the node, and what mass
    scaling added. Shape (capacity,)."""
    added_masses: FloatArray = sized("nodes")
    """The part of the masses that mass scaling added [kg]: it has no weight. Shape (capacity,)."""
    fixed: BoolArray = sized("nodes")
    """Whether each node is fixed, shape (capacity,)."""
    friction: FloatArray = sized("nodes")
    """Coefficient of friction around each node, where materials differ in friction or drag
    (`tissue.mesh.node_means`); shape (capacity,)."""
    drag: FloatArray = sized("nodes", fill=1.0)
    """Drag around each node over the highest of the body, exactly 1 where materials have the same;
    shape (capacity,)."""
    dragged_masses: FloatArray = sized("nodes")
    """Scratch of `tissue.forces.rigid_motion`: masses times `drag`, where it differs."""
    off_path: FloatArray = sized("nodes")
    """Distance of a cut's node from where the blade passed [m], the largest of several cuts; 0 for
    other nodes, -1 where no blade passed but a bridge was finished; shape (capacity,)."""
    node_tetrahedron: IntArray = sized("nodes")
    """One tetrahedron around each node; links lead to the others. Shape (capacity,)."""
    twin: IntArray = sized("nodes")
    """Next node in the ring of nodes that were one before cuts doubled it, shape (capacity,)."""
    tetrahedra: IntArray = sized("tetrahedra", 4)
    """Node indices, shape (capacity, 4)."""
    links: IntArray = sized("tetrahedra", 4)
    """Half-face behind each face, shape (capacity, 4)."""
    is_rigid: BoolArray = sized("tetrahedra")
    """Whether each tetrahedron is in a rigid core, shape (capacity,)."""
    n_rigid: IntCell
    """Number of tetrahedra in rigid cores."""
    material: IntArray = sized("tetrahedra")
    """Row of each tetrahedron in `materials`, shape (capacity,)."""
    n_nodes: IntCell
    """Number of nodes."""
    n_tetrahedra: IntCell
    """Number of tetrahedra."""
    lattice: Lattice
    """The lattice of exact decisions."""
    hanging: Hanging
    """Faces of two sizes that meet; empty unless the paper's scheme cuts."""
    materials: MaterialArrays
    """Materials of the tetrahedra."""
    interfaces: Interfaces
    """Layers between labels."""


def build_links(tetrahedra: IntArray) -> IntArray:
    """Return what is behind each face of each tetrahedron, shape (n_tets, 4).

    Raises:
        ValueError: a face belongs to more than two tetrahedra.
    """
    n = len(tetrahedra)
    faces = np.empty((4 * n, 3), dtype=np.int64)
    for f in range(4):
        faces[f::4] = tetrahedra[:, [k for k in range(4) if k != f]]
    faces.sort(axis=1)
    order = np.lexsort(faces.T)
    same = (faces[order[1:]] == faces[order[:-1]]).all(axis=1)
    if (same[1:] & same[:-1]).any():
        at = int(order[np.flatnonzero(same[1:] & same[:-1])[0]]) // 4
        raise ValueError(f"a face of tetrahedron {at} belongs to three or more tetrahedra")
    links = np.full(4 * n, OUTER, dtype=np.int64)
    first, second = order[:-1][same], order[1:][same]
    links[first], links[second] = second, first
    return links.reshape(n, 4)


def build_body(
    mesh: TetrahedralMesh,
    positions: FloatArray | None,
    fixed: BoolArray | None,
    materials: MaterialArrays | None = None,
    material: IntArray | None = None,
    interfaces: Interfaces | None = None,
) -> Body:
    """Return the body of a mesh.

    Args:
        mesh: The mesh.
        positions: Where its nodes are [m], shape (n_nodes, 3); None is at rest.
        fixed: Which of them do not move, shape (n_nodes,); None is none.
        materials: What it is made of; None is the usual material.
        material: Row of each tetrahedron in that table, shape (n_tets,); None is the first.
        interfaces: Layers between its labels; None for none.
    """
    rest = np.ascontiguousarray(mesh.positions, dtype=np.float64)
    tetrahedra = np.ascontiguousarray(mesh.tetrahedra, dtype=np.int64)
    n = len(rest)
    lattice = lattice_around(rest)
    node_tetrahedron = np.zeros(n, dtype=np.int64)
    node_tetrahedron[tetrahedra[::-1]] = np.arange(len(tetrahedra))[::-1, None]
    return Body.new(
        {"nodes": n, "tetrahedra": len(tetrahedra)},
        rest=grown(rest, n),
        lattice_rest=np.floor((rest - lattice.origin) / lattice.spacing + 0.5).astype(np.int64),
        positions=grown(rest if positions is None else positions, n),
        fixed=np.zeros(n, dtype=np.bool_) if fixed is None else fixed.copy(),
        node_tetrahedron=node_tetrahedron,
        twin=np.arange(n),
        tetrahedra=tetrahedra.copy(),
        links=build_links(tetrahedra),
        n_nodes=n,
        n_tetrahedra=len(tetrahedra),
        lattice=lattice,
        hanging=nothing_hanging(),
        material=np.zeros(len(tetrahedra), np.int64) if material is None else material.copy(),
        materials=MaterialArrays.of([Material()], [0]) if materials is None else materials,
        interfaces=no_interfaces() if interfaces is None else interfaces,
    )


def grown(array: np.ndarray, capacity: int, fill: float = 0) -> np.ndarray:
    """Return a copy of `array` with `capacity` rows, the new ones filled with `fill`."""
    if array.shape[1:] == (3,) and array.dtype == np.float64:
        larger = room_for_points(capacity)
        larger[len(array) :] = fill
    else:
        larger = np.full((capacity, *array.shape[1:]), fill, dtype=array.dtype)
    larger[: len(array)] = array
    return larger


def grown_body(body: Body, n_nodes: int, n_tetrahedra: int) -> Body:
    """Return the body with room for that many nodes and tetrahedra."""
    hanging = grown_hanging(body.hanging, n_nodes, n_tetrahedra)
    larger = body.grown({"nodes": n_nodes, "tetrahedra": n_tetrahedra})
    return larger.replaced(hanging=hanging)


@inlined
def relative_density(body: Body, t: int) -> float:
    """Return the density of a tetrahedron over that of the first material: exactly 1 of one."""
    density = body.materials.density
    relative: float = density[body.material[t]] / density[0]
    return relative


@kernel
def is_open(link: int) -> bool:
    """Return whether nothing is behind a face with that link: it is on the skin or on a cut."""
    return HANGING < link < 0


@kernel
def n_behind(body: Body, t: int, link: int) -> int:
    """Return how many tetrahedra are behind a face of `t` with that link: none, one or six."""
    if link >= 0:
        return 1
    if link > HANGING:
        return 0
    return SMALL_FACES if body.hanging.faces[HANGING - link, 0] == t else 1


@kernel
def behind(body: Body, t: int, link: int, i: int) -> int:
    """Return number `i` of the tetrahedra behind a face of `t` with that link."""
    if link >= 0:
        return link // 4
    row = HANGING - link
    other: int = body.hanging.faces[row, 1 + i if body.hanging.faces[row, 0] == t else 0]
    return other


@kernel
def local_index(body: Body, t: int, node: int) -> int:
    """Return which of the four nodes of tetrahedron `t` is `node`, or -1."""
    for k in range(4):
        if body.tetrahedra[t, k] == node:
            return k
    return -1


class Walk(NamedTuple):
    """Where a walk through the body at rest ended."""

    tetrahedron: int
    """The last tetrahedron."""
    inside: bool
    """Whether the point is in that tetrahedron."""
    link: int
    """Obstacle that stopped the walk: OUTER, CUT, or 0 if it was too long or ended inside."""


@kernel
def walk(body: Body, p: Vec3, start: int) -> Walk:
    """Walk from tetrahedron `start` towards the rest point `p` [m], through faces.

    The paper's search for the new active point tetrahedron "in the direct neighbourhood of the
    old one" (section 3), continued as far as it takes.
    """
    t = start
    for _ in range(LONGEST_WALK):
        w = barycentric_in(p, body.rest, body.tetrahedra, t)
        if smallest_weight(w) >= -INSIDE_TOLERANCE:
            return Walk(t, True, 0)
        stopped_by = OUTER
        exit_face = -1
        lowest = -INSIDE_TOLERANCE
        for f in range(4):
            weight = w[f]
            if weight < -INSIDE_TOLERANCE:
                if not is_open(body.links[t, f]):
                    if weight < lowest:
                        lowest = weight
                        exit_face = f
                elif body.links[t, f] == CUT:
                    stopped_by = CUT
        if exit_face < 0:
            return Walk(t, False, stopped_by)
        t = _beyond(body, p, t, body.links[t, exit_face])
    return Walk(t, False, 0)


@kernel
def holder_near(body: Body, p: Vec3, last: int) -> int:
    """Return the tetrahedron that holds a place of the body at rest [m].

    Where none does it is the one that the place is least outside of. What a cut makes of a
    tetrahedron keeps its label, and bodies touch at rest: so another label does not count.

    Args:
        body: The body.
        p: The place.
        last: The tetrahedron that held it before; -1 where that is not known.
    """
    label, mine = body.materials.label, -1
    if last >= 0:
        mine, found = label[body.material[last]], walk(body, p, last)
        if found.inside and label[body.material[found.tetrahedron]] == mine:
            return found.tetrahedron
    held, deepest = last, -np.inf
    for t in range(body.n_tetrahedra - 1, -1, -1):  # the parts of one come last
        if mine < 0 or label[body.material[t]] == mine:
            depth = smallest_weight(barycentric_in(p, body.rest, body.tetrahedra, t))
            if depth > deepest:
                held, deepest = t, depth
            if depth >= -INSIDE_TOLERANCE:
                break
    return held


@kernel
def _beyond(body: Body, p: Vec3, t: int, link: int) -> int:
    """Return the tetrahedron behind a face; of six, the one that `p` [m] is least outside of."""
    if link >= 0:
        return link // 4
    nearest = -1
    largest = -np.inf
    for i in range(n_behind(body, t, link)):
        other = behind(body, t, link, i)
        weight = smallest_weight(barycentric_in(p, body.rest, body.tetrahedra, other))
        if weight > largest:
            largest = weight
            nearest = other
    return nearest
