"""Force feedback: the force of the tissue on the blade acts on the arm, newton for newton."""

from typing import NamedTuple

import mujoco
import numpy as np
import pytest

from bridge.poses import motion
from scalpel_sim import SCENES, Scene, Simulation, prepare
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.scene.scene import changed
from tissue import BladeSegment, BladeSweep, FloatArray, StepResult

PRESS = changed(SCENES["grid2"], stroke="press", stretch=0.0, gravity=0.0, viscous_damping=50.0)
"""A press without stretch or gravity: the face that the blade presses is flat, at y = 0. Viscous
damping changes how soon the nodes come to rest, not where."""


class Run(NamedTuple):
    """A finished simulation and the results of the tissue in each frame."""

    simulation: Simulation
    results: list[StepResult]
    joint_force_errors: FloatArray
    """MuJoCo's generalised force of the wrench less J^T w, in each frame [N m]."""
    applied: FloatArray
    """Force on the blade that MuJoCo integrates in each frame [N], shape (n_frames, 3)."""

    def values(self, name: str) -> FloatArray:
        return np.array([getattr(result, name) for result in self.results])

    def forces(self) -> FloatArray:
        return np.array([result.wrench.force for result in self.results])

    def torques(self) -> FloatArray:
        return np.array([result.wrench.torque for result in self.results])


def run(scene: Scene, seconds_after: float = 0.2, *, frictionless: bool = False) -> Run:
    """Run the whole stroke of a scene."""
    simulation = prepare(scene)
    model, data = simulation.arm.model, simulation.arm.data
    if frictionless:
        model.dof_frictionloss[:] = 0.0
        model.tendon_frictionloss[:] = 0.0
    results: list[StepResult] = []
    errors: list[float] = []
    applied: list[FloatArray] = []

    def record(simulation: Simulation) -> None:
        results.append(simulation.result)
        errors.append(joint_force_error(simulation))
        applied.append(data.xfrc_applied[simulation.arm.blade.body_id, :3].copy())

    simulation.run(simulation.stroke.duration + seconds_after, record)
    assert np.isfinite(data.qpos).all()
    return Run(simulation, results, np.array(errors), np.array(applied))


def joint_force_error(simulation: Simulation) -> float:
    """Return the largest difference between the joint forces due to the wrench and J^T w."""
    model, data, wrench = simulation.arm.model, simulation.arm.data, simulation.wrench
    translation, rotation = np.zeros((2, 3, model.nv))
    body = simulation.arm.blade.body_id
    mujoco.mj_jac(model, data, translation, rotation, wrench.point, body)
    # All forces of the frame, less those from other sources.
    joint_forces = data.qfrc_smooth - data.qfrc_passive - data.qfrc_actuator + data.qfrc_bias
    return float(
        np.abs(joint_forces - translation.T @ wrench.force - rotation.T @ wrench.torque).max()
    )


@pytest.fixture(scope="module")
def cut() -> Run:
    """Run a straight cut clean through the small block of the paper's Figure 12 a."""
    return run(SCENES["grid2"])


@pytest.fixture(scope="module")
def press() -> Run:
    """Press the blade on the block without cutting it; the joints of the arm have no friction."""
    return run(PRESS, frictionless=True)


def test_the_joint_forces_are_the_transposed_jacobian_times_the_wrench(cut):
    assert np.abs(cut.joint_force_errors).max() < 1e-12


def test_the_wrench_acts_at_the_tip_and_is_that_of_the_tissue(cut):
    simulation = cut.simulation
    assert np.array_equal(simulation.recording.vector("force"), cut.forces())
    held = cut.values("anchored_length") > 0.0
    reported = np.array([result.wrench.point for result in cut.results])
    tips = simulation.frame.points_to_tissue(simulation.recording.vector("tip"))
    assert np.abs(reported - tips)[held].max() < 1e-12


def test_35_in_each_step_the_impulse_on_the_arm_is_opposite_to_that_on_the_tissue(cut):
    """The force that MuJoCo integrates, against the impulse on the nodes of the tissue."""
    dt = cut.simulation.dt
    on_tissue = dt * cut.values("force_on_tissue")
    assert np.abs(dt * cut.applied + on_tissue).max() < 1e-10
    assert np.abs(on_tissue).max() > 1e-4
    assert cut.simulation.bridge.counters.impulse_written_off == 0.0


@pytest.mark.parametrize(
    ("stroke", "error"),
    [
        ("straight", 1e-6),
        ("slanted", 1e-6),
        # Where the blade turns, the tissue counts the work of anchors that are about to slip, and
        # takes the torque at the anchored position: 3e-8 J in a step at most.
        ("curved", 1e-6),
    ],
)
def test_35_the_blade_does_the_same_work_on_both_sides(stroke, error):
    """Displacement of the arm's blade times its wrench, against the work that the tissue counts."""
    simulation = prepare(changed(SCENES["grid2"], stroke=stroke))
    poses: list[BladeSegment] = []
    by_arm, by_tissue = [0.0], [0.0]

    def record(simulation: Simulation) -> None:
        poses.append(simulation.arm.blade.segment())
        if len(poses) > 1:
            wrench, displacement = simulation.wrench, motion(poses[-2], poses[-1])
            # The torque is about the tip at the end of the step. About the mean position of the
            # tip, the lever is half of the displacement.
            tip_displacement = displacement[:3] + 0.5 * np.cross(displacement[3:], displacement[:3])
            by_arm.append(
                -float(wrench.force @ tip_displacement + wrench.torque @ displacement[3:])
            )
            by_tissue.append(simulation.result.work_of_blade)

    simulation.run(simulation.stroke.duration, record)
    assert by_tissue[-1] > 0.01
    assert np.abs(by_arm[1:] - np.diff(by_tissue)).max() < 1e-6
    assert sum(by_arm) == pytest.approx(by_tissue[-1], rel=error)


