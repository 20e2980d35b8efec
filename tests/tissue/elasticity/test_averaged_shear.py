"""Tetrahedra with averaged shear bend, twist and are pressed as a solid does, on coarse meshes.

References: Saint-Venant's torsion, and hexahedra of 27 nodes (`tests.support.hexahedra`). The
kernels have the stiffness of the matrix here (`tests/system/mechanics/test_mechanics.py`).
"""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import bodies, strokes
from tests.support.hexahedra import Hexahedra, solved
from tests.tissue.solids import LAWS, solid_of
from tissue import Material, SolverSettings, TetrahedralMesh, Tissue, block, lattice_block
from tissue.core.jit import is_compiling
from tissue.elasticity.stiffness_matrix import stiffness_matrix

SOFT = Material(young_modulus=1e5, poisson_ratio=0.45, law="neo_hookean")
MESHES = {"block": block, "lattice": lattice_block}


def cook(unit):
    """Map the unit cube to Cook's membrane, 48 x 44 and 16 x 10 mm [m]."""
    low, high = 44.0 * unit[:, 0], 44.0 + 16.0 * unit[:, 0]
    y = low + (high - low) * unit[:, 1]
    return 1e-3 * np.stack([48.0 * unit[:, 0], y, 10.0 * unit[:, 2]], axis=1)


def bar(unit):
    """Map the unit cube to a bar of 100 x 20 x 20 mm [m]."""
    return unit * np.array([0.1, 0.02, 0.02])


def deflection(stiffness, unit, points, shares, axis):
    """Return how far 1 N along an axis moves the far end of what is clamped at x = 0 [m]."""
    force = np.zeros_like(points)
    force[:, axis] = shares
    u = solved(stiffness, unit[:, 0] < 1e-9, np.zeros_like(points), force)
    return shares @ u[:, axis]


def of_tetrahedra(place, make, cells, material, axis):
    """Return the deflection of tetrahedra."""
    unit, tetrahedra = make(cells, (1.0, 1.0, 1.0))[:2]
    mesh = TetrahedralMesh(place(unit), tetrahedra)
    faces = np.concatenate([tetrahedra[:, s] for s in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))])
    faces = faces[np.isclose(unit[faces, 0], 1.0).all(axis=1)]
    x = mesh.positions[faces]
    areas = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)
    shares = np.bincount(faces.ravel(), np.repeat(areas, 3), len(unit))
    stiffness = stiffness_matrix(mesh, material, element="averaged")
    return deflection(stiffness, unit, mesh.positions, shares / shares.sum(), axis)


def of_hexahedra(place, cells, material, axis):
    """Return the deflection of hexahedra."""
    body = Hexahedra(cells, place)
    stiffness = body.stiffness(material.mu, material.lam)
    return deflection(stiffness, body.unit, body.points, body.face_loads(0), axis)


@pytest.mark.parametrize("make", MESHES.values(), ids=MESHES)
@pytest.mark.parametrize("poisson_ratio", [0.45, 0.49])
def test_cooks_membrane_of_12_cells_deflects_at_least_095(poisson_ratio, make):
    material = replace(SOFT, poisson_ratio=poisson_ratio)
    expected = of_hexahedra(cook, (8, 8, 2), material, 1)
    assert 0.95 <= of_tetrahedra(cook, make, (12, 12, 3), material, 1) / expected <= 1.03


@pytest.mark.parametrize("make", MESHES.values(), ids=MESHES)
def test_a_clamped_bar_of_6_cells_bends_within_3_percent(make):
    expected = of_hexahedra(bar, (20, 4, 4), SOFT, 2)
    assert of_tetrahedra(bar, make, (30, 6, 6), SOFT, 2) == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize(("make", "n", "highest"), [(block, 3, 1.12), (lattice_block, 3, 1.12)])
def test_a_bar_of_three_cells_twists_with_at_most_112_of_saint_venants_torque(make, n, highest):
    side, length, angle = 0.02, 0.1, 0.01
    mesh = make((n, n, 5 * n), (side, side, length))
    z, arm = mesh.positions[:, 2], mesh.positions - side / 2.0
    turned = np.stack([-angle * arm[:, 1], angle * arm[:, 0], 0.0 * z], axis=1)
    turned[z < 1e-9] = 0.0
    stiffness = stiffness_matrix(mesh, SOFT, element="averaged")
    u = solved(stiffness, (z < 1e-9) | (z > length - 1e-9), turned, np.zeros_like(turned)).ravel()
    torque = u @ (stiffness @ u) / angle
    ratio = torque / (0.1406 * SOFT.mu * side**4 * angle / length)
    assert 0.98 <= ratio <= highest


@pytest.mark.parametrize(("make", "highest"), [(block, 1.35), (lattice_block, 1.10)])
def test_a_glued_pad_of_two_layers_at_049_is_pressed_nearly_as_a_solid(make, highest):
    material, height, size = replace(SOFT, poisson_ratio=0.49), 0.01, (0.04, 0.04, 0.01)

    def force(points, stiffness):
        top, held = points[:, 2] > height - 1e-9, points[:, 2] < 1e-9
        motion = np.zeros_like(points)
        motion[top, 2] = -1e-4
        u = solved(stiffness, top | held, motion, np.zeros_like(points)).ravel()
        return u @ (stiffness @ u) / 1e-4

    mesh, solid = make((8, 8, 2), size), Hexahedra((8, 8, 4), lambda unit: unit * np.array(size))
    expected = force(solid.points, solid.stiffness(material.mu, material.lam))
    found = force(mesh.positions, stiffness_matrix(mesh, material, element="averaged"))
    assert 0.98 <= found / expected <= highest


