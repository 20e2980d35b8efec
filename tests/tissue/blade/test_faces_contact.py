"""The side faces of the blade: pressure, friction, and that action equals reaction."""

import itertools
import math

import numpy as np
import pytest

from tissue import BladeShape, Material, block
from tissue.blade.blade_state import new_blade_state
from tissue.blade.edge import BladeCoordinates, Edge, motion_at, pose_at
from tissue.blade.edge_anchors import new_anchors
from tissue.blade.faces_contact import (
    POINTS,
    ContactStates,
    blade_profile,
    new_face_contacts,
    with_more_faces,
)
from tissue.blade.faces_forces import add_face_stiffness, apply_face_forces, apply_sliding
from tissue.blade.faces_search import (
    find_faces,
    forget_cells,
    forget_changed_faces,
    release_faces,
)
from tissue.blade.known_faces import continue_contact, note_divided
from tissue.core.vec3 import Vec3
from tissue.mesh.body import CUT, build_body
from tissue.mesh.material_table import MaterialArrays
from tissue.mesh.star import no_visits
from tissue.mesh.tetrahedron_grid import build_grid, list_moved

pytestmark = pytest.mark.kernel

SHAPE = BladeShape(thickness=2e-3, bevel_angle=math.atan(0.25), height=20e-3)
MATERIAL = Material(blade_friction=0.5)
BLOCK = block((2, 2, 2), (0.01, 0.01, 0.01))
LENGTH = 0.03
NODE_SIZE = 4e-3
"""Node size of the body [m]; faces are searched for within half of it."""


def edge_at(x, y=0.015, z=-0.01, forward=Vec3(0.0, 1.0, 0.0)):
    """Return an upright blade with its edge behind the block and its side face at the block."""
    tip, heel = Vec3(x, y, z), Vec3(x, y, z + LENGTH)
    return Edge(tip, heel, forward, tip, heel, forward)


class Pressed:
    """The block, which ends at x = 10 mm, and a blade beside it with its side face at x - 1 mm."""

    def __init__(self, x=0.0115, material=MATERIAL, of_materials=None, rows=None):
        table = None if of_materials is None else MaterialArrays.of(of_materials, [0, 1])
        self.body = build_body(BLOCK, None, None, table, rows)
        anchors = new_anchors(2, LENGTH, 4.0 * material.young_modulus)
        n = len(BLOCK.tetrahedra)
        self.blade = new_blade_state(anchors, SHAPE, material, NODE_SIZE, n)
        if table is not None:
            numbers = np.stack([table.blade_friction, table.blade_viscosity], axis=1)
            self.blade = self.blade.replaced(sides=self.sides.replaced(of_materials=numbers))
        self.totals = self.blade.totals
        self.forces = np.zeros_like(self.body.rest)
        self.find(edge_at(x))

    @property
    def sides(self):
        return self.blade.sides

    def find(self, edge):
        forget_cells(self.sides)
        self.find_in(build_grid(self.body, self.body.positions, 0.0), edge)

    def find_in(self, grid, edge):
        while not find_faces(self.blade, self.body, grid, edge, 1.0):
            self.blade = self.blade.replaced(sides=with_more_faces(self.sides))

    def rows(self):
        return slice(self.sides.n_faces)

    def press(self, edge):
        self.forces[:] = 0.0
        x = self.body.positions
        apply_face_forces(self.blade, motion_at(edge, 1.0), x, 1.0, 1.0, self.forces)
        return self.forces.sum(axis=0)

    def slide(self, edge):
        apply_sliding(self.blade, pose_at(edge, 1.0), self.body.positions, 1e-3)

    def divide(self, wholes):
        """Divide each of these faces at a third of its first edge, as a cut does."""
        body, states, n = self.body, self.sides.states, len(wholes)
        for name in ContactStates.__annotations__:
            getattr(self.sides.states_before, name)[:] = getattr(states, name)
        self.sides.row_of_face[:] = -1
        assert note_divided(self.sides) == n
        x = body.positions
        middles = (x[wholes[:, 0]] + 2.0 * x[wholes[:, 1]]) / 3.0
        self.body = body.replaced(positions=np.vstack([x, middles]))
        self.forces = np.zeros_like(self.body.positions)
        for i, (a, b, c) in enumerate(wholes.tolist()):
            for row, corners in ((i, (a, len(x) + i, c)), (n + i, (c, len(x) + i, b))):
                self.sides.node[row] = corners
                self.sides.friction[row] = self.sides.of_materials[0, 0]
                assert continue_contact(self.blade, self.body, row, n)
        self.sides.n_faces = 2 * n


