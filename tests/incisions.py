"""Incisions at random: surfaces for `Tissue.incise`, of every kind that a hand could make."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tests.strokes import Stroke, pose
from tissue import FloatArray, TetrahedralMesh

N_PLACES = 60
"""Places of the edge on its way through the body; those of a curve are chords of it."""

OUTREACH = 1.15
"""How far an edge reaches, and where its way begins and ends, in half diagonals of the body."""


class Incision(NamedTuple):
    """A ruled surface."""

    edges: FloatArray
    """Places of the edge from tip to heel [m], shape (n_places, 2, 3)."""
    forward: FloatArray
    """Where it faces, shape (n_places, 3)."""


class Shape(NamedTuple):
    """How an edge goes through a body, in units of half the body's diagonal where not said."""

    ways: FloatArray
    """Where the edge is along its way, shape (n_places,)."""
    low: float = -OUTREACH
    """Where the tip is along the edge."""
    high: float = OUTREACH
    """Where the heel is."""
    bow: float = 0.0
    """How far the way goes sideways [m]."""
    waves: float = 0.0
    """How often, per half diagonal [rad]."""
    phase: float = 0.0
    twist: float = 0.0
    """How far the edge turns about its way, per half diagonal [rad]."""


THROUGH = np.linspace(-OUTREACH, OUTREACH, N_PLACES)


def tilted(random: np.random.Generator, thin: float) -> Shape:
    return Shape(THROUGH)


def curved(random: np.random.Generator, thin: float) -> Shape:
    bow = random.uniform(0.03, 0.15) * thin
    return Shape(
        THROUGH, bow=bow, waves=random.uniform(0.5, 1.5) * np.pi, phase=random.uniform(0.0, 6.0)
    )


def twisted(random: np.random.Generator, thin: float) -> Shape:
    return Shape(THROUGH, twist=random.uniform(-0.6, 0.6))


def back_and_forth(random: np.random.Generator, thin: float) -> Shape:
    turn = int(random.integers(20, 40))
    back = turn - int(random.integers(5, 18))
    ways = np.concatenate([THROUGH[:turn], THROUGH[back:turn][::-1], THROUGH[back:]])
    return curved(random, thin)._replace(ways=ways)


def slit(random: np.random.Generator, thin: float) -> Shape:
    """It stops inside, its tip too."""
    ways = np.linspace(-OUTREACH, random.uniform(-0.2, 0.3), N_PLACES)
    return Shape(ways, low=random.uniform(-0.15, 0.15))


def buried(random: np.random.Generator, thin: float) -> Shape:
    """Both ends of the edge are inside."""
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
"""Kinds that cut the body in two."""


def incision(mesh: TetrahedralMesh, kind: str, seed: int) -> Incision:
    """Return a surface of that kind through the middle third or so of the body, any way turned."""
    random = np.random.default_rng(seed)
    turn = rotation(random)
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    thin = float((high - low).min())
    aside = random.uniform(-0.2, 0.2) * thin
    return ruled(mesh, KINDS[kind](random, thin), turn, aside)


def ruled(mesh: TetrahedralMesh, shape: Shape, turn: FloatArray, aside: float = 0.0) -> Incision:
    """Return the surface: columns of `turn` are the way, the edge, and sideways; `aside` [m]."""
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    way, upright, sideways = turn.T
    at = shape.ways[:, None]
    swing = shape.waves * at + shape.phase
    along = np.cos(shape.twist * at) * upright + np.sin(shape.twist * at) * sideways
    places = middle + half * at * way + (aside + shape.bow * np.sin(swing)) * sideways
    slope = shape.bow * shape.waves / half * np.cos(swing)
    edges = np.stack([places + half * shape.low * along, places + half * shape.high * along], 1)
    return Incision(edges, way + slope * sideways)


def plane(mesh: TetrahedralMesh, normal: FloatArray, offset: float = 0.0) -> Incision:
    """Return the plane at `offset` [m] from the middle of the body along its normal."""
    normal = np.asarray(normal, dtype=np.float64) / np.linalg.norm(normal)
    way = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    way /= np.linalg.norm(way)
    turn = np.stack([way, np.cross(normal, way), normal], axis=1)
    return ruled(mesh, Shape(1.3 * THROUGH, -1.5, 1.5), turn, offset)


def crossing_planes(mesh: TetrahedralMesh, seed: int) -> list[Incision]:
    """Return three planes that cross at nearly right angles, near the middle of the body."""
    random = np.random.default_rng(seed)
    thin = float(np.ptp(mesh.positions, axis=0).min())
    turn = rotation(random) if seed % 2 else np.eye(3)
    return [
        plane(mesh, axis + random.uniform(-0.15, 0.15, 3), random.uniform(-0.1, 0.1) * thin)
        for axis in turn.T
    ]


def rotation(random: np.random.Generator) -> FloatArray:
    """Return a rotation, all of them equally likely."""
    q, r = np.linalg.qr(random.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.linalg.det(q)


def blade_on(cut: Incision, travel: float) -> Stroke:
    """Return the stroke of a blade along a surface, an end of it by at most `travel` [m] a frame.

    The blade is rigid: its middle goes straight from place to place, and it turns on the way.
    """
    middles, spans = cut.edges.mean(axis=1), cut.edges[:, 1] - cut.edges[:, 0]
    half = 0.5 * float(np.linalg.norm(spans[0]))
    stroke = []
    for i in range(len(middles) - 1):
        farthest = np.linalg.norm(cut.edges[i + 1] - cut.edges[i], axis=1).max()
        n = max(1, int(np.ceil(farthest / travel)))
        for at in np.arange(n) / n:
            middle, span, forward = (
                (1.0 - at) * x[i] + at * x[i + 1] for x in (middles, spans, cut.forward)
            )
            along = span / np.linalg.norm(span)
            stroke.append(pose(middle - half * along, middle + half * along, forward))
    return stroke


def area_within(mesh: TetrahedralMesh, cut: Incision) -> float:
    """Return the area of a flat incision inside the box that the body is [m2]."""
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
