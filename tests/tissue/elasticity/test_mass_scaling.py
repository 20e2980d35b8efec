"""Mass that slivers get: it bounds the frequencies, has no weight, and is in no report of mass."""

import numpy as np
import pytest

from tests.support import bodies, incisions, strokes
from tests.support.materials import SPRINGS
from tests.tissue.solids import SolidBody, highest_frequency, moved
from tissue import Material, SolverSettings, TetrahedralMesh, Tissue, block
from tissue.elasticity.frequency.strained import StepLimit, limited_frequency
from tissue.elasticity.mass_scaling import LARGEST_ADDED_MASS, LIMIT_STEP
from tissue.forces.terms import accelerations

MESH = block((6, 6, 3), (0.06, 0.06, 0.03))
FREE = {"viscous_damping": 0.0, "retardation_time": 0.0}
STRETCH = np.array([1.1, 1.0, 1.0])
"""Of bodies that are held, so that a slit across it stays open."""

LOW = 4000.0
"""Angular frequency that many nodes of the cut body exceed [1/s]: the uncut one has less."""


def solid_of(tissue):
    """Return the elements of a body."""
    return tissue._model.elasticity.arrays.solid


def body_of(mass_scaling, relaxation="global", is_held=True, **damping):
    """Return a block held at two sides, and stretched, or free."""
    return Tissue(
        MESH,
        Material(law="neo_hookean", poisson_ratio=0.45, young_modulus=10e3, **damping),
        fixed=bodies.sides(MESH) if is_held else None,
        positions=MESH.positions * STRETCH if is_held else None,
        solver=SolverSettings(mass_scaling=mass_scaling, relaxation=relaxation),
    )


def cut_body(mass_scaling, seed=0, **settings):
    """Return a block after two incisions."""
    tissue, kinds = body_of(mass_scaling, **settings), list(incisions.KINDS)
    for i in range(2):
        kind = kinds[(seed + 3 * i) % len(kinds)]
        tissue.incise(*incisions.incision(MESH, kind, seed + i))
    return tissue


@pytest.mark.parametrize("seed", range(6))
def test_after_cuts_no_bound_is_above_the_limit(seed):
    """The limit is that asked for or the bound of the uncut body, whichever is higher.

    Where the added mass would become large it is raised.
    """
    tissue = cut_body(LOW, seed)
    solid = solid_of(tissue)
    limit = max(LOW, tissue.cut_report().initial.frequency)
    while tissue.cut_report().now.frequency > limit * (1.0 + 1e-9):
        limit *= LIMIT_STEP
    added = tissue.cut_report().now.added_mass
    assert 0.0 < added <= LARGEST_ADDED_MASS
    bounds = np.sqrt(solid.frequency_squared[: tissue.n_nodes])
    assert bounds.max() <= limit * (1.0 + 1e-9)
    assert highest_frequency(SolidBody(tissue._body, solid)) <= limit
    assert tissue.cut_report().now.frequency <= limit * (1.0 + 1e-9)
    assert cut_body(None, seed).cut_report().now.frequency > 1.1 * limit


def test_the_report_tells_the_share_of_the_mass_that_was_added():
    tissue = cut_body(LOW)
    body, n = tissue._body, tissue.n_nodes
    own = tissue.snapshot().masses
    np.testing.assert_allclose(body.masses[:n], own + body.added_masses[:n], rtol=1e-12)
    share = body.added_masses[:n].sum() / own.sum()
    assert tissue.cut_report().now.added_mass == pytest.approx(share, rel=1e-12)
    assert 1e-4 < share < 0.1
    assert tissue.cut_report().initial.added_mass == 0.0
    assert (body.added_masses[:n] >= 0.0).all()


def test_springs_get_no_mass():
    tissue = Tissue(MESH, SPRINGS, solver=SolverSettings(mass_scaling=LOW))
    tissue.incise(*incisions.incision(MESH, next(iter(incisions.KINDS)), 0))
    assert not tissue._body.added_masses.any()


