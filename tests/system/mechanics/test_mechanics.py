"""The body against the theory of elasticity: acceptance tests 22 to 27, and more.

Small strains are compared with `tissue.elasticity.stiffness_matrix`. The matrix is compared here
with the engine's own forces, so its results for fine bars (`python -m benchmarks mesh-study`) hold
for the engine too.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import diags_array
from scipy.sparse.linalg import cg

from benchmarks.studies.mesh_study import MODES, Bar, Model
from tests.support import bodies
from tests.support.materials import SPRINGS
from tissue import SolverSettings, TetrahedralMesh, Tissue, block
from tissue.elasticity.stiffness_matrix import stiffness_matrix
from tissue.mesh.faces import sorted_faces
from tissue.mesh.validation import signed_volumes

NO_GRAVITY = (0.0, 0.0, 0.0)
UNDAMPED = replace(SPRINGS, viscous_damping=0.0, retardation_time=0.0)
LAWS = {
    "springs": UNDAMPED,
    "springs and volume": replace(UNDAMPED, poisson_ratio=0.45),
    "neo-Hookean": replace(UNDAMPED, law="neo_hookean", poisson_ratio=0.45),
    "exponential": replace(UNDAMPED, law="exponential", poisson_ratio=0.45, stiffening=15.0),
    "yeoh": replace(UNDAMPED, law="yeoh", poisson_ratio=0.45, yeoh_second=2.0),
}
SOLID = LAWS["neo-Hookean"]
RANDOM = bodies.jittered(4, seed=3)


def forces_at(mesh, positions, material, dt=1e-9):
    """Return the elastic forces of the engine, from the momentum gained in a tiny step [N]."""
    tissue = Tissue(mesh, material, positions=positions, gravity=NO_GRAVITY)
    tissue.step(None, dt)
    after = tissue.snapshot()
    return after.masses[:, None] * after.velocities / dt


@pytest.mark.parametrize("material", LAWS.values(), ids=LAWS)
def test_small_forces_are_those_of_the_stiffness_matrix(material):
    u = 1e-7 * np.random.default_rng(0).normal(size=RANDOM.positions.shape)
    found = forces_at(RANDOM, RANDOM.positions + u, material)
    found -= forces_at(RANDOM, RANDOM.positions - u, material)
    expected = -2.0 * (stiffness_matrix(RANDOM, material) @ u.ravel()).reshape(-1, 3)
    np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


# Acceptance test 22.


# Acceptance test 23.

DEFLECTION = {
    # nu: for 1, 2 and 4 cells through the thickness; deflection of the end over that of
    # Timoshenko's beam
    0.3: ((0.222, 0.504, 0.786), (0.351, 0.664, 0.875), (0.782, 1.042, 1.021)),
    0.45: ((0.113, 0.300, 0.595), (0.314, 0.613, 0.843), (0.620, 0.979, 0.996)),
    0.49: ((0.041, 0.108, 0.288), (0.228, 0.570, 0.822), (0.409, 0.915, 0.980)),
}
"""Deflections with linear tetrahedra, with the bulk modulus averaged over nodes, and with a share
of the shear as well. The law of Smith, de Goes and Kim averages a sixth of the shear modulus with
the bulk modulus, and is softer by up to 0.02."""

ELEMENTS = {
    "linear": {"averaged": False, "element": "plain"},
    "plain": {"averaged": True, "element": "plain"},
    "averaged": {"averaged": True, "element": "averaged"},
}

SPRING_DEFLECTION = (0.39, 0.67, 0.86)


@pytest.mark.parametrize("nu", [0.3, 0.45, 0.49])
@pytest.mark.parametrize("element", ELEMENTS)
def test_23_a_cantilever_bends_more_like_a_beam_on_a_finer_mesh(nu, element):
    model = Model("", replace(SOLID, poisson_ratio=nu), **ELEMENTS[element])
    found = [Bar(n, model).end_load_ratio() for n in (1, 2, 4)]
    expected = dict(zip(ELEMENTS, DEFLECTION[nu], strict=True))[element]
    assert found == pytest.approx(expected, abs=0.02)
    errors = np.abs(np.array(found) - 1.0)
    assert (np.diff(errors) < 0.0).all()


def test_23_springs_bend_more_like_a_beam_on_a_finer_mesh():
    found = [Bar(n, Model("", UNDAMPED)).end_load_ratio() for n in (1, 2, 4)]
    assert found == pytest.approx(SPRING_DEFLECTION, abs=0.02)


def test_23_at_poissons_ratio_0_sag_and_frequencies_converge_to_beam_theory():
    """Richardson extrapolation: the error is proportional to the square of the element size."""
    coarse, fine = (Bar(n, Model("", replace(SOLID, poisson_ratio=0.0))) for n in (3, 6))
    theory = fine.theory()
    found = {mode: (fine.frequencies()[mode], coarse.frequencies()[mode]) for mode in MODES}
    ratios = {mode: (4.0 * f - c) / 3.0 / theory[mode] for mode, (f, c) in found.items()}
    ratios["sag"] = (4.0 * fine.sag_ratio() - coarse.sag_ratio()) / 3.0
    assert ratios == pytest.approx(dict.fromkeys(ratios, 1.0), abs=0.025)


@pytest.mark.parametrize("material", LAWS.values(), ids=LAWS)
def test_23_the_sag_of_the_engine_is_that_of_the_matrix(material):
    """The material is stiff enough for a small sag: 1 % of the thickness."""
    material = replace(material, young_modulus=2e6)
    bar = Bar(2, Model("", material, element="averaged"))
    tissue = Tissue(bar.mesh, material, fixed=bar.mesh.positions[:, 0] < 1e-9)
    tissue.settle()
    after = tissue.snapshot()
    sag = -(after.positions - after.rest_positions)[bar.is_end, 2].mean()
    weight = np.zeros((len(bar.masses), 3))
    weight[:, 2] = -9.81 * bar.masses
    assert sag == pytest.approx(bar.deflection(weight), rel=0.01)


# Acceptance test 24.


@pytest.mark.parametrize("nu", [0.3, 0.45])
def test_24_with_four_cells_bending_is_at_most_8_and_stretching_3_percent_too_fast(nu):
    bar = Bar(4, Model("", replace(SOLID, poisson_ratio=nu)))
    found = bar.frequencies()
    assert found["bending 1"] / bar.euler_bernoulli() == pytest.approx(1.0, abs=0.08)
    assert found["stretching 1"] / bar.theory()["stretching 1"] == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("material", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("kind", ["bending", "torsion", "stretching"])
def test_24_the_engine_oscillates_at_the_frequencies_of_the_matrix(material, kind):
    bar = Bar(1, Model("", material, element="averaged"))
    mode = next(mode for mode in bar.modes if mode.kind == kind)
    rest = bar.mesh.positions
    tissue = Tissue(
        bar.mesh,
        material,
        fixed=rest[:, 0] < 1e-9,
        positions=rest + 1e-3 * bar.thickness * mode.motion,
        gravity=NO_GRAVITY,
    )
    n_periods = 0.3  # of the mode; the displacement is then the cosine of their phase
    tissue.step(None, n_periods / mode.frequency)
    now = (tissue.snapshot().positions - rest).ravel() @ mode.motion.ravel()
    share = now / (1e-3 * bar.thickness * np.sum(mode.motion**2))
    assert np.arccos(share) / (2.0 * np.pi) == pytest.approx(n_periods, rel=0.01)


# Acceptance test 25.


@pytest.mark.parametrize(
    ("relaxation", "frame"), [("global", 1e-3), ("global", 1e-2), ("verlet", 1e-3)]
)
@pytest.mark.parametrize("mesh", [block((3, 3, 3), (0.03,) * 3), RANDOM], ids=["cells", "random"])
def test_25_a_block_recovers_from_random_node_positions(mesh, frame, relaxation):
    """Within 2 s, in as many steps per frame as stability needs."""
    size = mesh.positions.max()
    tissue = Tissue(
        mesh,
        replace(SOLID, viscous_damping=20.0, retardation_time=2e-4),
        positions=np.random.default_rng(25).uniform(0.0, size, mesh.positions.shape),
        gravity=NO_GRAVITY,
        solver=SolverSettings(relaxation=relaxation),
    )
    for _ in range(round(2.0 / frame)):
        tissue.step(None, frame)
    after = tissue.snapshot()
    volumes = signed_volumes(after.positions, after.tetrahedra)
    np.testing.assert_allclose(volumes, signed_volumes(*mesh[:2]), rtol=0.05)


# Acceptance test 26.


def dead_load(mesh, before):
    """Return unit total force on the nodes of the right side of `before`, in proportion to area."""
    faces = sorted_faces(before.tetrahedra)
    outer = faces.halves[faces.starts[faces.counts == 1]]
    load = np.zeros_like(mesh.positions)
    for t, k in zip(*divmod(outer, 4), strict=True):
        nodes = np.delete(before.tetrahedra[t], k)
        a, b, c = before.positions[nodes]
        if min(a[0], b[0], c[0]) > before.positions[:, 0].max() - 1e-9:
            load[nodes, 0] += np.linalg.norm(np.cross(b - a, c - a)) / 6.0
    return load / load.sum()


def compliance_of(mesh, load, material, averaged=True):
    """Return the displacement along the load, per load, of a body held on the left [m/N]."""
    free = np.repeat(mesh.positions[:, 0] > 1e-9, 3)
    matrix = stiffness_matrix(mesh, material, averaged=averaged)[free][:, free]
    force = load.ravel()[free]
    motion, left = cg(matrix, force, rtol=1e-8, M=diags_array(1.0 / matrix.diagonal()))
    assert left == 0
    return float(force @ motion)


# Acceptance test 27.


def slit_compliance(n):
    """Return the compliance of a cube with a slit half through it, pulled across the slit [m/N].

    The cube is held on the left and pulled to the right; the engine cuts the slit from above.
    """
    size = 0.04
    mesh = block((n, n, n), (size, size, size))
    tissue = Tissue(mesh, SOLID, gravity=NO_GRAVITY)
    tips = [(size / 2.0, y, size / 2.0) for y in (-0.1 * size, 1.1 * size)]
    area = tissue.incise([[tip, (tip[0], tip[1], 1.1 * size)] for tip in tips], (0.0, 1.0, 0.0))
    assert area == pytest.approx(size**2 / 2.0, rel=1e-9)
    cut = tissue.snapshot()
    body = TetrahedralMesh(cut.rest_positions, cut.tetrahedra)
    return compliance_of(body, dead_load(body, mesh), SOLID)


def test_27_the_compliance_with_a_slit_is_the_same_on_a_mesh_twice_as_fine():
    assert slit_compliance(16) == pytest.approx(slit_compliance(8), rel=0.12)


# Large deformations.


@pytest.mark.parametrize("law", ["springs and volume", "neo-Hookean"])
def test_a_slender_tower_bends_under_a_sudden_newton_and_comes_to_rest(law):
    """10 x 10 x 60 mm: it bends by its own length, and oscillates. The whole newton acts at once,
    sideways, distributed over its mass. Springs alone would invert."""
    mesh = block((2, 2, 12), (0.01, 0.01, 0.06))
    material = replace(LAWS[law], young_modulus=300e3, viscous_damping=20.0)
    tissue = Tissue(
        mesh,
        material,
        fixed=mesh.positions[:, 2] < 1e-9,
        gravity=(1.0 / (material.density * 0.01 * 0.01 * 0.06), 0.0, 0.0),
    )
    top = mesh.positions[:, 2] > 0.06 - 1e-9
    deflection = []
    for _ in range(1000):
        tissue.step(None, 1e-3)
        now = tissue.snapshot()
        deflection.append(now.positions[top, 0].mean() - 0.005)
        assert (signed_volumes(now.positions, now.tetrahedra) > 0.3 * 0.005**3 / 6.0).all()
    assert max(deflection) > 0.05
    assert np.ptp(deflection[-100:]) < 1e-3


@pytest.mark.parametrize(
    ("material", "height"),
    [
        (replace(UNDAMPED, poisson_ratio=0.35), 0.7),
        (replace(UNDAMPED, poisson_ratio=0.45), 0.5),
        (SOLID, 0.6),
    ],
    ids=["springs, 0.35", "springs, 0.45", "tetrahedra"],
)
@pytest.mark.parametrize("mesh", [block((4, 4, 4), (0.04,) * 3), RANDOM], ids=["cells", "random"])
def test_no_tetrahedron_inverts_in_a_compressed_block(mesh, material, height):
    assert volumes_in_a_press(mesh, material, height).min() > 0.0


def volumes_in_a_press(mesh, material, height):
    """Return the volumes of the tetrahedra of a block between two plates, over those at rest."""
    z = mesh.positions[:, 2]
    tissue = Tissue(
        mesh,
        replace(material, viscous_damping=20.0),
        fixed=(z < 1e-9) | (z > z.max() - 1e-9),
        positions=mesh.positions * [1.0, 1.0, height],
        gravity=NO_GRAVITY,
    )
    tissue.settle()
    after = tissue.snapshot()
    return signed_volumes(after.positions, after.tetrahedra) / signed_volumes(*mesh[:2])
