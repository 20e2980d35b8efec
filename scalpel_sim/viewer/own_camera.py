"""The page's own camera: it looks from where the blade enters, and past the arms."""

from collections.abc import Sequence

import numpy as np

from bridge import TissueFrame
from scalpel_sim.viewer.model_shapes import Shape, in_world
from tissue import FloatArray

DISTANCE = 2.4
"""Distance of the camera from the body's centre, in diagonals of the body. The body then fills a
third of the page's height, which leaves room for the stylus."""

ELEVATIONS = np.radians([38.0, 55.0])
"""Elevations of the camera above the body's centre [rad], the better one first."""

ASIDE = np.radians([35.0, -35.0, 25.0, -25.0, 50.0, -50.0, 65.0, -65.0])
"""Azimuths of the camera from the direction out of which the blade comes [rad], the best first: a
little aside one looks into the cut that opens, and still sees the flat of the blade."""

LEAST_LEVEL = 0.5
"""Level part of the blade's direction below which it cuts down or up: then it comes from where its
handle is."""

COST_OF_THE_NEXT = 0.005
"""Share of the body that may be hidden in a camera before the next one is better: four of them, if
a point of it is hidden, and any, if a working end is."""

N_RAYS = 200
"""Points of the body to which rays are cast."""

_BESIDE = 1e-9
"""Determinant below which a ray runs beside a triangle."""


def own_eye(
    shapes: Sequence[Shape], body_poses: FloatArray, surface: FloatArray, frame: TissueFrame
) -> FloatArray:
    """Return the position of the page's own camera [m], world frame.

    Args:
        shapes: Visible shapes of the model.
        body_poses: Poses of all bodies of the model, see `model_shapes.body_poses`.
        surface: Points of the body's surface [m], tissue frame, shape (n, 3).
        frame: Where the tissue lies in the world.
    """
    box = np.stack([surface.min(axis=0), surface.max(axis=0)])
    centre, diagonal = frame.points_to_world(box.mean(axis=0)), np.linalg.norm(box[1] - box[0])
    points, entry = frame.points_to_world(surface), _entry(shapes, body_poses, frame)
    seen, ends = some_of(points, N_RAYS), working_ends(shapes, body_poses)
    best, least = centre, np.inf
    for order, (up, aside) in enumerate((up, aside) for up in ELEVATIONS for aside in ASIDE):
        level = np.cos(up) * np.array([np.cos(entry + aside), np.sin(entry + aside)])
        eye: FloatArray = centre + DISTANCE * diagonal * np.array([*level, np.sin(up)])
        cost = order * COST_OF_THE_NEXT + hidden(eye, seen, shapes, body_poses).mean()
        cost += hidden(eye, ends, shapes, body_poses).sum()
        if cost < least:
            best, least = eye, cost
        if (order + 1) * COST_OF_THE_NEXT >= least:
            break
    return best


def some_of(points: FloatArray, n: int) -> FloatArray:
    """Return at most `n` of the points, spread over them in their order."""
    chosen = np.linspace(0, len(points) - 1, min(n, len(points))).astype(int)
    return np.asarray(points[chosen])


def working_ends(shapes: Sequence[Shape], body_poses: FloatArray) -> FloatArray:
    """Return the tips of blades and the middles of pads [m], world frame, shape (n, 3)."""
    ends = [np.empty((0, 3))]
    for shape in shapes:
        if shape.is_end:
            own = np.zeros(3) if shape.edge is None else shape.edge[1]
            ends.append(in_world(shape, body_poses, own[None]))
    return np.concatenate(ends)


def hidden(
    eye: FloatArray, points: FloatArray, shapes: Sequence[Shape], body_poses: FloatArray
) -> FloatArray:
    """Return for each point whether a link of an arm stands between it and the eye.

    Blades, pads, what belongs to the world, and marks of targets are no links.

    Args:
        eye: Where it looks from [m], world frame.
        points: World frame [m], shape (n, 3).
        shapes: Visible shapes of the model.
        body_poses: Poses of all bodies of the model.
    """
    ways, is_hidden = points - eye, np.zeros(len(points), dtype=bool)
    for shape in shapes:
        if not shape.is_link:
            continue
        corners = in_world(shape, body_poses, shape.mesh.positions)
        middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        radius = np.linalg.norm(corners - middle, axis=1).max()
        along = np.clip(ways @ (middle - eye) / (ways**2).sum(axis=1), 0.0, 1.0)
        near = np.linalg.norm(eye + along[:, None] * ways - middle, axis=1) <= radius
        near &= ~is_hidden
        is_hidden[near] = _are_crossed(eye, ways[near], corners[shape.mesh.triangles])
    return is_hidden


def _are_crossed(eye: FloatArray, ways: FloatArray, triangles: FloatArray) -> FloatArray:
    """Return for each way from the eye whether a triangle crosses it before its end."""
    a, first, second = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    first, second, start = first - a, second - a, eye - a
    normal, crossed = np.cross(first, second), np.zeros(len(ways), dtype=bool)
    for i, way in enumerate(ways):
        size = -(normal @ way)
        size = np.where(np.abs(size) < _BESIDE * np.abs(size).max(initial=0.0), np.inf, size)
        turned = np.cross(way, start)
        u, v = -(second * turned).sum(axis=1) / size, (first * turned).sum(axis=1) / size
        t = (normal * start).sum(axis=1) / size
        crossed[i] = ((u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0) & (t < 1.0)).any()
    return crossed


def _entry(shapes: Sequence[Shape], body_poses: FloatArray, frame: TissueFrame) -> float:
    """Return the azimuth of the direction out of which the blade comes [rad], world frame.

    Without a blade it is along -y of the tissue, where strokes begin.
    """
    way = -frame.rotation[:, 1]
    for shape in shapes:
        if shape.edge is not None:
            heel, tip = in_world(shape, body_poses, np.stack(shape.edge))
            middle_of_sheet = in_world(shape, body_poses, np.zeros((1, 3)))[0]
            back = middle_of_sheet - 0.5 * (heel + tip)
            along = (heel - tip) / np.linalg.norm(heel - tip)
            back -= (back @ along) * along  # the sheet is behind its edge
            back /= np.linalg.norm(back)
            way = back if np.hypot(*back[:2]) > LEAST_LEVEL else along
    return float(np.arctan2(way[1], way[0]))