def test_masses_and_volumes_of_snapshot_and_pieces_are_those_without_mass_scaling():
    scaled, exact = cut_body(LOW), cut_body(None)
    """To rounding: a snapshot has the mass of each node less what was added."""
    np.testing.assert_allclose(scaled.snapshot().masses, exact.snapshot().masses, rtol=1e-14)
    for found, expected in zip(scaled.pieces(), exact.pieces(), strict=True):
        assert found.mass == pytest.approx(expected.mass, rel=1e-14)
        assert (found.volume, found.rest_volume) == (expected.volume, expected.rest_volume)
        size = np.abs(expected.inertia).max()
        np.testing.assert_allclose(found.inertia, expected.inertia, atol=1e-13 * size)


def forces(tissue, positions):
    """Return the forces on the nodes at positions, gravity included [N]."""
    body, n = tissue._body, tissue.n_nodes
    body.positions[:n] = positions
    out = np.zeros_like(body.positions)
    accelerations(tissue._model.context, out)
    return out[:n] * body.masses[:n, None]


def test_added_mass_changes_no_force_so_that_equilibrium_is_the_same():
    scaled, exact = cut_body(LOW), cut_body(None)
    rest = exact.snapshot().rest_positions
    x = moved(TetrahedralMesh(rest, exact.snapshot().tetrahedra), 1e-3)
    expected = forces(exact, x)
    np.testing.assert_allclose(forces(scaled, x), expected, atol=1e-12 * np.abs(expected).max())


def test_added_mass_keeps_the_sag_to_a_millionth():
    """Drag is strong, so that nothing moves any more; the slit stays open."""
    sags = []
    for mass_scaling in (0.4 * LOW, None):
        tissue = body_of(mass_scaling, viscous_damping=60.0)
        slit = [[(0.0287, y, 0.0123), (0.0287, y, 0.04)] for y in (-0.01, 0.07)]
        tissue.incise(slit, (0.0, 1.0, 0.0))
        for _ in range(1000):
            result = tissue.step(None, 1e-3)
        assert result.body_contacts.force == 0.0
        assert (tissue.cut_report().now.added_mass > 0.0) == (mass_scaling is not None)
        sags.append(tissue.snapshot().positions - tissue.snapshot().rest_positions)
    assert np.abs(sags[0] - sags[1]).max() < 1e-6 * np.abs(sags[1]).max()


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
def test_a_free_body_gains_the_momentum_of_its_own_weight(relaxation):
    tissue = cut_body(LOW, relaxation=relaxation, is_held=False, **FREE)
    body, n = tissue._body, tissue.n_nodes
    assert body.added_masses[:n].sum() > 1e-4 * body.masses[:n].sum()
    momentum = []
    for _ in range(20):
        tissue.step(None, 1e-3)
        momentum.append((body.masses[:n, None] * body.velocities[:n]).sum(axis=0))
    weight = tissue.snapshot().masses.sum() * np.array([0.0, 0.0, -9.81])
    gained = momentum[-1] - momentum[0]
    np.testing.assert_allclose(gained, 0.019 * weight, atol=1e-12 * abs(weight[2]))


@pytest.mark.parametrize("frequency", [0.0, -1.0])
def test_a_frequency_that_is_none_is_refused(frequency):
    with pytest.raises(ValueError, match="mass_scaling is"):
        Tissue(MESH, solver=SolverSettings(mass_scaling=frequency))


LEAST = 1.0
"""Below the bound of any body [1/s]: the limit is that of the uncut body."""

STRETCHED = 1.6
"""Length over that at rest: the bound on w^2 of the body more than doubles."""


def pulled_body(mass_scaling, part=slice(None), **material):
    """Return a block whose nodes in a part are drawn out along x."""
    at = MESH.positions.copy()
    at[part, 0] *= STRETCHED
    return Tissue(
        MESH,
        Material(young_modulus=10e3, poisson_ratio=0.45, **{"law": "neo_hookean", **material}),
        fixed=bodies.sides(MESH),
        positions=at,
        solver=SolverSettings(mass_scaling=mass_scaling),
    )


