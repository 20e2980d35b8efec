"""Scenes whose hands start elsewhere."""

import msgspec
import numpy as np

from scalpel_sim.scene.scene import changed

FARTHEST = 3e-3
"""How far starts are moved [m]."""


def moved(scene, rng):
    """Return a scene in which each hand does what it does at a place of its own, up to 3 mm away.

    Each is moved as a whole, in a random direction: its start, and all that follows. A stroke that
    is planned for the body stays.
    """
    graspers = [_moved_grasper(grasper, _way(rng)) for grasper in scene.graspers]
    by = _way(rng)
    strokes = [
        msgspec.structs.replace(stroke, points=[_moved(point, by) for point in stroke.points])
        if stroke.points
        else stroke
        for stroke in scene.strokes
    ]
    return changed(scene, graspers=tuple(graspers), strokes=tuple(strokes))


def _moved_grasper(grasper, by):
    motion = [
        row if row.at is None else msgspec.structs.replace(row, at=_moved(row.at, by))
        for row in grasper.motion
    ]
    return msgspec.structs.replace(grasper, motion=motion)


def _moved(point, by):
    return tuple((np.array(point) + by).tolist())


def _way(rng):
    """Return a vector that is anywhere in a ball alike [m]."""
    direction = rng.normal(size=3)
    return FARTHEST * rng.uniform() ** (1.0 / 3.0) * direction / np.linalg.norm(direction)
