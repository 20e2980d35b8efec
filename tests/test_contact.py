"""Contact of pieces, lips and the floor: nothing interpenetrates, and all comes to rest."""

from dataclasses import replace

import numpy as np
import pytest

from tests import bodies, strokes
from tests.materials import SPRINGS
from tissue import (
    FloatArray,
    IntArray,
    Material,
    Snapshot,
    SolverSettings,
    TetrahedralMesh,
    Tissue,
    block,
)
from tissue.contact.resolve import note_all_positions
from tissue.contact.state import FACES_CHANGED
from tissue.elasticity.internal_forces import elastic_energy
from tissue.mesh.faces import OUTWARD
from tissue.mesh.pieces import piece_of_tetrahedra, pieces_of

ELEMENT = 0.01
"""Edge of a cell in all bodies of these tests [m]."""

IMPULSES = SolverSettings(contact="impulses")

ALLOWED = 0.01 * ELEMENT
"""Largest allowed penetration of one body into another [m]."""

AT_REST = 0.01
"""Speed [m/s] below which no node moves by more than 10 um in a frame."""

SLAB = (0.06, 0.06, 0.02)
NO_GRAVITY = (0.0, 0.0, 0.0)


def joined(first: TetrahedralMesh, second: TetrahedralMesh, offset) -> TetrahedralMesh:
    """Return two bodies as one mesh, the second moved by an offset [m]."""
    return TetrahedralMesh(
        np.vstack([first.positions, second.positions + np.asarray(offset)]),
        np.vstack([first.tetrahedra, second.tetrahedra + len(first.positions)]),
    )


