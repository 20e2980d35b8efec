"""Self-proximity: skin near skin of the same piece that is not next to it in the body at rest."""

import numpy as np
import pytest

from tests.support.overlaps import joined
from tissue import TetrahedralMesh, block
from tissue.contact.geometry.faces import new_faces, with_found_pieces
from tissue.contact.search.node_motion import NO_PROXIMITY, NOTCH, PROXIMITY, new_node_motion
from tissue.contact.search.self_proximity import (
    APART,
    NEAR,
    OPPOSITE,
    find_self_proximity,
    new_self_proximity,
)
from tissue.mesh.body import build_body

pytestmark = pytest.mark.kernel

SIZE = 0.004
"""Size of a node, and edge of a cell [m]."""
N = 24
"""Cells along the strip."""


class Strip:
    """A flat strip of a row of cells, or another body, and what of it is found near itself."""

    def __init__(self, mesh=None):
        mesh = mesh or block((N, 1, 1), (N * SIZE, SIZE, SIZE))
        self.body = build_body(mesh, None, None)
        faces = new_faces(self.body.n_tetrahedra)
        self.faces = with_found_pieces(faces, self.body) or faces
        self.motion = new_node_motion(self.body.n_nodes, SIZE)
        self.proximity = new_self_proximity(self.body.n_nodes)

    def search(self) -> bool:
        return find_self_proximity(self.proximity, self.motion, self.faces, self.body)

    def bend(self, gap: float) -> None:
        """Turn the upper half of the strip about its middle, back over the rest, `gap` above it."""
        x, z = self.body.rest[:, 0], self.body.rest[:, 2]
        over = x > (N // 2 + 0.5) * SIZE
        self.body.positions[over, 0] = N * SIZE - x[over]
        self.body.positions[over, 2] = 2.0 * SIZE + gap - z[over]

    @property
    def marked(self) -> np.ndarray:
        """The nodes near skin of their own piece."""
        return np.flatnonzero(self.motion.self_proximity)


def test_skin_that_moves_apart_again_is_not_near_itself():
    strip = Strip()
    strip.bend(0.5 * SIZE)
    assert strip.search()
    strip.body.positions[:] = strip.body.rest
    assert not strip.search()
    assert len(strip.marked) == 0


def test_all_skin_is_tested_again_where_skin_is_newly_near():
    strip = Strip()
    strip.search()
    strip.motion.largest_path = 0.0
    strip.search()
    assert strip.motion.largest_path == 0.0
    strip.bend(0.5 * SIZE)
    strip.search()
    assert strip.motion.largest_path == np.inf


def test_what_has_moved_little_is_not_searched_again():
    strip = Strip()
    strip.search()
    strip.body.positions[:, 1] += 0.4 * SIZE
    strip.search()
    assert strip.proximity.n_searches == 1
    strip.body.positions[:, 1] += 0.4 * SIZE
    strip.search()
    assert strip.proximity.n_searches == 2


def test_skin_of_two_pieces_is_not_near_itself():
    """Their skin is searched for contacts in any case."""
    half = block((N // 2, 1, 1), (0.5 * N * SIZE, SIZE, SIZE))
    strip = Strip(joined(half, half, (0.5 * N * SIZE, 0.0, 0.0)))
    strip.search()
    strip.bend(0.5 * SIZE)
    assert not strip.search()


def test_a_body_that_has_exploded_is_not_searched():
    strip = Strip()
    strip.search()
    strip.body.positions[3] = [np.nan, 0.0, 0.0]
    strip.body.positions[5] = [1e9, 0.0, 0.0]
    assert not strip.search()
    assert strip.proximity.n_searches == 1


def notched(gap: int, lean: float = 0.0) -> Strip:
    """Return a block with a notch that many cells wide, whose walls lean out by an angle [rad]."""
    mesh = block((gap + 4, 2, 6), ((gap + 4) * SIZE, 2.0 * SIZE, 6.0 * SIZE))
    x, _, z = (mesh.positions[mesh.tetrahedra].mean(axis=1) / SIZE).T
    is_kept = (np.abs(x - 0.5 * gap - 2.0) > 0.5 * gap) | (z < 2.0)
    used, kept = np.unique(mesh.tetrahedra[is_kept], return_inverse=True)
    positions = mesh.positions[used]
    above = np.maximum(positions[:, 2] - 2.0 * SIZE, 0.0)
    side = np.sign(positions[:, 0] - (0.5 * gap + 2.0) * SIZE)
    positions[:, 0] += side * above * np.tan(lean)
    return Strip(TetrahedralMesh(positions, kept.reshape(-1, 4)))


def marks_by_definition(strip: Strip) -> np.ndarray:
    """Return the mark of each node of the one piece, from all pairs of nodes of its skin."""
    rest, outward = strip.body.rest, strip.proximity.outward
    skin = strip.proximity.skin[: strip.proximity.n_skin]
    marks = np.full(strip.body.n_nodes, NO_PROXIMITY)
    for node in skin:
        d = rest[skin] - rest[node]
        now = np.linalg.norm(strip.body.positions[skin] - strip.body.positions[node], axis=1)
        is_near, apart = now < NEAR * SIZE, np.linalg.norm(d, axis=1)
        own, others = outward[node], outward[skin]
        sizes = np.linalg.norm(own) * np.linalg.norm(others, axis=1)
        is_across = (d @ own > 0.0) & ((d * others).sum(axis=1) < 0.0)
        is_across &= others @ own < OPPOSITE * sizes
        if (is_near & is_across).any():
            marks[node] = NOTCH
        elif (is_near & (apart > APART * SIZE)).any():
            marks[node] = PROXIMITY
    return marks


@pytest.mark.parametrize("make", [Strip, lambda: notched(2), lambda: notched(1, 0.2)])
@pytest.mark.parametrize("seed", range(3))
def test_marks_are_those_of_all_pairs_of_nodes_of_the_skin(make, seed):
    strip, random = make(), np.random.default_rng(seed)
    if make is Strip:
        strip.bend(0.5 * SIZE)
    strip.body.positions[:, 0] *= random.uniform(0.6, 1.0)
    strip.body.positions += 0.3 * SIZE * random.standard_normal(strip.body.positions.shape)
    assert strip.search()
    expected = marks_by_definition(strip)
    assert (strip.motion.self_proximity == expected).all()
    assert len(np.unique(expected)) > 1
