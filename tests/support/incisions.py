"""Random incisions: surfaces for `Tissue.incise`, of every kind that a hand could make."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tests.support.strokes import Stroke, pose
from tissue import FloatArray, TetrahedralMesh

N_POSITIONS = 60
"""Number of positions of the edge along its path; a curved path is divided into chords."""

EXTENT = 1.15
"""Reach of an edge, and of its path, from the middle of the body [half diagonals]."""


class Incision(NamedTuple):
    """A ruled surface that an edge sweeps."""

    edges: FloatArray
    """Tip and heel of the edge at each position [m], shape (n_positions, 2, 3)."""
    forward: FloatArray
    """Direction in which the edge faces, shape (n_positions, 3)."""


class Shape(NamedTuple):
    """Shape of the path of an edge through a body; lengths in half diagonals unless stated."""

    path: FloatArray
    """Positions of the edge along its path, shape (n_positions,)."""
    low: float = -EXTENT
    """Position of the tip along the edge."""
    high: float = EXTENT
    """Position of the heel along the edge."""
    bow: float = 0.0
    """Amplitude of the sideways waves of the path [m]."""
    waves: float = 0.0
    """Angular frequency of the sideways waves, per half diagonal [rad]."""
    phase: float = 0.0
    """Phase of the sideways waves [rad]."""
    twist: float = 0.0
    """Rotation of the edge about its path, per half diagonal [rad]."""


THROUGH = np.linspace(-EXTENT, EXTENT, N_POSITIONS)


def tilted(random: np.random.Generator, thickness: float) -> Shape:
    return Shape(THROUGH)


def curved(random: np.random.Generator, thickness: float) -> Shape:
    bow = random.uniform(0.03, 0.15) * thickness
    return Shape(
        THROUGH, bow=bow, waves=random.uniform(0.5, 1.5) * np.pi, phase=random.uniform(0.0, 6.0)
    )


def twisted(random: np.random.Generator, thickness: float) -> Shape:
    return Shape(THROUGH, twist=random.uniform(-0.6, 0.6))


def back_and_forth(random: np.random.Generator, thickness: float) -> Shape:
    turn = int(random.integers(20, 40))
    back = turn - int(random.integers(5, 18))
    path = np.concatenate([THROUGH[:turn], THROUGH[back:turn][::-1], THROUGH[back:]])
    return curved(random, thickness)._replace(path=path)


def slit(random: np.random.Generator, thickness: float) -> Shape:
    """Return a path that ends inside the body, with the tip inside."""
    path = np.linspace(-EXTENT, random.uniform(-0.2, 0.3), N_POSITIONS)
    return Shape(path, low=random.uniform(-0.15, 0.15))


def buried(random: np.random.Generator, thickness: float) -> Shape:
    """Return a path on which both ends of the edge are inside the body."""
    low = random.uniform(-0.2, 0.0)
    return Shape(THROUGH, low=low, high=low + random.uniform(0.15, 0.3))


KINDS: dict[str, Callable[[np.random.Generator, float], Shape]] = {
    "tilted": tilted,
    "curved": curved,
    "twisted": twisted,
    "back and forth": back_and_forth,
    "slit": slit,
    "buried": buried,
}
CLEAN_THROUGH = ("tilted", "curved", "twisted", "back and forth")
"""Kinds of incision that cut the body in two."""


def incision(mesh: TetrahedralMesh, kind: str, seed: int) -> Incision:
    """Return a surface of that kind through about the middle third of the body, at any angle."""
    random = np.random.default_rng(seed)
    turn = rotation(random)
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    thickness = float((high - low).min())
    aside = random.uniform(-0.2, 0.2) * thickness
    return ruled(mesh, KINDS[kind](random, thickness), turn, aside)


def ruled(mesh: TetrahedralMesh, shape: Shape, turn: FloatArray, aside: float = 0.0) -> Incision:
    """Return the surface that an edge of this shape sweeps.

    Args:
        mesh: The body.
        shape: Shape of the path of the edge.
        turn: Unit vectors along the path, along the edge and sideways, as columns.
        aside: Sideways offset from the middle of the body [m].
    """
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    direction, upright, sideways = turn.T
    at = shape.path[:, None]
    swing = shape.waves * at + shape.phase
    along = np.cos(shape.twist * at) * upright + np.sin(shape.twist * at) * sideways
    centres = middle + half * at * direction + (aside + shape.bow * np.sin(swing)) * sideways
    slope = shape.bow * shape.waves / half * np.cos(swing)
    edges = np.stack([centres + half * shape.low * along, centres + half * shape.high * along], 1)
    return Incision(edges, direction + slope * sideways)


def plane(mesh: TetrahedralMesh, normal: FloatArray, offset: float = 0.0) -> Incision:
    """Return the plane at `offset` [m] from the middle of the body along its normal."""
    normal = np.asarray(normal, dtype=np.float64) / np.linalg.norm(normal)
    direction = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    direction /= np.linalg.norm(direction)
    turn = np.stack([direction, np.cross(normal, direction), normal], axis=1)
    return ruled(mesh, Shape(1.3 * THROUGH, -1.5, 1.5), turn, offset)


def crossing_planes(mesh: TetrahedralMesh, seed: int) -> list[Incision]:
    """Return three planes that cross at almost right angles near the middle of the body."""
    random = np.random.default_rng(seed)
    thickness = float(np.ptp(mesh.positions, axis=0).min())
    turn = rotation(random) if seed % 2 else np.eye(3)
    return [
        plane(mesh, axis + random.uniform(-0.15, 0.15, 3), random.uniform(-0.1, 0.1) * thickness)
        for axis in turn.T
    ]


def rotation(random: np.random.Generator) -> FloatArray:
    """Return a random rotation matrix, uniformly distributed."""
    q, r = np.linalg.qr(random.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.linalg.det(q)


def blade_on(cut: Incision, travel: float) -> Stroke:
    """Return the stroke of a blade along a surface; its ends move at most `travel` [m] a frame.

    The blade is rigid: its middle moves straight between positions while the blade rotates.
    """
    middles, spans = cut.edges.mean(axis=1), cut.edges[:, 1] - cut.edges[:, 0]
    half = 0.5 * float(np.linalg.norm(spans[0]))
    stroke = []
    for i in range(len(middles) - 1):
        farthest = np.linalg.norm(cut.edges[i + 1] - cut.edges[i], axis=1).max()
        n = max(1, int(np.ceil(farthest / travel)))
        for share in np.arange(n) / n:
            middle, span, forward = (
                (1.0 - share) * x[i] + share * x[i + 1] for x in (middles, spans, cut.forward)
            )
            along = span / np.linalg.norm(span)
            stroke.append(pose(middle - half * along, middle + half * along, forward))
    return stroke


def area_within(mesh: TetrahedralMesh, cut: Incision) -> float:
    """Return the area of a flat incision inside a box-shaped body [m2]."""
    first, last = cut.edges[0], cut.edges[-1]
    polygon = np.array([first[0], last[0], last[1], first[1]])
    for axis in range(3):
        x = mesh.positions[:, axis]
        for sign, limit in ((1.0, x.max()), (-1.0, -x.min())):
            polygon = _clipped(polygon, sign * polygon[:, axis] - limit)
    spokes = polygon[1:] - polygon[0]
    return 0.5 * float(np.linalg.norm(np.cross(spokes[:-1], spokes[1:]).sum(axis=0)))


def _clipped(polygon: FloatArray, height: FloatArray) -> FloatArray:
    """Return the part of a convex polygon where a linear function of its corners is negative."""
    kept = []
    for i in range(len(polygon)):
        j = (i + 1) % len(polygon)
        if height[i] <= 0.0:
            kept.append(polygon[i])
        if height[i] * height[j] < 0.0:
            share = height[i] / (height[i] - height[j])
            kept.append((1.0 - share) * polygon[i] + share * polygon[j])
    return np.array(kept)