@pytest.fixture
def pressed():
    return Pressed()


def test_the_profile_is_a_wedge_with_a_back_and_two_ends():
    sides = new_face_contacts(SHAPE, MATERIAL, NODE_SIZE, 1)
    reach = [
        blade_profile(sides, LENGTH, 0.0, BladeCoordinates(a, s, 0.0)).height
        for a, s in [(0.015, 0.0), (0.015, 2e-3), (0.015, 9e-3), (0.015, 0.02), (0.0, 9e-3)]
    ]
    np.testing.assert_allclose(reach, [0.0, 0.5e-3, 1e-3, 0.0, 0.0], atol=1e-15)


def test_pressure_is_stiffness_times_depth_times_area(pressed):
    force = pressed.press(edge_at(0.0108))  # its side face is 0.2 mm inside
    expected = pressed.sides.stiffness * 0.2e-3 * 0.01**2
    np.testing.assert_allclose(force, [-expected, 0.0, 0.0], rtol=1e-9, atol=1e-12)


def test_a_point_that_is_first_found_inside_the_blade_is_not_pushed_out():
    pressed = Pressed(x=0.0106)
    assert not pressed.press(edge_at(0.0106)).any()


def test_the_bevel_pushes_such_a_point_as_the_blade_advances():
    """After 2 mm the bevel of slope 1/4 is 0.5 mm thicker, and its side face 0.4 mm inside."""
    pressed = Pressed(x=0.0106)
    force = pressed.press(edge_at(0.0106, y=0.017))
    expected = pressed.sides.stiffness * 0.4e-3 * 0.01**2
    assert -force[0] == pytest.approx(expected, rel=1e-9)


def test_a_rising_bevel_pushes_the_tissue_forward():
    """The forward force of the wedge is its outward force times the slope."""
    pressed = Pressed(x=0.0106, material=Material())
    force = pressed.press(edge_at(0.0106, y=0.0158))
    assert force[0] < 0.0
    assert force[1] == pytest.approx(-0.25 * force[0], rel=1e-9)


def test_friction_holds_below_its_limit_and_slides_above(pressed):
    edge = edge_at(0.0108)
    pressed.press(edge)
    pressed.slide(edge)
    normal = -pressed.press(edge)[0]
    near, far = edge_at(0.0108, y=0.0150499), edge_at(0.0108, y=0.016)
    stuck = pressed.press(near)[1]
    assert stuck == pytest.approx(pressed.sides.stiffness * 0.0499e-3 * 0.01**2, rel=1e-6)
    assert pressed.press(far)[1] == pytest.approx(0.5 * normal, rel=1e-9)


