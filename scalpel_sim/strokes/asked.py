"""Plan of what a stroke cuts: the area, in the body at rest, and how many pieces it leaves.

Areas are counted as areas of cuts are; pieces are joined next to the sheet that the edge sweeps.
"""

import itertools

import numpy as np

from scalpel_sim.strokes.planned_sheet import mesh_edges
from scalpel_sim.strokes.stroke import Stroke
from tissue import BoolArray, FloatArray, IntArray, Snapshot
from tissue.support import components, place_tree, write_holders

_POSES, _PLACES = 400, 100
"""Poses of a stroke, and places along its edge, at which the body is looked up."""

_GOLDEN = 0.5 * (5.0**0.5 - 1.0)
"""By which the places move from pose to pose, as a share of their distance: on average they meet
the ends of a body as thin as a sheet, and never twice at the same height."""

_STRIDES = np.array((1 << 42, 1 << 21, 1))
"""By which cells of a grid are numbered, along x, y and z: 2^21 of them along each."""

_NEIGHBOURS = np.array(list(itertools.product((-1, 0, 1), repeat=3))) @ _STRIDES
"""From the number of a cell to its own and those of the cells around it."""

_PAUSE = 20
"""Poses after which an edge that comes near a cell again comes a second time: at the border of what
is near it comes and goes."""

_SHEET_POSES = 200
"""Poses of a stroke between which its sheet is flat: 0.5 mm of an organ each."""

_REACH = 0.1
"""Length of the sheet beyond the ends of the edge, in node sizes: an edge that ends as near
to the skin, or glides on a table, cuts through it, for a cut goes through nodes that are near."""

_ASIDE = np.array((0.61, 0.53, 0.59)) * 1e-3
"""By how much the sheet is moved aside, in node sizes, so that no node of a grid is on it."""

_ROUNDING = 1e-9
"""Share by which a segment may miss a triangle and still meet it: it may pass between two."""

_LEAST_WEIGHT = 1e-9
"""Barycentric weight by which a place may miss a tetrahedron and still be in it."""


def asked_area(stroke: Stroke, body: Snapshot) -> float | None:
    """Return the area that a stroke is to cut [m2], at rest; None for one that says nothing of it.

    It is what the edge passes on its way forward if the body does not give way. What is passed
    twice counts twice.

    Args:
        stroke: In the tissue frame.
        body: The body as it lies before the stroke, tissue frame.
    """
    if stroke.asked is None:
        return None
    return sum(_area_between(stroke, body, *interval) for interval in stroke.asked)


def first_areas(stroke: Stroke, body: Snapshot, near: float) -> list[tuple[float, float]] | None:
    """Return when each cut of a stroke is to begin [s], and its area [m2], at rest.

    What is passed twice counts once: a cut that is deepened, or crossed, is open there already.
    None for a stroke that says nothing of it.

    Args:
        stroke: In the tissue frame.
        body: The body as it lies before the stroke, tissue frame.
        near: Distance within which a place has been passed already [m].
    """
    if stroke.asked is None:
        return None
    passed = PassedPlaces(near)
    found = []
    for start, end in stroke.asked:
        places, areas = _passed_between(stroke, start, end)
        is_first = np.concatenate([passed.pass_by(each) for each in places])
        passed.pause()
        places, areas = np.concatenate(places)[is_first], np.concatenate(areas)[is_first]
        at_rest = _areas_at_rest(places, areas, body)
        found.append((start, float(np.linalg.norm(at_rest, axis=1).sum())))
    return found


class PassedPlaces:
    """Which cells of a grid the edge has been near, and left.

    Args:
        size: Size of a cell [m].
    """

    def __init__(self, size: float) -> None:
        self._size = size
        self._last: dict[int, int] = {}
        """The pose at which the edge was near a cell last."""
        self._left: set[int] = set()
        self._pose = 0

    def pass_by(self, places: FloatArray) -> BoolArray:
        """Return which places of the next pose the edge has not been at and left before.

        Args:
            places: Along the edge [m], shape (n, 3).
        """
        self._pose += 1
        cells = np.floor(places / self._size).astype(np.int64) @ _STRIDES
        near = np.unique(np.unique(cells)[:, None] + _NEIGHBOURS)
        for cell in near.tolist():
            if self._last.get(cell, self._pose) < self._pose - _PAUSE:
                self._left.add(cell)
            self._last[cell] = self._pose
        return np.array([cell not in self._left for cell in cells.tolist()])

    def pause(self) -> None:
        """Count what comes as another pass: the edge leaves all cells."""
        self._pose += _PAUSE


def _area_between(stroke: Stroke, body: Snapshot, start: float, end: float) -> float:
    """Return the area that a stroke is to cut between two instants [m2]."""
    places, areas = _passed_between(stroke, start, end)
    at_rest = _areas_at_rest(np.concatenate(places), np.concatenate(areas), body)
    return float(np.linalg.norm(at_rest, axis=1).sum())


