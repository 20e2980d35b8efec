"""Contact as forces: what is pressed holds, what rests stays, and nothing is made of nothing."""

import numpy as np
import pytest

from tests.support import bodies, strokes
from tests.support.overlaps import (
    ELEMENT,
    NO_GRAVITY,
    SLAB,
    frame_speed,
    joined,
    overlap_depth,
    speed,
)
from tissue import Material, SolverSettings, Tissue, block

ALLOWED = 0.02 * ELEMENT
"""Largest allowed penetration of one body into another [m]; springs must be pressed to push."""

AT_REST = 0.01


def pressed_blocks(solver: SolverSettings = SolverSettings(), beside=(0.0, 0.0)) -> Tissue:
    """Return a block on another; gravity is chosen so that it weighs 1 N."""
    lower = block((6, 6, 2), SLAB)
    mesh = joined(lower, block((5, 4, 2), SLAB), (*beside, SLAB[2] + 1e-3))
    weight = 1.0 / (1000.0 * np.prod(SLAB))
    held = mesh.positions[:, 2] == 0.0
    material = Material(viscous_damping=20.0)
    return Tissue(mesh, material, fixed=held, gravity=(0.0, 0.0, -weight), solver=solver)


@pytest.mark.parametrize("beside", [(0.0, 0.0), (0.013, 0.007)])
def test_two_blocks_pressed_together_with_1_n_hold_and_come_to_rest(beside):
    tissue = pressed_blocks(beside=beside)
    for i in range(1500):
        result = tissue.step(None, strokes.DT)
        if i % 100 == 0:
            assert overlap_depth(tissue.snapshot()) < ALLOWED
    assert result.body_contacts.force == pytest.approx(1.0, rel=0.1)
    assert result.body_contacts.penetration < ALLOWED
    assert frame_speed(tissue) < AT_REST
    assert tissue.pieces()[1 if tissue.pieces()[0].is_held else 0].centre[2] > 1.39 * SLAB[2]


def lift(tissue: Tissue, by: float) -> None:
    """Lift the upper of two blocks [m]."""
    body, n = tissue._body, tissue.n_nodes
    body.positions[:n][body.rest[:n, 2] > SLAB[2] + 0.5e-3, 2] += by


def test_what_is_no_longer_found_lets_go_little_by_little():
    """A node held by a contact of 1 mN snaps at a metre a second where that ends at once."""
    tissue = pressed_blocks()
    for _ in range(500):
        before = tissue.step(None, strokes.DT).body_contacts.force
    lift(tissue, ELEMENT)
    forces = [tissue.step(None, strokes.DT).body_contacts.force for _ in range(20)]
    assert 0.6 * before < forces[0] < before
    assert np.all(np.diff(forces) <= 0.0)
    assert forces[-1] == 0.0
    assert tissue._model.contact.forces.n_contacts == 0


def test_what_is_found_again_goes_on_with_the_force_that_fades():
    tissue = pressed_blocks()
    for _ in range(500):
        before = tissue.step(None, strokes.DT).body_contacts.force
    for by in (ELEMENT, -ELEMENT):
        lift(tissue, by)
        result = tissue.step(None, strokes.DT)
    assert result.body_contacts.force > 0.4 * before
    assert tissue.step(None, strokes.DT).body_contacts.force > 0.4 * before
    assert tissue._model.contact.forces.n_fading == 0


def advance(tissue: Tissue, duration: float, every: int = 50) -> float:
    """Advance the body; return the deepest overlap, tested in every `every`-th frame [m]."""
    worst = 0.0
    for i in range(round(duration / strokes.DT)):
        result = tissue.step(None, strokes.DT)
        if i % every == 0:
            worst = max(worst, overlap_depth(tissue.snapshot()))
        worst = max(worst, result.body_contacts.penetration)
    return worst


def on_floor(gravity=(0.0, 0.0, -9.81), solver=SolverSettings(), **material) -> Tissue:
    """Return a loose block on a floor at z = 0."""
    mesh = block((3, 3, 2), (0.03, 0.03, 0.02))
    return Tissue(mesh, Material(**material), gravity=gravity, floor=0.0, solver=solver)