@pytest.mark.parametrize("every", [5, 10, 33])
def test_a_cut_with_an_answer_every_few_frames_is_the_same_cut(every, cut):
    """Pieces and area are the same, and the impulse to 1.5 %; peaks differ, see the README."""
    seldom = run(changed(SCENES["grid2"], tissue_every=every))
    assert seldom.simulation.link.n_pieces() == 2
    assert seldom.results[-1].cut_area == pytest.approx(cut.results[-1].cut_area, rel=0.01)
    impulses = [
        found.simulation.recording.vector("force").sum(axis=0) * found.simulation.dt
        for found in (cut, seldom)
    ]
    assert np.linalg.norm(impulses[1] - impulses[0]) < 0.015 * np.linalg.norm(impulses[0])
    profile = seldom.simulation.recording.column("rx_s")
    solved = np.arange(len(profile)) % every == 0
    assert (profile[solved] > 0.0).all() and not profile[~solved].any()


def test_a_cut_through_a_virtual_coupling_is_the_same_cut(cut):
    """The blade in the tissue only lags behind the arm's, by force over stiffness."""
    with_coupling = run(changed(SCENES["grid2"], coupling="virtual"))
    assert with_coupling.simulation.link.n_pieces() == 2
    assert with_coupling.results[-1].cut_area == pytest.approx(cut.results[-1].cut_area, rel=0.01)
    steady = (cut.values("cut_area") > 5e-4) & (cut.values("cut_area") < 1e-3)
    forces = [
        np.linalg.norm(found.simulation.recording.vector("force")[steady], axis=1).mean()
        for found in (cut, with_coupling)
    ]
    assert forces[1] == pytest.approx(forces[0], rel=0.02)


def test_the_hand_deflects_by_force_over_its_stiffness(press):
    arm, wrench = press.simulation.arm, press.simulation.wrench
    stiffness = arm.model.actuator("hand_x").gainprm[0]
    assert arm.hand.deflection * stiffness == pytest.approx(wrench.force, rel=0.02, abs=2e-3)


def test_the_force_of_a_press_is_the_stiffness_of_the_tissue_times_the_indentation(press):
    """A blade without an arm meets the same force at the same depth, and half at half of it."""
    stroke = press.simulation.stroke
    tip = press.simulation.recording.vector("tip")[-1]
    indentation = float(press.simulation.frame.points_to_tissue(tip)[1])
    assert 0.0 < indentation < stroke.pose(stroke.duration).tip[1]  # the hand deflects too
    applied_force = -press.simulation.wrench.force[1]
    assert applied_force == pytest.approx(force_alone(stroke.pose(0.0), indentation), rel=0.03)
    assert applied_force == pytest.approx(
        2.0 * force_alone(stroke.pose(0.0), indentation / 2.0), rel=0.1
    )


def force_alone(start: BladeSegment, indentation: float) -> float:
    """Return the force [N] on a blade that moves to an indentation at 20 mm/s and rests there."""
    tissue, dt, speed, n_resting = make_tissue(PRESS), 1e-3, 0.02, 500
    displacement = indentation - start.tip[1]
    before = start
    for done in np.append(
        np.linspace(0.0, displacement, round(displacement / speed / dt)),
        np.full(n_resting, displacement),
    ):
        shift = np.array([0.0, done, 0.0])
        after = start._replace(tip=start.tip + shift, heel=start.heel + shift)
        result = tissue.step(BladeSweep(before, after), dt)
        before = after
    return -float(result.wrench.force[1])


def test_the_force_on_the_arm_never_exceeds_the_limit_of_its_device():
    scene = changed(SCENES["grid2"], toughness=200.0, young_modulus=100e3, preset="touch")
    found = run(scene, 0.0)
    applied_force = np.linalg.norm(found.simulation.recording.vector("force"), axis=1)
    reported = np.linalg.norm(found.forces(), axis=1)
    assert reported.max() > 3.5
    assert applied_force.max() <= 3.3 * (1.0 + 1e-12)
    assert found.simulation.bridge.counters.force_limited == (reported > 3.3).sum()


@pytest.mark.parametrize(
    ("stroke", "pieces"),
    [("straight", 2), ("slanted", 2), ("curved", 2), ("stop", 1), ("press", 1)],
)
def test_a_stroke_clean_through_leaves_two_pieces_and_any_other_one(stroke, pieces):
    found = run(changed(SCENES["grid2"], stroke=stroke))
    assert found.simulation.link.n_pieces() == pieces
