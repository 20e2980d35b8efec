"""Whole cuts by the paper's scheme: supported cuts, and soundness after unsupported ones."""

import itertools

import numpy as np
import pytest

from tests.support import bodies, soundness, strokes
from tests.support.materials import SPRINGS
from tests.tissue.kernels_of import row, springs_of
from tissue import SolverSettings, Tissue, block

CELL = 0.01
NO_GRAVITY = (0.0, 0.0, 0.0)
UP, Y = np.array([0.0, 0.0, 1.0]), (0.0, 1.0, 0.0)


def block_of(*cells):
    """Return a block of the paper's Table 1, of cubic cells."""
    return block(cells, [n * CELL for n in cells])


def uncut(mesh, scheme="paper", **options):
    options = {"gravity": NO_GRAVITY, "solver": SolverSettings(scheme=scheme)} | options
    return Tissue(mesh, **options)


def upright(mesh, x=0.4, depth=1.2, stop=1.15, rake=0.0, yaw=0.0):
    """Return the positions of an edge that enters from the top and moves along y.

    All lengths are shares of the size of the body.

    Args:
        mesh: The body.
        x: Position across the body, in its middle along y.
        depth: Depth of the tip.
        stop: End of the motion along y.
        rake: Advance of the edge ahead of its tip, per height.
        yaw: Motion across the body, per length of the body.
    """
    size = mesh.positions.max(axis=0)
    low, high = (1.0 - depth) * size[2], 1.3 * size[2]
    ahead = rake * (high - low) / size[1]
    edges = []
    for y in np.linspace(-0.4, stop, 41):
        tip = np.array([(x + yaw * (y - 0.5)) * size[0], y * size[1], low])
        heel = np.array([(x + yaw * (y + ahead - 0.5)) * size[0], (y + ahead) * size[1], high])
        edges.append([tip, heel])
    return np.array(edges)


def faults(before, tissue):
    """Return the faults of the body, except those that hanging nodes cause."""
    after = tissue.snapshot()
    ignored = ("open", "share no face", "without a twin")
    found = soundness.faults(before, after, volume=1e-12)
    return [fault for fault in found if not any(text in fault for text in ignored)]


TABLE_1 = {  # cells, a stroke, initial and final number of tetrahedra as in the paper
    "2 x 2 x 2": ((2, 2, 2), {"depth": 0.5}, 48, 354),
    "2 x 4 x 3": ((2, 4, 3), {"depth": 0.5}, 144, 960),
    "4 x 6 x 4": ((4, 6, 4), {"depth": 0.7, "stop": 1.35, "rake": -0.5, "yaw": 0.2}, 576, 2446),
}


@pytest.mark.parametrize("cells", TABLE_1)
def test_the_counts_of_table_1_are_initial_and_17_for_each_tetrahedron_cut(cells):
    shape, stroke, initial, final = TABLE_1[cells]
    mesh = block_of(*shape)
    assert len(mesh.tetrahedra) == initial
    tissue = uncut(mesh)
    tissue.incise(upright(mesh, **stroke), Y)
    statistics = tissue.scheme_statistics()
    assert statistics.paper_count == final == initial + 17 * statistics.n_cut
    assert tissue.n_tetrahedra == initial + 16 * statistics.n_cut
    assert statistics.n_unsupported == statistics.n_guarded == 0


PLANES = {  # cells, then the numbers of cut tetrahedra, hanging edge nodes, hanging face nodes
    "along the block": ((4, 6, 4), 144, 164, 96),
    "across the block": ((6, 4, 4), 96, 112, 64),
}


