"""Fill a smooth implicit shape with tetrahedra that have no bad angles.

Source: Labelle and Shewchuk, "Isosurface stuffing: fast tetrahedral meshes with good dihedral
angles", ACM Trans. Graph. 26 (2007). A body-centred cubic lattice is laid over the shape, lattice
points close to the surface are moved onto it, and the tetrahedra that the surface still crosses are
cut off by stencils. With the constants below they prove dihedral angles from 10.7 to 164.8 degrees.
"""

import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import FloatArray, IntArray
from tissue.mesh.validation import signed_volumes
from tissue.types import TetrahedralMesh

ImplicitFunction = Callable[[FloatArray], FloatArray]
"""Points [m], shape (n, 3), to values, shape (n,): positive inside, negative outside."""

ALPHA_LONG = 0.24999
"""Fraction of a long edge within which a surface point moves the end of the edge onto itself."""
ALPHA_SHORT = 0.41189
"""Fraction of a short edge within which a surface point moves the end of the edge onto itself. The
pair is the paper's optimum for meshes of one size."""

MAX_LATTICE_POINTS = 20_000_000
"""StuffingLattice points of the largest lattice: a larger one would take tens of gigabytes."""

BISECTIONS = 50
"""Halvings of an edge in the search for the surface: down to rounding."""

INSIDE, ON, OUTSIDE = 1, 0, -1


def stuff(
    implicit_function: ImplicitFunction, bounds: npt.ArrayLike, spacing: float
) -> TetrahedralMesh:
    """Return a tetrahedral mesh of the inside of `implicit_function`.

    Args:
        implicit_function: The shape. It should be smooth at the scale of `spacing`.
        bounds: Lowest and highest corner of a box around the shape [m], shape (2, 3).
        spacing: Edge of a lattice cell [m]; a tetrahedron inside has a twelfth of its volume.

    Raises:
        ValueError: The box or the spacing makes no sense, the shape is not within the box, or it
            holds no point of the lattice.
    """
    lattice = lattice_of(*checked_box(bounds, spacing), spacing)
    values = np.asarray(implicit_function(lattice.points), dtype=np.float64)
    if not np.isfinite(values).all():
        raise ValueError("the implicit function is not finite everywhere in the box")
    if (values[lattice.is_outermost] >= 0.0).any():
        raise ValueError("the shape is not within the bounds; make them larger")
    signs = np.sign(values).astype(np.int64)
    if not (signs > 0).any():
        raise ValueError("the shape holds no point of the lattice; make the spacing smaller")

    tetrahedra = lattice.tetrahedra()
    edges = edges_between(tetrahedra, signs)
    edges = edges[signs[edges].prod(axis=1) < 0]
    is_inside = signs[edges[:, 0]] > 0
    ends = np.where(is_inside[:, None], edges, edges[:, ::-1])
    cuts = bisected(implicit_function, *lattice.points[ends].swapaxes(0, 1))
    moved = moved_to_surface(lattice.points, signs, edges, cuts)
    edges, cuts = edges[moved.is_cut], cuts[moved.is_cut]

    tetrahedra = _cut_off(tetrahedra, moved.signs, edges, len(moved.points))
    return turned_left_and_used(np.concatenate([moved.points, cuts]), tetrahedra)


