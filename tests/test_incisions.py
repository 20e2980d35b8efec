"""Incisions of every kind in bodies of every kind: what must hold, and how often the rest does.

Numbers in names of tests refer to the acceptance tests that the design was written with.
"""

import os
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import trimesh

from tests import bodies, incisions, judged, soundness
from tests.incisions import Incision
from tissue.mesh_io import read_mesh
from tissue.tissue import CutQuality, Tissue
from tissue.types import TetrahedralMesh
from tissue.validation import checked

EXACT = CutQuality(snap=0.0, floor=0.0, guard=0.0, crumb=0.0)
"""Every crossing gets its own node: what is cut can be counted."""

MADE = {
    "jittered grid": partial(bodies.jittered_grid, 4),
    "Delaunay, 10 degrees": partial(bodies.body_centred, 3),
    "Delaunay, slivers": partial(bodies.with_slivers, 4),
}
GOOD = ("jittered grid", "Delaunay, 10 degrees")

FOLDER = os.environ.get("SCALPEL_SIM_TEST_MESHES")
FILES = {  # and their unit of length, in metres: organs of about 0.1 m
    "sofa_liver.msh": 0.01,
    "sofa_truthcylinder1.msh": 0.005,
    "bullet_banana.vtk": 1.0,
    "sofaenv_tissue_volume.msh": 1.0,
}


def at_rest(mesh: TetrahedralMesh, quality: CutQuality | None = None) -> Tissue:
    return Tissue(mesh, gravity=(0.0, 0.0, 0.0), quality=quality)


def cut_along(mesh: TetrahedralMesh, *cuts: Incision, quality: CutQuality | None = None) -> Tissue:
    """Return the body after those cuts."""
    tissue = at_rest(mesh, quality)
    for cut in cuts:
        tissue.incise(*cut)
    return tissue


def random_plane(mesh: TetrahedralMesh, seed: int) -> Incision:
    random = np.random.default_rng(seed)
    thin = float(np.ptp(mesh.positions, axis=0).min())
    return incisions.plane(mesh, random.normal(size=3), random.uniform(-0.1, 0.1) * thin)


# 11


def n_after_plane(mesh: TetrahedralMesh, cut: Incision) -> int:
    """Four tetrahedra of each that has one node on its own side of a plane, six of two and two."""
    normal = np.cross(cut.forward[0], cut.edges[0, 1] - cut.edges[0, 0])
    above = (mesh.positions - cut.edges[0, 0]) @ normal > 0.0
    n_above = above[mesh.tetrahedra].sum(axis=1)
    n_a, n_b = np.isin(n_above, (1, 3)).sum(), (n_above == 2).sum()
    return int(len(mesh.tetrahedra) - (n_a + n_b) + 4 * n_a + 6 * n_b)


@pytest.mark.parametrize("made", GOOD)
@pytest.mark.parametrize("seed", range(25))
def test_11_a_plane_makes_4_or_6_of_each_tetrahedron_it_crosses(made, seed):
    mesh = MADE[made](seed)
    cut = random_plane(mesh, seed)
    tissue = at_rest(mesh, EXACT)
    area = tissue.incise(*cut)
    assert tissue.n_tetrahedra == n_after_plane(mesh, cut)
    assert area == pytest.approx(incisions.area_within(mesh, cut), rel=1e-9)
    assert tissue.n_pieces() == 2


# 12


class InspectedTissue(judged.WatchedTissue):
    """A tissue that is looked at after every cut step that changed it."""

    def __init__(self, mesh: TetrahedralMesh, **options) -> None:
        super().__init__(mesh, **options)
        self.whole = self.snapshot()
        self.looked_at = -1
        self.n_looks = 0
        self.found: list[str] = []

    def _cut(self, one_pass) -> None:
        super()._cut(one_pass)
        links = self._body.links[: self.n_tetrahedra]
        state = self.n_tetrahedra + 10**6 * int((links < 0).sum())
        if state != self.looked_at:
            self.looked_at = state
            self.n_looks += 1
            after = self.snapshot()
            self.found += soundness.faults(self.whole, after, volume=1e-12, lips_match=False)
            self.found += soundness.link_faults(self._body)


