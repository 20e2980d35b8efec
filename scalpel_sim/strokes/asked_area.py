"""The area that a stroke is to cut, in the body at rest, as areas of cuts are counted."""

import itertools

import numpy as np

from scalpel_sim.strokes.material_at import tetrahedra_at
from scalpel_sim.strokes.stroke import Stroke
from tissue import BoolArray, FloatArray, Snapshot

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
    passed = _PassedPlaces(near)
    found = []
    for start, end in stroke.asked:
        places, areas = _passed_between(stroke, start, end)
        is_first = np.concatenate([passed.pass_by(each) for each in places])
        passed.pause()
        places, areas = np.concatenate(places)[is_first], np.concatenate(areas)[is_first]
        at_rest = _areas_at_rest(places, areas, body)
        found.append((start, float(np.linalg.norm(at_rest, axis=1).sum())))
    return found


class _PassedPlaces:
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