def node_inside():
    """Return the node nearest to the middle of the block."""
    middle = np.array([0.03, 0.03, 0.015])
    return int(np.argmin(np.linalg.norm(MESH.positions - middle, axis=1)))


def strained_bound(tissue):
    """Return a bound on the frequencies of a body as it is deformed, near the truth [1/s]."""
    system, anything = tissue._model, StepLimit(allowed=0.0, added=0.0, n_steps=0)
    squared = system.elasticity.strained_frequency_squared(system.body, system.visits, anything)
    return np.sqrt(squared)


def test_what_is_stretched_in_one_place_is_no_faster_than_the_limit():
    one = [node_inside()]
    scaled, exact = pulled_body(LEAST, one), pulled_body(None, one)
    scaled._model.elasticity.arrays.scaling.most = np.inf
    limit = scaled.cut_report().initial.frequency
    assert strained_bound(scaled) <= limit < 1.1 * limit < strained_bound(exact)
    assert scaled.cut_report().now.added_mass > 0.0
    assert exact.cut_report().now.added_mass == 0.0


def test_what_is_stretched_everywhere_is_faster():
    """All nodes would need mass, and the body gets no more than a little."""
    scaled = pulled_body(LEAST)
    assert strained_bound(scaled) > 1.2 * scaled.cut_report().initial.frequency
    assert 0.0 < scaled.cut_report().now.added_mass <= LARGEST_ADDED_MASS


def test_tissue_that_stiffens_as_it_is_stretched_gets_mass_for_it_too():
    kind = {"law": "exponential", "stiffening": 1.0}
    scaled, exact = (pulled_body(least, [node_inside()], **kind) for least in (LEAST, None))
    scaled._model.elasticity.arrays.scaling.most = np.inf
    limit = scaled.cut_report().initial.frequency
    assert strained_bound(scaled) <= limit < 1.1 * limit < strained_bound(exact)
    assert scaled.cut_report().now.added_mass > LARGEST_ADDED_MASS


def test_mass_that_is_used_up_is_given_back_and_used_up_again_soon_takes_another_step():
    tissue = pulled_body(LEAST, [node_inside()], law="exponential", stiffening=1.0)
    scaling = tissue._model.elasticity.arrays.scaling
    tissue.step(None, strokes.DT)
    assert scaling.between_cuts > 0.0
    for steps in (0, 1):
        scaling.most, scaling.is_used_up = scaling.between_cuts, 1
        scaling.increments = 10_000 * (1 - steps)
        assert scaling.steps == 0
        tissue.step(None, strokes.DT)
        assert scaling.increments < 2
    assert scaling.steps > 0


def test_tissue_that_does_not_stiffen_gives_mass_back_no_more_often_than_in_100_increments():
    tissue = pulled_body(LEAST, [node_inside()])
    scaling = tissue._model.elasticity.arrays.scaling
    tissue.step(None, strokes.DT)
    for increments, is_returned in ((5, False), (100, True)):
        scaling.most, scaling.is_used_up = scaling.between_cuts, 1
        scaling.increments = increments
        tissue.step(None, strokes.DT)
        assert (scaling.increments <= 1) == is_returned
    assert scaling.steps == 0


