"""Fibres on the edge of the blade: what it sweeps across, and the force on the bend."""

from itertools import pairwise

import numpy as np
import pytest

from tests.support.bodies import jittered
from tissue.blade.edge import Edge
from tissue.core.simd import room_for_points
from tissue.core.vec3 import Vec3
from tissue.forces.attachments import CAUGHT, SEVERED, STRAIGHT, holding_energy, no_attachments
from tissue.forces.fibre_crossing import catch_fibres, note_fibres
from tissue.forces.fibres import force_at, slip_fibres
from tissue.forces.rigid_motion import add_rigid_part, rigid_motion
from tissue.mesh.body import build_body
from tissue.mesh.pieces import LoosePieces, loose_pieces_of

pytestmark = pytest.mark.kernel

POSITIONS = np.array([[0.0, 0.0, -1.0]] + [[9.0, 9.0, 9.0]] * 3)
"""The fibre goes from its first node, (0, 0, -1), to (0, 0, 1)."""


def fibre(**fields):
    found = no_attachments(1)
    found.nodes[0], found.weights[0] = range(4), (1.0, 0.0, 0.0, 0.0)
    found.begin[0] = found.end[0] = (0.0, 0.0, 1.0)
    numbers = {"stiffness": 10.0, "length": 2.0, "section": 1e-2, "toughness": 50.0}
    for name, value in (numbers | fields).items():
        getattr(found, name)[0] = value
    return found


def edge(y0, y1, *, x=(-1.0, 1.0), z=0.0, forward=1.0, lift=0.0):
    """An edge along x, of which the heel is `lift` higher, that moves from y0 to y1."""
    ends = [Vec3(x[0], y, z) for y in (y0, y1)], [Vec3(x[1], y, z + lift) for y in (y0, y1)]
    ahead = Vec3(0.0, forward, 0.0)
    return Edge(ends[0][0], ends[1][0], ahead, ends[0][1], ends[1][1], ahead)


def swept(fibres, *edges):
    for each in edges:
        note_fibres(fibres, POSITIONS, 0.0)
        catch_fibres(fibres, POSITIONS, each, 0.0, 1.0)
    return fibres


def test_an_edge_that_sweeps_across_a_fibre_catches_it_where_it_passes():
    found = swept(fibre(), edge(-0.1, 0.3, x=(-0.25, 0.75), z=0.5))
    assert found.state[0] == CAUGHT and found.n_caught == 1
    np.testing.assert_allclose(found.place[0], [0.25, 0.3])  # from the tip; the edge is ahead
    np.testing.assert_allclose(found.bend[0], [0.0, 0.0, 0.5])
    assert found.released == 0.0


@pytest.mark.parametrize(
    "beside",
    [
        {"x": (0.01, 1.0)},
        {"x": (-1.0, -0.01)},
        {"z": 1.01},
        {"z": -1.01},
        {"forward": -1.0},
        {"x": (-5e-8, 5e-8), "lift": 2.0, "z": -1.0},
    ],
    ids=["tip", "heel", "above", "below", "back", "along it"],
)
def test_an_edge_that_passes_beside_it_does_not(beside):
    assert swept(fibre(), edge(-0.1, 0.3, **beside)).state[0] == STRAIGHT


def test_a_crossing_that_two_increments_share_is_found_once():
    """The edge stops on the fibre: touching counts as one of the sides, in both increments."""
    for parts in ([-0.1, 0.0, 0.1], [0.1, 0.0, -0.1]):
        ahead = 1.0 if parts[0] < 0 else -1.0
        states = []
        found = fibre()
        for y0, y1 in pairwise(parts):
            swept(found, edge(y0, y1, forward=ahead))
            states.append(found.state[0])
        assert states[-1] == CAUGHT and found.n_caught == 1


def test_an_edge_without_motion_catches_nothing():
    for y in (-0.1, 0.0, 0.1):
        assert swept(fibre(), edge(y, y)).state[0] == STRAIGHT


def test_a_fibre_that_moves_onto_an_edge_at_rest_is_caught():
    found = fibre()
    found.before[0] = (0.0, 0.1, -1.0, 0.0, 0.1, 1.0)
    catch_fibres(found, POSITIONS, edge(0.05, 0.05), 0.0, 1.0)
    assert found.state[0] == CAUGHT


