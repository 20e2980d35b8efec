"""Incisions of every kind in bodies of every kind: invariants, and rates of success.

Numbers in names of tests are those of the acceptance tests in the specification.
"""

from functools import partial

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support import bodies, incisions, judged, soundness
from tests.support.incisions import Incision
from tissue import CutSettings, SolverSettings, TetrahedralMesh, Tissue

EXACT = CutSettings(snap=0.0, floor=0.0, guard=0.0, crumb=0.0)
"""Settings that give every crossing a node of its own, so that counts are exact."""

MESHES = {
    "jittered grid": partial(bodies.jittered_grid, 4),
    "Delaunay, 10 degrees": partial(bodies.body_centred, 3),
    "Delaunay, slivers": partial(bodies.with_slivers, 4),
}
GOOD = ("jittered grid", "Delaunay, 10 degrees")


def at_rest(mesh: TetrahedralMesh, quality: CutSettings | None = None) -> Tissue:
    return Tissue(
        mesh, gravity=(0.0, 0.0, 0.0), solver=SolverSettings(cut=quality or CutSettings())
    )


def cut_along(mesh: TetrahedralMesh, *cuts: Incision, quality: CutSettings | None = None) -> Tissue:
    """Return a body cut along these surfaces."""
    tissue = at_rest(mesh, quality)
    for cut in cuts:
        tissue.incise(*cut)
    return tissue


def random_plane(mesh: TetrahedralMesh, seed: int) -> Incision:
    random = np.random.default_rng(seed)
    thin = float(np.ptp(mesh.positions, axis=0).min())
    return incisions.plane(mesh, random.normal(size=3), random.uniform(-0.1, 0.1) * thin)


# Acceptance test 11.


def n_after_plane(mesh: TetrahedralMesh, cut: Incision) -> int:
    """Return the expected count: 4 from a tetrahedron cut with 1 and 3 nodes, 6 from 2 and 2."""
    normal = np.cross(cut.forward[0], cut.edges[0, 1] - cut.edges[0, 0])
    above = (mesh.positions - cut.edges[0, 0]) @ normal > 0.0
    n_above = above[mesh.tetrahedra].sum(axis=1)
    n_a, n_b = np.isin(n_above, (1, 3)).sum(), (n_above == 2).sum()
    return int(len(mesh.tetrahedra) - (n_a + n_b) + 4 * n_a + 6 * n_b)


@pytest.mark.parametrize("mesh_kind", GOOD)
@pytest.mark.parametrize("seed", range(25))
def test_11_a_plane_makes_4_or_6_of_each_tetrahedron_it_crosses(mesh_kind, seed):
    mesh = MESHES[mesh_kind](seed)
    cut = random_plane(mesh, seed)
    tissue = at_rest(mesh, EXACT)
    area = tissue.incise(*cut)
    assert tissue.n_tetrahedra == n_after_plane(mesh, cut)
    assert area == pytest.approx(incisions.area_within(mesh, cut), rel=1e-9)
    assert tissue.n_pieces() == 2


# Acceptance test 12.


class InspectedTissue(judged.WatchedTissue):
    """A tissue that is checked after every cut step that changed it."""

    def __init__(self, mesh: TetrahedralMesh, **options) -> None:
        super().__init__(mesh, **options)
        self.original = self.snapshot()
        self.inspected_state = -1
        self.n_inspected = 0
        self.found: list[str] = []

    def after_cut(self) -> None:
        links = self._body.links[: self.n_tetrahedra]
        state = self.n_tetrahedra + 10**6 * int((links < 0).sum())
        if state != self.inspected_state:
            self.inspected_state = state
            self.n_inspected += 1
            after = self.snapshot()
            self.found += soundness.faults(self.original, after, volume=1e-12, lips_match=False)
            self.found += soundness.link_faults(self._body)


def test_12_the_mesh_is_sound_after_each_of_a_thousand_steps_of_crossing_cuts():
    n_inspected = 0
    for seed in range(24):
        mesh = bodies.jittered_grid(3, seed) if seed % 2 else bodies.body_centred(2, seed)
        tissue = InspectedTissue(
            mesh, positions=judged.out_of_shape(mesh, seed), gravity=(0.0, 0.0, 0.0)
        )
        judged.set_random_velocities(tissue, seed)
        kinds = list(incisions.KINDS)
        for i in range(3):
            kind = kinds[(seed + i) % len(kinds)]
            tissue.incise(*incisions.incision(mesh, kind, 3 * seed + i))
        assert tissue.found == []
        assert tissue.momentum_jump < 1e-12
        n_inspected += tissue.n_inspected
    assert n_inspected >= 1000


