"""The body against the theory of elasticity: 22 to 27 of the engine's acceptance tests, and more.

Small strains are compared with `tissue.stiffness`, whose matrix is held against the engine's own
forces here; so what a fine bar does by the matrix (benchmarks/mesh_study.py) the engine does too.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse.linalg import splu

from benchmarks.mesh_study import MODES, Bar, Model
from tests import bodies
from tissue.material import Material
from tissue.shapes import grid
from tissue.stiffness import stiffness_matrix
from tissue.tissue import Tissue
from tissue.types import TetrahedralMesh
from tissue.validation import signed_volumes

NO_GRAVITY = (0.0, 0.0, 0.0)
UNDAMPED = Material(viscous_damping=0.0, retardation_time=0.0)
LAWS = {
    "springs": UNDAMPED,
    "springs and volume": replace(UNDAMPED, poisson_ratio=0.45),
    "neo-Hookean": replace(UNDAMPED, law="neo_hookean", poisson_ratio=0.45),
}
SOLID = LAWS["neo-Hookean"]
RANDOM = bodies.jittered(4, seed=3)


def forces_at(mesh, positions, material, dt=1e-9):
    """Elastic forces of the engine [N]: the momentum that they give a body in next to no time."""
    tissue = Tissue(mesh, material, positions=positions, gravity=NO_GRAVITY)
    tissue.step(None, dt)
    after = tissue.snapshot()
    return after.masses[:, None] * after.velocities / dt


@pytest.mark.parametrize("material", LAWS.values(), ids=LAWS)
def test_small_forces_are_those_of_the_stiffness_matrix(material):
    u = 1e-6 * np.random.default_rng(0).normal(size=RANDOM.positions.shape)
    found = forces_at(RANDOM, RANDOM.positions + u, material)
    found -= forces_at(RANDOM, RANDOM.positions - u, material)
    wanted = -2.0 * (stiffness_matrix(RANDOM, material) @ u.ravel()).reshape(-1, 3)
    np.testing.assert_allclose(found, wanted, atol=1e-5 * np.abs(wanted).max())


# 22


def test_22_under_an_affine_strain_tetrahedra_inside_are_in_equilibrium():
    gradient = np.array([[1.2, 0.1, 0.0], [0.0, 0.9, 0.2], [0.1, 0.0, 1.1]])
    forces = forces_at(RANDOM, RANDOM.positions @ gradient.T, SOLID)
    inside = np.all((RANDOM.positions > 1e-6) & (RANDOM.positions < 0.04 - 1e-6), axis=1)
    assert inside.sum() > 20
    assert np.abs(forces[inside]).max() < 1e-8 * np.abs(forces).max()


def test_22_a_rod_that_is_pulled_pulls_back_with_youngs_modulus():
    strain, nu = 1e-4, SOLID.poisson_ratio

    def pull(strain):
        stretched = RANDOM.positions * (1.0 + strain * np.array([1.0, -nu, -nu]))
        forces = forces_at(RANDOM, stretched, SOLID)
        return -forces[RANDOM.positions[:, 0] > 0.04 - 1e-9, 0].sum()

    stress = (pull(strain) - pull(-strain)) / (2.0 * strain) / 0.04**2
    assert stress == pytest.approx(SOLID.young_modulus, rel=1e-6)


# 23

DEFLECTION = {
    # nu, cells through the thickness: plain, averaged; tip over Timoshenko's (table 4.4)
    (0.3, 1): (0.22, 0.35),
    (0.3, 2): (0.50, 0.66),
    (0.3, 4): (0.79, 0.875),
    (0.45, 1): (0.11, 0.31),
    (0.45, 2): (0.30, 0.61),
    (0.45, 4): (0.60, 0.84),
    (0.49, 1): (0.04, 0.23),
    (0.49, 2): (0.11, 0.57),
    (0.49, 4): (0.29, 0.82),
}
OF_SPRINGS = (0.39, 0.67, 0.86)


@pytest.mark.parametrize("nu", [0.3, 0.45, 0.49])
@pytest.mark.parametrize("averaged", [False, True], ids=["plain", "averaged"])
def test_23_a_cantilever_bends_the_more_like_a_beam_the_finer_it_is(nu, averaged):
    model = Model("", replace(SOLID, poisson_ratio=nu), averaged)
    found = [Bar(n, model).end_load_ratio() for n in (1, 2, 4)]
    wanted = [DEFLECTION[nu, n][averaged] for n in (1, 2, 4)]
    assert found == pytest.approx(wanted, abs=0.02)
    assert sorted(found) == found


def test_23_springs_bend_the_more_like_a_beam_the_finer_they_are():
    found = [Bar(n, Model("", UNDAMPED)).end_load_ratio() for n in (1, 2, 4)]
    assert found == pytest.approx(OF_SPRINGS, abs=0.02)


def test_23_where_nothing_narrows_sag_and_frequencies_converge_to_beam_theory():
    """Error as the square of the element size: both meshes carried on to none."""
    coarse, fine = (Bar(n, Model("", replace(SOLID, poisson_ratio=0.0))) for n in (3, 6))
    theory = fine.theory()
    found = {mode: (fine.frequencies()[mode], coarse.frequencies()[mode]) for mode in MODES}
    ratios = {mode: (4.0 * f - c) / 3.0 / theory[mode] for mode, (f, c) in found.items()}
    ratios["sag"] = (4.0 * fine.sag_ratio() - coarse.sag_ratio()) / 3.0
    assert ratios == pytest.approx(dict.fromkeys(ratios, 1.0), abs=0.02)


@pytest.mark.parametrize("material", LAWS.values(), ids=LAWS)
def test_23_the_engine_sags_as_the_matrix_says(material):
    """Under a hundredth of gravity, for a sag that is small."""
    bar = Bar(2, Model("", material))
    tissue = Tissue(
        bar.mesh, material, fixed=bar.mesh.positions[:, 0] < 1e-9, gravity=(0.0, 0.0, -0.01)
    )
    tissue.settle()
    after = tissue.snapshot()
    sag = -(after.positions - after.rest_positions)[bar.is_end, 2].mean()
    weight = np.zeros((len(bar.masses), 3))
    weight[:, 2] = -0.01 * bar.masses
    assert sag == pytest.approx(bar.deflection(weight), rel=0.01)


# 24


@pytest.mark.parametrize("nu", [0.3, 0.45])
def test_24_four_cells_through_the_thickness_bend_8_and_stretch_3_percent_too_fast_at_most(nu):
    bar = Bar(4, Model("", replace(SOLID, poisson_ratio=nu)))
    found = bar.frequencies()
    assert found["bending 1"] / bar.euler_bernoulli() == pytest.approx(1.0, abs=0.08)
    assert found["stretching 1"] / bar.theory()["stretching 1"] == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("material", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize(("mode", "axis"), [("bending 1", 2), ("stretching 1", 0)])
def test_24_the_engine_swings_at_the_frequencies_of_the_matrix(material, mode, axis):
    bar = Bar(1, Model("", material))
    rest = bar.mesh.positions
    shape = np.zeros_like(rest)
    along = rest[:, 0] / bar.length
    # What a static end load does, which is nearly the mode; the rest of it is small and fast.
    shape[:, axis] = along**2 * (3.0 - along) / 2.0 if axis == 2 else np.sin(0.5 * np.pi * along)
    small = 1e-3 * bar.thickness * shape
    if axis == 2:
        small[:, 0] = (
            -1e-3
            * bar.thickness
            * (rest[:, 2] - bar.thickness / 2.0)
            / bar.length
            * (3.0 * along - 1.5 * along**2)
        )
    tissue = Tissue(
        bar.mesh, material, fixed=rest[:, 0] < 1e-9, positions=rest + small, gravity=NO_GRAVITY
    )
    period = 1.0 / bar.frequencies()[mode]
    dt, tip = period / 200.0, []
    for _ in range(1200):
        tissue.step(None, dt)
        after = tissue.snapshot()
        tip.append((after.positions - rest)[bar.is_end, axis].mean())
    spectrum = np.abs(np.fft.rfft(np.array(tip) * np.hanning(len(tip)), n=1 << 16))
    found = np.fft.rfftfreq(1 << 16, dt)[spectrum.argmax()]
    assert found == pytest.approx(1.0 / period, rel=0.01)


# 25

QUARTER_TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("material", LAWS.values(), ids=LAWS)
def test_25_a_body_that_is_turned_feels_no_force(material):
    forces = forces_at(RANDOM, RANDOM.positions @ QUARTER_TURN.T, material)
    assert np.abs(forces).max() < 1e-9 * material.young_modulus * 0.01**2


@pytest.mark.parametrize("seed", range(3))
def test_25_nodes_thrown_anywhere_in_the_block_find_their_places_again(seed):
    material = replace(SOLID, viscous_damping=20.0, retardation_time=2e-4)
    mesh = grid((3, 3, 3), (0.03, 0.03, 0.03))
    tissue = Tissue(
        mesh,
        material,
        positions=np.random.default_rng(seed).uniform(0.0, 0.03, mesh.positions.shape),
        gravity=NO_GRAVITY,
    )
    for _ in range(200):
        tissue.step(None, 0.01)
    after = tissue.snapshot()
    volumes = signed_volumes(after.positions, after.tetrahedra)
    np.testing.assert_allclose(volumes, signed_volumes(*mesh), rtol=0.05)


# 27


def slit_compliance(n):
    """How far the lips of a slit in a cube give way to a pressure between them, per pressure."""
    size = 0.04
    mesh = grid((n, n, n), (size, size, size))
    tissue = Tissue(mesh, SOLID, gravity=NO_GRAVITY)
    tips = [(size / 2.0, share * size, size / 2.0) for share in (0.25, 0.75)]
    tissue.incise([[tip, (tip[0], tip[1], 1.1 * size)] for tip in tips], (0.0, 1.0, 0.0))
    cut, surface = tissue.snapshot(), tissue.surface()
    assert tissue.n_pieces() == 1
    lips = surface.rest_positions[surface.triangles[surface.is_cut]]
    normals = np.cross(lips[:, 1] - lips[:, 0], lips[:, 2] - lips[:, 0]) / 2.0
    assert np.abs(normals).sum() == pytest.approx(2.0 * size**2 / 4.0, rel=1e-9)
    # A triangle of the surface has the nodes of the body in the same places on the same side.
    forces = np.zeros_like(cut.positions)
    centres = cut.rest_positions[cut.tetrahedra].mean(axis=1)
    side = np.zeros(len(cut.positions))
    side[cut.tetrahedra] = np.sign(centres[:, 0] - size / 2.0)[:, None]
    for triangle, normal in zip(lips, normals, strict=True):
        for corner in triangle:
            at = np.all(np.abs(cut.rest_positions - corner) < 1e-9, axis=1)
            own = at & ((side == -np.sign(normal[0])) | (at.sum() == 1))
            forces[own] -= normal / 3.0
    body = TetrahedralMesh(cut.rest_positions, cut.tetrahedra)
    free = np.repeat(cut.rest_positions[:, 2] > 1e-9, 3)
    matrix = stiffness_matrix(body, SOLID)[free][:, free].tocsc()
    load = forces.ravel()[free]
    return float(load @ splu(matrix).solve(load))


def test_27_a_slit_gives_way_as_much_on_a_mesh_twice_as_fine():
    assert slit_compliance(16) == pytest.approx(slit_compliance(8), rel=0.12)
