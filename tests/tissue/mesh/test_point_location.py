"""Point location by a grid, against a test of every tetrahedron; and bounds of the body."""

import numpy as np
import pytest

from tests.support import bodies
from tests.tissue.kernels_of import cut_of
from tissue import BladeSegment, BladeSweep, Material, TetrahedralMesh, Tissue, block
from tissue.core.vec3 import Vec3, lerp
from tissue.cutting.stellar_subdivision import split_edge
from tissue.geometry.tetrahedron import barycentric_in, smallest_weight
from tissue.mesh.body import build_body, grown_body
from tissue.mesh.bounding_boxes import chunk_nodes, chunks_of, write_bounds
from tissue.mesh.point_location import tetrahedra_along, tetrahedron_at, tetrahedron_in_box
from tissue.mesh.tetrahedron_grid import (
    TETRAHEDRA_PER_LINE,
    build_grid,
    cell_along,
    list_appended,
    list_moved,
    no_grid,
)

pytestmark = pytest.mark.kernel

MARGIN = 0.05


@pytest.fixture
def cut():
    """Return a unit cube of about 150 tetrahedra."""
    return cut_of(bodies.jittered(3, 0, size=1.0))


def first_containing(body, p: Vec3) -> int:
    """Return the first tetrahedron that contains a point, or -1, by testing all."""
    for t in range(body.n_tetrahedra):
        if smallest_weight(barycentric_in(p, body.positions, body.tetrahedra, t)) >= 0.0:
            return t
    return -1


def contains(body, t: int, p: Vec3) -> bool:
    return smallest_weight(barycentric_in(p, body.positions, body.tetrahedra, t)) >= 0.0


def expect_found(body, cells, seed: int) -> None:
    """Fail unless each random point that is in a tetrahedron is found in one that contains it."""
    for row in np.random.default_rng(seed).uniform(-0.2, 1.2, (60, 3)).tolist():
        p = Vec3(*row)
        t = tetrahedron_at(body, cells, body.positions, p)
        assert (t >= 0) == (first_containing(body, p) >= 0)
        assert t < 0 or contains(body, t, p)


def test_points_are_found_as_by_testing_all_tetrahedra(cut):
    expect_found(cut.body, build_grid(cut.body, cut.body.positions, MARGIN), seed=0)


def test_an_empty_grid_finds_nothing(cut):
    assert tetrahedron_at(cut.body, no_grid(), cut.body.positions, Vec3(0.5, 0.5, 0.5)) == -1


def test_points_are_found_while_nodes_move_by_less_than_the_margin(cut):
    cells = build_grid(cut.body, cut.body.positions, MARGIN)
    n = cut.body.n_nodes
    cut.body.positions[:n] += np.random.default_rng(1).uniform(-0.02, 0.02, (n, 3))
    expect_found(cut.body, cells, seed=1)


def test_a_tetrahedron_is_listed_in_cells_that_are_new_to_it_alone(cut):
    cells = build_grid(cut.body, cut.body.positions, MARGIN)
    n, n_at_first = cut.body.n_nodes, n_entries(cells)
    cut.body.positions[:n] -= [0.2, 0.0, 0.0]
    assert list_moved(cut.body, cut.visits, cells, np.arange(n), n, cut.scratch.around)
    assert n_at_first < n_entries(cells) < 1.5 * n_at_first
    for cell in range(len(cells.head)):
        listed = tetrahedra_in(cells, cell)
        assert len(set(listed)) == len(listed)


def tetrahedra_in(cells, cell: int) -> list[int]:
    """Return the tetrahedra that a cell lists."""
    line, n = cells.head[cell]
    listed = []
    while line >= 0:
        listed += cells.lines[line, 1 : 1 + n].tolist()
        line, n = cells.lines[line, 0], TETRAHEDRA_PER_LINE
    return listed


def n_entries(cells) -> int:
    return sum(len(tetrahedra_in(cells, cell)) for cell in range(len(cells.head)))


