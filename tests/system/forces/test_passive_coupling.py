"""An arm that presses, is released or taps never gets more energy out than it put in.

The hand is a spring of 5 kN/m. The wall has no memory, so the exact force in each frame is known;
the same is tested on tissue.
"""

from functools import cache
from typing import NamedTuple

import mujoco
import numpy as np
import pytest

from bridge import Bridge, VirtualCoupling
from bridge.counters import Counters
from scalpel_sim import SCENES, Simulation, prepare
from scalpel_sim.arm.arm import Arm
from scalpel_sim.scene.scene import changed
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.validate.coupling import work_on_tissue
from tests.bridge.coupling.walls import Wall
from tissue import BladeSegment, FloatArray

DT = 1e-3
NEVER_LESS = -1e-6
"""Lower bound of the energy of the passivity observer [J]."""
GAP, DEPTH = 1e-3, 2e-3
"""Distance of the wall at the start, and depth of the hand's target in the wall [m]."""
N_FRAMES = 350
RELEASE_FRAME = 150


class Press(NamedTuple):
    """Forces and energies in a press against the wall."""

    force: FloatArray
    """Force of the wall in each frame [N], shape (n_frames,)."""
    energy: FloatArray
    """Kinetic energy of the arm in each frame [J], shape (n_frames,)."""
    account: FloatArray
    """Energy that the arm has put in by the observer, in each frame [J], shape (n_frames,)."""
    work: FloatArray
    """Energy that the arm has put in by its motion, in each frame [J], shape (n_frames - 1,)."""
    counters: Counters


def hold(frame: int) -> float:
    return min(0.05 * frame * DT, GAP + DEPTH)


def tap(frame: int) -> float:
    return 0.5 * (GAP + DEPTH) * (1.0 - np.cos(2.0 * np.pi * 8.0 * frame * DT))


@cache
def press(
    hand: str,
    every: int,
    stiffness: float = 5e3,
    *,
    stiffness_scale: float = 1.0,
    passivity: bool = True,
    coupling: VirtualCoupling | None = None,
) -> Press:
    """Move the blade of a Touch against a wall; hold it, release it or tap as `hand` says.

    Args:
        hand: One of `HANDS`.
        every: Frames between two answers of the wall.
        stiffness: Stiffness of the wall [N/m].
        stiffness_scale: Stiffness that the wall reports over its true stiffness.
        passivity: Whether the passivity controller is on.
        coupling: Virtual coupling between blade and wall, or None.
    """
    arm = Arm("touch")
    start = arm.blade.segment()
    normal = np.array([0.0, -1.0, 0.0])
    front = max(start.tip[1], start.heel[1])
    wall = Wall(np.array([0.0, front + GAP, 0.0]), normal, stiffness, stiffness_scale)
    bridge = Bridge(
        wall, limits=arm.limits, tissue_every=every, passivity=passivity, coupling=coupling
    )
    force, energy, account = np.zeros((3, N_FRAMES))
    forces, torques, poses = np.zeros((N_FRAMES, 3)), np.zeros((N_FRAMES, 3)), []
    for frame in range(N_FRAMES):
        displacement = tap(frame) if hand == "taps" else hold(frame)
        if hand == "releases" and frame == RELEASE_FRAME:
            release(arm)
        arm.hand.follow(shifted(start, displacement))
        arm.step1()
        segment = arm.blade.segment()
        wrench = bridge.step(segment, DT)
        arm.blade.apply(wrench)
        poses.append(segment)
        forces[frame] = wrench.force
        torques[frame] = wrench.torque + np.cross(wrench.point - segment.tip, wrench.force)
        arm.step2()
        arm.check()
        force[frame], energy[frame] = wrench.force @ normal, kinetic_energy(arm)
        account[frame] = bridge.counters.passivity.energy
    work = work_on_tissue(forces, torques, np.array(poses))
    return Press(force, energy, account, work, bridge.counters)


def shifted(segment: BladeSegment, displacement: float) -> BladeSegment:
    offset = np.array([0.0, displacement, 0.0])
    return segment._replace(tip=segment.tip + offset, heel=segment.heel + offset)


def release(arm: Arm) -> None:
    """Switch off the actuators of the hand."""
    arm.model.actuator_gainprm[arm.hand.actuators] = 0.0
    arm.model.actuator_biasprm[arm.hand.actuators] = 0.0


def kinetic_energy(arm: Arm) -> float:
    mass = np.zeros((arm.model.nv, arm.model.nv))
    mujoco.mj_fullM(arm.model, arm.data, mass)
    return float(0.5 * arm.data.qvel @ mass @ arm.data.qvel)