def _passed_between(
    stroke: Stroke, start: float, end: float
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return places that the edge passes between two instants, and area vectors there.

    Both are lists with an array for each pose, shape (n, 3), of [m] and [m2].
    """
    poses = [stroke.pose(t) for t in np.linspace(start, end, _POSES)]
    places, areas = [], []
    for i, (before, after) in enumerate(itertools.pairwise(poses)):
        shares = (np.arange(_PLACES) + i * _GOLDEN % 1.0) / _PLACES
        tip, heel = 0.5 * (before.tip + after.tip), 0.5 * (before.heel + after.heel)
        edge, forward = heel - tip, before.forward + after.forward
        forward = forward / np.linalg.norm(forward)
        motion = 0.5 * (after.tip + after.heel - before.tip - before.heel)
        ahead = max(float(motion @ forward), 0.0) / _PLACES
        places.append(tip + shares[:, None] * edge)
        areas.append(np.broadcast_to(ahead * np.cross(edge, forward), (_PLACES, 3)))
    return places, areas


def _areas_at_rest(places: FloatArray, areas: FloatArray, body: Snapshot) -> FloatArray:
    """Return area vectors in the body at rest [m2]; zero outside the body. Shape (n, 3).

    Args:
        places: Where they are in the body as it lies [m], shape (n, 3).
        areas: Area vectors there [m2], shape (n, 3).
        body: The body.
    """
    holder, _ = tetrahedra_at(places, body)
    held = np.flatnonzero(holder >= 0)
    corners, rest = (
        part[body.tetrahedra[holder[held]]] for part in (body.positions, body.rest_positions)
    )
    lying = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    found = lying @ np.linalg.inv(np.swapaxes(rest[:, 1:] - rest[:, :1], 1, 2))
    at_rest = np.zeros_like(areas)
    # Nanson's formula: area at rest = transposed gradient x area / ratio of volumes.
    at_rest[held] = np.einsum("nji,nj->ni", found, areas[held]) / np.linalg.det(found)[:, None]
    return at_rest


def n_large(volumes: FloatArray, node_size: float) -> int:
    """Return how many volumes are no crumbs: at least a cube as long as the size of a node.

    Args:
        volumes: At rest [m3], shape (n,).
        node_size: Mean size of a node [m].
    """
    return int((volumes >= node_size**3).sum())


def asked_pieces(stroke: Stroke, body: Snapshot, node_size: float) -> int | None:
    """Return the number of pieces, crumbs left out, that a stroke is to leave of a body.

    They are what hangs together by the edges of the mesh that the sheet does not cross, if the body
    does not give way. None for a stroke that says nothing of what it is to cut.

    Args:
        stroke: In the tissue frame.
        body: The body as it lies before the stroke, tissue frame.
        node_size: Mean size of a node [m].
    """
    if stroke.asked is None:
        return None
    edges = mesh_edges(body.tetrahedra)
    ends = body.positions[edges]
    low, high = ends.min(axis=1), ends.max(axis=1)
    is_crossed = np.zeros(len(edges), bool)
    for start, end in stroke.asked:
        for quad in _sheet(stroke, start, end, node_size):
            near = (low <= quad.max(axis=0)).all(axis=1) & (high >= quad.min(axis=0)).all(axis=1)
            for corners in (quad[[0, 1, 2]], quad[[2, 1, 3]]):
                is_crossed[near] |= _meet(ends[near], corners)
    n, label = components(len(body.positions), edges[~is_crossed])
    volumes = np.asarray(np.bincount(label, _volumes_of_nodes(body), n), float)
    return n_large(volumes, node_size)


def _sheet(stroke: Stroke, start: float, end: float, node_size: float) -> list[FloatArray]:
    """Return the flat parts of what the edge sweeps forwards: four corners each [m], (4, 3)."""
    parts = []
    poses = [stroke.pose(t) for t in np.linspace(start, end, _SHEET_POSES)]
    for before, after in itertools.pairwise(poses):
        motion = after.tip + after.heel - before.tip - before.heel
        if float(motion @ (before.forward + after.forward)) <= 0.0:
            continue
        corners = []
        for pose in (before, after):
            along = pose.heel - pose.tip
            along *= _REACH * node_size / float(np.linalg.norm(along))
            corners += [pose.tip - along, pose.heel + along]
        parts.append(np.array(corners) + _ASIDE * node_size)
    return parts


def _meet(segments: FloatArray, corners: FloatArray) -> BoolArray:
    """Return which segments meet a triangle (Moeller and Trumbore 1997, J. Graphics Tools 2:21).

    Args:
        segments: Ends [m], shape (n, 2, 3).
        corners: Of the triangle [m], shape (3, 3).
    """
    ways, offsets = segments[:, 1] - segments[:, 0], segments[:, 0] - corners[0]
    along, across = corners[1] - corners[0], corners[2] - corners[0]
    normal = np.cross(along, across)
    facing = -ways @ normal
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = np.cross(offsets, ways)
        at = offsets @ normal / facing
        u, v = turned @ across / facing, -turned @ along / facing
        inside = (np.minimum(u, v) >= -_ROUNDING) & (u + v <= 1.0 + _ROUNDING)
        return np.asarray((facing != 0.0) & inside & (at >= 0.0) & (at <= 1.0))


def _volumes_of_nodes(body: Snapshot) -> FloatArray:
    """Return a quarter of the volume of the tetrahedra around each node at rest [m3], (n,)."""
    corners = body.rest_positions[body.tetrahedra]
    quarters = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 24.0
    n = len(body.positions)
    return np.asarray(np.bincount(body.tetrahedra.ravel(), np.repeat(quarters, 4), n), float)


def tetrahedra_at(places: FloatArray, body: Snapshot) -> tuple[IntArray, FloatArray]:
    """Return a tetrahedron that holds each place, or -1, and the weights of the place in it.

    Args:
        places: In the body as it lies [m], shape (n, 3).
        body: The body.

    Returns:
        Tetrahedra, shape (n,), and barycentric weights, shape (n, 4): 0 where there is none.
    """
    holders, weights = np.full(len(places), -1), np.zeros((len(places), 4))
    if len(places):
        positions = np.require(body.positions, np.float64, ["C", "W"])
        tetrahedra = np.require(body.tetrahedra, np.int64, ["C", "W"])
        tree = place_tree(places)
        write_holders(tree, positions, tetrahedra, -_LEAST_WEIGHT, holders, weights)
    return holders, weights
