"""The rigid part of a motion has its momentum and its angular momentum, and is the whole of it."""

import numpy as np
import pytest

from tests.support.bodies import jittered
from tissue.core.simd import room_for_points
from tissue.forces.rigid_motion import add_rigid_part, rigid_motion
from tissue.mesh.body import build_body
from tissue.mesh.pieces import LoosePieces, loose_pieces_of

pytestmark = pytest.mark.kernel

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
    found = rigid_motion(body, loose, 0, field)
    assert found.angular == (0.0, 0.0, 0.0)
    assert found.linear == pytest.approx(tuple(SPEED))