@pytest.mark.parametrize("seed", range(10))
def test_no_motion_but_rigid_ones_is_without_energy(seed):
    """Ten random patches each, whole and with tetrahedra taken out."""
    random = np.random.default_rng(seed)
    for _ in range(10):
        mesh = bodies.jittered(2, int(random.integers(1 << 30)))
        kept = mesh.tetrahedra[random.permutation(len(mesh.tetrahedra))[: random.integers(4, 48)]]
        for part in (mesh, connected(TetrahedralMesh(mesh.positions, kept))):
            own = np.linalg.eigvalsh(stiffness_matrix(part, SOFT, element="plain").toarray())
            found = np.linalg.eigvalsh(stiffness_matrix(part, SOFT, element="averaged").toarray())
            assert (np.abs(found[:6]) < 1e-9 * found[-1]).all()
            assert found[6] > 0.3 * own[6]


def connected(mesh):
    """Return the tetrahedra that share faces with the first one, on nodes of their own."""
    faces = np.sort(mesh.tetrahedra[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]], axis=2)
    kept = {0}
    while True:
        seen = {tuple(face) for t in kept for face in faces[t]}
        more = {t for t in range(len(faces)) if any(tuple(face) in seen for face in faces[t])}
        if more == kept:
            break
        kept = more
    nodes, tetrahedra = np.unique(mesh.tetrahedra[sorted(kept)], return_inverse=True)
    return TetrahedralMesh(mesh.positions[nodes], tetrahedra.reshape(-1, 4))


@pytest.mark.parametrize("name", ["averaged shear", "averaged exponential", "averaged yeoh"])
def test_uniform_strain_gives_the_stress_of_the_law_at_every_node_inside(name):
    """The patch test: forces inside vanish, those outside are as without averages."""
    mesh = bodies.jittered(3, seed=4)
    x = mesh.positions @ (np.eye(3) + np.random.default_rng(1).normal(size=(3, 3)) * 0.1).T
    inside = ((mesh.positions > 1e-6) & (mesh.positions < mesh.positions.max() - 1e-6)).all(axis=1)
    law = LAWS[name]
    own = law.replaced(
        shear_of_nodes=0.0,
        lam_of_tetrahedra=0.0 if law.a != 1.0 else law.mu,
        lam_of_nodes=law.lam_of_nodes - (0.0 if law.a != 1.0 else 0.7 * law.mu),
    )
    forces, expected = solid_of(mesh, law).forces(x), solid_of(mesh, own).forces(x)
    scale = np.abs(expected).max()
    assert np.abs(forces[inside]).max() < 1e-12 * scale
    np.testing.assert_allclose(forces, expected, atol=1e-12 * scale)


def test_tetrahedra_turned_against_each_other_take_their_shear_back():
    """Under random displacements, by hundredths of an element and by half of one."""
    mesh = bodies.jittered(3, seed=4)
    shear = {"lam_of_tetrahedra": 0.0, "lam_of_nodes": 1e-9, "second": 1e-6, "third": 0.0}
    averaged = LAWS["averaged yeoh"].replaced(**shear)
    own = averaged.replaced(shear_of_nodes=0.0)
    size = mesh.positions.max() / 3.0
    random = np.random.default_rng(2).uniform(-size, size, mesh.positions.shape)

    def ratio(share):
        x = mesh.positions + share * random
        return solid_of(mesh, averaged).energy(x) / solid_of(mesh, own).energy(x)

    assert 0.3 < ratio(0.01) < 0.6
    assert 0.85 < ratio(0.5) < 1.0


@pytest.mark.skipif(not is_compiling(), reason="a cut of a block: compiled only")
@pytest.mark.parametrize("law", ["neo_hookean", "exponential"])
def test_a_cut_gives_the_same_bits_with_two_threads_and_after_an_undo(law):
    def cut(threads, undoes):
        mesh = block((4, 4, 3), (0.04, 0.04, 0.03))
        stiffening = {"stiffening": 5.0} if law == "exponential" else {}
        material = Material(law=law, young_modulus=10e3, toughness=10.0, **stiffening)
        solver = SolverSettings(element="averaged", threads=threads, precision="single")
        tissue = Tissue(mesh, material, fixed=bodies.sides(mesh), solver=solver)
        for i, sweep in enumerate(strokes.sweeps(strokes.slanted(mesh))):
            if undoes and i == 60:
                state = tissue.save_state()
                for _ in range(20):
                    tissue.step(None, strokes.DT)
                tissue.load_state(state)
            tissue.step(sweep, strokes.DT)
        after = tissue.snapshot()
        assert tissue.cut_report().now.n_tetrahedra > len(mesh.tetrahedra)
        return after.positions.tobytes() + after.velocities.tobytes()

    once = cut(1, False)
    assert cut(2, False) == once
    assert cut(1, True) == once
