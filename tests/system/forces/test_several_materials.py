"""Cuts through bodies of several materials: the force of each, labels, masses and states."""

import numpy as np
import pytest

from tests.support import bodies, incisions, strokes
from tests.support.bodies import sides
from tissue import BladeShape, Energies, Material, SolverSettings, TetrahedralMesh, Tissue, block
from tissue.mesh.validation import signed_volumes

SIZE = np.array([0.04, 0.04, 0.02])
CELL = 0.005
X, SPEED = 0.0187, 0.1
SOFT = Material(young_modulus=30e3, toughness=20.0)
TOUGH = Material(young_modulus=60e3, toughness=60.0, density=1200.0)
NO_GRAVITY = (0.0, 0.0, 0.0)


def labelled(axis: int, border: float, cells: float = CELL) -> TetrahedralMesh:
    """Return a block whose label is 1 beyond a border along an axis."""
    mesh = block(np.rint(SIZE / cells).astype(int), SIZE)
    middles = mesh.positions[mesh.tetrahedra].mean(axis=1)
    return mesh._replace(labels=(middles[:, axis] > border).astype(np.int64))


BOTH = {None: SOFT, 1: TOUGH}


def drawn(
    mesh: TetrahedralMesh, materials=BOTH, **options
) -> tuple[Energies, np.ndarray, np.ndarray]:
    """Draw an upright edge along y through a body; return energies, places of it, and forces."""
    solver = SolverSettings(audit=True)
    where = {"fixed": sides(mesh), "gravity": NO_GRAVITY, "solver": solver}
    tissue = Tissue(mesh, materials, **where | options)
    poses = strokes.upright(X, -0.004, 0.044, -0.004, 0.026, SPEED)
    results = strokes.make(tissue, poses)
    return (
        results[-1].energies,
        np.array([pose.tip[1] for pose in poses[1:]]),
        -np.array([result.wrench.force[1] for result in results]),
    )


def test_two_layers_beneath_each_other_cost_the_sum_of_toughness_times_depth():
    _, y, force = drawn(labelled(2, 0.01))
    steady = force[(y > 0.015) & (y < 0.03)].mean()
    assert steady == pytest.approx((20.0 + 60.0) * 0.01, rel=0.05)


@pytest.mark.parametrize("border", [0.0175, 0.02, 0.0225])
def test_the_force_steps_at_the_border_within_an_element(border):
    """The border is jagged by a cell: labels are of whole tetrahedra."""
    energies, y, force = drawn(labelled(1, border))
    before, after = (force[(y > a) & (y < b)].mean() for a, b in ((0.008, 0.013), (0.028, 0.036)))
    assert before == pytest.approx(20.0 * SIZE[2], rel=0.05)
    assert after == pytest.approx(60.0 * SIZE[2], rel=0.05)
    passed = y[force > 0.5 * (before + after)][0]
    assert abs(passed - border) < CELL
    assert abs(energies.residual) < 0.02 * energies.work_of_blade


def test_each_label_is_tougher_at_speed_by_its_own_law():
    at_speed = SOFT.changed(toughness_exponent=0.5, toughness_speed=SPEED / 4.0)
    energies, y, force = drawn(labelled(1, 0.02), {0: SOFT, 1: at_speed})
    before, after = (force[(y > a) & (y < b)].mean() for a, b in ((0.008, 0.013), (0.028, 0.036)))
    assert before == pytest.approx(20.0 * SIZE[2], rel=0.05)
    assert after == pytest.approx((1.0 + 4.0**0.5) * 20.0 * SIZE[2], rel=0.05)
    assert abs(energies.residual) < 0.02 * energies.work_of_blade


def test_the_blade_rubs_on_each_label_with_its_own_friction():
    """A blade that is wholly within a label is dragged as in a body of that label alone."""
    rough = SOFT.changed(blade_friction=0.5, blade_viscosity=2000.0)
    within, mesh = ((0.008, 0.013), (0.03, 0.036)), labelled(1, 0.02)
    bodies_of = (SOFT, rough, {0: SOFT, 1: rough})
    blade = BladeShape(thickness=1e-3, height=4e-3)
    runs = [drawn(mesh, each, blade=blade) for each in bodies_of]
    (_, y, force), forces = runs[2], [run[2] for run in runs]
    for label, (low, high) in enumerate(within):
        at = (y > low) & (y < high)
        assert force[at].mean() == pytest.approx(forces[label][at].mean(), rel=0.02)
    assert forces[1][at].mean() > 1.1 * forces[0][at].mean()


