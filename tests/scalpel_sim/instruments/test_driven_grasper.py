"""What a grasper closes on, holds and lets go, and that both sides feel it."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bridge import TissueFrame
from scalpel_sim.arm.grasper import (
    FORWARD,
    GRASPER,
    PADS_HEEL,
    PADS_TIP,
    SHAFT_LENGTH,
    GuidedGrasper,
    Pads,
    add_grasper,
)
from scalpel_sim.arm.hand import Impedance, add_hand
from scalpel_sim.instruments.driven_grasper import DrivenGrasper, GripSettings, between_pads
from scalpel_sim.instruments.geom_coupling import GeomCoupling
from scalpel_sim.strokes.grasp_motion import GraspMotion, Waypoint
from tissue import Material, SolverSettings, Tissue, block

DT = 1e-3
UP, X = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
GEL = Material(
    law="neo_hookean", young_modulus=20e3, poisson_ratio=0.45, density=1000.0, viscous_damping=40.0
)
BLOCK = block((3, 3, 6), (0.006, 0.006, 0.03))
"""1.08 g."""
GANTRY = """
<mujoco>
  <option timestep="0.001" gravity="0 0 -9.81"><flag autoreset="disable"/></option>
  <worldbody>
    <body name="arm" pos="0 0 -.2" gravcomp="1">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <joint name="yaw" axis="0 0 1" armature="1e-4"/>
      <joint name="pitch" axis="0 1 0" armature="1e-4"/>
      <joint name="roll" axis="1 0 0" armature="1e-4"/>
      <geom size=".02" mass=".05"/>
    </body>
  </worldbody>