def test_each_face_rubs_with_the_friction_of_the_tetrahedron_behind_it():
    rows = np.arange(len(BLOCK.tetrahedra)) % 2
    materials = [Material(blade_friction=friction) for friction in (0.1, 0.7)]
    pressed = Pressed(of_materials=materials, rows=rows)
    pressed.press(edge_at(0.0108))
    pressed.slide(edge_at(0.0108))
    force = pressed.press(edge_at(0.0108, y=0.016))
    sides = pressed.sides
    behind = rows[sides.face[pressed.rows()] // 4]
    area = POINTS * sides.states.area[pressed.rows()]
    assert set(behind[area > 0.0]) == {0, 1}
    pressure = sides.stiffness * 0.2e-3
    each = [0.1, 0.7] @ np.array([area[behind == row].sum() for row in (0, 1)])
    assert force[1] == pytest.approx(pressure * each, rel=1e-9)


def test_friction_drags_tissue_along_the_edge_as_the_blade_moves_along_it(pressed):
    pressed.press(edge_at(0.0108))
    pressed.slide(edge_at(0.0108))
    held = pressed.press(edge_at(0.0108, z=-0.01 + 0.0499e-3))[2]
    assert held == pytest.approx(pressed.sides.stiffness * 0.0499e-3 * 0.01**2, rel=1e-6)


def test_sliding_dissipates_friction_times_displacement(pressed):
    pressed.slide(edge_at(0.0108))
    normal = -pressed.press(edge_at(0.0108))[0]
    for y in (0.0155, 0.0165):
        before = pressed.totals.work_of_friction
        pressed.press(edge_at(0.0108, y=y))
        pressed.slide(edge_at(0.0108, y=y))
    dissipated = pressed.totals.work_of_friction - before
    assert dissipated == pytest.approx(0.5 * normal * 1e-3, rel=1e-6)


def test_viscosity_adds_stress_times_speed():
    """The point slides 0.5 mm in 1 ms, less the few percent by which its spring is extended."""
    dry, wet = Pressed(), Pressed(material=Material(blade_friction=0.5, blade_viscosity=1e3))
    forces = []
    for one in (dry, wet):
        for y in (0.015, 0.0155, 0.016):
            one.press(edge_at(0.0108, y=y))
            one.slide(edge_at(0.0108, y=y))
        forces.append(one.press(edge_at(0.0108, y=0.016))[1])
    assert forces[1] - forces[0] == pytest.approx(1e3 * 0.5 * 0.01**2, rel=0.1)


def test_the_force_is_the_slope_of_the_energy(pressed):
    """The work of the blade from outside to 0.2 mm inside, in 200 steps, is the stored energy."""
    xs = np.linspace(0.0112, 0.0108, 201)
    for a, b in itertools.pairwise(xs):
        end, start = edge_at(b), edge_at(a)
        after = (end.tip_t1, end.heel_t1, end.forward_t1)
        moving = Edge(start.tip_t0, start.heel_t0, start.forward_t0, *after)
        x, at_half = pressed.body.positions, motion_at(moving, 0.5)
        apply_face_forces(pressed.blade, at_half, x, 1.0, 1.0, pressed.forces)
    pressed.slide(edge_at(0.0108))
    stored = pressed.sides.states.energy[pressed.rows()].sum()
    assert pressed.totals.work_of_blade == pytest.approx(stored, rel=1e-4)
    release_faces(pressed.blade)
    assert pressed.totals.released == pytest.approx(stored, rel=1e-12)


def test_a_face_that_is_found_again_keeps_its_friction(pressed):
    edge = edge_at(0.0108)
    pressed.slide(edge)
    dragged = edge_at(0.0108, y=0.01503)
    before = pressed.press(dragged)
    pressed.find(dragged)
    np.testing.assert_allclose(pressed.press(dragged), before, rtol=1e-9)


def test_a_search_adds_no_energy_to_a_face_that_changes_size_under_the_blade(pressed):
    edge = edge_at(0.0108)
    pressed.slide(edge)
    pressed.body.positions[:, 1] *= 1.1  # the faces are larger now
    pressed.slide(edge)
    before = pressed.totals.released
    areas = pressed.sides.states.area[pressed.rows()].copy()
    loaded = pressed.sides.states.energy[pressed.rows()] > 0.0
    assert loaded.any()
    pressed.find(edge)
    assert pressed.totals.released == pytest.approx(before, abs=1e-18)
    np.testing.assert_array_equal(pressed.sides.states.area[: len(areas)][loaded], areas[loaded])


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"thickness": -1e-3}, "thickness"),
        ({"height": math.nan}, "height"),
        ({"bevel_angle": 1.5}, "degrees"),
        ({"height": 1e-4}, "bevels"),
        ({"edge_radius": -1.0}, "edge_radius"),
    ],
)
def test_an_impossible_blade_is_refused_by_name(fields, message):
    with pytest.raises(ValueError, match=message):
        BladeShape(**fields)


