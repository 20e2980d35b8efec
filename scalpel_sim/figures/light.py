"""Light from many directions, each with its shadow: a lamp of some width, and a bright sky."""

import math
from typing import NamedTuple

import numpy as np

from scalpel_sim.figures.camera import View, look_along
from scalpel_sim.figures.rasterise import rasterise
from tissue import FloatArray
from tissue.core.jit import kernel

N_LAMP, N_SKY = 32, 64
"""Directions that stand for the lamp and for the sky. Fewer, and shadows have steps."""
LAMP_SHARE = 0.5
"""Of all light on a surface that faces it; the rest is the sky's."""
LAMP_WIDTH = 0.09
"""Radius of the lamp seen from the body [rad]: how soft its shadows are."""
MAP_PIXELS = 320
"""Sides of each shadow map."""
BIAS = 2.5
"""How far a point must lie behind what the light sees to be in its shadow, in pixels of the map.
Less, and surfaces that the light grazes have stripes; more, and shadows come off their bodies."""
_LIFT = 2.0
"""How far off its surface a point is looked up, in pixels of the map, for the same reason."""
FAINTEST = 1e-3
"""Share of a light in a highlight below which none is seen, and none is computed."""
GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


class Lights(NamedTuple):
    """Parallel light from n directions, and how far each gets."""

    towards: FloatArray
    """Unit vectors towards the lights, shape (n, 3)."""
    strength: FloatArray
    """Of what a surface facing all of them would get, shape (n,)."""
    axes: FloatArray
    """Right, up and forward of each light's view, shape (n, 3, 3)."""
    eyes: FloatArray
    """Where each view looks from [m], shape (n, 3)."""
    scales: FloatArray
    """Pixels of each map for a metre, shape (n,)."""
    maps: FloatArray
    """Minus the distance [m] of what each light meets, shape (n, MAP_PIXELS, MAP_PIXELS)."""


class Lit(NamedTuple):
    """What reaches points of surfaces."""

    diffuse: FloatArray
    """Light on the surface, 1 from everywhere; shape (n_points,)."""
    mirrored: FloatArray
    """Light that a glossy surface throws into the eye, shape (n_points,)."""


def lights(lamp: FloatArray, triangles: FloatArray, in_sky: np.ndarray) -> Lights:
    """Return lamp and sky over opaque triangles [m], shape (n, 3, 3).

    Args:
        lamp: Direction towards the middle of the lamp, shape (3,).
        triangles: What throws shadows.
        in_sky: Whether each takes light of the sky away too, shape (n,). What is long and thin
            should not: the few directions of the sky would show, as rays.
    """
    towards = np.concatenate([_disc_around(lamp), _sky()])
    strength = np.full(len(towards), LAMP_SHARE / N_LAMP)
    strength[N_LAMP:] = (1.0 - LAMP_SHARE) / N_SKY * 2.0  # half of the sky faces any wall
    corners = triangles.reshape(-1, 3)
    views = [look_along(-direction, corners, MAP_PIXELS) for direction in towards]
    return Lights(
        towards,
        strength,
        np.array([[view.right, view.up, view.forward] for view in views]),
        np.array([view.eye for view in views]),
        np.array([view.scale for view in views]),
        np.stack(
            [
                _met(view, triangles if i < N_LAMP else triangles[in_sky])
                for i, view in enumerate(views)
            ]
        ),
    )


def light_on(
    shining: Lights,
    points: FloatArray,
    normals: FloatArray,
    flat: FloatArray,
    to_eye: FloatArray,
    shininess: float,
) -> Lit:
    """Return the light at points [m], shape (n, 3).

    Args:
        shining: The lights.
        points: On surfaces.
        normals: Unit vectors as smoothing and relief have them, shape (n, 3).
        flat: Unit vectors as the triangles have them, towards the eye, shape (n, 3).
        to_eye: Unit vectors, shape (n, 3).
        shininess: Sharpness of highlights (Blinn and Phong's exponent).
    """
    lit = Lit(np.zeros(len(points)), np.zeros(len(points)))
    _light_on(*shining, points, normals, flat, to_eye, shininess, *lit)
    return lit


@kernel
def _light_on(
    towards: FloatArray,
    strength: FloatArray,
    axes: FloatArray,
    eyes: FloatArray,
    scales: FloatArray,
    maps: FloatArray,
    points: FloatArray,
    normals: FloatArray,
    flat: FloatArray,
    to_eye: FloatArray,
    shininess: float,
    diffuse: FloatArray,
    mirrored: FloatArray,
) -> None:
    least = FAINTEST ** (1.0 / shininess)
    for i in range(len(points)):
        for k in range(len(towards)):
            lx, ly, lz = towards[k, 0], towards[k, 1], towards[k, 2]
            facing = normals[i, 0] * lx + normals[i, 1] * ly + normals[i, 2] * lz
            if facing <= 0.0 or flat[i, 0] * lx + flat[i, 1] * ly + flat[i, 2] * lz <= 0.0:
                continue
            lift = _LIFT / scales[k]
            x = points[i, 0] + lift * flat[i, 0] - eyes[k, 0]
            y = points[i, 1] + lift * flat[i, 1] - eyes[k, 1]
            z = points[i, 2] + lift * flat[i, 2] - eyes[k, 2]
            reached = strength[k] * _reaches(maps[k], axes[k], scales[k], x, y, z)
            diffuse[i] += facing * reached
            hx, hy, hz = lx + to_eye[i, 0], ly + to_eye[i, 1], lz + to_eye[i, 2]
            glance = normals[i, 0] * hx + normals[i, 1] * hy + normals[i, 2] * hz
            glance /= math.sqrt(hx * hx + hy * hy + hz * hz)
            if glance > least:
                mirrored[i] += reached * glance**shininess


@kernel
def _reaches(
    nearness: FloatArray, axes: FloatArray, scale: float, x: float, y: float, z: float
) -> float:
    """How much of a light reaches a place given from its eye, from 0 to 1.

    Four places of the map around it, weighed: an edge of a shadow without steps.
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


def _met(view: View, triangles: FloatArray) -> FloatArray:
    """Return minus the distance of what a light meets, -inf where it meets nothing."""
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
    towards = middle + off
    return towards / np.linalg.norm(towards, axis=1, keepdims=True)