@pytest.mark.parametrize("scheme", ["stellar", "paper"])
def test_children_have_the_label_and_the_mass_of_their_parent(scheme):
    mesh = bodies.jittered(3, 5)
    labels = np.arange(len(mesh.tetrahedra)) % 3
    tissue = Tissue(
        mesh._replace(labels=labels),
        {0: SOFT, 1: TOUGH, 2: TOUGH.changed(density=2000.0)},
        solver=SolverSettings(scheme=scheme, mass_scaling=None),
    )
    volumes = signed_volumes(mesh.positions, mesh.tetrahedra)
    expected = [volumes[labels == label].sum() for label in range(3)]
    for seed in range(6 if scheme == "stellar" else 1):
        kind = list(incisions.KINDS)[seed % len(incisions.KINDS)]
        tissue.incise(*incisions.incision(mesh, kind, seed))
    body = tissue.snapshot()
    assert len(body.tetrahedra) > len(mesh.tetrahedra)
    now = signed_volumes(body.rest_positions, body.tetrahedra)
    found = [now[tissue.labels() == label].sum() for label in range(3)]
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    density = np.array([1000.0, 1200.0, 2000.0])
    assert body.masses.sum() == pytest.approx(density @ expected, rel=1e-12)


def test_a_factor_gives_the_body_that_is_made_of_the_material():
    mesh = labelled(2, 0.01)
    stiff = SOFT.changed(young_modulus=2.0 * 30e3, density=1500.0, toughness=40.0)
    where = {"fixed": sides(mesh), "solver": SolverSettings(audit=True)}
    made = Tissue(mesh, {0: SOFT, 1: stiff}, **where)
    changed = Tissue(mesh, SOFT, **where)
    changed.set_material(1, young_modulus=2.0, density=1.5, toughness=2.0)
    poses = strokes.upright(X, -0.004, 0.012, -0.004, 0.026, SPEED)
    for tissue in (made, changed):
        strokes.make(tissue, poses)
    np.testing.assert_array_equal(made.snapshot().positions, changed.snapshot().positions)


def test_a_state_carries_the_materials():
    mesh = labelled(2, 0.01)
    where = {"fixed": sides(mesh)}
    tissue, other = (Tissue(mesh, {None: SOFT, 1: TOUGH}, **where) for _ in range(2))
    poses = strokes.upright(X, -0.004, 0.01, -0.004, 0.026, SPEED)
    before = tissue.save_state()
    tissue.set_material(None, young_modulus=np.linspace(0.7, 1.4, len(mesh.tetrahedra)))
    changed = tissue.save_state()
    strokes.make(tissue, poses)
    after = tissue.snapshot().positions
    for state in (changed, type(changed).from_bytes(changed.to_bytes())):
        one = tissue if state is changed else other
        one.load_state(state)
        strokes.make(one, poses)
        np.testing.assert_array_equal(one.snapshot().positions, after)
    tissue.load_state(before)
    strokes.make(tissue, poses)
    assert not np.array_equal(tissue.snapshot().positions, after)


def test_materials_that_do_not_go_together_are_refused():
    mesh = labelled(2, 0.01)
    with pytest.raises(ValueError, match="label 1 has law exponential and the rest"):
        Tissue(mesh, {0: SOFT, 1: Material(law="exponential", stiffening=5.0)})
    springs = SOFT.changed(law="springs")
    with pytest.raises(ValueError, match=r"label 1 has retardation_time 0\.001"):
        Tissue(mesh, {0: springs, 1: springs.changed(retardation_time=1e-3)})
    with pytest.raises(ValueError, match="no material is given for label 0"):
        Tissue(mesh, {1: SOFT})
    with pytest.raises(ValueError, match="no tetrahedron has label 'vessel'; there is 0, 1"):
        Tissue(mesh, {None: SOFT, "vessel": SOFT})
    tissue = Tissue(mesh, SOFT)
    for where, factors, message in (
        (3, {"density": 2.0}, "no tetrahedron has label 3"),
        (1, {"poisson_ratio": 2.0}, "poisson_ratio is no quantity"),
        (1, {"density": -1.0}, "the factor of density must be finite and positive"),
        (np.zeros(3, bool), {"density": 2.0}, "where has shape"),
    ):
        with pytest.raises(ValueError, match=message):
            tissue.set_material(where, **factors)


@pytest.mark.parametrize(
    "factors", [{"young_modulus": 1.3, "density": 0.8}, {"toughness": 0.6, "friction": 1.5}]
)
@pytest.mark.parametrize("materials", [SOFT, BOTH], ids=["one material", "two materials"])
def test_factors_of_an_episode_leave_nothing_to_the_next(materials, factors):
    """However often: what a cut in a changed body has written is gone with the state."""
    mesh, where = labelled(2, 0.01), {"fixed": sides(labelled(2, 0.01))}
    poses = strokes.upright(X, -0.004, 0.02, -0.004, 0.026, SPEED)

    def cut(tissue):
        strokes.make(tissue, poses)
        return tissue.snapshot().positions

    fresh, tissue = (Tissue(mesh, materials, **where) for _ in range(2))
    fresh.set_material(None, **factors)
    changed, start = cut(fresh), tissue.save_state()
    as_it_was = cut(tissue)
    assert not np.array_equal(as_it_was, changed)
    for _ in range(2):
        tissue.load_state(start)
        tissue.set_material(None, **factors)
        np.testing.assert_array_equal(cut(tissue), changed)
    tissue.load_state(start)
    np.testing.assert_array_equal(cut(tissue), as_it_was)
