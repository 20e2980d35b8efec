"""The minimum cut between two lips, by hand and against scipy's maximum flow."""

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import maximum_flow

from tests.support import bodies
from tissue import block
from tissue.cutting.minimum_cut import clear_lips, minimum_cut, new_flow_graph, put_on_lip
from tissue.geometry.tetrahedron import face_area
from tissue.mesh.body import CUT, build_body
from tissue.mesh.star import no_visits

pytestmark = pytest.mark.kernel


class Graph:
    """A body with lips, and searches in it."""

    def __init__(self, mesh):
        n = len(mesh.tetrahedra)
        self.body = build_body(mesh, None, None)
        self.visits = no_visits(len(mesh.positions), n)
        self.graph = new_flow_graph(n)

    def put(self, plus, minus):
        for t in plus:
            put_on_lip(self.graph, t, 1)
        for t in minus:
            put_on_lip(self.graph, t, -1)

    def area(self, limit=np.inf):
        return minimum_cut(self.graph, self.body, self.visits, limit)

    def side(self):
        return sorted(self.graph.queue[: self.graph.n_queued].tolist())


def scipy_area(body, plus, minus):
    """Return the maximum flow between two sets of tetrahedra, areas rounded to 1e-9 of a unit."""
    n = body.n_tetrahedra
    unit = 1e-9 * face_area(body.rest, body.tetrahedra, 0, 0)
    capacity = np.zeros((n + 2, n + 2), dtype=np.int64)
    for t in range(n):
        for f in range(4):
            if body.links[t, f] >= 0:
                area = face_area(body.rest, body.tetrahedra, t, f)
                capacity[t, body.links[t, f] // 4] = round(area / unit / 1e3)
    capacity[n, plus] = capacity[minus, n + 1] = 10**8
    return maximum_flow(csr_array(capacity.astype(np.int32)), n, n + 1).flow_value * unit * 1e3


def test_a_search_ends_where_the_area_is_above_the_limit():
    mesh = block((1, 2, 6), (1.0, 2.0, 6.0))
    bar = Graph(mesh)
    bar.put([0], [len(mesh.tetrahedra) - 1])
    least = bar.area()
    assert bar.area(0.5 * least) > 0.5 * least
    assert bar.area(least * (1.0 + 1e-9)) == pytest.approx(least, rel=1e-12)


@pytest.mark.parametrize("seed", range(12))
def test_the_area_is_the_maximum_flow_of_scipy(seed):
    """Between lips of up to 8 tetrahedra, in meshes of random tetrahedra with cuts; twice."""
    random = np.random.default_rng(seed)
    mesh = bodies.jittered(3, seed % 3)
    found = Graph(mesh)
    body = found.body
    for half in random.choice(4 * body.n_tetrahedra, 60, replace=False):
        link = body.links[half // 4, half % 4]
        if link >= 0:
            body.links[half // 4, half % 4] = body.links[link // 4, link % 4] = CUT
    for _ in range(2):
        chosen = random.permutation(body.n_tetrahedra)[: random.integers(2, 17)]
        plus, minus = np.array_split(chosen, 2)
        found.put(plus, minus)
        area = found.area()
        assert area == pytest.approx(scipy_area(body, plus, minus), rel=1e-4)
        side = set(found.side())
        assert side.issuperset(plus.tolist()) and side.isdisjoint(minus.tolist())
        through = sum(
            face_area(body.rest, body.tetrahedra, t, f)
            for t in side
            for f in range(4)
            if body.links[t, f] >= 0 and body.links[t, f] // 4 not in side
        )
        assert through == pytest.approx(area, rel=1e-9)
        clear_lips(found.graph)
