"""Stand below a body on the page: a draped stand on the floor, and a tray of steel on it.

It is drawn for the eye alone, so that a body that hangs in its supports does not float in fog. No
part of a run touches it, and it stands clear of what moves: body, blades and arms.
"""

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from scalpel_sim.viewer.model_shapes import Shape, in_world
from scalpel_sim.viewer.primitives import TriangleMesh
from tissue import FloatArray

TRAY_GAP = 0.025
"""Least distance of the tray from the body above it [m]: the tip of a blade that is led goes 20 mm
beneath a body."""

DRAPE_MARGIN = 0.8
"""Width of the drape beyond the body where nothing stands there, in diagonals of the body."""

LEAST_DRAPE_MARGIN = -0.1
"""Where something leaves less room than that beside the body there is no stand. Below 0 the stand
may end under the body, as where an arm has its base right next to it."""

STAND_GAP = 0.01
"""Distance of the stand from what stands next to it [m]."""

_TRAY_MARGIN, _TRAY_HEIGHT = 0.25, 0.07
"""Width of the tray beyond the body, and its height, in diagonals of the body."""

_DISH = 0.25
"""Depth of the middle of a tray, in heights of the tray: a mirror that is quite flat shows
one thing."""

_CORNER, _HEM = 0.12, 0.03
"""Radii of the corners and of the upper edge of the drape, in diagonals of the body."""

_FOLD_LENGTH, _FOLD_DEPTH = 0.3, 0.03
"""Length and depth of the folds in which the drape hangs, in diagonals of the body."""

_N_CORNER, _N_FOLD, _N_HEM = 5, 6, 3
"""Points of an outline around a corner and along a fold, and rows of them over an edge."""

_UPRIGHT = 0.999
"""Least z of the normal of a plane that is a floor."""


class Stand(NamedTuple):
    """The meshes of a stand, world frame."""

    drape: TriangleMesh
    """Cloth. Texture coordinates are lengths on it [m]."""
    tray: TriangleMesh | None
    """None where the body lies on a table already."""


def stand_under(
    shapes: Sequence[Shape], body_poses: FloatArray, surface: FloatArray
) -> Stand | None:
    """Return the stand of a body; None without a floor far enough below it, or without room.

    Args:
        shapes: Visible shapes of the model.
        body_poses: Poses of all bodies of the model, see `model_shapes.body_poses`.
        surface: Points of the body's surface [m], world frame, shape (n, 3).
    """
    body = np.stack([surface.min(axis=0), surface.max(axis=0)])
    diagonal = float(np.linalg.norm(body[1] - body[0]))
    floors, tables, others = [], [], []
    for shape in shapes:
        corners = in_world(shape, body_poses, shape.mesh.positions)
        box = np.stack([corners.min(axis=0), corners.max(axis=0)])
        if shape.kind == int(mujoco.mjtGeom.mjGEOM_PLANE):
            if np.ptp(corners[:, 2]) <= (1.0 - _UPRIGHT) * np.ptp(corners[:, 0]):
                floors.append(box[0, 2])
        elif shape.is_table:
            tables.append(box)
        elif not shape.is_target:
            others.append(box)
    top = tables[0][0, 2] if tables else body[0, 2] - TRAY_GAP
    tray_height = 0.0 if tables else _TRAY_HEIGHT * diagonal
    floor = max((z for z in floors if z < body[0, 2]), default=np.inf)
    if top - tray_height - floor < _HEM * diagonal:
        return None
    ground = _ground(body, diagonal, top, others)
    if ground is None:
        return None
    drape = _drape(ground, floor, top - tray_height, diagonal)
    if tables:
        return Stand(drape, None)
    margin = _TRAY_MARGIN * diagonal
    inner = [
        np.maximum(body[0, :2] - margin, ground[0]),
        np.minimum(body[1, :2] + margin, ground[1]),
    ]
    return Stand(drape, _tray(np.stack(inner), top - tray_height, diagonal))


def _ground(
    body: FloatArray, diagonal: float, top: float, others: Sequence[FloatArray]
) -> FloatArray | None:
    """Return lowest and highest corner of what a stand covers [m], shape (2, 2); None: no room.

    Args:
        body: Lowest and highest corner of the body [m], shape (2, 3).
        diagonal: Of the body [m].
        top: Height of the stand [m].
        others: The same corners of what stands next to it.
    """
    ways = np.array([[-1.0], [1.0]])
    ground = body[:, :2] + DRAPE_MARGIN * diagonal * ways
    least = body[:, :2] + LEAST_DRAPE_MARGIN * diagonal * ways
    for box in others:
        low, high = box[0] - STAND_GAP, box[1] + STAND_GAP
        if box[0, 2] > top or (low[:2] > ground[1]).any() or (high[:2] < ground[0]).any():
            continue
        best = None
        for axis in (0, 1):
            for end, side in ((0, high[axis]), (1, low[axis])):
                moved = ground.copy()
                moved[end, axis] = side
                fits = side <= least[0, axis] if end == 0 else side >= least[1, axis]
                if fits and (best is None or np.prod(np.ptp(moved, 0)) > np.prod(np.ptp(best, 0))):
                    best = moved
        if best is None:
            return None
        ground = best
    return ground