def test_whatever_the_nodes_do_a_tetrahedron_is_listed_wherever_its_box_is(cut):
    """Each node goes its own way, so that tetrahedra leave their cells by one node at a time."""
    cells, random = build_grid(cut.body, cut.body.positions, MARGIN), np.random.default_rng(5)
    body, n = cut.body, cut.body.n_nodes
    velocities = random.uniform(-1.0, 1.0, (n, 3)) * MARGIN
    for _ in range(12):
        body.positions[:n] += velocities * random.uniform(0.0, 1.0, (n, 1))
        assert list_moved(body, cut.visits, cells, np.arange(n), n, cut.scratch.around)
        for t in range(body.n_tetrahedra):
            corners = body.positions[body.tetrahedra[t]]
            ends = np.array(
                [
                    [cell_along(cells, corners[:, c].min(), c) for c in range(3)],
                    [cell_along(cells, corners[:, c].max(), c) for c in range(3)],
                ]
            )
            assert (cells.cells[t, :3] <= ends[0]).all()
            assert (cells.cells[t, 3:] >= ends[1]).all()


def test_what_is_listed_in_other_cells_is_logged(cut):
    cells = build_grid(cut.body, cut.body.positions, MARGIN)
    n, cells.n_logged = cut.body.n_nodes, 0
    assert list_moved(cut.body, cut.visits, cells, np.arange(n), n, cut.scratch.around)
    assert cells.n_logged == 0
    before = cells.cells.copy()
    cut.body.positions[0] = [1.0, 1.0, 1.0]  # from the corner opposite
    assert list_moved(cut.body, cut.visits, cells, np.arange(n), n, cut.scratch.around)
    changed = np.flatnonzero((cells.cells != before).any(axis=1))
    assert len(changed) > 0
    assert sorted(cells.log[: cells.n_logged]) == changed.tolist()


def test_points_on_a_line_are_found_as_each_by_itself(cut):
    cells, random = build_grid(cut.body, cut.body.positions, MARGIN), np.random.default_rng(4)
    n, found = 40, np.zeros(40, np.int64)
    for _ in range(10):
        ends = tuple(Vec3(*row) for row in random.uniform(-0.2, 1.2, (2, 3)).tolist())
        begin = 0
        while begin < n:
            begin = tetrahedra_along(cut.body, cells, ends, n, begin, n, found)
        for k in range(n):
            p = lerp(k / (n - 1.0), *ends)
            assert found[k] == tetrahedron_at(cut.body, cells, cut.body.positions, p)
            assert found[k] == first_containing(cut.body, p)


def test_points_are_found_after_nodes_went_to_and_fro(cut):
    cells, random = build_grid(cut.body, cut.body.positions, MARGIN), np.random.default_rng(3)
    n = cut.body.n_nodes
    for seed in range(8):
        cut.body.positions[:n] += random.uniform(-2.0, 2.0, 3) * MARGIN
        assert list_moved(cut.body, cut.visits, cells, np.arange(n), n, cut.scratch.around)
        expect_found(cut.body, cells, seed)


def test_a_grid_has_no_room_for_a_body_whose_arrays_have_grown(cut):
    body, cells = cut.body, build_grid(cut.body, cut.body.positions, MARGIN)
    n_nodes, n_tetrahedra = len(body.positions), len(body.tetrahedra)
    for room in ((2 * n_nodes, n_tetrahedra), (n_nodes, 2 * n_tetrahedra)):
        larger = grown_body(body, *room)
        assert not list_appended(larger, larger.positions, cells)
    assert list_appended(body, body.positions, cells)


def test_points_are_found_in_tetrahedra_that_were_appended(cut):
    cells = build_grid(cut.body, cut.body.positions, MARGIN)
    for t in range(0, 60, 5):
        split_edge(cut, cut.body.tetrahedra[t, 0], cut.body.tetrahedra[t, 1], 0.4)
    assert list_appended(cut.body, cut.body.positions, cells)
    expect_found(cut.body, cells, seed=3)


