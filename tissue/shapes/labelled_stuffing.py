"""Fill several shapes that touch each other with tetrahedra that share their faces.

The isosurface stuffing of `tissue.shapes.isosurface_stuffing`, of more than two materials. Where
two meet in a lattice tetrahedron its stencils are taken on both sides; where three or four do, a
point inside it is joined with what the faces show of them, and a point inside a face with its
edges. What lies in a face follows from the face alone, so that neighbours agree on it and no gap is
left. Then nodes where three labels or more meet, one of them the outside, are moved to where they
meet.
"""

import itertools

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import FloatArray, IntArray
from tissue.shapes.isosurface_stuffing import (
    INSIDE,
    ON,
    OUTSIDE,
    MovedToSurface,
    bisected,
    checked_box,
    edges_between,
    lattice_of,
    moved_to_surface,
    quadrilateral,
    stencil,
    turned_left_and_used,
)
from tissue.shapes.label_borders import DepthFunction, moved_to_borders
from tissue.types import TetrahedralMesh

ON_SURFACE = -1
"""Label of a lattice point that was moved onto a surface."""

PartCorner = tuple[int, ...]
"""(i,): node i of a lattice tetrahedron; (i, j): where its edge ij is cut; (i, j, k): the point
in that face, and (0, 1, 2, 3): the point in it, where three labels or more meet."""


def stuff_labels(
    depth: DepthFunction, n_labels: int, bounds: npt.ArrayLike, spacing: float
) -> TetrahedralMesh:
    """Return a tetrahedral mesh of the inside of several shapes, with the label of each.

    Args:
        depth: How deep points are in each shape. It should be smooth at the scale of `spacing`.
        n_labels: Number of shapes: their labels are 1 to `n_labels`.
        bounds: Lowest and highest corner of a box around the shapes [m], shape (2, 3).
        spacing: Edge of a lattice cell [m]; a tetrahedron inside has a twelfth of its volume.

    Raises:
        ValueError: The box or the spacing makes no sense, the shapes are not within the box, or
            they hold no point of the lattice.
    """
    lattice = lattice_of(*checked_box(bounds, spacing), spacing)
    labels = _labels_at(depth, n_labels, lattice.points)
    if labels[lattice.is_outermost].any():
        raise ValueError("the shapes are not within the bounds; make them larger")
    if not labels.any():
        raise ValueError("the shapes hold no point of the lattice; make the spacing smaller")
    tetrahedra = lattice.tetrahedra(labels > 0)
    edges = edges_between(tetrahedra, labels)
    a, b = labels[edges].T
    inner, outer = lattice.points[edges].swapaxes(0, 1)
    cuts = bisected(lambda at: depth(at, a) - depth(at, b), inner, outer)
    moved = _moved(lattice.points, tetrahedra, labels, edges, cuts)
    nodes = _Nodes(moved.points, edges[moved.is_cut], cuts[moved.is_cut])
    mesh = _divided(nodes, tetrahedra, moved.signs)
    return mesh._replace(positions=moved_to_borders(mesh, depth, spacing))


def _labels_at(depth: DepthFunction, n_labels: int, points: FloatArray) -> IntArray:
    """Return the label of each point: that in whose shape it is deepest, the lowest of equals."""
    labels = np.zeros(len(points), dtype=np.int64)
    deepest = depth(points, labels)
    for label in range(1, n_labels + 1):
        depths = depth(points, np.full(len(points), label))
        is_deeper = depths > deepest
        labels[is_deeper], deepest = label, np.maximum(deepest, depths)
    return labels


def _moved(
    points: FloatArray, tetrahedra: IntArray, labels: IntArray, edges: IntArray, cuts: FloatArray
) -> MovedToSurface:
    """Move lattice points onto the surfaces; of a tetrahedron between two labels never all four.

    It might be flat then. Towards the outside it may: there it is left out. The point stays that
    would have been moved farthest, so that the cuts of its edges are far from it.
    """
    stays = np.zeros(len(points), dtype=bool)
    while True:
        moved = moved_to_surface(points, labels, edges, cuts, ON_SURFACE, stays)
        tets = tetrahedra[(moved.signs[tetrahedra] == ON_SURFACE).all(axis=1)]
        met = np.sort(labels[edges[moved.onto[tets]]].reshape(len(tets), 8), axis=1)
        inner = np.where(met == 0, met[:, -1:], met)
        tets = tets[(inner != inner[:, :1]).any(axis=1)]
        if not len(tets):
            return moved
        ways = np.linalg.norm(moved.points - points, axis=1)[tets]
        stays[tets[np.arange(len(tets)), ways.argmax(axis=1)]] = True


def _divided(nodes: "_Nodes", tetrahedra: IntArray, labels: IntArray) -> TetrahedralMesh:
    """Return the parts of lattice tetrahedra that have a label over 0.

    Args:
        nodes: StuffingLattice points and cuts of edges.
        tetrahedra: Of the lattice.
        labels: Of its points.
    """
    patterns, of_tetrahedron = np.unique(
        _in_order_of_appearance(labels[tetrahedra]), axis=0, return_inverse=True
    )
    parts, found = [], []
    for k, pattern in enumerate(patterns.tolist()):
        tets = tetrahedra[of_tetrahedron.ravel() == k]
        for part, owner in _parts(tuple(pattern)):
            is_kept = labels[tets[:, owner]] > 0
            parts.append(np.stack([nodes.of(tets[is_kept], corner) for corner in part], axis=1))
            found.append(labels[tets[is_kept, owner]])
    return turned_left_and_used(nodes.positions(), np.concatenate(parts), np.concatenate(found))


