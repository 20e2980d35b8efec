"""Random sequences of cuts in random bodies: what a hand may do, and what it should not."""

from collections.abc import Callable
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from scalpel_sim import SCENES
from tests.support import bodies, incisions
from tests.support.incisions import Incision, Shape
from tissue import FloatArray, TetrahedralMesh, block, cylinder, liver_lobe
from tissue.shapes.isosurface_stuffing import stuff

FEWEST, MOST = 5, 50
"""Number of cuts in a sequence."""

MOST_CLEAN = 3
"""Cuts clean through the whole body in a sequence: after more of them only crumbs are left."""

N_PLACES = 13
"""Positions of the edge along a curved path."""


def ball(radius: float = 0.02, spacing: float = 0.011) -> TetrahedralMesh:
    """Return a ball of some 500 tetrahedra."""
    reach = radius + 2.0 * spacing
    return stuff(lambda x: radius - np.linalg.norm(x, axis=1), [[-reach] * 3, [reach] * 3], spacing)


BODIES: dict[str, Callable[[], TetrahedralMesh]] = {
    "block": partial(block, (3, 4, 3), (0.03, 0.04, 0.03)),
    "ball": ball,
    "cylinder": partial(cylinder, (3, 4), 0.02, 0.03),
    "lobe": partial(liver_lobe, 2.2),
    "grid of the paper": SCENES["grid2"].mesh,
    "slab": SCENES["slab"].mesh,
    "skin": SCENES["skin"].mesh,
    "shifted grid": partial(bodies.jittered_grid, 4, 0),
    "Delaunay": partial(bodies.body_centred, 3, 0),
    "slivers": partial(bodies.with_slivers, 4, 0),
} | {file: partial(bodies.third_party_mesh, file) for file in bodies.FILES if bodies.FOLDER}


@lru_cache
def body(name: str) -> TetrahedralMesh:
    return BODIES[name]()


class Cut(NamedTuple):
    """A cut of a sequence."""

    kind: str
    incision: Incision
    surface: FloatArray
    """The part of it on which the edge goes ahead [m], shape (n_positions, 2, 3); n may be 0."""


class Draw(NamedTuple):
    """What a cut is drawn from."""

    random: np.random.Generator
    mesh: TetrahedralMesh
    earlier: list[Cut]
    loose: FloatArray | None
    """Centroid of the smallest loose piece, at rest [m]; None where the body is whole."""

    @property
    def half(self) -> float:
        """Half the diagonal of the body [m]."""
        return 0.5 * float(np.linalg.norm(np.ptp(self.mesh.positions, axis=0)))

    def turn(self) -> FloatArray:
        return incisions.rotation(self.random)

    def point(self) -> FloatArray:
        """Return a point in the body."""
        corners = self.mesh.positions[self.random.choice(self.mesh.tetrahedra)]
        return self.random.dirichlet(np.ones(4)) @ corners

    def surface(self, turn: FloatArray, through: FloatArray, shape: Shape) -> Cut:
        """Return a cut along the surface of that shape with a point of the body as its middle."""
        moved = incisions.ruled(self.mesh, shape, turn)
        low, high = self.mesh.positions.min(axis=0), self.mesh.positions.max(axis=0)
        edges = moved.edges + (through - 0.5 * (low + high))
        return Cut("", Incision(edges, moved.forward), edges)


MARGIN = 0.1
"""How far an edge that passes the whole body reaches beyond it [half diagonals]."""

SHORTEST = 0.15
"""Length of the shortest edge of a slit [half diagonals]."""


def extent(draw: Draw, through: FloatArray, along: FloatArray) -> FloatArray:
    """Return from where to where the body reaches along a direction from a point, with a margin.

    In half diagonals, shape (2,).
    """
    at = (draw.mesh.positions - through) @ along / draw.half
    return np.array([at.min() - MARGIN, at.max() + MARGIN])


def plane(draw: Draw, through: FloatArray, turn: FloatArray) -> Cut:
    """Return a plane cut clean through the body."""
    path, edge = (extent(draw, through, turn[:, k]) for k in (0, 1))
    return draw.surface(turn, through, Shape(path, *edge))


def patch(draw: Draw, through: FloatArray, turn: FloatArray) -> Cut:
    """Return a flat cut of a part of the body's width; often it begins and ends inside."""
    long, wide = draw.random.uniform(0.1, 0.5, 2)
    return draw.surface(turn, through, Shape(np.array([-long, long]), -wide, wide))


def slanted(draw: Draw) -> Cut:
    return plane(draw, draw.point(), draw.turn())


def curved(draw: Draw) -> Cut:
    """Return a wavy cut clean through the body."""
    thickness = float(np.ptp(draw.mesh.positions, axis=0).min())
    through, turn = draw.point(), draw.turn()
    first, last = extent(draw, through, turn[:, 0])
    shape = incisions.curved(draw.random, thickness)._replace(
        path=np.linspace(first, last, N_PLACES),
        low=extent(draw, through, turn[:, 1])[0],
        high=extent(draw, through, turn[:, 1])[1],
    )
    return draw.surface(turn, through, shape)