class StuffingLattice(NamedTuple):
    """A body-centred cubic lattice: corners of cubic cells, and their centres."""

    points: FloatArray
    """[m], shape (n_points, 3)."""
    is_outermost: npt.NDArray[np.bool_]
    """Whether the point is on the surface of the lattice, shape (n_points,)."""
    cells: IntArray
    """Number of cells along each axis, shape (3,)."""

    def tetrahedra(self, is_of_use: npt.NDArray[np.bool_] | None = None) -> IntArray:
        """Return node indices, shape (n_tets, 4).

        The long edges go from node 0 to 1 and from 2 to 3. The first end of each is even, which
        decides how neighbours cut a face that both share.

        Args:
            is_of_use: Points of which a tetrahedron must have one, shape (n_points,). None: all.
        """
        n_corners = int(np.prod(self.cells + 1))
        centres = np.indices(tuple(self.cells)).reshape(3, -1).T

        def corner(index: IntArray) -> IntArray:
            nodes: IntArray = np.ravel_multi_index(tuple(index.T), tuple(self.cells + 1))
            return nodes

        def centre(index: IntArray) -> IntArray:
            nodes: IntArray = n_corners + np.ravel_multi_index(tuple(index.T), tuple(self.cells))
            return nodes

        # Each face between two cells has four tetrahedra: both centres, and two corners side by
        # side.
        tetrahedra = []
        for axis, (u, v) in enumerate(((1, 2), (2, 0), (0, 1))):
            unit = np.eye(3, dtype=np.int64)
            lower = centres[centres[:, axis] < self.cells[axis] - 1]
            around = [
                unit[axis] + s * unit[u] + t * unit[v] for s, t in ((0, 0), (1, 0), (1, 1), (0, 1))
            ]
            for first, second in zip(around, around[1:] + around[:1], strict=True):
                a = _even_first(lower, lower + unit[axis])
                b = _even_first(lower + first, lower + second)
                columns = [centre(a[0]), centre(a[1]), corner(b[0]), corner(b[1])]
                found = np.stack(columns, axis=1)
                if is_of_use is not None:
                    found = found[is_of_use[found].any(axis=1)]
                tetrahedra.append(found)
        return np.concatenate(tetrahedra)


def checked_box(bounds: npt.ArrayLike, spacing: float) -> tuple[FloatArray, IntArray]:
    """Return the lowest corner [m] of a lattice around a box, and its numbers of cells.

    Args:
        bounds: Lowest and highest corner of the box [m], shape (2, 3).
        spacing: Edge of a lattice cell [m].

    Raises:
        ValueError: the box or the spacing makes no sense.
    """
    box = np.asarray(bounds, dtype=np.float64)
    if box.shape != (2, 3) or not np.isfinite(box).all() or not (box[0] < box[1]).all():
        raise ValueError(f"bounds are {bounds!r}; they must be a lowest and a highest corner in m")
    if not np.isfinite(spacing) or spacing <= 0.0:
        raise ValueError(f"spacing is {spacing} m; it must be finite and positive")
    cells = np.ceil((box[1] - box[0]) / spacing) + 2  # one more around it for the outermost points
    if 2 * np.prod(cells) > MAX_LATTICE_POINTS:
        raise ValueError(
            f"spacing {spacing} m gives {2 * np.prod(cells):.3g} points; make it larger"
        )
    middle = 0.5 * (box[0] + box[1])
    return middle - 0.5 * spacing * cells, cells.astype(np.int64)


def lattice_of(lowest: FloatArray, cells: IntArray, spacing: float) -> StuffingLattice:
    """Return the lattice of `cells` from the corner `lowest` [m] on.

    Args:
        lowest: Its lowest corner [m].
        cells: Number of cells along each axis.
        spacing: Edge of a cell [m].
    """
    corners = np.indices(tuple(cells + 1)).reshape(3, -1).T
    centres = np.indices(tuple(cells)).reshape(3, -1).T
    points = lowest + spacing * np.concatenate([corners, centres + 0.5])
    is_outermost = np.concatenate(
        [((corners == 0) | (corners == cells)).any(axis=1), np.zeros(len(centres), dtype=bool)]
    )
    return StuffingLattice(points, is_outermost, cells)


def _even_first(a: IntArray, b: IntArray) -> tuple[IntArray, IntArray]:
    """Order neighbours along an axis so that the first has an even sum of indices."""
    is_odd = (a.sum(axis=1) % 2 == 1)[:, None]
    return np.where(is_odd, b, a), np.where(is_odd, a, b)


def edges_between(tetrahedra: IntArray, signs: IntArray) -> IntArray:
    """Return the edges whose ends differ in sign, the lower index first and in order.

    Args:
        tetrahedra: Node indices, shape (n_tets, 4).
        signs: Sign, or any number, of each node.
    """
    mixed = tetrahedra[(signs[tetrahedra] != signs[tetrahedra[:, :1]]).any(axis=1)]
    pairs = np.concatenate([mixed[:, pair] for pair in itertools.combinations(range(4), 2)])
    pairs = np.sort(pairs[signs[pairs[:, 0]] != signs[pairs[:, 1]]], axis=1)
    return np.unique(pairs, axis=0)


