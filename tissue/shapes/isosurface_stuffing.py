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
"""Lattice points of the largest lattice: a larger one would take tens of gigabytes."""

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
    lattice = _lattice(*_checked_box(bounds, spacing), spacing)
    values = np.asarray(implicit_function(lattice.points), dtype=np.float64)
    if not np.isfinite(values).all():
        raise ValueError("the implicit function is not finite everywhere in the box")
    if (values[lattice.is_outermost] >= 0.0).any():
        raise ValueError("the shape is not within the bounds; make them larger")
    signs = np.sign(values).astype(np.int64)
    if not (signs > 0).any():
        raise ValueError("the shape holds no point of the lattice; make the spacing smaller")

    edges = lattice.edges[signs[lattice.edges].prod(axis=1) < 0]
    cuts = _surface_points(implicit_function, lattice.points, edges, signs)
    points, signs, is_left = _moved_to_surface(lattice.points, signs, edges, cuts)
    edges, cuts = edges[is_left], cuts[is_left]

    tetrahedra = _cut_off(lattice.tetrahedra, signs, edges, len(points))
    points = np.concatenate([points, cuts])
    turned = signed_volumes(points, tetrahedra) < 0.0
    tetrahedra[turned] = tetrahedra[turned][:, [0, 1, 3, 2]]
    used, tetrahedra = np.unique(tetrahedra, return_inverse=True)
    return TetrahedralMesh(points[used], tetrahedra.reshape(-1, 4))


class _Lattice(NamedTuple):
    """A body-centred cubic lattice: corners of cubic cells, and their centres."""

    points: FloatArray
    """[m], shape (n_points, 3)."""
    is_outermost: npt.NDArray[np.bool_]
    """Whether the point is on the surface of the lattice, shape (n_points,)."""
    tetrahedra: IntArray
    """Node indices, shape (n_tets, 4). The long edges go from node 0 to 1 and from 2 to 3. The
    first end of each is even, which decides how neighbours cut a face that both share."""
    edges: IntArray
    """Ends of the edges, the lower index first, shape (n_edges, 2)."""


def _checked_box(bounds: npt.ArrayLike, spacing: float) -> tuple[FloatArray, IntArray]:
    """Return the lowest corner of the lattice [m], and its numbers of cells."""
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


def _lattice(lowest: FloatArray, cells: IntArray, spacing: float) -> _Lattice:
    """Return the lattice of `cells` from the corner `lowest` [m] on."""
    corners = np.indices(tuple(cells + 1)).reshape(3, -1).T
    centres = np.indices(tuple(cells)).reshape(3, -1).T
    points = lowest + spacing * np.concatenate([corners, centres + 0.5])
    is_outermost = np.concatenate(
        [((corners == 0) | (corners == cells)).any(axis=1), np.zeros(len(centres), dtype=bool)]
    )

    def corner(index: IntArray) -> IntArray:
        nodes: IntArray = np.ravel_multi_index(tuple(index.T), tuple(cells + 1))
        return nodes

    def centre(index: IntArray) -> IntArray:
        nodes: IntArray = len(corners) + np.ravel_multi_index(tuple(index.T), tuple(cells))
        return nodes

    # Each face between two cells has four tetrahedra: both centres, and two corners side by side.
    tetrahedra = []
    for axis, (u, v) in enumerate(((1, 2), (2, 0), (0, 1))):
        unit = np.eye(3, dtype=np.int64)
        lower = centres[centres[:, axis] < cells[axis] - 1]
        around = [
            unit[axis] + s * unit[u] + t * unit[v] for s, t in ((0, 0), (1, 0), (1, 1), (0, 1))
        ]
        for first, second in zip(around, around[1:] + around[:1], strict=True):
            a = _even_first(lower, lower + unit[axis])
            b = _even_first(lower + first, lower + second)
            columns = [centre(a[0]), centre(a[1]), corner(b[0]), corner(b[1])]
            tetrahedra.append(np.stack(columns, axis=1))
    tets = np.concatenate(tetrahedra)
    pairs = np.concatenate([tets[:, pair] for pair in itertools.combinations(range(4), 2)])
    return _Lattice(points, is_outermost, tets, np.unique(np.sort(pairs, axis=1), axis=0))


def _even_first(a: IntArray, b: IntArray) -> tuple[IntArray, IntArray]:
    """Order neighbours along an axis so that the first has an even sum of indices."""
    is_odd = (a.sum(axis=1) % 2 == 1)[:, None]
    return np.where(is_odd, b, a), np.where(is_odd, a, b)


def _surface_points(
    implicit_function: ImplicitFunction, points: FloatArray, edges: IntArray, signs: IntArray
) -> FloatArray:
    """Return where the surface crosses each of `edges` [m], shape (n_edges, 3)."""
    swapped = signs[edges[:, 0]] < 0
    inner = points[np.where(swapped, edges[:, 1], edges[:, 0])]
    outer = points[np.where(swapped, edges[:, 0], edges[:, 1])]
    for _ in range(BISECTIONS):
        middle = 0.5 * (inner + outer)
        is_inside = (implicit_function(middle) > 0.0)[:, None]
        inner, outer = np.where(is_inside, middle, inner), np.where(is_inside, outer, middle)
    return 0.5 * (inner + outer)


