"""The law of contact of the blade's blunt sides, for a sample that presses on one face."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tissue import BladeShape, Material, block
from tissue.blade.blade_state import new_blade_state
from tissue.blade.edge import Edge, motion_at, pose_at
from tissue.blade.edge_anchors import new_anchors
from tissue.blade.spine_contact import (
    BACK,
    HEEL_END,
    PIERCING,
    PRESSING,
    STIFFEST,
    TIP_END,
    fit_stiffness,
    measure_tip_speeds,
    new_spine_contacts,
    press_energy,
    press_force,
    press_of,
    spine_side,
    strip_law_of,
    strip_stiffness,
    touched_point,
)
from tissue.blade.spine_forces import (
    add_spine_stiffness,
    apply_spine_forces,
    clear_spine_forces,
    slip_spine,
)
from tissue.core.vec3 import Vec3, dot
from tissue.mesh.body import build_body
from tissue.mesh.star import no_visits

pytestmark = pytest.mark.kernel

MESH = block((2, 2, 2), (0.02, 0.02, 0.02))
SHAPE = BladeShape()
NODE_SIZE, EDGE_LENGTH = 0.008, 0.016
MATERIAL = Material(10e3, toughness=20.0, skin_toughness=30.0, blade_friction=0.5)
LEADS = {
    BACK: ((0.0, -0.008, SHAPE.height), (0.0, 0.008, SHAPE.height), (0.0, 0.0, 1.0)),
    HEEL_END: ((0.0, -0.003, EDGE_LENGTH), (0.0, -0.003, 0.0), (0.0, -1.0, 0.0)),
    TIP_END: ((0.0, -0.003, 0.0), (0.0, -0.003, EDGE_LENGTH), (0.0, -1.0, 0.0)),
}
"""Places of tip and heel from the middle of the leading side, and where the edge faces."""


def edge_of(side, depth, beside=(0.0, 0.0)):
    at = np.array([0.011 + beside[0], 0.011 + beside[1], 0.02 - depth])
    tip, heel, forward = LEADS[side]
    tip, heel = Vec3(*(at + tip)), Vec3(*(at + heel))
    return Edge(tip, heel, Vec3(*forward), tip, heel, Vec3(*forward))


class PressingBlade:
    """A block, and a blade of which one sample of a side touches the skin straight above it."""

    def __init__(self, side, material=MATERIAL):
        self.body = build_body(MESH, None, None)
        self.visits = no_visits(len(MESH.positions), len(MESH.tetrahedra))
        state = new_blade_state(new_anchors(2, EDGE_LENGTH, 1e3), SHAPE, material, NODE_SIZE, 48)
        spine = new_spine_contacts(SHAPE, EDGE_LENGTH, material, NODE_SIZE)
        self.blade, self.spine = state.replaced(spine=spine), spine
        self.k = int(np.flatnonzero(spine.side == side)[1])
        at = spine_side(spine, pose_at(edge_of(side, 0.0), 1.0), self.k).at
        self._touch(np.array(at))
        self.forces = np.zeros_like(self.body.rest)

    def _touch(self, p):
        body, k = self.body, self.k
        for t, nodes in enumerate(body.tetrahedra[: body.n_tetrahedra]):
            corners = np.column_stack([body.rest[nodes], np.ones(4)]).T
            weights = np.linalg.solve(corners, [*p, 1.0])
            if weights.min() > -1e-12 and np.isclose(body.rest[nodes, 2], 0.02).sum() == 3:
                self.spine.tetrahedron[k], self.spine.weights[k] = t, weights
                self.spine.rest[k], self.spine.state[k] = p, PRESSING
                self.spine.n_pressing = 1
                return
        raise AssertionError(p)

    def press(self, edge):
        spine, pose = self.spine, pose_at(edge, 1.0)
        side = spine_side(spine, pose, self.k)
        point = touched_point(spine, self.body, self.body.positions, self.k)
        return press_of(spine, self.k, side, pose.normal, point, self.blade.toughness)

    def energy(self, edge):
        return press_energy(self.spine, self.k, self.press(edge))

    def force(self, edge):
        pose = pose_at(edge, 1.0)
        side = spine_side(self.spine, pose, self.k)
        return press_force(self.spine, self.k, side, pose.normal, self.press(edge))

    def apply(self, edge):
        apply_spine_forces(
            self.blade, self.body, motion_at(edge, 1.0), self.body.positions, 1.0, 1.0, self.forces
        )
        return self.blade.totals

    def slip(self, edge):
        slip_spine(self.blade, self.body, self.visits, pose_at(edge, 1.0))


@pytest.mark.parametrize("side", LEADS)
def test_a_side_presses_with_its_stiffness_times_depth(side):
    held = PressingBlade(side)
    depth = 1e-4
    force = held.force(edge_of(side, depth))
    assert force == pytest.approx((0.0, 0.0, -held.spine.stiffness[held.k] * depth), abs=1e-12)


@pytest.mark.parametrize("side", LEADS)
@pytest.mark.parametrize("beside", [(3e-5, -2e-5), (3e-4, -2e-4)], ids=["sticks", "slides"])
def test_the_force_is_the_gradient_of_the_energy(side, beside):
    held, h = PressingBlade(side), 1e-8
    edge = edge_of(side, 1e-4, beside)
    force, numeric = held.force(edge), []
    node = held.body.tetrahedra[held.spine.tetrahedron[held.k], 0]
    weight = held.spine.weights[held.k, 0]
    if weight == 0.0:
        node = held.body.tetrahedra[held.spine.tetrahedron[held.k], 1]
        weight = held.spine.weights[held.k, 1]
    for axis in range(2):  # along the skin the limit of friction stays
        ends = []
        for sign in (-1.0, 1.0):
            held.body.positions[node, axis] += sign * h
            ends.append(held.energy(edge))
            held.body.positions[node, axis] -= sign * h
        numeric.append(-(ends[1] - ends[0]) / (2.0 * h))
    np.testing.assert_allclose(numeric, weight * np.array(force[:2]), rtol=1e-4, atol=1e-12)


def test_friction_stays_below_coulombs_limit_and_what_slides_is_lost_to_it():
    held, depth = PressingBlade(BACK), 1e-4
    edge = edge_of(BACK, depth, (3e-4, 4e-4))
    push = held.spine.stiffness[held.k] * depth
    force = held.force(edge)
    assert math.hypot(force.x, force.y) == pytest.approx(0.5 * push)
    before = held.energy(edge)
    held.slip(edge)
    assert held.force(edge) == pytest.approx(tuple(force), abs=1e-15)
    assert held.blade.totals.work_of_friction == pytest.approx(before - held.energy(edge))
    assert held.blade.totals.work_of_friction == pytest.approx(0.5 * push * (5e-4 - 0.5 * depth))


def test_the_tip_holds_up_to_the_toughness_of_the_skin_then_pierces_at_that_of_the_rest():
    held = PressingBlade(TIP_END)
    length, stiffness = held.spine.length[held.k], held.spine.stiffness[held.k]
    limit = 30.0 * length / stiffness
    held.slip(edge_of(TIP_END, 0.99 * limit))
    assert held.spine.state[held.k] == PRESSING
    edge = edge_of(TIP_END, 1.01 * limit)
    before = held.energy(edge)
    assert held.force(edge).z == pytest.approx(-30.0 * length)
    held.slip(edge)
    assert held.spine.state[held.k] == PIERCING
    assert held.force(edge).z == pytest.approx(-20.0 * length)
    totals = held.blade.totals
    assert totals.work_of_cutting == pytest.approx(20.0 * length * (1.01 * limit - limit / 1.5))
    spent = totals.work_of_cutting + totals.work_of_breaking
    assert spent == pytest.approx(before - held.energy(edge))


def test_the_samples_cover_the_back_and_both_ends():
    spine = new_spine_contacts(SHAPE, EDGE_LENGTH, MATERIAL, NODE_SIZE)
    for side, size in ((BACK, EDGE_LENGTH), (HEEL_END, SHAPE.height), (TIP_END, SHAPE.height)):
        assert spine.length[spine.side == side].sum() == pytest.approx(size)
    pose = pose_at(edge_of(BACK, 0.0), 1.0)
    for k in range(len(spine.state)):
        side = spine_side(spine, pose, k)
        assert dot(side.outward, side.beside) == dot(side.outward, pose.normal) == 0.0


def test_a_thinner_blade_sinks_in_farther_and_a_thick_one_is_as_stiff_as_may_be():
    thin, thick = replace(SHAPE, thickness=0.1e-3), replace(SHAPE, thickness=0.4e-3)
    one, other = (
        strip_stiffness(strip_law_of(shape, MATERIAL, NODE_SIZE), 0.0) for shape in (thin, thick)
    )
    unit = 2.0 * (1.0 - 0.45**2) / (math.pi * 10e3)
    assert 1.0 / one - 1.0 / other == pytest.approx(unit * math.log(4.0))
    wide = BladeShape(thickness=0.05, bevel_angle=1.0, height=0.06)
    assert strip_stiffness(strip_law_of(wide, MATERIAL, NODE_SIZE), 0.0) == STIFFEST * 10e3


def test_a_sample_between_rows_of_nodes_is_softer_than_on_a_row():
    """Nodes of the skin are 10 mm apart: 1 mm from a row it is 9 and 1 mm from two of them."""
    held = PressingBlade(BACK)
    pose = pose_at(edge_of(BACK, 0.0), 1.0)
    fit_stiffness(held.spine, held.body, held.k, pose.normal)
    law, length = held.spine.law, held.spine.length[held.k]
    assert held.spine.stiffness[held.k] == pytest.approx(strip_stiffness(law, 9e-6) * length)
    assert strip_stiffness(law, 9e-6) < strip_stiffness(law, 0.0)


@pytest.mark.parametrize("side", LEADS)
def test_a_side_does_not_pull(side):
    held = PressingBlade(side)
    assert held.force(edge_of(side, -1e-4)) == (0.0, 0.0, 0.0)
    assert held.energy(edge_of(side, -1e-4)) == 0.0


def test_a_faster_tip_pierces_at_a_higher_toughness():
    law = Material(toughness=20.0, skin_toughness=30.0, toughness_exponent=1.0, toughness_speed=0.1)
    held = PressingBlade(TIP_END, law)
    length, stiffness = held.spine.length[held.k], held.spine.stiffness[held.k]
    deep = edge_of(TIP_END, 60.0 * length / stiffness)
    at_first = edge_of(TIP_END, 60.0 * length / stiffness - 1e-4)
    edge = Edge(
        *(at_first.tip_t0, at_first.heel_t0, at_first.forward_t0),
        *(deep.tip_t1, deep.heel_t1, deep.forward_t1),
    )
    measure_tip_speeds(held.spine, edge, 1e-3)  # 0.1 mm in 1 ms
    np.testing.assert_allclose(held.spine.speed[held.spine.side == TIP_END], 0.1)
    assert not held.spine.speed[held.spine.side != TIP_END].any()
    held.slip(edge)
    assert held.force(edge).z == pytest.approx(-40.0 * length)
    totals = held.blade.totals
    assert totals.work_of_cutting == pytest.approx(40.0 * length * 20.0 * length / stiffness)


@pytest.mark.parametrize("side", LEADS)
def test_force_and_torque_on_blade_and_tissue_are_opposite(side):
    held = PressingBlade(side)
    totals = held.apply(edge_of(side, 1e-4, (3e-5, -2e-5)))
    n = held.body.n_nodes
    torque = np.cross(held.body.positions[:n], held.forces[:n]).sum(axis=0)
    np.testing.assert_allclose(held.forces.sum(axis=0), -totals.impulse, atol=1e-15)
    np.testing.assert_allclose(torque, -totals.angular_impulse, atol=1e-15)
    clear_spine_forces(held.spine, held.body, held.forces)
    assert not held.forces.any()


def test_the_rows_of_stiffness_add_up_to_that_of_the_samples_that_press():
    held = PressingBlade(BACK)
    add_spine_stiffness(held.spine, held.body, held.forces)
    assert held.forces.sum() == pytest.approx(held.spine.stiffness[held.k])