def test_mass_that_a_node_got_between_cuts_and_does_not_need_at_rest_is_taken_back():
    tissue = pulled_body(LEAST, [node_inside()])
    body, elasticity = tissue._body, tissue._model.elasticity
    n, scaling = tissue.n_nodes, elasticity.arrays.scaling
    masses, bounds = body.masses[:n].copy(), elasticity.arrays.frequency_squared[:n].copy()
    strained_bound(tissue)
    assert (body.masses[:n] > 1.01 * masses).any()
    body.velocities[:n, :3] = velocities = np.random.default_rng(0).normal(size=(n, 3))
    heavier, scaling.lost, scaling.impulse[:] = body.masses[:n].copy(), 0.0, 0.0
    elasticity.return_mass(body)
    np.testing.assert_allclose(body.masses[:n], masses, rtol=1e-12)
    np.testing.assert_allclose(elasticity.arrays.frequency_squared[:n], bounds, rtol=1e-12)
    np.testing.assert_array_equal(body.velocities[:n, :3], velocities)
    lost = 0.5 * ((heavier - masses) * (velocities**2).sum(axis=1)).sum()
    assert scaling.lost == pytest.approx(lost, rel=1e-9)
    taken = (masses - heavier)[:, None] * velocities
    moments = np.cross(body.positions[:n, :3], taken)
    np.testing.assert_allclose(scaling.impulse, np.hstack((taken, moments)).sum(axis=0), rtol=1e-9)
    assert scaling.added == pytest.approx(0.0, abs=1e-12 * masses.sum())
    measures = tissue.cut_report().now
    assert measures.added_mass == 0.0
    assert measures.most_added_mass == pytest.approx((heavier - masses).sum() / masses.sum())


def test_as_the_blade_leaves_no_node_has_mass_that_it_does_not_need_at_rest():
    tissue = body_of(LEAST)
    was_engaged, interaction = False, tissue._model.interaction
    for sweep in strokes.sweeps(strokes.slanted(MESH)):
        tissue.step(sweep, strokes.DT)
        if was_engaged and not interaction.is_engaged:
            break  # later on lips that swing may need some again
        was_engaged = interaction.is_engaged
    body, elastic, n = tissue._body, tissue._model.elasticity.arrays, tissue.n_nodes
    assert elastic.scaling.largest > elastic.scaling.added
    got = body.added_masses[:n] > 0.0
    needed = elastic.solid.frequency_squared[:n][got]
    np.testing.assert_allclose(needed, elastic.scaling.allowed, rtol=1e-9)


def test_where_a_time_step_is_one_step_nodes_get_no_mass_between_cuts():
    """A hundredth of a millisecond is, ten are not."""
    tissue = pulled_body(LEAST, [node_inside()])
    assert tissue.step(None, 1e-5).n_substeps == 1
    assert not tissue._body.added_masses.any()
    tissue.step(None, 1e-2)
    assert tissue._body.added_masses.any()


@pytest.mark.parametrize("room", [1.0, 0.0], ids=["some", "none"])
def test_a_node_that_gets_mass_keeps_its_momentum_and_its_lost_energy_is_counted(room):
    tissue = pulled_body(LEAST)
    body, elastic, node = tissue._body, tissue._model.elasticity.arrays, node_inside()
    body.velocities[node, :3] = 1.0, -2.0, 0.5
    elastic.scaling.most *= room
    mass, velocity = body.masses[node], body.velocities[node, :3].copy()
    own, bound = elastic.frequency_squared[node], 3.0 * LOW**2
    found = limited_frequency(elastic, body, node, bound, LOW**2)
    if room == 0.0:
        assert found == bound and body.masses[node] == mass and elastic.scaling.lost == 0.0
        return
    assert found == pytest.approx(LOW**2, rel=1e-12)
    assert body.masses[node] == pytest.approx(3.0 * mass, rel=1e-12)
    assert body.added_masses[node] == elastic.scaling.added == pytest.approx(2.0 * mass, rel=1e-12)
    assert elastic.frequency_squared[node] == pytest.approx(own / 3.0, rel=1e-12)
    np.testing.assert_allclose(
        body.masses[node] * body.velocities[node, :3], mass * velocity, rtol=1e-12
    )
    before, after = mass * velocity @ velocity, mass * velocity @ velocity / 3.0
    assert elastic.scaling.lost == pytest.approx(0.5 * (before - after), rel=1e-12)
    assert limited_frequency(elastic, body, node, found, LOW**2) == found