def overlap_depths(body: Snapshot, part: IntArray) -> FloatArray:
    """Return how deep each node that is in another part lies in it [m], testing every pair.

    The depth of a node in a tetrahedron of another part is its distance from the surface of that
    part, approximated by the nearest plane of a boundary face. `part` is that of each tetrahedron.
    """
    of_node = np.zeros(len(body.positions), dtype=np.int64)
    of_node[body.tetrahedra] = part[:, None]
    corners = body.positions[body.tetrahedra]
    to_weights = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
    nodes = body.tetrahedra[:, OUTWARD].reshape(-1, 3)
    faces = np.column_stack([np.repeat(part, 4), np.sort(nodes, axis=1)])
    _, same, count = np.unique(faces, axis=0, return_inverse=True, return_counts=True)
    boundary = nodes[count[same.ravel()] == 1]
    a, b, c = (body.positions[boundary[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    depths = []
    for node, p in enumerate(body.positions):
        w = np.einsum("tij,tj->ti", to_weights, p - corners[:, 0])
        inside = (w.min(axis=1) > 0.0) & (w.sum(axis=1) < 1.0) & (part != of_node[node])
        if inside.any():
            other = of_node[boundary[:, 0]] == part[inside][0]
            below = -((p - a[other]) * normals[other]).sum(axis=1)
            depths.append(below[below > 0.0].min())
    return np.array(depths)


def overlap_depth(body: Snapshot) -> float:
    """Return the deepest penetration of a node of one piece into another [m]."""
    return float(overlap_depths(body, piece_of_tetrahedra(body)).max(initial=0.0))


def speed(tissue: Tissue) -> float:
    return float(np.linalg.norm(tissue.snapshot().velocities, axis=1).max())


def frame_speed(tissue: Tissue) -> float:
    """Return the largest displacement of a node in a frame over its length [m/s].

    A pinched node may have a velocity without moving.
    """
    before = tissue.snapshot().positions
    tissue.step(None, strokes.DT)
    moved = tissue.snapshot().positions - before
    return float(np.linalg.norm(moved, axis=1).max()) / strokes.DT


def advance(tissue: Tissue, duration: float, every: int = 50) -> float:
    """Advance the body; return the deepest overlap, tested in every `every`-th frame [m]."""
    worst = 0.0
    for i in range(round(duration / strokes.DT)):
        result = tissue.step(None, strokes.DT)
        if i % every == 0:
            worst = max(worst, overlap_depth(tissue.snapshot()))
        worst = max(worst, result.body_contacts.penetration)
    return worst


def incised(mesh: TetrahedralMesh, at: float, until: float, **options) -> Tissue:
    """Return a body cut along an upright plane, from its front to y = `until` [m]."""
    tissue = Tissue(mesh, fixed=bodies.sides(mesh), gravity=NO_GRAVITY, **options, solver=IMPULSES)
    edges = [[(at, y, -0.01), (at, y, 0.05)] for y in (-0.01, until)]
    assert tissue.incise(edges, (0.0, 1.0, 0.0)) > 0.0
    return tissue


def squeeze(tissue: Tissue, by: float) -> None:
    """Move both held sides towards each other along x, each by `by` [m]."""
    body, n = tissue._body, tissue.n_nodes
    held = body.fixed[:n]
    middle = body.rest[:n, 0].mean()
    body.positions[:n][held, 0] += np.where(body.rest[:n][held, 0] < middle, by, -by)


PAIRS = {
    "the same mesh": ((6, 6, 2), (0.0, 0.0)),
    "another mesh": ((5, 4, 2), (0.0, 0.0)),
    "half beside each other": ((6, 6, 2), (0.013, 0.007)),
}


@pytest.mark.parametrize("pair", PAIRS)
def test_two_blocks_pressed_together_with_1_n_do_not_overlap_and_come_to_rest(pair):
    """The upper block lies on the lower one; gravity is chosen so that it weighs 1 N."""
    cells, beside = PAIRS[pair]
    lower = block((6, 6, 2), SLAB)
    mesh = joined(lower, block(cells, SLAB), (*beside, SLAB[2] + 1e-3))
    weight = 1.0 / (1000.0 * np.prod(SLAB))
    # Damping changes how soon the body comes to rest, not where.
    tissue = Tissue(
        mesh,
        Material(viscous_damping=20.0),
        fixed=mesh.positions[:, 2] == 0.0,
        gravity=(0.0, 0.0, -weight),
        solver=IMPULSES,
    )
    assert advance(tissue, 2.5) < ALLOWED
    last = tissue.step(None, strokes.DT)
    assert last.body_contacts.n_contacts > 10
    assert last.body_contacts.force == pytest.approx(
        1.0, rel=0.25
    )  # faces bend, so not all normals point upwards
    assert frame_speed(tissue) < AT_REST
    upper = tissue.pieces()[1 if tissue.pieces()[0].is_held else 0]
    assert np.linalg.norm(upper.velocity) < 1e-3
    assert upper.centre[2] > 1.39 * SLAB[2]


def test_two_halves_pressed_together_across_a_cut_with_1_n_do_not_overlap_and_come_to_rest():
    """A block cut in two and squeezed between its held sides."""
    mesh = block((6, 4, 4), (0.06, 0.04, 0.04))
    sides = bodies.sides(mesh)
    tissue = Tissue(
        mesh,
        Material(toughness=2.0, viscous_damping=20.0),
        fixed=sides,
        gravity=NO_GRAVITY,
        solver=IMPULSES,
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


@pytest.mark.parametrize("until", [0.02, 0.06], ids=["a slit", "clean through"])
def test_freshly_cut_lips_under_no_load_have_no_contact_force(until):
    tissue = incised(bodies.jittered(3, 0), 0.0207, until)
    for _ in range(50):
        contacts = tissue.step(None, strokes.DT).body_contacts
        assert contacts.force < 1e-12 and contacts.penetration < 1e-12
    assert speed(tissue) < 1e-12


def test_the_lips_of_a_slit_that_is_pressed_shut_do_not_interpenetrate():
    mesh = block((4, 6, 4), (0.04, 0.06, 0.04))
    tissue = incised(mesh, 0.0207, 0.03, material=Material(viscous_damping=20.0))
    assert tissue.n_pieces() == 1
    for _ in range(200):
        squeeze(tissue, 1e-5)
        for _ in range(2):
            pressed = tissue.step(None, strokes.DT).body_contacts.force
    for _ in range(300):
        pressed = tissue.step(None, strokes.DT).body_contacts.force
    assert pressed > 0.5
    surface = tissue.surface()
    lips = np.unique(surface.triangles[surface.is_cut])
    a, b, c = (surface.positions[surface.triangles[surface.is_cut][:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    for p in surface.positions[lips]:
        height = ((p - a) * normals).sum(axis=1)
        weights = np.stack(
            [
                np.einsum("ij,ij->i", np.cross(c - p, b - p), -normals),
                np.einsum("ij,ij->i", np.cross(a - p, c - p), -normals),
                np.einsum("ij,ij->i", np.cross(b - p, a - p), -normals),
            ]
        )
        under = (weights > 0.0).all(axis=0) & (height < 0.0) & (height > -0.4 * ELEMENT)
        assert not under.any() or height[under].min() > -ALLOWED
    assert len(lips) > 20


def test_before_the_first_cut_contact_has_nothing_to_test():
    mesh = block((4, 4, 4), (0.04,) * 3)
    tissue = Tissue(mesh, fixed=bodies.sides(mesh), solver=IMPULSES)
    assert not tissue._system.contact.is_awake
    tissue.step(None, strokes.DT)
    assert not tissue._system.contact.arrays.start.any()
    strokes.make(tissue, strokes.straight(mesh))
    assert tissue._system.contact.is_awake


def falling(height=0.02, material=None, gravity=(0.0, 0.0, -9.81), **options):
    """Return a loose block at `height` [m] above a floor at z = 0."""
    mesh = block((3, 3, 2), (0.03, 0.03, 0.02))
    lifted = mesh._replace(positions=mesh.positions + np.array([0.0, 0.0, height]))
    return Tissue(lifted, material, gravity=gravity, floor=0.0, **options, solver=IMPULSES)


def test_a_block_that_falls_on_the_floor_stays_on_it_and_comes_to_rest():
    tissue = falling()
    for _ in range(2000):
        result = tissue.step(None, strokes.DT)
        assert result.bounds[0, 2] > -ALLOWED
    assert speed(tissue) < AT_REST
    assert result.body_contacts.force_of_floor[2] == pytest.approx(0.018 * 9.81, rel=0.05)
    assert result.body_contacts.force == 0.0


@pytest.mark.parametrize(("degrees", "slides"), [(10.0, False), (15.0, False), (19.0, True)])
def test_friction_of_0_3_holds_a_block_on_a_slope_of_less_than_16_7_degrees(degrees, slides):
    """The floor is level; gravity is tilted instead."""
    slope = np.radians(degrees)
    material = Material(viscous_damping=2.0, friction=0.3)
    tissue = falling(0.0, material, 9.81 * np.array([np.sin(slope), 0.0, -np.cos(slope)]))
    for _ in range(500):
        tissue.step(None, strokes.DT)
    before = tissue.pieces()[0].centre[0]
    for _ in range(300):
        tissue.step(None, strokes.DT)
    moved = tissue.pieces()[0].centre[0] - before
    assert moved > 0.01 if slides else abs(moved) < 1e-4


def energy(tissue: Tissue, gravity: float = 0.0) -> float:
    """Return kinetic, elastic and potential energy [J]."""
    body = tissue.snapshot()
    kinetic = 0.5 * float(body.masses @ (body.velocities**2).sum(axis=1))
    weight = gravity * float(body.masses @ body.positions[:, 2])
    return kinetic + elastic_energy(tissue._system.elasticity.arrays, tissue._body) + weight


@pytest.mark.parametrize(("closing", "young"), [(0.2, 10e3), (1.0, 10e3), (3.0, 100e3)])
def test_two_free_blocks_that_collide_keep_their_momentum_and_gain_no_energy(closing, young):
    """Undamped, with different meshes, edges and corners first, at up to 1/3 of the wave speed."""
    first, second = block((3, 3, 3), (0.03,) * 3), block((2, 2, 2), (0.03,) * 3)
    mesh = joined(first, second, (0.007, 0.004, 0.032))
    tissue = Tissue(
        mesh,
        replace(SPRINGS, young_modulus=young, viscous_damping=0.0, retardation_time=0.0),
        gravity=NO_GRAVITY,
        solver=IMPULSES,
    )
    n, m = len(first.positions), len(mesh.positions)
    tissue._body.velocities[n:m] = [0.1, 0.0, -closing]

    def momentum():
        body = tissue.snapshot()
        return (body.masses[:, None] * body.velocities).sum(axis=0)

    before, energy_t0 = momentum(), energy(tissue)
    worst = advance(tissue, 0.1, every=5)
    np.testing.assert_allclose(momentum(), before, atol=1e-12 * np.linalg.norm(before))
    assert energy(tissue) < energy_t0
    assert worst < ALLOWED
    body = tissue.snapshot()
    speeds = [body.velocities[part, 2].mean() for part in (slice(0, n), slice(n, m))]
    assert speeds[1] > speeds[0] - 0.9 * closing  # they did collide


def test_the_energy_of_a_block_that_bounces_never_exceeds_what_it_fell_with():
    tissue = falling(0.05, Material(viscous_damping=0.0))
    at_first = energy(tissue, 9.81)
    highest = max(
        energy(tissue, 9.81) for _ in range(500) if tissue.step(None, strokes.DT) is not None
    )
    assert highest < at_first * (1.0 + 1e-9)
    assert energy(tissue, 9.81) < 0.8 * at_first


@pytest.mark.parametrize("contact", ["impulses", "penalty"])
def test_crossed_beams_touch_edge_on_edge(contact):
    """Both beams stand on an edge, so that no node comes near a face of the other."""
    beam = block((6, 1, 1), (0.06, 0.01, 0.01))
    c = np.sqrt(0.5)
    on_edge = (beam.positions - [0.03, 0.005, 0.005]) @ np.array(
        [[1.0, 0.0, 0.0], [0.0, c, c], [0.0, -c, c]]
    )
    lower = beam._replace(positions=on_edge)
    upper = beam._replace(positions=on_edge[:, [1, 0, 2]] * [1.0, -1.0, 1.0])
    mesh = joined(lower, upper, (0.005, 0.005, 0.0145))
    n = len(on_edge)
    fixed = np.arange(len(mesh.positions)) < n
    tissue = Tissue(
        mesh,
        Material(viscous_damping=20.0),
        fixed=fixed,
        gravity=(0.0, 0.0, -2.0),
        solver=SolverSettings(contact=contact),
    )
    low, ridge = mesh.positions[n:, 2].min(), mesh.positions[:n, 2].max()
    edge = (mesh.positions[n:, 2] < low + 1e-9) & (np.abs(mesh.positions[n:, 1]) < 0.006)
    assert edge.sum() == 2 and low > ridge
    most_contacts = 0
    for _ in range(300):
        contacts = tissue.step(None, strokes.DT).body_contacts
        most_contacts = max(most_contacts, contacts.n_contacts)
        # The edge between the two nodes crosses the ridge of the lower beam, which is at y = 0.
        (_, y0, z0), (_, y1, z1) = tissue.snapshot().positions[n:][edge]
        assert z0 - y0 * (z1 - z0) / (y1 - y0) > ridge - ALLOWED
    assert most_contacts > 0


def test_a_piece_that_is_cut_off_lands_on_the_floor_and_pieces_fall_on_pieces():
    mesh = block((4, 2, 2), (0.04, 0.02, 0.02))
    tissue = Tissue(
        mesh,
        Material(toughness=0.5),
        fixed=mesh.positions[:, 0] <= 0.02,
        floor=-0.03,
        solver=IMPULSES,
    )
    strokes.make(tissue, strokes.straight(mesh, 0.75))
    for _ in range(1000):
        result = tissue.step(None, strokes.DT)
    held, loose = pieces_of(tissue.snapshot())
    assert held.is_held and not loose.is_held
    assert -0.03 < loose.centre[2] < -0.015
    assert result.body_contacts.force_of_floor[2] == pytest.approx(loose.mass * 9.81, rel=0.1)
    assert np.linalg.norm(loose.velocity) < AT_REST


def test_contact_is_reproducible_to_the_bit():
    def run():
        mesh = joined(
            block((3, 3, 3), (0.03,) * 3), block((2, 2, 2), (0.03,) * 3), (0.01, 0, 0.031)
        )
        tissue = Tissue(mesh, fixed=mesh.positions[:, 2] == 0.0, solver=IMPULSES)
        results = [tissue.step(None, strokes.DT) for _ in range(100)]
        assert results[-1].body_contacts.n_contacts > 0
        return tissue.snapshot()

    for one, other in zip(run(), run(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_contact_arrays_that_grow_within_a_step_change_nothing(monkeypatch):
    def run():
        mesh = joined(
            block((3, 3, 3), (0.03,) * 3), block((2, 2, 2), (0.03,) * 3), (0.01, 0, 0.031)
        )
        tissue = Tissue(mesh, fixed=mesh.positions[:, 2] == 0.0, solver=IMPULSES)
        for _ in range(60):
            tissue.step(None, strokes.DT)
        return tissue.snapshot()

    ample = run()
    monkeypatch.setattr("tissue.contact.self_contact.CAPACITY", 8)
    for one, other in zip(ample, run(), strict=True):
        np.testing.assert_array_equal(one, other)


def resting_blocks(n_steps=300):
    """Return a small block at rest on a larger one."""
    lower, upper = block((3, 3, 3), (0.03,) * 3), block((2, 2, 2), (0.03,) * 3)
    mesh = joined(lower, upper, (1e-3, 2e-3, 0.0301))
    material = Material(viscous_damping=20.0)
    tissue = Tissue(mesh, material, fixed=mesh.positions[:, 2] == 0.0, solver=IMPULSES)
    for _ in range(n_steps):
        tissue.step(None, strokes.DT)
    return tissue


def test_contact_applies_no_impulse_before_a_step():
    """Impulses along the normals of the last step fed energy to corners of lips that turn."""
    tissue = resting_blocks()
    contact, body = tissue._system.contact.arrays, tissue._body
    assert (contact.contacts.impulse[: contact.contacts.n_contacts] > 0.0).sum() > 5
    before = tissue.snapshot()
    note_all_positions(contact, body)
    np.testing.assert_array_equal(tissue.snapshot().velocities, before.velocities)
    np.testing.assert_array_equal(tissue.snapshot().positions, before.positions)


def test_contacts_of_changed_faces_are_found_again_and_the_others_persist():
    tissue = resting_blocks()
    contact = tissue._system.contact.arrays
    contacts, faces = contact.contacts, contact.faces
    faces_of = {
        tuple(contacts.node[k]): contacts.face[k].tolist() for k in range(contacts.n_contacts)
    }
    changed = {face for sides in list(faces_of.values())[:4] for face in sides}
    faces.generation[list(changed)] += 1
    contact.stale = FACES_CHANGED
    tissue.step(None, strokes.DT)
    n_changed = n_lasting = 0
    for k in range(contacts.n_contacts):
        sides = faces_of.get(tuple(contacts.node[k]))
        if sides is not None and changed & set(sides):
            assert contacts.last_impulse[k] == 0.0
            n_changed += 1
        elif sides is not None:
            n_lasting += contacts.last_impulse[k] > 0.0
    assert n_changed > 0 and n_lasting > 3


def cut_and_dropped(n_steps: int) -> Snapshot:
    """Cut a block in two at a slant, so that one lip slides down the other on to the floor."""
    mesh = block((4, 2, 2), (0.04, 0.02, 0.02))
    fixed = mesh.positions[:, 0] == 0.0
    tissue = Tissue(
        mesh, replace(SPRINGS, toughness=0.5), fixed=fixed, floor=-0.01, solver=IMPULSES
    )
    results = strokes.make(tissue, strokes.slanted(mesh, lean=0.4, rake=0.2))
    results += [tissue.step(None, strokes.DT) for _ in range(n_steps)]
    assert tissue.n_pieces() == 2
    assert max(result.body_contacts.force for result in results) > 0.0
    assert results[-1].body_contacts.force_of_floor[2] > 0.01
    return tissue.snapshot()


def test_testing_every_pair_of_the_body_in_every_step_changes_no_bit(monkeypatch):
    """With a huge margin every pair is listed, and if no node is fast every pair is near."""
    default = cut_and_dropped(150)
    monkeypatch.setattr("tissue.contact.self_contact.PAIR_MARGIN", 1e3)
    monkeypatch.setattr("tissue.contact.self_contact.FAST_MOVE", 1e3)
    for one, other in zip(default, cut_and_dropped(150), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("floor", [np.nan, np.inf, 0.011])
def test_a_floor_that_is_not_finite_or_inside_the_body_is_refused(floor):
    mesh = block((1, 1, 1), (0.01,) * 3)
    lifted = mesh._replace(positions=mesh.positions + np.array([0.0, 0.0, 0.01]))
    with pytest.raises(ValueError, match="floor"):
        Tissue(lifted, floor=floor, solver=IMPULSES)