</mujoco>
"""


def rows(*given):
    """Rows of a motion with the shaft up: time, height of the pads, opening."""
    return GraspMotion([Waypoint(t, (0.0, 0.0, z), UP, X, gap) for t, z, gap in given], "left")


def led(motion, tissue, frame=TissueFrame(), settings=GripSettings(closed=0.008), force=None):
    """A grasper on a gantry, at the start of its motion."""
    spec = mujoco.MjSpec.from_string(GANTRY)
    add_grasper(spec, "arm", force=force)
    add_hand(spec, Impedance(), GRASPER + PADS_HEEL, GRASPER + PADS_TIP, FORWARD)
    model = spec.compile()
    data = mujoco.MjData(model)
    start = frame.points_to_world(motion.stroke(0.0, 1e-3).pose(0.0).heel)
    data.qpos[:3] = start - [0.0, 0.0, SHAFT_LENGTH - 0.2]
    data.qpos[-2:] = 0.5 * motion.opening(0.0)
    mujoco.mj_forward(model, data)
    grasper = GuidedGrasper(model, data)
    grasper.hold()
    return DrivenGrasper(grasper, data, motion, tissue, frame, settings)


def run(hand, tissue, seconds, *others):
    """Do frames with a grasper and other partners; return the force on the grasper in each."""
    data, forces, partners = hand._data, [], [hand, *others]
    for _ in range(round(seconds / DT)):
        hand.lead(data.time)
        mujoco.mj_step1(data.model, data)
        for partner in partners:
            partner.follow()
        tissue.step(None, DT)
        for partner in partners:
            partner.apply()
        mujoco.mj_step2(data.model, data)
        forces.append(hand.wrench.force)
    return np.array(forces)


def hanging(audit=False, gravity=-9.81):
    """A block around the axis, 30 mm high, in gravity along z, held by nothing."""
    positions = BLOCK.positions - [0.003, 0.003, 0.0]
    mesh, solver = BLOCK._replace(positions=positions), SolverSettings(audit=audit)
    return Tissue(mesh, GEL, gravity=(0.0, 0.0, gravity), solver=solver)


# Which points


def test_points_between_the_pads_are_those_of_the_tissue_in_the_box():
    tissue = Tissue(block((4, 4, 4), (0.02, 0.02, 0.02)))
    pads = Pads(np.array([0.01, 0.02, 0.01]), np.eye(3), np.array([0.003, 0.005, 0.002]))
    found = between_pads(tissue, pads)
    assert len(found) == 5 * 5 * 4  # 5 from pad to pad, and half of the box is outside
    low, high = found.min(axis=0), found.max(axis=0)
    assert low == pytest.approx([0.0076, 0.0155, 0.0085])
    assert high == pytest.approx([0.0124, 0.0195, 0.0115])


def test_points_of_a_body_that_has_moved_are_given_where_they_are_at_rest():
    """The body is stretched to twice its length and turned; so are the pads."""
    mesh = block((2, 4, 2), (0.01, 0.02, 0.01))
    turned = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
    stretched = mesh.positions * [1.0, 2.0, 1.0]
    tissue = Tissue(mesh, positions=stretched @ turned.T)
    middle = np.array([0.005, 0.02, 0.005])
    pads = Pads(turned @ middle, turned, np.array([0.002, 0.004, 0.002]))
    found = between_pads(tissue, pads)
    rest = (middle + [[0.0, y, 0.0] for y in (-0.0035, 0.0035)]) * [1.0, 0.5, 1.0]
    assert len(found) == 4 * 8 * 4
    assert (found[:, 1].min(), found[:, 1].max()) == pytest.approx((rest[0, 1], rest[1, 1]))
    frame = TissueFrame(turned.T, np.array([0.1, 0.2, 0.3]))
    in_world = Pads(frame.points_to_world(pads.centre), np.eye(3), pads.half_size)
    assert np.sort(between_pads(tissue, in_world, frame), axis=0) == pytest.approx(
        np.sort(found, axis=0), abs=1e-9
    )


def test_nothing_is_between_pads_beside_the_body():
    pads = Pads(np.array([0.5, 0.0, 0.0]), np.eye(3), np.full(3, 0.005))
    assert between_pads(Tissue(BLOCK), pads).shape == (0, 3)


# What it holds


def test_a_grasper_that_has_closed_on_a_piece_carries_its_weight():
    tissue = hanging()
    hand = led(rows((0.0, 0.005, 0.007)), tissue)
    force = run(hand, tissue, 0.6)[-100:].mean(axis=0)
    weight = tissue.pieces()[0].mass * 9.81
    assert force == pytest.approx([0.0, 0.0, -weight], abs=0.02 * weight)
    assert hand.n_points > 100
    recorded = hand.columns.values(None)
    assert recorded[:3] == list(hand.wrench.force) and recorded[7] == hand.n_points


def test_the_work_of_the_hand_is_in_the_account_of_energy():
    tissue = hanging(audit=True)
    hand = led(rows((0.0, 0.005, 0.007), (0.6, 0.055, 0.007)), tissue)
    run(hand, tissue, 0.9)
    energies = tissue.step(None, DT).energies
    lifted = tissue.pieces()[0].mass * 9.81 * 0.05
    assert energies.potential == pytest.approx(lifted, rel=0.02)
    assert abs(energies.residual) < 5e-3 * energies.work_of_loads


def test_it_lets_go_where_its_jaws_open():
    tissue = hanging()
    hand = led(rows((0.0, 0.005, 0.007), (0.1, 0.005, 0.007), (0.2, 0.005, 0.015)), tissue)
    run(hand, tissue, 0.1)
    assert hand.n_points > 0
    forces = run(hand, tissue, 0.2)
    assert hand.n_points == 0 and hand.grip is None
    assert forces[-1] == pytest.approx(np.zeros(3), abs=1e-12)
    assert tissue.pieces()[0].velocity[2] == pytest.approx(-9.81 * 0.14, rel=0.2)  # it falls


@pytest.mark.parametrize(
    "settings", [GripSettings(closed=0.008), None], ids=["tied", "by friction"]
)
def test_jaws_that_close_on_nothing_say_so_once(settings, caplog):
    tissue = hanging()
    hand = led(rows((0.0, 0.2, 0.007), (0.05, 0.2, 0.0)), tissue, settings=settings)
    run(hand, tissue, 0.2)
    assert hand.n_points == 0
    assert caplog.text.count("the jaws of the grasper 'left' closed, and no tissue was there") == 1


def test_what_is_pulled_harder_than_it_is_held_slips_out_and_that_is_said_once(caplog):
    tissue = hanging()
    weight = tissue.pieces()[0].mass * 9.81
    hand = led(
        rows((0.0, 0.005, 0.007)),
        tissue,
        settings=GripSettings(closed=0.008, breaks_at=0.5 * weight),
    )
    run(hand, tissue, 0.3)
    assert hand.n_points == 0 and np.abs(hand.wrench.force).max() < 1e-12
    assert caplog.text.count("the tissue slipped out of the grasper 'left'") == 1


@pytest.mark.parametrize(("share", "holds"), [(3.0, True), (0.3, False)])
def test_friction_holds_what_weighs_less_than_both_pads_press_times_its_coefficient(share, holds):
    """Pads of friction 0.6: Coulomb. Gravity pulls the block out of the jaws, along the shaft."""
    tissue = hanging(gravity=9.81)
    weight = tissue.pieces()[0].mass * 9.81
    force = share * weight / (2.0 * 0.6)
    hand = led(rows((0.0, 0.005, 0.006), (0.01, 0.005, 0.0)), tissue, settings=None, force=force)
    coupling = GeomCoupling(hand._data, tissue, hand.grasper.bodies)
    forces = run(hand, tissue, 0.4, coupling)
    assert hand.n_points == 0
    falls = tissue.pieces()[0].velocity[2] > 1.0
    assert falls != holds
    if holds:
        assert forces[-100:].mean(axis=0) == pytest.approx([0.0, 0.0, weight], abs=0.1 * weight)
        assert hand.grasper.opening == pytest.approx(0.006, rel=0.1)  # as wide as the block


def test_a_turned_world_changes_nothing():
    """The same in a world that is turned about the vertical and moved."""
    forces = []
    for frame in (
        TissueFrame(),
        TissueFrame(Rotation.from_rotvec([0.0, 0.0, 0.7]).as_matrix(), np.array([0.1, 0.2, 0.3])),
    ):
        tissue = hanging()
        hand = led(rows((0.0, 0.005, 0.007), (0.3, 0.02, 0.007)), tissue, frame)
        run(hand, tissue, 0.02)  # the gantry turns to where its hand is
        forces.append(run(hand, tissue, 0.3)[-1])
    assert forces[1] == pytest.approx(forces[0], abs=0.05 * abs(forces[0][2]))