def _moved_to_surface(
    points: FloatArray, signs: IntArray, edges: IntArray, cuts: FloatArray
) -> tuple[FloatArray, IntArray, npt.NDArray[np.bool_]]:
    """Move each lattice point that is too near to a cut of its edges to the nearest such cut.

    One point after another: the edges of a point on the surface are no longer cut, so that its
    neighbours may stay where they are.

    Returns:
        Points and signs after the moves, and which of `edges` are still cut.
    """
    points, signs = points.copy(), signs.copy()
    is_cut = np.ones(len(edges), dtype=bool)
    lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    is_long = lengths > 0.95 * lengths.max(initial=0.0)  # short ones have sqrt(3) / 2 of it
    limits = np.where(is_long, ALPHA_LONG, ALPHA_SHORT) * lengths
    distances = np.linalg.norm(points[edges] - cuts[:, None], axis=2)

    ends = edges.ravel()
    order = np.argsort(ends, kind="stable")
    nodes, firsts = np.unique(ends[order], return_index=True)
    for node, incident in zip(nodes, np.split(order // 2, firsts[1:]), strict=True):
        near = incident[is_cut[incident]]
        distance = distances[near, (edges[near, 1] == node).astype(np.int64)]
        is_near = distance < limits[near]
        if is_near.any():
            points[node] = cuts[near[np.argmin(np.where(is_near, distance, np.inf))]]
            signs[node] = ON
            is_cut[incident] = False
    return points, signs, is_cut


_Vertex = tuple[int, int]
"""(i, i): node i of a lattice tetrahedron; (i, j): where the surface crosses its edge ij."""


def _cut_off(tetrahedra: IntArray, signs: IntArray, edges: IntArray, n_points: int) -> IntArray:
    """Return the tetrahedra inside, of either orientation; cut k is node `n_points` + k."""
    tetrahedra = tetrahedra[(signs[tetrahedra] > 0).any(axis=1)]
    keys = edges[:, 0] * n_points + edges[:, 1]  # sorted, for the edges are
    patterns = signs[tetrahedra]
    parts = []
    for pattern in itertools.product((INSIDE, ON, OUTSIDE), repeat=4):
        tets = tetrahedra[(patterns == pattern).all(axis=1)]
        for part in _stencil(pattern) if len(tets) else []:
            columns = []
            for i, j in part:
                low, high = np.minimum(tets[:, i], tets[:, j]), np.maximum(tets[:, i], tets[:, j])
                cut = n_points + np.searchsorted(keys, low * n_points + high)
                columns.append(low if i == j else cut)
            parts.append(np.stack(columns, axis=1))
    return np.concatenate(parts)


def _stencil(pattern: tuple[int, ...]) -> list[tuple[_Vertex, ...]]:
    """Return the tetrahedra that are left of one whose nodes have these signs."""
    inside, on, outside = ([i for i in range(4) if pattern[i] == s] for s in (INSIDE, ON, OUTSIDE))
    kept = [(i, i) for i in inside + on]
    if not inside:
        return []
    if not outside:
        return [tuple(kept)]
    if len(inside) == 1:
        return [(*kept, *((inside[0], n) for n in outside))]
    if len(outside) == 1 and len(inside) == 2:
        return _pyramid((on[0], on[0]), _face(inside[0], inside[1], outside[0]))
    if len(outside) == 1:
        # Corner n is cut off. Its long edge goes to p; the diagonals of both faces at pn meet in
        # the cut of pn, so that a tetrahedron and a pyramid remain.
        (n,) = outside
        p = n ^ 1
        q, r = (i for i in inside if i != p)
        whole = ((p, p), (q, q), (r, r), (p, n))
        return [whole, *_pyramid((p, n), _face(q, r, n))]
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


def _face(p: int, q: int, n: int) -> list[_Vertex]:
    """Return the quadrilateral left of face pqn without corner n: its diagonal, the other ends."""
    if _is_long(p, q):
        return [(p, p), (q, n), (q, q), (p, n)]  # both cuts are on short edges: from the even node
    if _is_long(q, n):
        p, q = q, p
    return [(p, n), (q, q), (p, p), (q, n)]  # from the cut on the long edge pn


def _pyramid(apex: _Vertex, base: list[_Vertex]) -> list[tuple[_Vertex, ...]]:
    """Return the two halves of a pyramid; `base` is a diagonal, and the other two corners."""
    a, b, c, d = base
    return [(apex, a, b, c), (apex, a, b, d)]


def _is_long(i: int, j: int) -> bool:
    """Return whether two nodes of a lattice tetrahedron are joined by a long edge."""
    return i ^ 1 == j