def test_a_blade_that_stays_in_its_grid_cells_finds_the_same_faces_as_a_new_search():
    """The blade moves to and fro by less than a cell, into another cell, and away."""
    pressed = Pressed()
    kept = build_grid(pressed.body, pressed.body.positions, 0.5e-3)
    n_found = []
    for x in (0.0115, 0.0113, 0.0109, 0.0131, 0.0045, 0.0115):
        faces = []
        for from_scratch in (False, True):
            if from_scratch:
                forget_cells(pressed.sides)
            pressed.find_in(kept, edge_at(x))
            faces.append(pressed.sides.face[pressed.rows()].tolist())
        assert faces[0] == faces[1]
        n_found.append(len(faces[0]))
    assert 0 < n_found.count(0) < len(n_found)


def test_faces_that_a_cut_opens_or_a_grid_lists_anew_are_found_as_by_a_new_search():
    """Links are cut beside the blade, and then nodes move to other cells, all in the same cells."""
    pressed = Pressed()
    body, kept = pressed.body, build_grid(pressed.body, pressed.body.positions, 0.5e-3)
    visits = no_visits(len(body.positions), len(body.tetrahedra))
    edge, n_before = edge_at(0.0109), pressed.sides.n_faces
    pressed.find_in(kept, edge)
    for t in sorted(
        {face // 4 for face in pressed.sides.around[: pressed.sides.n_around].tolist()}
    ):
        for f in range(4):
            link = int(body.links[t, f])
            if link >= 0:
                body.links[t, f] = body.links[link // 4, link % 4] = CUT
                changed = np.array([t, link // 4, -1])  # room for one more
                forget_changed_faces(pressed.sides, body, changed, 2)
                break
        expect_as_new(pressed, kept, edge)
    assert pressed.sides.n_faces > n_before
    for shift in (0.4e-3, -0.8e-3, 1.2e-3):
        body.positions[:, 1] += shift
        everything = np.arange(body.n_nodes)
        n, queue = body.n_nodes, pressed.blade.queue
        assert list_moved(body, visits, kept, everything, n, queue)
        expect_as_new(pressed, kept, edge)


def expect_as_new(pressed, grid, edge):
    """Fail unless a search finds what one finds that lists all faces around the blade again."""
    pressed.find_in(grid, edge)
    found = pressed.sides.face[pressed.rows()].tolist()
    forget_cells(pressed.sides)
    pressed.find_in(grid, edge)
    assert found == pressed.sides.face[pressed.rows()].tolist() == sorted(found)


def test_skin_with_tissue_between_it_and_the_blade_is_not_touched():
    """The blade stands in the block, 2 mm below its side, and goes forward by its bevel."""
    pressed = Pressed(x=0.008)
    assert not np.isclose(pressed.body.rest[pressed.sides.node[pressed.rows()], 0], 0.01).any()
    assert not pressed.press(edge_at(0.008, y=0.021)).any()


def test_the_parts_of_a_face_that_is_cut_press_and_rub_as_the_whole_did(pressed):
    """Each face in contact is divided at a point of its first edge, and is looked for again."""
    edge = edge_at(0.0108, y=0.0151)
    pressed.slide(edge_at(0.0108))
    pressed.press(edge)
    pressed.slide(edge)
    pressed.totals.angular_impulse[:] = 0.0
    force = pressed.press(edge)
    torque, n = pressed.totals.angular_impulse.copy(), pressed.sides.n_faces
    assert n > 0 and pressed.sides.states.energy[:n].min() > 0.0
    energy, wholes = pressed.sides.states.energy[:n].sum(), pressed.sides.node[:n].copy()
    pressed.divide(wholes)
    pressed.totals.angular_impulse[:] = 0.0
    np.testing.assert_allclose(pressed.press(edge), force, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(pressed.totals.angular_impulse, torque, rtol=1e-9, atol=1e-12)
    pressed.slide(edge)
    assert pressed.sides.states.energy[: 2 * n].sum() == pytest.approx(energy, rel=1e-9)


def test_side_contacts_add_stiffness_to_their_nodes(pressed):
    rows = np.zeros_like(pressed.body.rest)
    add_face_stiffness(pressed.sides, rows)
    area = POINTS * pressed.sides.states.area[pressed.rows()].sum()
    assert rows[:, 0].sum() >= pressed.sides.stiffness * area
