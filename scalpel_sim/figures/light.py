"""Light from many directions with shadows: a lamp of some width, and a bright sky."""

import math
from typing import NamedTuple

import numpy as np

from scalpel_sim.figures.camera import View, parallel_view
from scalpel_sim.figures.rasterise import rasterise
from tissue import BoolArray, FloatArray
from tissue.support import kernel

N_LAMP, N_SKY = 32, 64
"""Number of directions that stand for the lamp and for the sky. With fewer, shadows have steps."""
LAMP_SHARE = 0.5
"""Share of the lamp in the light on a surface that faces it; the rest comes from the sky."""
LAMP_WIDTH = 0.09
"""Angular radius of the lamp seen from the body [rad]: it makes the edges of shadows soft."""
MAP_PIXELS = 320
"""Side of each shadow map [pixels]."""
BIAS = 2.5
"""Distance behind the surface that a light reaches at which a point is in shadow, in pixels of the
shadow map. With less, surfaces that the light grazes have stripes; with more, shadows start away
from their bodies."""
_LIFT = 2.0
"""Height above its surface at which a point is looked up in a shadow map, in pixels of the map, for
the same reason."""
FAINTEST = 1e-3
"""Strength of a highlight, as a fraction of its light, below which it is not computed."""
GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
"""Angle [rad] that spreads points evenly over a disc or a sphere."""


class Lights(NamedTuple):
    """Parallel light from n directions, with shadow maps."""

    towards: FloatArray
    """Unit vectors towards the lights, shape (n, 3)."""
    strength: FloatArray
    """Strength of each light, shape (n,). A surface that faced all of them would get the sum."""
    axes: FloatArray
    """Right, up and forward of the view from each light, shape (n, 3, 3)."""
    eyes: FloatArray
    """Position of the eye of each view [m], shape (n, 3)."""
    scales: FloatArray
    """Pixels per metre of each shadow map, shape (n,)."""
    maps: FloatArray
    """Shadow maps: minus the distance [m] at which the light meets a surface, shape
    (n, MAP_PIXELS, MAP_PIXELS)."""


class SurfacePoints(NamedTuple):
    """Points of surfaces at which the light is computed."""

    positions: FloatArray
    """Positions [m], shape (n, 3)."""
    normals: FloatArray
    """Unit normals with smoothing and relief, shape (n, 3)."""
    face_normals: FloatArray
    """Unit normals of the triangles, on the side of the eye, shape (n, 3)."""
    to_eye: FloatArray
    """Unit vectors towards the eye, shape (n, 3)."""


class Illumination(NamedTuple):
    """Light at points of surfaces."""

    diffuse: FloatArray
    """Light that falls on the surface, 1 if from everywhere; shape (n_points,)."""
    specular: FloatArray
    """Light that a glossy surface reflects into the eye, shape (n_points,)."""


def make_lights(lamp: FloatArray, triangles: FloatArray, blocks_sky: BoolArray) -> Lights:
    """Return the lights of a lamp and of the sky, with the shadows of opaque triangles.

    Args:
        lamp: Direction towards the middle of the lamp, shape (3,).
        triangles: Corners of the triangles that cast shadows [m], shape (n, 3, 3).
        blocks_sky: Whether each triangle casts shadows of the sky's light too, shape (n,). Long and
            thin objects should not: the few directions of the sky would show as rays.
    """
    towards = np.concatenate([_disc_around(lamp), _sky()])
    strength = np.full(len(towards), LAMP_SHARE / N_LAMP)
    strength[N_LAMP:] = (1.0 - LAMP_SHARE) / N_SKY * 2.0  # half of the sky faces any wall
    corners = triangles.reshape(-1, 3)
    views = [parallel_view(-direction, corners, MAP_PIXELS) for direction in towards]
    return Lights(
        towards,
        strength,
        np.array([[view.right, view.up, view.forward] for view in views]),
        np.array([view.eye for view in views]),
        np.array([view.scale for view in views]),
        np.stack(
            [
                _shadow_map(view, triangles if i < N_LAMP else triangles[blocks_sky])
                for i, view in enumerate(views)
            ]
        ),
    )


def illuminate(lights: Lights, points: SurfacePoints, shininess: float) -> Illumination:
    """Return the light at points; `shininess` is the exponent of highlights (Blinn and Phong)."""
    n = len(points.positions)
    light = Illumination(np.zeros(n), np.zeros(n))
    _illuminate(lights, points, shininess, light)
    return light


