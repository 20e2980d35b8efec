"""The crack front: nodes where the tip passes faces, joined by edges of the mesh."""

import itertools

import numpy as np
import pytest

from tests.support import bodies, soundness
from tests.tissue.kernels_of import cut_of
from tissue.cutting.blade_path import put_on_lattice
from tissue.cutting.collision_detection import find_active_tetrahedra
from tissue.cutting.crack_front import bring_front_to_blade, extend_fronts
from tissue.cutting.cut_surface import on_cut_surface

pytestmark = [
    pytest.mark.kernel,
    # The hash of an edge overflows on purpose; with the JIT off NumPy warns of it.
    pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning"),
]

X, DEPTH = 0.37, 0.41


def swept(y0: float, y1: float, low: float = DEPTH):
    """Return a unit cube in which an upright edge at X moved from y0 to y1, its tip at `low`."""
    cut = cut_of(bodies.jittered(3, 2, size=1.0), n_samples=5)
    cut = cut.replaced(limits=cut.limits.replaced(snap=0.1))
    path = cut.path
    heights = np.linspace(low, 1.2, 5)
    for array, y in ((path.t0, y0), (path.t1, y1)):
        array[:] = np.stack([np.full(5, X), np.full(5, y), heights], axis=1)
    path.forward[:] = [0.0, 1.0, 0.0]
    path.sideways[:] = [1.0, 0.0, 0.0]
    path.member[:] = True
    path.linked[:-1] = True
    centres = cut.body.rest[cut.body.tetrahedra[: cut.body.n_tetrahedra]].mean(axis=1)
    for k in range(5):
        path.seed[k] = np.linalg.norm(centres - path.t1[k], axis=1).argmin()
    put_on_lattice(path, cut.body.lattice)
    find_active_tetrahedra(cut)
    return cut


def nodes_on_cut_surface(cut) -> list[int]:
    return [n for n in range(cut.body.n_nodes) if on_cut_surface(cut.surface, n)]


def edges_of(cut) -> set[tuple[int, int]]:
    tetrahedra = cut.body.tetrahedra[: cut.body.n_tetrahedra].tolist()
    return {pair for t in tetrahedra for pair in itertools.combinations(sorted(t), 2)}


def expect_sound(cut) -> None:
    n_tetrahedra, n = cut.body.n_tetrahedra, cut.body.n_nodes
    volumes = soundness.volumes(cut.body.rest[:n], cut.body.tetrahedra[:n_tetrahedra])
    assert volumes.min() > 0.0
    assert volumes.sum() == pytest.approx(1.0, rel=1e-13)
    assert soundness.link_faults(cut.body) == []


def test_nodes_lie_where_the_tip_passed_faces_and_edges_join_them():
    cut = swept(-0.1, 0.45)
    extend_fronts(cut)
    nodes = nodes_on_cut_surface(cut)
    along = sorted(nodes, key=lambda node: cut.body.rest[node, 1])
    assert len(along) >= 3
    rest = cut.body.rest[along]
    assert np.abs(rest[:, 0] - X).max() < 0.1
    assert np.abs(rest[:, 2] - DEPTH).max() < 0.1
    edges = edges_of(cut)
    for a, b in itertools.pairwise(along):
        assert (min(a, b), max(a, b)) in edges
    expect_sound(cut)


def test_the_front_ends_at_the_last_face_that_the_tip_passed():
    cut = swept(-0.1, 0.45)
    extend_fronts(cut)
    last = max(nodes_on_cut_surface(cut), key=lambda node: cut.body.rest[node, 1])
    assert cut.surface.front[0] == last
    assert cut.surface.front[1] == -1  # the heel is above the body


def test_a_tip_that_leaves_at_the_far_side_leaves_no_front():
    cut = swept(-0.1, 1.1)
    extend_fronts(cut)
    assert cut.surface.front[0] == -1
    assert cut.body.rest[nodes_on_cut_surface(cut), 1].max() == pytest.approx(1.0)


def test_a_tip_outside_the_body_makes_no_front():
    cut = swept(-0.1, 0.45, low=-0.2)
    extend_fronts(cut)
    assert nodes_on_cut_surface(cut) == []


def test_a_front_brought_to_a_resting_blade_runs_from_its_tip_to_the_skin():
    cut = swept(-0.1, 0.45)
    extend_fronts(cut)
    before = set(nodes_on_cut_surface(cut))
    bring_front_to_blade(cut)
    along_blade = sorted(
        set(nodes_on_cut_surface(cut)) - before, key=lambda node: cut.body.rest[node, 2]
    )
    rest = cut.body.rest[along_blade]
    assert np.abs(rest[:, :2] - [X, 0.45]).max() < 0.12
    assert rest[-1, 2] == pytest.approx(1.0)
    expect_sound(cut)