def test_the_floor_bears_the_weight_of_a_block():
    tissue = on_floor(viscous_damping=10.0)
    for _ in range(2000):
        result = tissue.step(None, strokes.DT)
    assert result.body_contacts.force_of_floor[2] == pytest.approx(0.018 * 9.81, rel=1e-3)
    assert np.abs(result.body_contacts.force_of_floor[:2]).max() < 1e-3 * 0.018 * 9.81
    assert result.body_contacts.force == 0.0
    assert result.bounds[0, 2] > -ALLOWED
    assert speed(tissue) < 1e-3


@pytest.mark.parametrize(("degrees", "slides"), [(10.0, False), (15.0, False), (19.0, True)])
def test_friction_of_0_3_holds_a_block_on_a_slope_of_less_than_16_7_degrees(degrees, slides):
    """The floor is level; gravity is tilted instead."""
    slope = np.radians(degrees)
    tilted = 9.81 * np.array([np.sin(slope), 0.0, -np.cos(slope)])
    tissue = on_floor(tilted, viscous_damping=2.0, friction=0.3)
    for _ in range(500):
        tissue.step(None, strokes.DT)
    before = tissue.pieces()[0].centre[0]
    for _ in range(300):
        tissue.step(None, strokes.DT)
    moved = tissue.pieces()[0].centre[0] - before
    assert moved > 0.01 if slides else abs(moved) < 1e-4


def split_block(solver: SolverSettings = SolverSettings()) -> Tissue:
    """Return a block cut in two, whose held sides are pushed together by 1 mm."""
    mesh = bodies.jittered(3, 0)
    tissue = Tissue(
        mesh,
        Material(viscous_damping=20.0),
        fixed=bodies.sides(mesh),
        gravity=NO_GRAVITY,
        solver=solver,
    )
    edges = [[(0.0207, y, -0.01), (0.0207, y, 0.05)] for y in (-0.01, 0.06)]
    assert tissue.incise(edges, (0.0, 1.0, 0.0)) > 0.0
    return tissue


def squeeze(tissue: Tissue, by: float) -> None:
    """Move both held sides towards each other along x, each by `by` [m]."""
    body, n = tissue._body, tissue.n_nodes
    held = body.fixed[:n]
    inwards = np.where(body.rest[:n][held, 0] < 0.02, by, -by)
    body.positions[:n][held, 0] += inwards


def test_freshly_cut_lips_under_no_load_have_no_contact_force():
    tissue = split_block()
    for _ in range(50):
        contacts = tissue.step(None, strokes.DT).body_contacts
        assert contacts.force < 1e-9 and contacts.penetration < 1e-9
    assert speed(tissue) < 1e-9


def test_lips_that_lie_node_on_node_press_as_much_as_those_that_are_shifted():
    """Each node meets all faces around its twin; they count once."""
    pushed = []
    for shift in (0.0, 0.0042):
        lower = block((6, 6, 2), SLAB)
        mesh = joined(lower, block((6, 6, 2), SLAB), (shift, shift, SLAB[2]))
        weight = 1.0 / (1000.0 * np.prod(SLAB))
        tissue = Tissue(
            mesh,
            Material(viscous_damping=50.0),
            fixed=mesh.positions[:, 2] == 0.0,
            gravity=(0.0, 0.0, -weight),
        )
        for _ in range(600):
            result = tissue.step(None, strokes.DT)
        pushed.append(result.body_contacts)
    assert pushed[0].n_contacts <= 2 * 49
    assert pushed[0].force == pytest.approx(1.0, rel=0.05)
    assert pushed[1].force == pytest.approx(pushed[0].force, rel=0.05)


def test_a_piece_that_is_cut_off_lands_on_the_floor():
    mesh = block((4, 2, 2), (0.04, 0.02, 0.02))
    tissue = Tissue(mesh, fixed=mesh.positions[:, 0] <= 0.02, floor=-0.005)
    strokes.make(tissue, strokes.straight(mesh, 0.75))
    for _ in range(600):
        result = tissue.step(None, strokes.DT)
    loose = next(piece for piece in tissue.pieces() if not piece.is_held)
    assert result.body_contacts.force_of_floor[2] == pytest.approx(loose.mass * 9.81, rel=0.1)
    assert np.linalg.norm(loose.velocity) < AT_REST