def test_the_force_on_the_bend_is_the_slope_of_the_energy():
    found, step, random = fibre(), 1e-6, np.random.default_rng(0)
    x, end = Vec3(0.0, 0.0, -1.0), Vec3(0.0, 0.0, 1.0)

    def energy(bend):
        lengths = [np.linalg.norm(bend - np.array(each)) for each in (x, end)]
        return holding_energy(found, 0, sum(lengths))

    for bend in random.uniform(-0.5, 0.5, (10, 3)):
        slope = [
            (energy(bend + step * axis) - energy(bend - step * axis)) / (2.0 * step)
            for axis in np.eye(3)
        ]
        force = force_at(found, 0, Vec3(*bend), x, end)
        np.testing.assert_allclose(force, -np.array(slope), atol=1e-6)


def test_a_slip_spends_the_energy_that_the_string_loses_and_leaves_the_resistance():
    """Section 0.01 m2 is 0.113 m across: the edge goes in at 50 * 0.01 / 0.113 = 4.43 N."""
    found = swept(fibre(), edge(-0.1, 0.0), edge(0.0, 1e-9))
    x, end = Vec3(0.0, 0.0, -1.0), Vec3(0.0, 0.0, 1.0)
    there = edge(0.0, 0.75)
    before = holding_energy(found, 0, 2.0 * np.hypot(1.0, 0.75 - found.place[0, 1]))
    slip_fibres(found, POSITIONS, there, 1.0)
    after = holding_energy(found, 0, 2.0 * np.hypot(1.0, found.bend[0, 1]))
    assert found.state[0] == CAUGHT
    assert found.severing == pytest.approx(before - after) and before > after
    force = force_at(found, 0, Vec3(*found.bend[0]), x, end)
    np.testing.assert_allclose(force, [0.0, -0.5 / np.sqrt(0.04 / np.pi), 0.0], atol=1e-9)


AXIS, SPEED = np.array([3.0, -1.0, 2.0]), np.array([0.1, 0.2, -0.3])


@pytest.fixture
def body():
    body = build_body(jittered(2, 0), None, None)
    body.masses[:] = np.random.default_rng(1).uniform(1e-3, 2e-3, len(body.masses))
    return body


def rigid_part(body, loose, motion):
    field, out = room_for_points(len(body.rest)), room_for_points(len(body.rest))
    field[: len(motion)] = motion
    add_rigid_part(body, loose, field, 1.0, out)
    return out[: body.n_nodes]


def momenta(body, motion):
    m, x = body.masses[: body.n_nodes, None], body.positions[: body.n_nodes]
    return (m * motion).sum(axis=0), np.cross(x, m * motion).sum(axis=0)


def test_the_rigid_part_of_a_rigid_motion_is_the_motion(body):
    motion = SPEED + np.cross(AXIS, body.positions[: body.n_nodes])
    np.testing.assert_allclose(rigid_part(body, loose_pieces_of(body), motion), motion, atol=1e-14)


def test_the_rigid_part_of_any_motion_has_its_momenta(body):
    motion = np.random.default_rng(0).normal(size=(body.n_nodes, 3))
    found = momenta(body, rigid_part(body, loose_pieces_of(body), motion))
    for one, other in zip(found, momenta(body, motion), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-14)


def test_nodes_in_one_line_do_not_turn(body):
    body.positions[:3] = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.01], [0.0, 0.0, 0.03]]
    loose = LoosePieces(node=np.arange(3), begin=np.array([0, 3]))
    field = room_for_points(len(body.rest))
    field[:3] = SPEED
    found = rigid_motion(body.masses, body.positions, loose, 0, field)
    assert found.angular == (0.0, 0.0, 0.0)
    assert found.linear == pytest.approx(tuple(SPEED))


def test_a_fibre_is_severed_for_just_its_energy():
    found = swept(fibre(), edge(-0.1, 0.0), edge(0.0, 1e-9))
    before = holding_energy(found, 0, 2.0 * np.hypot(1.0, 2.0))
    slip_fibres(found, POSITIONS, edge(0.0, 2.0), 1.0)
    assert found.state[0] == SEVERED and found.n_caught == 0
    assert found.severing == 0.5
    assert found.released == pytest.approx(before - 0.5)