@pytest.mark.parametrize("plane", PLANES)
def test_a_planar_cut_of_the_paper_s_block_leaves_as_many_hanging_nodes_as_expected(plane):
    cells, n_cut, edge_nodes, face_nodes = PLANES[plane]
    tissue = uncut(block_of(*cells))
    tissue.incise(upright(block_of(*cells)), Y)
    statistics = tissue.scheme_statistics()
    assert tissue.n_pieces() == 2
    of_case = {"A": n_cut * 2 // 3, "B": n_cut // 3, "C": 0, "D": 0, "E": 0}
    assert statistics.n_of_case == of_case
    assert statistics.n_hanging_edge_nodes == edge_nodes
    assert statistics.n_hanging_face_nodes == face_nodes


def test_the_mesh_grows_2_to_3_times_as_much_as_with_the_stellar_scheme():
    mesh = block_of(4, 6, 4)
    ours = uncut(mesh, scheme="stellar")
    paper = uncut(mesh)
    for tissue in (ours, paper):
        tissue.incise(upright(mesh), Y)
        assert tissue.n_pieces() == 2
    assert paper.n_tetrahedra == 2880
    assert ours.n_tetrahedra < 1110


@pytest.mark.parametrize("seed", range(12))
def test_random_planar_strokes_lose_nothing_and_leave_positive_volumes(seed):
    random = np.random.default_rng(seed)
    mesh = bodies.jittered(3, seed % 3) if seed % 2 else block_of(3, 4, 2)
    tissue = uncut(mesh)
    tissue._body.velocities[:] = random.normal(size=tissue._body.velocities.shape)
    before = tissue.snapshot()
    for _ in range(2):
        shape = random.uniform([0.2, 0.3, 0.3, -0.5, -0.4], [0.8, 1.2, 1.2, 0.5, 0.4])
        tissue.incise(upright(mesh, *shape), Y)
    assert tissue.scheme_statistics().n_cut > 0
    assert faults(before, tissue) == []
    after = tissue.snapshot()
    momentum = before.masses @ before.velocities
    assert after.masses @ after.velocities == pytest.approx(momentum, abs=1e-12)


def in_depth(mesh, *stops):
    """Return the stroke of an upright edge along y through the given stops, tip inside [m]."""
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    x = 0.45 * low[0] + 0.55 * high[0]
    z = 0.6 * low[2] + 0.4 * high[2]
    ys = np.concatenate([strokes.along_y(a, b) for a, b in itertools.pairwise(stops)])
    return [strokes.pose((x, y, z), (x, y, high[2] + 0.02), Y) for y in ys]


UNSUPPORTED = {
    "backward and forward again": lambda m: in_depth(m, -0.005, 0.02, 0.0, 0.06),
    "curved": lambda m: strokes.curved(m, 0.2),
    "heel first": lambda m: [
        strokes.pose(p.heel, p.tip, p.forward) for p in in_depth(m, -0.005, 0.03)
    ],
    "along a plane of the mesh": lambda m: strokes.straight(m, 0.5),
    "in from the side, and up": lambda m: [
        strokes.pose((0.017, y, 0.01 + y), (0.017, y - 0.01, 0.05 + y), Y)
        for y in strokes.along_y(-0.02, 0.05)
    ],
}


@pytest.mark.parametrize("mesh", ["grid", "jittered"])
@pytest.mark.parametrize("stroke", UNSUPPORTED)
def test_unsupported_strokes_leave_the_mesh_sound(stroke, mesh):
    body = block((2, 3, 2), (0.04, 0.06, 0.04)) if mesh == "grid" else bodies.jittered(3, 1)
    tissue = uncut(body, fixed=bodies.sides(body))
    before = tissue.snapshot()
    results = strokes.make(tissue, UNSUPPORTED[stroke](body))
    assert all(np.isfinite(r.wrench.force).all() for r in results)
    assert max(np.linalg.norm(r.wrench.force) for r in results) > 0.1
    assert tissue.scheme_statistics().n_cut > 0
    assert faults(before, tissue) == []


def test_a_tetrahedron_is_cut_once_and_later_crossings_are_counted():
    mesh = block_of(2, 2, 2)
    tissue = uncut(mesh)
    tissue.incise(upright(mesh), Y)
    first = tissue.scheme_statistics()
    n = tissue.n_tetrahedra
    tissue.incise(upright(mesh, 0.42), Y)
    again = tissue.scheme_statistics()
    assert tissue.n_tetrahedra == n
    assert (again.n_cut, first.n_ignored_crossings) == (first.n_cut, 0)
    assert again.n_ignored_crossings > 0


def test_tetrahedra_with_codes_that_are_not_in_the_table_are_left_whole_and_counted():
    """Two opposite edges of a tetrahedron are cut, by cuts that do not touch."""
    mesh = bodies.unit_tetrahedron()
    tissue = uncut(mesh)
    records = tissue._stages.incision.scheme._records
    records.crossed_at[records.edges_of[0, [0, 4]]] = 0.5  # AB and CD
    tissue.incise([[(0.1, -1.0, 2.0), (0.1, -1.0, 3.0)], [(0.1, 2.0, 2.0), (0.1, 2.0, 3.0)]], Y)
    statistics = tissue.scheme_statistics()
    assert (statistics.n_unsupported, statistics.n_cut) == (1, 0)
    assert tissue.n_tetrahedra == 1


def test_a_tetrahedron_is_split_once_the_blade_has_left_it():
    mesh = block_of(2, 6, 2)
    tissue = uncut(mesh, fixed=bodies.sides(mesh))
    for sweep in strokes.sweeps(strokes.upright(0.008, -0.005, 0.03, -0.01, 0.03)):
        tissue.step(sweep, strokes.DT)
        records = tissue._stages.incision.scheme._records
        split = records.first_child >= 0
        behind = mesh.positions[mesh.tetrahedra[split]][:, :, 1].max(axis=1)
        anchors = tissue._model.interaction.state.anchors
        seeds = anchors.tetrahedron[anchors.state > 0]
        assert not split[[t for t in seeds if t < len(split)]].any()
        assert not len(behind) or behind.max() < sweep.t1.tip[1] + CELL
    assert tissue.scheme_statistics().n_cut > 0
    assert tissue.scheme_statistics().n_waiting > 0


def test_the_point_is_nearly_always_where_it_was_or_next_door():
    """Section 3: "high hit rates"; here of a blade that tissue holds, in steps of 1 ms."""
    mesh = block_of(4, 6, 4)
    tissue = uncut(mesh, fixed=bodies.sides(mesh))
    strokes.make(tissue, strokes.upright(0.0152, -0.005, 0.08, 0.012, 0.045))
    statistics = tissue.scheme_statistics()
    assert statistics.n_local_searches > 100
    assert 0 < statistics.n_global_searches < 0.1 * statistics.n_local_searches


def test_springs_and_masses_are_those_of_the_split_mesh():
    """Each existing edge has a spring; an uncut neighbour keeps its long edges."""
    mesh = block_of(2, 2, 2)
    tissue = uncut(mesh, material=SPRINGS)
    tissue.incise(upright(mesh, depth=0.5), Y)
    body, n = tissue._body, tissue.n_nodes
    kept = [row(tissue._model.elasticity.arrays.springs, i) for i in range(n)]
    masses = body.masses[:n].copy()
    from_scratch = springs_of(body, tissue.material.young_modulus)
    assert kept == [row(from_scratch, i) for i in range(n)]
    np.testing.assert_array_equal(masses, body.masses[:n])
    pairs = {tuple(sorted(p)) for t in body.tetrahedra[: tissue.n_tetrahedra].tolist()
             for i, a in enumerate(t) for p in [(a, b) for b in t[i + 1 :]]}  # fmt: skip
    assert pairs == {(i, j) for i in range(n) for j in kept[i] if i < j}
    assert all(kept[j][i] == spring for i in range(n) for j, spring in kept[i].items())


def test_a_cut_that_exceeds_the_capacity_takes_several_passes():
    mesh = block_of(2, 14, 14)
    tissue = uncut(mesh)
    before = tissue.snapshot()
    tissue.incise(upright(mesh)[[0, -1]], Y)
    statistics = tissue.scheme_statistics()
    assert statistics.n_of_case == {"A": 4 * 196, "B": 2 * 196, "C": 0, "D": 0, "E": 0}
    assert tissue.n_pieces() == 2
    assert faults(before, tissue) == []


def test_an_unknown_scheme_is_refused_by_name():
    with pytest.raises(ValueError, match=r"no scheme 'papre'.*stellar, paper"):
        Tissue(block_of(1, 1, 1), solver=SolverSettings(scheme="papre"))


def test_other_schemes_have_no_such_statistics():
    assert uncut(block_of(1, 1, 1), scheme="stellar").scheme_statistics() is None