def bisected(
    implicit_function: ImplicitFunction, inner: FloatArray, outer: FloatArray
) -> FloatArray:
    """Return where the surface crosses the lines between points [m], shape (n, 3).

    Args:
        implicit_function: The shape.
        inner: An end of each line that is inside [m], shape (n, 3).
        outer: The other end, which is outside.
    """
    for _ in range(BISECTIONS):
        middle = 0.5 * (inner + outer)
        is_inside = (implicit_function(middle) > 0.0)[:, None]
        inner, outer = np.where(is_inside, middle, inner), np.where(is_inside, outer, middle)
    return 0.5 * (inner + outer)


class MovedToSurface(NamedTuple):
    """StuffingLattice points of which some were moved onto the surface."""

    points: FloatArray
    """[m], shape (n_points, 3)."""
    signs: IntArray
    """Sign of each."""
    is_cut: npt.NDArray[np.bool_]
    """Which of the edges are still cut."""
    onto: IntArray
    """The edge to whose cut each point was moved, -1: it was not."""


def moved_to_surface(
    points: FloatArray,
    signs: IntArray,
    edges: IntArray,
    cuts: FloatArray,
    on: int = ON,
    stays: npt.NDArray[np.bool_] | None = None,
) -> MovedToSurface:
    """Move each lattice point that is too near to a cut of its edges to the nearest such cut.

    In the order of their numbers: the edges of a point on the surface are no longer cut, so that
    its neighbours may stay where they are. All at once are moved that have no neighbour before
    them that may still move, which is the same.

    Args:
        points: StuffingLattice points [m], shape (n, 3).
        signs: Sign, or any number, of each.
        edges: Those that are cut, in order, shape (n_edges, 2).
        cuts: Where each is [m], shape (n_edges, 3).
        on: The sign of a point that was moved.
        stays: Points that may not be moved. None: all may.
    """
    points, signs, onto = points.copy(), signs.copy(), np.full(len(points), -1)
    is_cut = np.ones(len(edges), dtype=bool)
    lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    is_long = lengths > 0.95 * lengths.max(initial=0.0)  # short ones have sqrt(3) / 2 of it
    limits = np.where(is_long, ALPHA_LONG, ALPHA_SHORT) * lengths
    distances = np.linalg.norm(points[edges] - cuts[:, None], axis=2)
    is_near = distances < limits[:, None]
    if stays is not None:
        is_near &= ~stays[edges]
    near_edge, near_end = np.nonzero(is_near)
    while True:
        is_left = is_cut[near_edge]
        near_edge, near_end = near_edge[is_left], near_end[is_left]
        nodes = edges[near_edge, near_end]
        if not nodes.size:
            return MovedToSurface(points, signs, is_cut, onto)
        may_move = np.zeros(len(points), dtype=bool)
        may_move[nodes] = True
        waits = np.zeros(len(points), dtype=bool)  # edges have their lower end first
        waits[edges[is_cut & may_move[edges].all(axis=1), 1]] = True
        of_ready = np.flatnonzero(~waits[nodes])
        distance = distances[near_edge[of_ready], near_end[of_ready]]
        order = of_ready[np.lexsort((near_edge[of_ready], distance, nodes[of_ready]))]
        moved, first = np.unique(nodes[order], return_index=True)
        onto[moved] = near_edge[order[first]]
        points[moved] = cuts[onto[moved]]
        signs[moved] = on
        has_moved = np.zeros(len(points), dtype=bool)
        has_moved[moved] = True
        is_cut &= ~has_moved[edges].any(axis=1)


def turned_left_and_used(
    points: FloatArray, tetrahedra: IntArray, labels: IntArray | None = None
) -> TetrahedralMesh:
    """Return a mesh of tetrahedra of either orientation, without the points that none uses.

    Args:
        points: [m], shape (n, 3).
        tetrahedra: Indices of them, shape (n_tets, 4).
        labels: Of the tetrahedra. None: there are none.
    """
    turned = signed_volumes(points, tetrahedra) < 0.0
    tetrahedra = np.where(turned[:, None], tetrahedra[:, [0, 1, 3, 2]], tetrahedra)
    used, tetrahedra = np.unique(tetrahedra, return_inverse=True)
    return TetrahedralMesh(points[used], tetrahedra.reshape(-1, 4), labels)