def test_arrays_that_grow_within_a_step_change_nothing(monkeypatch):
    def run() -> Tissue:
        tissue = split_block()
        for _ in range(30):
            squeeze(tissue, 1e-5)
            tissue.step(None, strokes.DT)
        return tissue

    ample = run()
    monkeypatch.setattr("tissue.contact.self_contact.CAPACITY_OF_PAIRS", 4)
    for one, other in zip(ample.snapshot(), run().snapshot(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_lips_that_lie_inside_each_other_come_out():
    """Lips touch at rest; both were moved by 1 mm before any contact was known."""
    tissue = split_block()
    body, n = tissue._body, tissue.n_nodes
    tetrahedra = body.tetrahedra[: tissue.n_tetrahedra]
    is_left = body.rest[tetrahedra].mean(axis=1)[:, 0] < 0.0207
    body.positions[:n, 0] += np.where(np.isin(np.arange(n), tetrahedra[is_left]), 1e-3, -1e-3)
    before = overlap_depth(tissue.snapshot())
    assert before > 0.15 * ELEMENT
    advance(tissue, 0.5, every=500)
    assert overlap_depth(tissue.snapshot()) < 0.2 * before


def test_what_is_found_inside_another_part_comes_out():
    """At rest the blocks are apart; where they begin, the upper one is sunk in by 4 mm."""
    cells, size = (2, 2, 1), (0.02, 0.02, 0.01)
    mesh = joined(block(cells, size), block(cells, size), (0.003, 0.002, 0.05))
    sunk = mesh.positions - np.where(mesh.positions[:, 2:] > 0.04, [0.0, 0.0, 0.044], 0.0)
    held = mesh.positions[:, 2] == 0.0
    material = Material(viscous_damping=20.0)
    tissue = Tissue(mesh, material, fixed=held, positions=sunk, gravity=NO_GRAVITY)
    assert overlap_depth(tissue.snapshot()) > 0.3 * ELEMENT
    fastest = 0.0
    for _ in range(1000):
        tissue.step(None, strokes.DT)
        fastest = max(fastest, speed(tissue))
    assert overlap_depth(tissue.snapshot()) < ALLOWED
    assert fastest < 0.1


@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_a_cut_body_neither_gains_energy_nor_creeps_as_it_rests_in_motion(gravity):
    """The body takes its steps all the time. In a finer block 0.02 nJ and 0.2 um were measured in
    nineteen seconds."""
    mesh = block((4, 4, 2), (0.04, 0.04, 0.02))
    tissue = Tissue(
        mesh,
        Material(30e3, toughness=20.0),
        fixed=bodies.sides(mesh),
        gravity=(0.0, 0.0, -gravity),
        solver=SolverSettings(relaxation="verlet", audit=True),
    )
    strokes.make(tissue, strokes.upright(0.0201, -0.003, 0.043, 0.008, 0.03))

    def after(seconds):
        """Return the energy stored, the residual and the loss in contact [J], and positions."""
        for _ in range(round(seconds / strokes.DT)):
            tissue._stages.global_stepper.wake()
            energies = tissue.step(None, strokes.DT).energies
        stored = energies.elastic + energies.kinetic + energies.potential + energies.held
        return (stored, energies.residual, energies.contact), tissue.snapshot().positions

    energies, positions = after(2.0)  # until it has swung out
    energies_at_last, positions_at_last = after(6.0)
    np.testing.assert_allclose(energies_at_last, energies, rtol=0.0, atol=1e-9)
    assert np.abs(positions_at_last - positions).max() < 1e-6


@pytest.mark.parametrize(
    ("closing", "young", "deepest"),
    [(0.2, 10e3, ALLOWED), (1.0, 100e3, 0.5e-3), (3.0, 100e3, 10e-3)],
)
def test_two_free_blocks_that_collide_keep_their_momentum_and_gain_no_energy(
    closing, young, deepest
):
    """Undamped, with different meshes, edges and corners first, at up to a third of the wave speed.

    The force of a contact is limited: at several metres a second blocks sink in (docs/contact.md).
    """
    first, second = block((3, 3, 3), (0.03,) * 3), block((2, 2, 2), (0.03,) * 3)
    mesh = joined(first, second, (0.007, 0.004, 0.032))
    tissue = Tissue(
        mesh,
        Material(young, viscous_damping=0.0, retardation_time=0.0),
        gravity=NO_GRAVITY,
        solver=SolverSettings(audit=True, mass_scaling=None),
    )
    n, m = len(first.positions), len(mesh.positions)
    tissue._body.velocities[n:m] = [0.1, 0.0, -closing]

    def momentum():
        body = tissue.snapshot()
        return (body.masses[:, None] * body.velocities).sum(axis=0)

    before = momentum()
    energy_t0 = 0.5 * float(tissue.snapshot().masses @ (tissue.snapshot().velocities ** 2).sum(1))
    worst = advance(tissue, 0.1, every=5)
    np.testing.assert_allclose(momentum(), before, atol=1e-12 * np.linalg.norm(before))
    energies = tissue.step(None, strokes.DT).energies
    assert energies.elastic + energies.kinetic + energies.held < energy_t0
    assert worst < deepest
    body = tissue.snapshot()
    speeds = [body.velocities[part, 2].mean() for part in (slice(0, n), slice(n, m))]
    assert speeds[1] > speeds[0] - 0.9 * closing  # they did collide


def test_two_halves_pressed_together_across_a_cut_with_1_n_do_not_overlap_and_come_to_rest():
    """A block cut in two and squeezed between its held sides."""
    mesh = block((6, 4, 4), (0.06, 0.04, 0.04))
    sides = bodies.sides(mesh)
    tissue = Tissue(
        mesh,
        Material(toughness=2.0, viscous_damping=20.0),
        fixed=sides,
        gravity=NO_GRAVITY,
    )
    strokes.make(tissue, strokes.slanted(mesh, lean=0.1, rake=0.2))
    assert tissue.n_pieces() == 2
    worst = 0.0
    for _ in range(300):
        squeeze(tissue, 1e-5)
        worst = max(worst, advance(tissue, 0.005, every=5))
        if tissue.step(None, strokes.DT).body_contacts.force > 1.0:
            break
    worst = max(worst, advance(tissue, 0.5))
    assert worst < ALLOWED
    last = tissue.step(None, strokes.DT)
    assert last.body_contacts.force == pytest.approx(1.0, rel=0.2)
    assert speed(tissue) < AT_REST


def test_crossed_beams_touch_edge_on_edge():
    """Beams that stand on an edge each: no node comes near a face of the other."""
    beam = block((6, 1, 1), (0.06, 0.01, 0.01))
    x, y, z = (beam.positions - [0.03, 0.005, 0.005]).T
    on_edge = np.stack([x, np.sqrt(0.5) * (y - z), np.sqrt(0.5) * (y + z)], axis=1)
    upper = beam._replace(positions=on_edge[:, [1, 0, 2]] * [1.0, -1.0, 1.0])
    mesh = joined(beam._replace(positions=on_edge), upper, (0.005, 0.005, 0.0145))
    is_lower = np.arange(len(mesh.positions)) < len(on_edge)
    material = Material(viscous_damping=20.0)
    tissue = Tissue(mesh, material, fixed=is_lower, gravity=(0.0, 0.0, -2.0))
    low, ridge = mesh.positions[~is_lower, 2].min(), mesh.positions[is_lower, 2].max()
    at_edge = ~is_lower & (mesh.positions[:, 2] < low + 1e-9) & (abs(mesh.positions[:, 1]) < 0.006)
    assert at_edge.sum() == 2 and low > ridge
    most_contacts = 0
    for _ in range(300):
        contacts = tissue.step(None, strokes.DT).body_contacts
        most_contacts = max(most_contacts, contacts.n_contacts)
        # The edge between the two nodes crosses the ridge of the lower beam, which is at y = 0.
        (_, y0, z0), (_, y1, z1) = tissue.snapshot().positions[at_edge]
        assert z0 - y0 * (z1 - z0) / (y1 - y0) > ridge - ALLOWED
    assert most_contacts > 0


@pytest.mark.parametrize("floor", [np.nan, np.inf, 0.011])
def test_a_floor_that_is_not_finite_or_inside_the_body_is_refused(floor):
    mesh = block((1, 1, 1), (0.01,) * 3)
    lifted = mesh._replace(positions=mesh.positions + np.array([0.0, 0.0, 0.01]))
    with pytest.raises(ValueError, match="floor"):
        Tissue(lifted, floor=floor)