def _drape(ground: FloatArray, floor: float, top: float, diagonal: float) -> TriangleMesh:
    """Return a cloth that lies on a block, and hangs down to the floor in folds."""
    depth, radius, hem = _FOLD_DEPTH * diagonal, _CORNER * diagonal, _HEM * diagonal
    ground = ground + np.array([[2.0 * depth], [-2.0 * depth]])  # folds stay in it
    outline = _Outline(ground, radius, _FOLD_LENGTH * diagonal / _N_FOLD)
    turns = np.linspace(0.0, np.pi / 2.0, _N_HEM + 1)
    edge = np.stack([radius - hem + hem * np.sin(turns), top - hem + hem * np.cos(turns)], 1)
    fall = np.linspace(1.0, 0.0, 4)[1:]
    waves = outline.lengths * (2.0 * np.pi / (_FOLD_LENGTH * diagonal))
    folds = depth * (np.sin(waves) + 0.6 * np.sin(0.37 * waves + 1.0))
    rows = [outline.row(0.0, top, is_centre=True), outline.row(0.0, top)]
    rows += [outline.row(out, height) for out, height in edge]
    rows += [
        outline.row(radius + (1.0 - share) * folds, floor + share * (top - hem - floor))
        for share in fall
    ]
    hanging = np.concatenate([np.zeros(len(rows) - 3), (1.0 - fall) * (top - hem - floor)])
    return _loft(rows, outline, hanging)


def _tray(ground: FloatArray, floor: float, diagonal: float) -> TriangleMesh:
    """Return a shallow tray with a rounded bottom and a lip."""
    height, radius = _TRAY_HEIGHT * diagonal, _CORNER * diagonal
    outline = _Outline(ground, radius, 0.5 * diagonal)
    sheet, bend = 0.1 * height, 0.4 * height
    low = floor + sheet + _DISH * height
    turns = np.linspace(0.0, np.pi / 2.0, _N_HEM + 1)
    inner = radius - 4.0 * sheet
    rows = [outline.row(0.0, floor + sheet, is_centre=True), outline.row(0.0, low)]
    rows += [
        outline.row(inner - bend + bend * np.sin(turn), low + bend * (1.0 - np.cos(turn)))
        for turn in turns
    ]
    lip = [(inner, 1.0 - 0.12), (inner + sheet, 1.0), (radius - sheet, 1.0), (radius, 0.9)]
    lip += [(radius - sheet, 0.8), (inner + 2.0 * sheet, 0.8), (inner - 0.5 * bend, 0.0)]
    rows += [outline.row(out, floor + share * height) for out, share in lip]
    return _loft(rows, outline, np.zeros(len(rows)))


class _Outline:
    """A rectangle with rounded corners as a row of points, counter-clockwise from above.

    Args:
        ground: Its lowest and highest corner [m], shape (2, 2).
        radius: Of its corners [m].
        step: Distance of points along its sides, at most [m].
    """

    def __init__(self, ground: FloatArray, radius: float, step: float) -> None:
        self._middle = ground.mean(axis=0)
        half = np.maximum(0.5 * np.ptp(ground, axis=0) - radius, 0.0)
        signs = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
        within, out = [], []
        for i, sign in enumerate(signs):
            angles = np.pi / 2.0 * (i + np.linspace(0.0, 1.0, _N_CORNER))
            along = signs[(i + 1) % 4] - sign
            n_side = max(int(np.abs(along * half).sum() / step), 1)
            shares = np.linspace(0.0, 1.0, n_side + 1)[1:-1, None]
            within += [np.tile(sign * half, (_N_CORNER, 1)), (sign + shares * along) * half]
            turned = np.concatenate([angles, np.full(n_side - 1, angles[-1])])
            out.append(np.stack([np.cos(turned), np.sin(turned)], axis=1))
        self._within, self.out = np.concatenate(within), np.concatenate(out)
        rim = self._within + radius * self.out
        steps = np.linalg.norm(np.roll(rim, -1, axis=0) - rim, axis=1)
        self.lengths = np.concatenate([[0.0], np.cumsum(steps)[:-1]])
        """Length of the outline up to each point [m]."""

    def row(self, out: float | FloatArray, height: float, *, is_centre: bool = False) -> FloatArray:
        """Return the points at a distance from the inner rectangle, and at a height, (n, 3)."""
        within = np.zeros_like(self._within) if is_centre else self._within
        level = self._middle + within + np.reshape(out, (-1, 1)) * self.out
        return np.column_stack([level, np.full(len(level), height)])


def _loft(rows: Sequence[FloatArray], outline: _Outline, hanging: FloatArray) -> TriangleMesh:
    """Return the smooth surface through rows of points, from its middle outwards.

    Args:
        rows: Points, as many in each row; the first are all in one place.
        outline: Where they come from.
        hanging: Length of cloth by which each row hangs below its edge [m].
    """
    points = np.stack(rows)
    n_rows, n = points.shape[:2]
    first = np.arange(n)
    after = np.roll(first, -1)
    quads = [
        np.stack(
            [
                [i * n + first, (i + 1) * n + first, (i + 1) * n + after],
                [i * n + first, (i + 1) * n + after, i * n + after],
            ]
        )
        for i in range(n_rows - 1)
    ]
    triangles = np.concatenate([quad.transpose(0, 2, 1).reshape(-1, 3) for quad in quads])
    positions = points.reshape(-1, 3)
    a, b, c = (positions[triangles[:, corner]] for corner in range(3))
    of_faces, normals = np.cross(b - a, c - a), np.zeros_like(positions)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], of_faces)
    normals[:n] = [0.0, 0.0, 1.0]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    uv = points[:, :, :2] + hanging[:, None, None] * outline.out
    return TriangleMesh(positions, triangles, normals, uv.reshape(-1, 2))