@kernel
def _illuminate(
    lights: Lights, points: SurfacePoints, shininess: float, light: Illumination
) -> None:
    """Add the light of all `lights` at all `points` to `light`."""
    positions, normals, flat, to_eye = points
    towards, strength, axes, eyes, scales, maps = lights
    least = FAINTEST ** (1.0 / shininess)
    for i in range(len(positions)):
        for k in range(len(towards)):
            lx, ly, lz = towards[k, 0], towards[k, 1], towards[k, 2]
            facing = normals[i, 0] * lx + normals[i, 1] * ly + normals[i, 2] * lz
            if facing <= 0.0 or flat[i, 0] * lx + flat[i, 1] * ly + flat[i, 2] * lz <= 0.0:
                continue
            lift = _LIFT / scales[k]
            x = positions[i, 0] + lift * flat[i, 0] - eyes[k, 0]
            y = positions[i, 1] + lift * flat[i, 1] - eyes[k, 1]
            z = positions[i, 2] + lift * flat[i, 2] - eyes[k, 2]
            reached = strength[k] * _unshadowed_share(maps[k], axes[k], scales[k], x, y, z)
            light.diffuse[i] += facing * reached
            hx, hy, hz = lx + to_eye[i, 0], ly + to_eye[i, 1], lz + to_eye[i, 2]
            glance = normals[i, 0] * hx + normals[i, 1] * hy + normals[i, 2] * hz
            glance /= math.sqrt(hx * hx + hy * hy + hz * hz)
            if glance > least:
                light.specular[i] += reached * glance**shininess


@kernel
def _unshadowed_share(
    nearness: FloatArray, axes: FloatArray, scale: float, x: float, y: float, z: float
) -> float:
    """Return the share of a light that reaches a point, from 0 to 1.

    The four nearest pixels of the shadow map are weighted, so that edges of shadows have no steps.

    Args:
        nearness: Shadow map of the light, shape (MAP_PIXELS, MAP_PIXELS).
        axes: Right, up and forward of the view from the light, shape (3, 3).
        scale: Pixels of the map per metre.
        x: Coordinate of the point from the eye of that view [m].
        y: Coordinate of the point from the eye of that view [m].
        z: Coordinate of the point from the eye of that view [m].
    """
    n = len(nearness)
    u = 0.5 * n + scale * (axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z) - 0.5
    v = 0.5 * n - scale * (axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z) - 0.5
    near = -(axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z) + BIAS / scale
    left, top = math.floor(u), math.floor(v)
    total = 0.0
    for dx in range(2):
        for dy in range(2):
            column = min(max(left + dx, 0), n - 1)
            row = min(max(top + dy, 0), n - 1)
            if near >= nearness[row, column]:
                total += abs(1 - dx - (u - left)) * abs(1 - dy - (v - top))
    return total


def _shadow_map(view: View, triangles: FloatArray) -> FloatArray:
    """Return the shadow map of a view from a light; -inf where the light meets no triangle."""
    return rasterise(view.project(triangles), view.width, view.height).nearness


def _sky() -> FloatArray:
    """Return directions spread evenly over the upper half of the sphere, shape (N_SKY, 3)."""
    up = (np.arange(N_SKY) + 0.5) / N_SKY
    level, turn = np.sqrt(1.0 - up**2), GOLDEN_ANGLE * np.arange(N_SKY)
    return np.stack([level * np.cos(turn), level * np.sin(turn), up], axis=1)


def _disc_around(lamp: FloatArray) -> FloatArray:
    """Return directions spread evenly over a disc around the lamp's middle, shape (N_LAMP, 3)."""
    middle = lamp / np.linalg.norm(lamp)
    across = np.cross(middle, [0.3, 0.5, 0.8])
    across /= np.linalg.norm(across)
    also_across = np.cross(middle, across)
    radius = LAMP_WIDTH * np.sqrt((np.arange(N_LAMP) + 0.5) / N_LAMP)
    turn = GOLDEN_ANGLE * np.arange(N_LAMP)
    off = (radius * np.cos(turn))[:, None] * across + (radius * np.sin(turn))[:, None] * also_across
    towards: FloatArray = middle + off
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    return towards