StencilVertex = tuple[int, int]
"""(i, i): node i of a lattice tetrahedron; (i, j): where the surface crosses its edge ij."""


def _cut_off(tetrahedra: IntArray, signs: IntArray, edges: IntArray, n_points: int) -> IntArray:
    """Return the tetrahedra inside, of either orientation; cut k is node `n_points` + k."""
    tetrahedra = tetrahedra[(signs[tetrahedra] > 0).any(axis=1)]
    keys = edges[:, 0] * n_points + edges[:, 1]  # sorted, for the edges are
    patterns = signs[tetrahedra]
    parts = []
    for pattern in itertools.product((INSIDE, ON, OUTSIDE), repeat=4):
        tets = tetrahedra[(patterns == pattern).all(axis=1)]
        for part in stencil(pattern) if len(tets) else []:
            columns = []
            for i, j in part:
                low, high = np.minimum(tets[:, i], tets[:, j]), np.maximum(tets[:, i], tets[:, j])
                cut = n_points + np.searchsorted(keys, low * n_points + high)
                columns.append(low if i == j else cut)
            parts.append(np.stack(columns, axis=1))
    return np.concatenate(parts)


def stencil(pattern: tuple[int, ...]) -> list[tuple[StencilVertex, ...]]:
    """Return the tetrahedra that are left of one whose nodes have these signs.

    Args:
        pattern: `INSIDE`, `ON` or `OUTSIDE` for each of the four.
    """
    inside, on, outside = ([i for i in range(4) if pattern[i] == s] for s in (INSIDE, ON, OUTSIDE))
    kept = [(i, i) for i in inside + on]
    if not inside:
        return []
    if not outside:
        return [tuple(kept)]
    if len(inside) == 1:
        return [(*kept, *((inside[0], n) for n in outside))]
    if len(outside) == 1 and len(inside) == 2:
        return _pyramid((on[0], on[0]), quadrilateral(inside[0], inside[1], outside[0]))
    if len(outside) == 1:
        # Corner n is cut off. Its long edge goes to p; the diagonals of both faces at pn meet in
        # the cut of pn, so that a tetrahedron and a pyramid remain.
        (n,) = outside
        p = n ^ 1
        q, r = (i for i in inside if i != p)
        whole = ((p, p), (q, q), (r, r), (p, n))
        return [whole, *_pyramid((p, n), quadrilateral(q, r, n))]
    p, q = inside
    m, n = outside
    if _is_long(p, q):
        # Both faces at pq have their diagonals from p, which is even.
        whole = ((p, p), (q, q), (q, m), (q, n))
        return [whole, *_pyramid((p, p), [(p, m), (q, n), (p, n), (q, m)])]
    if not _is_long(p, m):
        m, n = n, m
    # The long edges are pm and qn: each cut is an end of the diagonal of a face and of the surface.
    return [
        ((p, p), (q, q), (p, m), (q, n)),
        ((p, p), (p, n), (p, m), (q, n)),
        ((q, q), (q, m), (p, m), (q, n)),
    ]


def quadrilateral(p: int, q: int, n: int) -> list[StencilVertex]:
    """Return what is left of face pqn without corner n: a diagonal, and the other two corners.

    Args:
        p: A node of the face, the lower of the two that are left.
        q: The other.
        n: The corner that is cut off.
    """
    if _is_long(p, q):
        return [(p, p), (q, n), (q, q), (p, n)]  # both cuts are on short edges: from the even node
    if _is_long(q, n):
        p, q = q, p
    return [(p, n), (q, q), (p, p), (q, n)]  # from the cut on the long edge pn


def _pyramid(apex: StencilVertex, base: list[StencilVertex]) -> list[tuple[StencilVertex, ...]]:
    """Return the two halves of a pyramid; `base` is a diagonal, and the other two corners."""
    a, b, c, d = base
    return [(apex, a, b, c), (apex, a, b, d)]


def _is_long(i: int, j: int) -> bool:
    """Return whether two nodes of a lattice tetrahedron are joined by a long edge."""
    return i ^ 1 == j