# Acceptance test 13.


@pytest.mark.parametrize("mesh_kind", GOOD)
@pytest.mark.parametrize("seed", range(4))
def test_13_after_ten_cuts_the_surface_is_watertight_and_encloses_the_volume(mesh_kind, seed):
    mesh = MESHES[mesh_kind](seed)
    kinds = list(incisions.KINDS)
    tissue = cut_along(
        mesh,
        *(incisions.incision(mesh, kinds[i % len(kinds)], 100 * seed + i) for i in range(10)),
    )
    surface = tissue.surface()
    edges = np.sort(surface.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, n_triangles = np.unique(edges, axis=0, return_counts=True)
    assert (n_triangles % 2 == 0).all()
    assert soundness.is_closed(surface.triangles)
    shell = trimesh.Trimesh(surface.positions, surface.triangles, process=False)
    assert shell.volume == pytest.approx(
        soundness.volumes(mesh.positions, mesh.tetrahedra).sum(), rel=1e-12
    )


# Acceptance test 15.


@pytest.mark.parametrize("mesh_kind", MESHES)
def test_15_a_curved_cut_clean_through_leaves_two_pieces_in_200_of_200_runs(mesh_kind):
    not_in_two = []
    for seed in range(200):
        mesh = MESHES[mesh_kind](seed)
        if cut_along(mesh, incisions.incision(mesh, "curved", seed)).n_pieces() != 2:
            not_in_two.append(seed)
    assert not_in_two == []


@pytest.mark.parametrize("mesh_kind", MESHES)
def test_15_three_planes_that_cross_leave_eight_pieces_in_97_of_100_runs(mesh_kind):
    n = 40
    eight = 0
    for seed in range(n):
        mesh = MESHES[mesh_kind](seed)
        eight += cut_along(mesh, *incisions.crossing_planes(mesh, seed)).n_pieces() == 8
    assert eight >= 0.97 * n


# Acceptance test 16.


def crack(tissue: Tissue) -> np.ndarray:
    """Return the triangles of the cut, each once, with corners merged by rest position."""
    surface = tissue.surface()
    _, corner = np.unique(surface.rest_positions, axis=0, return_inverse=True)
    return np.unique(np.sort(corner.ravel()[surface.triangles[surface.is_cut]], axis=1), axis=0)


def euler_characteristic(triangles: np.ndarray) -> int:
    edges = triangles[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2)
    return len(np.unique(triangles)) - len(np.unique(edges, axis=0)) + len(triangles)


def flat_slit(mesh: TetrahedralMesh, seed: int) -> Incision:
    """Return a flat, nearly upright cut that ends inside the body, with its tip inside."""
    random = np.random.default_rng(seed)
    small = random.uniform(-0.2, 0.2, 3)
    normal = np.array([1.0, *small[:2]]) / np.linalg.norm([1.0, *small[:2]])
    direction = np.array([0.0, 1.0, small[2]])
    direction -= (direction @ normal) * normal
    direction /= np.linalg.norm(direction)
    turn = np.stack([direction, np.cross(normal, direction), normal], axis=1)
    path = np.linspace(-1.5, random.uniform(-0.1, 0.2), incisions.N_POSITIONS)
    return incisions.ruled(mesh, incisions.Shape(path, random.uniform(-0.2, 0.1), 1.5), turn)


SLITS = {
    "default settings, within 10 %": (CutSettings(), 0.10),
    "closer snapping, no guard, within 3 %": (CutSettings(snap=0.1, floor=0.1, guard=0.0), 0.03),
}


@pytest.mark.parametrize("case", SLITS)
def test_16_a_slit_is_a_disk_and_on_average_has_the_area_swept_by_the_blade(case):
    quality, error = SLITS[case]
    disks, ratios = [], []
    for seed in range(40):
        mesh = bodies.jittered_grid(6, seed) if seed % 2 else bodies.body_centred(5, seed)
        cut = flat_slit(mesh, seed)
        tissue = at_rest(mesh, quality)
        ratios.append(tissue.incise(*cut) / incisions.area_within(mesh, cut))
        disks.append(euler_characteristic(crack(tissue)) == 1)
    assert np.mean(disks) >= 0.9
    assert np.mean(ratios) == pytest.approx(1.0, abs=error)


# Acceptance test 17.


def added_again(mesh: TetrahedralMesh, cut: Incision) -> tuple[int, float]:
    """Return the tetrahedra and the share of area that repeating an incision adds."""
    tissue = at_rest(mesh)
    area = tissue.incise(*cut)
    n = tissue.n_tetrahedra
    again = tissue.incise(*cut)
    return tissue.n_tetrahedra - n, again / area


@pytest.mark.parametrize("mesh_kind", GOOD)
def test_17_a_plane_that_is_cut_a_second_time_adds_nothing(mesh_kind):
    for seed in range(50):
        mesh = MESHES[mesh_kind](seed)
        assert added_again(mesh, incisions.incision(mesh, "tilted", seed)) == (0, 0.0)


@pytest.mark.parametrize("kind", ["curved", "back and forth"])
@pytest.mark.parametrize("mesh_kind", GOOD)
def test_17_a_curve_that_is_cut_a_second_time_adds_no_tetrahedra_in_97_of_100_runs(mesh_kind, kind):
    n = 50
    added = [
        added_again(mesh, incisions.incision(mesh, kind, seed))[0]
        for seed, mesh in ((seed, MESHES[mesh_kind](seed)) for seed in range(n))
    ]
    assert np.count_nonzero(added) <= 0.03 * n


@pytest.mark.parametrize("mesh_kind", GOOD)
def test_17_an_edge_that_moves_back_and_forth_on_its_cut_surface_adds_nothing(mesh_kind):
    for seed in range(20):
        mesh = MESHES[mesh_kind](seed)
        cut = incisions.incision(mesh, "curved", seed)
        there_and_back = np.concatenate([np.arange(40), np.arange(40)[::-1], np.arange(60)])
        again = Incision(cut.edges[there_and_back], cut.forward[there_and_back])
        once, thrice = cut_along(mesh, cut), cut_along(mesh, again)
        assert thrice.n_tetrahedra == once.n_tetrahedra
        assert thrice.n_pieces() == once.n_pieces()


# Acceptance test 18.


@pytest.mark.parametrize("mesh_kind", GOOD)
def test_18_no_altitude_falls_below_the_guard_and_the_frequency_grows_6_times_in_five_cuts(
    mesh_kind,
):
    """8 times at most, with a median of 6: the planes cross in the middle of a coarse body."""
    growth = []
    for seed in range(20):
        mesh = MESHES[mesh_kind](seed)
        tissue = at_rest(mesh)
        before = tissue._model.elasticity.frequency_squared
        for i in range(5):
            tissue.incise(*incisions.incision(mesh, list(incisions.KINDS)[i], 10 * seed + i))
        after = tissue.snapshot()
        altitude = soundness.smallest_altitude(after.rest_positions, after.tetrahedra)
        assert altitude >= (1.0 - 1e-9) * CutSettings().guard * tissue.node_size
        growth.append(np.sqrt(tissue._model.elasticity.frequency_squared / before))
    assert np.median(growth) <= 6.0
    assert max(growth) <= 8.0


# Acceptance test 19.


def tetrahedra_at_rest(tissue: Tissue, turn: np.ndarray, shift: np.ndarray) -> set[frozenset]:
    """Return each tetrahedron as the set of its nodes' positions, moved back, in 1e-11 m."""
    body = tissue.snapshot()
    where = np.round((body.rest_positions - shift) @ turn / 1e-11).astype(np.int64)
    return {frozenset(map(tuple, where[nodes].tolist())) for nodes in body.tetrahedra}


def test_19_a_body_and_a_cut_that_are_moved_together_give_the_same_mesh():
    """To 1e-11 m in 0.04 m, except in runs where positions are rounded to different values."""
    same = []
    for seed in range(40):
        mesh = MESHES[GOOD[seed % 2]](seed)
        cut = incisions.incision(mesh, list(incisions.KINDS)[seed % len(incisions.KINDS)], seed)
        random = np.random.default_rng(seed)
        turn, shift = incisions.rotation(random), random.normal(size=3) * 0.1
        moved = mesh._replace(positions=mesh.positions @ turn.T + shift)
        cut_there = Incision(cut.edges @ turn.T + shift, cut.forward @ turn.T)
        here = tetrahedra_at_rest(cut_along(mesh, cut), np.eye(3), np.zeros(3))
        same.append(here == tetrahedra_at_rest(cut_along(moved, cut_there), turn, shift))
    assert np.mean(same) >= 0.95


def test_19_the_mirror_image_of_a_cut_has_the_same_area_and_as_many_tetrahedra():
    mirror = np.array([-1.0, 1.0, 1.0])
    for seed in range(20):
        mesh = MESHES[GOOD[seed % 2]](seed)
        cut = random_plane(mesh, seed)
        image = TetrahedralMesh(mesh.positions * mirror, mesh.tetrahedra[:, [0, 1, 3, 2]])
        tissue, twin = at_rest(mesh, EXACT), at_rest(image, EXACT)
        area = tissue.incise(*cut)
        assert twin.incise(cut.edges * mirror, cut.forward * mirror) == pytest.approx(
            area, rel=1e-9
        )
        assert twin.n_tetrahedra == tissue.n_tetrahedra


# Acceptance test 20.


def test_20_mass_volume_and_momentum_are_unchanged_after_a_hundred_cuts():
    mesh = bodies.jittered_grid(4, 1)
    tissue = judged.WatchedTissue(
        mesh, positions=judged.out_of_shape(mesh, 1), gravity=(0.0, 0.0, 0.0)
    )
    judged.set_random_velocities(tissue, 1)
    before = tissue.snapshot()
    for i in range(100):
        kind = ("slit", "buried", "curved")[i % 3]
        tissue.incise(*incisions.incision(mesh, kind, i))
    verdict = judged.judge(before, tissue, lips_match=False)
    assert verdict.faults == []
    assert max(verdict.mass, verdict.volume) < 1e-12
    assert verdict.momentum < 1e-12
    assert verdict.growth > 5.0


def cuts_of(mesh: TetrahedralMesh, kind: str, seed: int) -> list[Incision]:
    """Return one incision of a kind, or for "crossing" two of any kind that may cross."""
    if kind != "crossing":
        return [incisions.incision(mesh, kind, seed)]
    kinds = list(incisions.KINDS)
    return [incisions.incision(mesh, kinds[(seed + i) % len(kinds)], seed + i) for i in (0, 3)]


@pytest.mark.parametrize("kind", [*incisions.KINDS, "crossing"])
@pytest.mark.parametrize("mesh_kind", MESHES)
def test_random_incisions_leave_a_sound_body(mesh_kind, kind):
    for seed in range(1000, 1010):
        mesh = MESHES[mesh_kind](seed)
        assert judged.incised(mesh, cuts_of(mesh, kind, seed), seed).faults == []


@pytest.mark.parametrize("kind", [*incisions.KINDS, "crossing"])
def test_a_moving_blade_leaves_a_sound_body(kind):
    for mesh_kind in MESHES:
        mesh = MESHES[mesh_kind](7)
        assert judged.cut_by_blade(mesh, cuts_of(mesh, kind, 7)).faults == []


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    st.sampled_from(GOOD),
    st.integers(0, 10**6),
    st.lists(st.tuples(st.sampled_from(list(incisions.KINDS)), st.integers(0, 10**6)), max_size=5),
)
def test_any_sequence_of_incisions_leaves_a_sound_body(mesh_kind, seed, sequence):
    """Including incisions that repeat or cross earlier ones."""
    mesh = MESHES[mesh_kind](seed)
    cuts = [incisions.incision(mesh, kind, seed) for kind, seed in sequence]
    verdict = judged.incised(mesh, cuts, seed)
    assert verdict.faults == []
    assert verdict.n_pieces >= 1


@pytest.mark.skipif(not bodies.FOLDER, reason="SCALPEL_SIM_TEST_MESHES names no folder")
@pytest.mark.parametrize("kind", [*incisions.KINDS, "crossing"])
@pytest.mark.parametrize("file", bodies.FILES)
def test_random_incisions_leave_a_third_party_mesh_sound(file, kind):
    mesh = bodies.third_party_mesh(file)
    assert judged.incised(mesh, cuts_of(mesh, kind, 3), 3).faults == []
