"""Tissue against rigid geoms: it rests, slides, is held, and pushes back."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tissue import (
    BladeSegment,
    BladeSweep,
    Geom,
    Material,
    SolverSettings,
    Tissue,
    TissueError,
    block,
    fixed_nodes,
)

DT = 1e-3
GEL = Material(
    law="neo_hookean", young_modulus=50e3, poisson_ratio=0.45, toughness=5.0, viscous_damping=20.0
)
BRICK = block((4, 3, 2), (0.04, 0.03, 0.02))
WEIGHT = 0.04 * 0.03 * 0.02 * GEL.density * 9.81
TABLE = Geom("table", "plane", friction=0.5)


def brick(gravity=(0.0, 0.0, -9.81), fixed=None, **solver):
    held = None if fixed is None else fixed_nodes(BRICK, fixed)
    settings = SolverSettings(audit=True, **solver)
    return Tissue(BRICK, GEL, gravity=gravity, fixed=held, solver=settings)


def on_incline(degrees, **solver):
    """A brick that has settled on a table, seen from the table: gravity leans."""
    angle = np.radians(degrees)
    tissue = brick((9.81 * np.sin(angle), 0.0, -9.81 * np.cos(angle)), **solver)
    contact = tissue.collide_with([TABLE])
    tissue.settle()
    return tissue, contact


def centre(tissue):
    now = tissue.snapshot()
    return now.masses @ now.positions / now.masses.sum()


def total_momentum(tissue):
    now = tissue.snapshot()
    return now.masses @ now.velocities


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
def test_what_rests_on_a_table_presses_with_its_weight(relaxation):
    tissue, touch = on_incline(0.0, relaxation=relaxation)
    for _ in range(20):
        tissue.step(None, DT)
    assert touch.wrench(0).force == pytest.approx([0.0, 0.0, -WEIGHT], abs=1e-3 * WEIGHT)
    assert tissue.bounds[0, 2] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("relaxation", ["global", "verlet"])
@pytest.mark.parametrize("thickness", [0.01, 0.02])
def test_what_rests_on_a_table_does_not_begin_to_tremble(relaxation, thickness):
    gel = Material(law="neo_hookean", young_modulus=50e3, poisson_ratio=0.0, viscous_damping=0.0)
    tissue = Tissue(
        block((4, 3, 2), (0.04, 0.03, thickness)), gel, solver=SolverSettings(relaxation=relaxation)
    )
    tissue.collide_with([TABLE])
    tissue.settle()
    for _ in range(1500):
        tissue.step(None, DT)
    assert np.abs(tissue.snapshot().velocities).max() < 1e-6


@pytest.mark.parametrize(("degrees", "slides"), [(26.565 - 1.0, False), (26.565 + 1.0, True)])
def test_a_block_slips_at_the_angle_whose_tangent_is_the_friction(degrees, slides):
    tissue, _ = on_incline(degrees)
    before = centre(tissue)
    for _ in range(300):
        tissue.step(None, DT)
    way = (centre(tissue) - before)[0]
    assert way > 1e-3 if slides else abs(way) < 1e-7


def test_a_block_that_slides_is_braked_by_the_friction():
    angle = np.radians(40.0)
    tissue = brick((9.81 * np.sin(angle), 0.0, -9.81 * np.cos(angle)))
    contact = tissue.collide_with([TABLE])
    for _ in range(200):  # until it no longer trembles
        tissue.step(None, DT)
    assert contact.wrench(0).force[2] < 0.0
    v = total_momentum(tissue)[0]
    for _ in range(200):
        tissue.step(None, DT)
    gained = (total_momentum(tissue)[0] - v) / (WEIGHT / 9.81) / 0.2
    slope = np.radians(40.0)
    assert gained == pytest.approx(9.81 * (np.sin(slope) - 0.5 * np.cos(slope)), rel=0.05)


def test_what_the_geoms_get_is_what_the_tissue_loses_to_rounding():
    tissue = brick(gravity=(0.0, 0.0, 0.0))
    pads = [Geom("a", "box", (0.003, 0.012, 0.008), 0.5), Geom("b", "sphere", (0.01,), 0.3)]
    touch = tissue.collide_with(pads, [[-0.0031, 0.014, 0.011], [0.0501, 0.016, 0.011]])
    for k in range(60):
        before = total_momentum(tissue)
        touch.move([[-0.0031 + 5e-5 * k, 0.014, 0.011], [0.0501 - 4e-5 * k, 0.016, 0.011]])
        tissue.step(None, DT)
        change = (total_momentum(tissue) - before) / DT
        assert change + touch.wrenches()[0].sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-9)
    assert len(touch.forces().geom) > 10
    assert touch.forces().force.sum(axis=0) == pytest.approx(-touch.wrenches()[0].sum(axis=0))


def test_the_torque_on_a_geom_is_the_moment_of_its_contacts():
    tissue, touch = on_incline(10.0)
    for _ in range(5):
        tissue.step(None, DT)
    found = touch.forces()
    moment = np.cross(found.point, -found.force).sum(axis=0)
    assert touch.wrench(0).torque == pytest.approx(moment, abs=1e-7)


def test_a_step_reports_the_force_of_each_contact_with_the_number_of_its_geom():
    tissue = brick(gravity=(0.0, 0.0, 0.0), fixed="back")
    pads = [Geom("a", "box", (0.003, 0.012, 0.008), 0.5), Geom("b", "sphere", (0.01,), 0.3)]
    touch = tissue.collide_with(pads, [[-0.0031, 0.014, 0.011], [0.0501, 0.016, 0.011]])
    blade = [edge_at(-0.003 + 1e-4 * k) for k in range(61)]
    for k, sweep in enumerate(map(BladeSweep, blade, blade[1:])):
        touch.move([[-0.0031 + 2e-5 * k, 0.014, 0.011], [0.0501 - 2e-5 * k, 0.016, 0.011]])
        result = tissue.step(sweep, DT)
    contacts = result.contacts
    force = contacts.normal_force[:, None] * contacts.normal + contacts.friction
    for geom, on_geom in enumerate(touch.wrenches()[0]):
        mine = contacts.geom == geom
        assert mine.any() and not contacts.cut_area[mine].any()
        assert force[mine].sum(axis=0) == pytest.approx(-on_geom, abs=1e-12)
    assert np.einsum("ni,ni->n", contacts.friction, contacts.normal) == pytest.approx(0, abs=1e-12)
    of_blade = contacts.of_blade
    assert len(of_blade.geom) > 2 and (of_blade.geom == -1).all()
    assert len(of_blade.geom) == (contacts.geom == -1).sum()
    assert (-force[contacts.geom == -1]).sum(axis=0) == pytest.approx(
        result.wrench_t1.force, abs=1e-12
    )


def edge_at(y):
    """An upright edge through the middle of the brick."""
    ends = np.array([[0.0213, y, -0.01], [0.0213, y, 0.03]])
    return BladeSegment(*ends, np.array([0.0, 1.0, 0.0]))


def test_the_work_of_a_drop_is_accounted_for():
    tissue = brick()
    tissue.collide_with([TABLE], [[0.0, 0.0, -0.005]])
    for _ in range(1500):
        energies = tissue.step(None, 2e-4).energies
    assert abs(energies.residual) < 0.005 * -energies.potential
    assert energies.contact > 0.0


def test_the_work_of_a_squeeze_is_accounted_for():
    tissue = brick(gravity=(0.0, 0.0, 0.0), fixed="bottom")
    press = tissue.collide_with([Geom("press", "plane", friction=0.3)], [[0, 0, 0.0201]], [TURNED])
    for k in range(200):
        press.move([[0.0, 0.0, 0.0201 - 2e-5 * min(k, 100)]])
        energies = tissue.step(None, DT).energies
    assert energies.work_of_loads > 1e-4
    assert abs(energies.residual) < 0.005 * energies.work_of_loads


@pytest.mark.parametrize(
    ("relaxation", "friction", "share"),
    [("global", 0.0, 0.005), ("global", 0.6, 0.005), ("verlet", 0.6, 0.01)],
)
def test_the_work_of_jaws_that_close_on_an_edge_is_accounted_for(relaxation, friction, share):
    mesh = block((10, 8, 4), (0.04, 0.03, 0.014))
    tissue = Tissue(
        mesh,
        GEL,
        gravity=(0.0, 0.0, 0.0),
        fixed=fixed_nodes(mesh, "left"),
        solver=SolverSettings(audit=True, relaxation=relaxation),
    )
    pads = [Geom(name, "box", (0.005, 0.005, 0.001), friction) for name in ("upper", "lower")]
    jaws = tissue.collide_with(pads, between_jaws(0.0142))
    for opening in [*np.linspace(0.0142, 0.010, 100), *[0.010] * 50]:
        jaws.move(between_jaws(opening))
        energies = tissue.step(None, DT).energies
    assert energies.work_of_loads > 1e-3
    assert abs(energies.residual) < share * energies.work_of_loads


@pytest.mark.parametrize("friction", [0.0, 0.05, 0.5])
def test_the_work_of_pads_that_slip_along_a_block_is_accounted_for(friction):
    mesh = block((8, 4, 2), (0.072, 0.036, 0.018))
    tissue = Tissue(
        mesh,
        Material(law="neo_hookean", young_modulus=20e3, poisson_ratio=0.45, viscous_damping=20.0),
        gravity=(0.0, 0.0, 0.0),
        fixed=fixed_nodes(mesh, "left"),
        solver=SolverSettings(audit=True),
    )
    pads = [Geom(name, "box", (0.008, 0.008, 0.002), friction) for name in ("upper", "lower")]
    middle = np.array([0.04, 0.017, 0.009])
    pinch = tissue.collide_with(pads, middle + np.array([[0, 0, 0.0111], [0, 0, -0.0111]]))
    ways = [(depth, 0.0) for depth in np.linspace(0.0, 0.0026, 100)]
    ways += [(0.0026, x) for x in np.linspace(0.0, 0.02, 200)]
    for depth, x in ways:
        pinch.move(middle + np.array([[x, 0, 0.0111 - depth], [x, 0, depth - 0.0111]]))
        energies = tissue.step(None, DT).energies
    assert pinch.wrench(0).force[2] > 2.0
    assert abs(energies.residual) < 0.005 * energies.work_of_loads


def between_jaws(opening):
    """Centres of two pads of 2 mm on the edge of a block of 14 mm, so far apart [m]."""
    return [[0.036, 0.015, 0.007 + side * (opening / 2 + 0.001)] for side in (1.0, -1.0)]


TURNED = Rotation.from_rotvec([np.pi, 0.0, 0.0]).as_matrix()
"""Axes of a plane that faces down."""


def cross_2d(u, v):
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


def is_covered(surface, point):
    """Whether tissue is above a point by more than 0.3 mm."""
    a, b, c = surface.positions[surface.triangles].swapaxes(0, 1)
    u, v, w = (b - a)[:, :2], (c - a)[:, :2], point[:2] - a[:, :2]
    area = cross_2d(u, v)
    s, t = cross_2d(w, v) / area, cross_2d(u, w) / area
    height = a[:, 2] + s * (b - a)[:, 2] + t * (c - a)[:, 2]
    return bool(((s >= 0) & (t >= 0) & (s + t <= 1) & (height > point[2] + 3e-4)).any())


@pytest.mark.parametrize("angle", [0.0, 27.0, 45.0])
@pytest.mark.parametrize("shift", [0.0, 0.0011])
def test_a_rod_of_one_millimetre_does_not_pass_at_half_a_metre_a_second(angle, shift):
    mesh = block((9, 9, 6), (0.03, 0.03, 0.02))
    tissue = Tissue(mesh, GEL, fixed=fixed_nodes(mesh, "bottom"), gravity=(0.0, 0.0, 0.0))
    lying = Rotation.from_euler("ZY", [angle, 90.0], degrees=True).as_matrix()
    x = np.array([0.015 + shift, 0.015 + 0.3 * shift, 0.0206])
    rod = tissue.collide_with([Geom("rod", "capsule", (5e-4, 0.02), 0.2)], [x], [lying])
    for k in range(60):
        down = min((k + 1) * 0.5 * DT, 0.0036)
        rod.move([x - [0.0, 0.0, down]])
        tissue.step(None, DT)
    along = np.linspace(-0.014, 0.014, 29)[:, None] * lying[:, 2]
    assert not any(is_covered(tissue.surface(), p) for p in x - [0.0, 0.0, down] + along)
    assert rod.wrench(0).force[2] > 1.0


def test_a_ball_between_the_nodes_of_a_face_is_felt():
    """The nearest node is 5 mm from the middle of a ball of 2 mm."""
    mesh = block((3, 3, 2), (0.03, 0.03, 0.02))
    tissue = Tissue(mesh, GEL, fixed=fixed_nodes(mesh, "bottom"), gravity=(0.0, 0.0, 0.0))
    ball = tissue.collide_with([Geom("ball", "sphere", (0.002,))], [[0.0135, 0.0165, 0.022]])
    for k in range(100):
        ball.move([[0.0135, 0.0165, 0.022 - 1e-5 * (k + 1)]])
        tissue.step(None, DT)
    assert ball.wrench(0).force[2] > 0.1


def test_a_cut_piece_lands_on_the_table():
    tissue = brick(fixed="left")
    touch = tissue.collide_with([TABLE], [[0.0, 0.0, -0.004]])
    line = [[[0.021, y, 0.03], [0.021, y, -0.01]] for y in np.linspace(-0.01, 0.04, 26)]
    tissue.incise(line, (0.0, 1.0, 0.0))
    assert tissue.n_pieces() == 2
    for _ in range(600):
        tissue.step(None, DT)
    loose = next(piece for piece in tissue.pieces() if not piece.is_held)
    assert touch.wrench(0).force[2] == pytest.approx(-9.81 * loose.mass, rel=0.05)


def test_threads_give_the_same_bits():
    states = []
    for threads in (1, 2):
        tissue = brick(threads=threads)
        ball = Geom("ball", "sphere", (0.01,), 0.2)
        touch = tissue.collide_with([TABLE, ball], [[0, 0, -1e-3], [0.02, 0.015, 0.0301]])
        for k in range(50):
            touch.move([[0, 0, -1e-3], [0.02, 0.015, 0.0301 - 1e-4 * k]])
            tissue.step(None, DT)
        states.append(tissue.snapshot().positions.tobytes() + touch.wrenches()[0].tobytes())
    assert states[0] == states[1]


def test_a_move_that_is_refused_moves_none_of_the_geoms():
    """The second has no pose: the first, which has, stays as well."""
    balls = [Geom(name, "sphere", (0.01,)) for name in ("one", "two")]
    begin = np.array([[0.02, 0.015, 0.05], [0.1, 0.1, 0.1]])
    states = []
    for is_tried in (False, True):
        tissue = brick()
        touch = tissue.collide_with(balls, begin)
        if is_tried:
            with pytest.raises(ValueError, match="geom 'two'"):
                touch.move(begin + np.array([[0, 0, -0.015], [0, 0, np.nan]]))
        tissue.step(None, DT)
        states.append(tissue.snapshot().positions.tobytes() + touch.arrays.geoms.origin.tobytes())
    assert states[0] == states[1]


def test_a_body_that_no_geom_holds_is_refused_or_said_to_move():
    tissue = brick()
    tissue.collide_with(
        [Geom("wall", "plane")], [[-0.01, 0, 0]], [[[0, 0, 1], [0, 1, 0], [-1, 0, 0]]]
    )
    with pytest.raises(TissueError, match="cannot come to rest"):
        tissue.settle()


@pytest.mark.parametrize(
    ("geom", "said"),
    [
        (Geom("a", "cone"), "geom 'a' has the shape 'cone'; there are plane, sphere"),
        (Geom("a", "box", (1.0, 2.0)), r"sizes \(1.0, 2.0\); a box has 3"),
        (Geom("a", "sphere", (-1.0,)), "positive and finite"),
        (Geom("a", "sphere", (1.0,), float("nan")), "friction of nan"),
        (Geom("a", "mesh"), "needs `vertices`"),
        (Geom("a", "mesh", vertices=np.eye(3)), "without a volume"),
        (Geom("a", "sphere", (0.01,)), "10 mm inside the tissue|mm inside the tissue"),
    ],
)
def test_a_geom_that_makes_no_sense_is_refused(geom, said):
    with pytest.raises(ValueError, match=said):
        brick().collide_with([geom], [[0.02, 0.015, 0.01]])


def test_poses_that_make_no_sense_are_refused():
    touch = brick().collide_with([TABLE])
    with pytest.raises(ValueError, match="three finite numbers"):
        touch.move([[0.0, 0.0, np.nan]])
    with pytest.raises(ValueError, match="three axes as columns"):
        touch.move([[0.0, 0.0, 0.0]], [2.0 * np.eye(3)])
    with pytest.raises(ValueError, match="turns by more than"):
        touch.move([[0.0, 0.0, 0.0]], [TURNED])


def test_a_geom_that_would_take_long_to_follow_is_refused():
    """500 increments of a quarter of its thickness of 2 mm: 0.25 m."""
    touch = brick().collide_with([Geom("rod", "capsule", (1e-3, 0.01))], [[0.0, 0.0, 1.0]])
    touch.move([[0.24, 0.0, 1.0]])
    with pytest.raises(ValueError, match=r"geom 'rod' moves so far in one step, to .*increments"):
        touch.move([[0.26, 0.0, 1.0]])


def test_two_geoms_of_one_name_are_refused():
    with pytest.raises(ValueError, match="two geoms have the name 'table'"):
        brick().collide_with([TABLE, TABLE])


def test_the_hierarchical_relaxation_refuses_geoms():
    springs = Material(law="springs", poisson_ratio=0.25)
    tissue = Tissue(BRICK, springs, solver=SolverSettings(relaxation="hierarchical"))
    with pytest.raises(ValueError, match="does not touch geoms with relaxation='hierarchical'"):
        tissue.collide_with([TABLE])