HANDS = ("holds", "releases", "taps")


@pytest.mark.parametrize("stiffness", [500.0, 5e3, 25e3])
@pytest.mark.parametrize("every", [1, 10, 33])
@pytest.mark.parametrize("hand", ["releases", "taps"])
def test_by_the_motion_of_the_arm_no_hand_gets_energy_out_of_a_wall(hand, every, stiffness):
    """Forces that MuJoCo applied, and where it moved the blade: nothing that the observer knows."""
    work = press(hand, every, stiffness).work
    put_in = np.clip(np.diff(work), 0.0, None).sum()
    assert put_in > 5e-5
    assert work[-1] >= -0.01 * put_in


@pytest.mark.parametrize("every", [1, 5, 10])
def test_a_released_arm_leaves_with_no_more_energy_than_was_stored(every):
    """Measured by MuJoCo's masses and speeds, which the observer does not know.

    The frame of the release is excluded: it cannot be predicted.
    """
    found = press("releases", every)
    stored = found.account[RELEASE_FRAME]
    assert stored > 5e-5
    assert 0.8 * stored < found.energy[RELEASE_FRAME + 1 :].max() <= stored - NEVER_LESS


@pytest.mark.parametrize("stiffness", [5e3, 18e3])
@pytest.mark.parametrize("every", [5, 10, 33])
def test_with_the_stiffness_of_the_wall_a_held_blade_rests_without_the_controller(every, stiffness):
    found = press("holds", every, stiffness, passivity=False)
    assert np.std(found.force[-100:]) < 5e-3
    assert found.counters.passivity.least_energy >= NEVER_LESS


@pytest.mark.parametrize("every", [5, 10, 33])
def test_holding_the_last_wrench_creates_energy(every):
    """The result of the other tests without extrapolation by stiffness and without damping."""
    found = press("releases", every, stiffness_scale=0.0, passivity=False)
    assert found.counters.passivity.least_energy < -1e-3
    assert (
        found.energy[RELEASE_FRAME:].max()
        > 2.0 * press("releases", every).energy[RELEASE_FRAME:].max()
    )


@pytest.mark.parametrize("every", [1, 10, 33])
@pytest.mark.parametrize("hand", HANDS)
def test_holding_the_last_wrench_creates_no_energy_with_the_controller(hand, every):
    assert press(hand, every, stiffness_scale=0.0).counters.passivity.least_energy >= NEVER_LESS


@pytest.mark.parametrize("every", [1, 10])
@pytest.mark.parametrize("hand", HANDS)
def test_a_virtual_coupling_creates_no_energy_without_the_controller(hand, every):
    found = press(hand, every, passivity=False, coupling=VirtualCoupling())
    assert found.counters.passivity.least_energy >= NEVER_LESS
    assert found.force.max() < 700.0 * DEPTH


TISSUE = changed(
    SCENES["grid2"], stroke="press", stretch=0.0, gravity=0.0, preset="touch", speed=0.2
)
"""Scene with a blade of 38 mm on gel of 10 kPa; their contact stiffness is 1.5 kN/m."""


def press_tissue(every: int, hand: str) -> Simulation:
    """Press, and then for 0.2 s hold, release, or tap."""
    simulation = prepare(changed(TISSUE, tissue_every=every))
    pressed = simulation.stroke.duration
    if hand == "taps":
        simulation.stroke = with_taps(simulation.stroke)
    simulation.run(pressed)
    if hand == "releases":
        release(simulation.arm)
    simulation.run(pressed + 0.2)
    return simulation


def with_taps(stroke: Stroke) -> Stroke:
    """Return the stroke followed by two taps, 6 mm back and in again."""
    times = np.linspace(0.0, 0.2, 101)[1:]
    displacements = -3e-3 * (1.0 - np.cos(2.0 * np.pi * 10.0 * times))
    last = stroke.pose(stroke.duration)
    before = np.linspace(0.0, stroke.duration, 200)
    return Stroke(
        np.append(before, stroke.duration + times),
        [stroke.pose(t) for t in before]
        + [shifted(last, displacement) for displacement in displacements],
    )


@pytest.mark.parametrize("every", [1, 10, 33])
@pytest.mark.parametrize("hand", HANDS)
def test_no_hand_gets_energy_out_of_tissue(hand, every):
    simulation = press_tissue(every, hand)
    forces = np.linalg.norm(simulation.recording.vector("force"), axis=1)
    assert forces.max() > 0.15
    assert simulation.bridge.counters.passivity.least_energy >= NEVER_LESS