def slit(draw: Draw) -> Cut:
    """Return a cut that stops inside the body, its tip inside too."""
    through, turn = draw.point(), draw.turn()
    path, edge = (extent(draw, through, turn[:, k]) for k in (0, 1))
    path[1] = draw.random.uniform(path[0] + MARGIN, path[1])
    edge[0] = draw.random.uniform(edge[0], edge[1] - SHORTEST)
    return draw.surface(turn, through, Shape(path, *edge))


def short(draw: Draw) -> Cut:
    return patch(draw, draw.point(), draw.turn())


def bent(draw: Draw) -> Cut:
    """Return a short cut that curves."""
    low = draw.random.uniform(-0.5, 0.1)
    shape = Shape(
        np.linspace(-0.4, 0.4, N_PLACES),
        low=low,
        high=low + draw.random.uniform(0.2, 0.6),
        bow=draw.random.uniform(0.02, 0.1) * draw.half,
        waves=draw.random.uniform(2.0, 6.0),
        phase=draw.random.uniform(0.0, 6.0),
    )
    return draw.surface(draw.turn(), draw.point(), shape)


def through_a_node(draw: Draw) -> Cut:
    return patch(draw, draw.random.choice(draw.mesh.positions), draw.turn())


def along_an_edge(draw: Draw) -> Cut:
    """Return a cut whose plane holds an edge of the mesh."""
    a, b, *_ = draw.mesh.positions[draw.random.choice(draw.mesh.tetrahedra)]
    turn = frame(b - a, draw.random.normal(size=3))
    return patch(draw, a, turn[:, [1, 0, 2]] * [1.0, 1.0, -1.0])


def in_a_face(draw: Draw) -> Cut:
    """Return a cut in the plane of a face of the mesh."""
    a, b, c, _ = draw.mesh.positions[draw.random.choice(draw.mesh.tetrahedra)]
    return patch(draw, (a + b + c) / 3.0, frame(b - a, np.cross(b - a, c - a)))


def frame(along: FloatArray, towards: FloatArray) -> FloatArray:
    """Return unit vectors along the first, across it, and near the second, as columns."""
    first = along / np.linalg.norm(along)
    second = np.cross(towards, first)
    second /= np.linalg.norm(second)
    return np.stack([first, second, np.cross(first, second)], axis=1)


def graze(draw: Draw) -> Cut:
    """Return a plane that touches the body at its outermost node, or passes a little under it."""
    turn = draw.turn()
    outermost = draw.mesh.positions[np.argmax(draw.mesh.positions @ turn[:, 2])]
    depth = draw.random.choice([-1e-13, 0.0, 1e-13, 1e-4, 1e-2]) * draw.half
    return plane(draw, outermost - depth * turn[:, 2], turn)


def again(draw: Draw) -> Cut:
    return draw.earlier[draw.random.integers(len(draw.earlier))] if draw.earlier else short(draw)


def still(draw: Draw) -> Cut:
    """Return an edge that does not move."""
    cut = short(draw)
    places = cut.incision.edges[[0, 0, 0]]
    return Cut("", Incision(places, cut.incision.forward[[0, 0, 0]]), places[:0])


def drawn_back(draw: Draw) -> Cut:
    """Return an edge that goes in and comes back the same way."""
    cut = slit(draw)
    edges = np.concatenate([cut.incision.edges, cut.incision.edges[:1]])
    forward = cut.incision.forward[[0, 1, 1]]
    return Cut("", Incision(edges, forward), cut.surface)


def backward(draw: Draw) -> Cut:
    """Return an edge that moves with its back ahead: it cuts nothing."""
    cut = short(draw)
    edges = cut.incision.edges[::-1]
    return Cut("", Incision(edges, cut.incision.forward), edges[:0])


def loose_piece(draw: Draw) -> Cut:
    if draw.loose is None:
        return short(draw)
    return patch(draw, draw.loose, draw.turn())


CLEAN = {"plane": slanted, "curve": curved}
PARTIAL = {
    "slit": slit,
    "short": short,
    "bent": bent,
    "through a node": through_a_node,
    "along an edge": along_an_edge,
    "in a face": in_a_face,
    "graze": graze,
    "again": again,
    "still": still,
    "drawn back": drawn_back,
    "backward": backward,
    "loose piece": loose_piece,
}


def kinds_of(random: np.random.Generator) -> list[str]:
    """Return the kinds of cut of a sequence, in their order: many of few kinds, or of most."""
    n = int(random.integers(FEWEST, MOST + 1))
    kinds = random.choice(list(CLEAN), random.integers(0, MOST_CLEAN + 1)).tolist()
    among = random.choice(list(PARTIAL), random.integers(1, len(PARTIAL) + 1), replace=False)
    kinds += random.choice(among, n - len(kinds)).tolist()
    return random.permutation(kinds).tolist()


def drawn(kind: str, draw: Draw) -> Cut:
    return (CLEAN | PARTIAL)[kind](draw)._replace(kind=kind)