def _in_order_of_appearance(labels: IntArray) -> IntArray:
    """Return labels of four nodes as 0, 1, 2, 3 in the order in which they appear."""
    result = np.full(labels.shape, ON_SURFACE)
    n_found = np.zeros(len(labels), dtype=np.int64)
    for i in range(4):
        is_new = labels[:, i] != ON_SURFACE
        for j in range(i):
            is_same = labels[:, i] == labels[:, j]
            result[is_same, i] = result[is_same, j]
            is_new &= ~is_same
        result[is_new, i] = n_found[is_new]
        n_found += is_new
    return result


class _Nodes:
    """Numbers the nodes of the mesh: lattice points, cuts of edges, points in faces and inside."""

    def __init__(self, points: FloatArray, edges: IntArray, cuts: FloatArray) -> None:
        self._n = len(points)
        self._keys = edges[:, 0] * self._n + edges[:, 1]  # sorted, for the edges are
        self._positions = [points, cuts]
        self._n_nodes = len(points) + len(cuts)
        self._inner: dict[tuple[int, ...], int] = {}

    def positions(self) -> FloatArray:
        """Return where all are [m]."""
        return np.concatenate(self._positions)

    def of(self, tetrahedra: IntArray, corner: PartCorner) -> IntArray:
        """Return the node at a corner of a part of each tetrahedron."""
        chosen = np.sort(tetrahedra[:, corner], axis=1)
        if len(corner) == 1:
            return chosen[:, 0]
        if len(corner) == 2:
            at = np.searchsorted(self._keys, chosen[:, 0] * self._n + chosen[:, 1])
            return self._n + at
        return self._inside(chosen)

    def _inside(self, chosen: IntArray) -> IntArray:
        """Return the node in the middle of each face or tetrahedron: that of its cuts."""
        rows, inverse = np.unique(chosen, axis=0, return_inverse=True)
        keys = [tuple(row) for row in rows.tolist()]
        new = [i for i, key in enumerate(keys) if key not in self._inner]
        if new:
            self._inner.update((keys[i], self._n_nodes + place) for place, i in enumerate(new))
            self._n_nodes += len(new)
            self._positions.append(self._middle_of_cuts(rows[new]))
        nodes = np.array([self._inner[key] for key in keys], dtype=np.int64)
        return nodes[inverse.ravel()]

    def _middle_of_cuts(self, rows: IntArray) -> FloatArray:
        """Return the mean of the cuts of the edges between the nodes of each row [m]."""
        total, n_cuts = np.zeros((len(rows), 3)), np.zeros((len(rows), 1))
        cuts = self._positions[1]
        for i, j in itertools.combinations(range(rows.shape[1]), 2):
            keys = rows[:, i] * self._n + rows[:, j]
            at = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
            is_cut = self._keys[at] == keys
            total[is_cut] += cuts[at[is_cut]]
            n_cuts[is_cut] += 1.0
        return total / n_cuts


def _parts(pattern: tuple[int, ...]) -> list[tuple[tuple[PartCorner, ...], int]]:
    """Return the parts of a tetrahedron whose nodes have these labels, each of one label.

    Args:
        pattern: Labels in order of appearance; `ON_SURFACE` is none.

    Returns:
        Four corners of each part, and a node that has its label.
    """
    present = sorted(set(pattern) - {ON_SURFACE})
    if len(present) <= 2:
        parts = []
        for label in present:
            signs = [ON if p == ON_SURFACE else INSIDE if p == label else OUTSIDE for p in pattern]
            for part in stencil(tuple(signs)):
                parts.append((tuple(_corner(vertex) for vertex in part), pattern.index(label)))
        return parts
    # Joined with a point on the surface, a face that has it would be flat.
    on = [i for i in range(4) if pattern[i] == ON_SURFACE]
    apex: PartCorner = tuple(on) or (0, 1, 2, 3)
    faces = [face for face in itertools.combinations(range(4), 3) if not set(on) & set(face)]
    return [
        ((apex, *triangle), owner)
        for face in faces
        for triangle, owner in _triangles(face, pattern)
    ]


def _triangles(
    face: tuple[int, ...], pattern: tuple[int, ...]
) -> list[tuple[tuple[PartCorner, ...], int]]:
    """Return the triangles of a face of a tetrahedron with these labels, as `_parts` does."""
    on = [i for i in face if pattern[i] == ON_SURFACE]
    others = [i for i in face if pattern[i] != ON_SURFACE]
    present = {pattern[i] for i in others}
    if len(present) == 1:
        return [(tuple((i,) for i in face), others[0])]
    if len(present) == 3:
        return [(((i,), _corner((i, j)), face), i) for i, j in itertools.permutations(others, 2)]
    if on:
        p, q = others
        return [((tuple(on), (i,), _corner((p, q))), i) for i in (p, q)]
    (n,) = (i for i in face if sum(pattern[i] == pattern[j] for j in face) == 1)
    p, q = (i for i in face if i != n)
    a, b, c, d = (_corner(vertex) for vertex in quadrilateral(p, q, n))
    return [((a, b, c), p), ((a, b, d), p), (((n,), _corner((p, n)), _corner((q, n))), n)]


def _corner(vertex: tuple[int, int]) -> PartCorner:
    """Return a vertex of a stencil as a corner."""
    i, j = sorted(vertex)
    return (i,) if i == j else (i, j)