def test_a_box_beside_the_body_contains_no_tetrahedron_and_one_across_it_does(cut):
    x = cut.body.positions
    cells = build_grid(cut.body, x, MARGIN)
    beside = Vec3(1.1, 0.0, 0.0), Vec3(1.2, 1.0, 1.0)
    across = Vec3(0.9, 0.4, 0.4), Vec3(1.2, 0.5, 0.5)
    assert tetrahedron_in_box(cut.body, cells, x, *beside) == -1
    found = tetrahedron_in_box(cut.body, cells, x, *across)
    corners = x[cut.body.tetrahedra[found]]
    assert corners.max(axis=0)[0] >= 0.9
    assert (corners.max(axis=0)[1:] >= 0.4).all()
    assert (corners.min(axis=0)[1:] <= 0.5).all()


def test_the_bounds_of_the_body_are_those_of_its_nodes(cut):
    cut.body.positions[7] = [-3.0, 0.5, 4.0]
    corners = np.empty((2, 3))
    assert write_bounds(cut.body, corners)
    assert corners.tolist() == [[-3.0, 0.0, 0.0], [1.0, 1.0, 4.0]]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_node_that_is_not_finite_is_detected(cut, value):
    cut.body.positions[7, 1] = value
    assert not write_bounds(cut.body, np.empty((2, 3)))


BLOCK = block((8, 4, 4), (0.08, 0.04, 0.04))


def body_of(mesh: TetrahedralMesh, positions=None):
    return build_body(mesh, positions, None)


def in_some_box(boxes, points):
    """Return whether each point is in some box."""
    inside = (boxes[:, None, 0] <= points) & (points <= boxes[:, None, 1])
    return inside.all(axis=2).any(axis=0)


def test_boxes_of_a_bent_body_do_not_cover_its_hollow():
    """A bar is bent to a half circle; a single box around it would contain its centre."""
    rest = BLOCK.positions
    turn = np.pi * rest[:, 0] / 0.08
    radius = 0.1 + rest[:, 1]
    bent = np.stack([radius * np.cos(turn), radius * np.sin(turn), rest[:, 2]], axis=1)
    body = body_of(BLOCK, bent)
    boxes = chunks_of(body, chunk_nodes(body)).boxes
    assert in_some_box(boxes, bent).all()
    assert not in_some_box(boxes, np.array([[0.0, 0.02, 0.02]])).any()


def test_a_body_of_one_tetrahedron_is_one_chunk():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    body = body_of(TetrahedralMesh(corners, np.array([[0, 1, 2, 3]])))
    np.testing.assert_array_equal(
        chunks_of(body, chunk_nodes(body)).boxes, [[[0, 0, 0], [1, 1, 1]]]
    )


def test_the_speed_of_the_fastest_node_is_reported():
    body = body_of(BLOCK)
    body.velocities[7] = 3.0, 0.0, -4.0
    assert chunks_of(body, chunk_nodes(body)).fastest == 5.0


def test_spare_capacity_is_in_no_box():
    body = body_of(BLOCK)
    grown = grown_body(body, 1000, 9000)
    grown.positions[len(BLOCK.positions) :] = 1e6
    expected = chunks_of(body, chunk_nodes(body)).boxes
    np.testing.assert_array_equal(chunks_of(grown, chunk_nodes(grown)).boxes, expected)


def test_boxes_follow_a_body_that_is_cut():
    """The blade cuts half through; the boxes contain the new nodes and their neighbours."""
    mesh = block((2, 2, 2), (0.02, 0.02, 0.02))
    tissue = Tissue(mesh, Material(toughness=5.0), fixed=mesh.positions[:, 0] == 0.0)
    before = None
    for y in np.linspace(-0.001, 0.012, 27):
        tip, heel = np.array([0.009, y, -0.005]), np.array([0.009, y, 0.025])
        after = BladeSegment(tip, heel, np.array([0.0, 1.0, 0.0]))
        tissue.step(BladeSweep(before or after, after), 5e-3)
        before = after
        snapshot = tissue.snapshot()
        corners = snapshot.positions[snapshot.tetrahedra]
        low, high, boxes = corners.min(axis=1), corners.max(axis=1), tissue.chunks().boxes
        inside = (boxes[:, None, 0] <= low) & (high <= boxes[:, None, 1])
        assert inside.all(axis=2).any(axis=0).all()
    assert len(snapshot.positions) > len(mesh.positions)