def test_12_the_mesh_is_sound_after_each_of_a_thousand_steps_of_cuts_that_cross():
    n_looks = 0
    for seed in range(24):
        mesh = bodies.jittered_grid(3, seed) if seed % 2 else bodies.body_centred(2, seed)
        tissue = InspectedTissue(
            mesh, positions=judged.out_of_shape(mesh, seed), gravity=(0.0, 0.0, 0.0)
        )
        judged.moving(tissue, seed)
        kinds = list(incisions.KINDS)
        for i in range(3):
            kind = kinds[(seed + i) % len(kinds)]
            tissue.incise(*incisions.incision(mesh, kind, 3 * seed + i))
        assert tissue.found == []
        assert tissue.momentum_jump < 1e-12
        n_looks += tissue.n_looks
    assert n_looks >= 1000


# 13


@pytest.mark.parametrize("made", GOOD)
@pytest.mark.parametrize("seed", range(4))
def test_13_after_ten_cuts_the_surface_is_watertight_and_holds_the_volume(made, seed):
    mesh = MADE[made](seed)
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


# 15


@pytest.mark.parametrize("made", MADE)
def test_15_a_curved_cut_clean_through_leaves_two_pieces_in_200_of_200_runs(made):
    whole = []
    for seed in range(200):
        mesh = MADE[made](seed)
        if cut_along(mesh, incisions.incision(mesh, "curved", seed)).n_pieces() != 2:
            whole.append(seed)
    assert whole == []


@pytest.mark.parametrize("made", MADE)
def test_15_three_planes_that_cross_leave_eight_pieces_in_97_of_100_runs(made):
    n = 40
    eight = 0
    for seed in range(n):
        mesh = MADE[made](seed)
        eight += cut_along(mesh, *incisions.crossing_planes(mesh, seed)).n_pieces() == 8
    assert eight >= 0.97 * n


# 16


def crack(tissue: Tissue) -> np.ndarray:
    """Return the triangles that a cut opened, each once, its corners named by where they rest."""
    surface = tissue.surface()
    _, corner = np.unique(surface.rest_positions, axis=0, return_inverse=True)
    return np.unique(np.sort(corner.ravel()[surface.triangles[surface.is_cut]], axis=1), axis=0)


def euler_characteristic(triangles: np.ndarray) -> int:
    edges = triangles[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2)
    return len(np.unique(triangles)) - len(np.unique(edges, axis=0)) + len(triangles)


def flat_slit(mesh: TetrahedralMesh, seed: int) -> Incision:
    """Return a flat cut, upright but for some degrees, that ends inside with its tip inside."""
    random = np.random.default_rng(seed)
    small = random.uniform(-0.2, 0.2, 3)
    normal = np.array([1.0, *small[:2]]) / np.linalg.norm([1.0, *small[:2]])
    way = np.array([0.0, 1.0, small[2]])
    way -= (way @ normal) * normal
    way /= np.linalg.norm(way)
    turn = np.stack([way, np.cross(normal, way), normal], axis=1)
    ways = np.linspace(-1.5, random.uniform(-0.1, 0.2), incisions.N_PLACES)
    return incisions.ruled(mesh, incisions.Shape(ways, random.uniform(-0.2, 0.1), 1.5), turn)


@pytest.mark.parametrize(("snap", "error"), [(0.1, 0.03), (0.3, 0.10)])
def test_16_a_slit_is_a_disk_of_the_area_that_the_blade_swept(snap, error):
    disks, ratios = [], []
    for seed in range(40):
        mesh = bodies.jittered_grid(6, seed) if seed % 2 else bodies.body_centred(5, seed)
        cut = flat_slit(mesh, seed)
        tissue = at_rest(mesh, CutQuality(snap=snap, floor=snap))
        ratios.append(tissue.incise(*cut) / incisions.area_within(mesh, cut))
        disks.append(euler_characteristic(crack(tissue)) == 1)
    assert np.mean(disks) >= 0.9
    assert np.mean(ratios) == pytest.approx(1.0, abs=error)
