"""An arm that presses, lets go and taps: it never gets more energy out than it put in.

The hand is a spring of 5 kN/m. The wall has no memory, so that what an answer in every frame would
be is known; tissue is tried too.
"""

from typing import NamedTuple

import mujoco
import numpy as np
import pytest

from bridge import Bridge, VirtualCoupling
from bridge.counters import Counters
from scalpel_sim import SCENES, Simulation, prepare
from scalpel_sim.arm.arm import Arm
from scalpel_sim.arm.hand import ACTUATORS
from scalpel_sim.scenes import changed
from scalpel_sim.strokes.stroke import Stroke
from tests.bridge.coupling.walls import Wall
from tissue import BladeSegment, FloatArray

DT = 1e-3
NEVER_LESS = -1e-6
"""[J]."""
GAP, DEPTH = 1e-3, 2e-3
"""[m]: how far the wall is at the start, and how far into it the hand leads."""
N_FRAMES = 350
LET_GO = 150


class Press(NamedTuple):
    """What happened at the wall."""

    force: FloatArray
    """In each frame, of the wall [N], shape (n_frames,)."""
    energy: FloatArray
    """Of the arm's motion in each frame [J], shape (n_frames,)."""
    account: FloatArray
    """What the observer says that the arm has put in, in each frame [J], shape (n_frames,)."""
    counters: Counters


def hold(frame: int) -> float:
    return min(0.05 * frame * DT, GAP + DEPTH)


def tap(frame: int) -> float:
    return 0.5 * (GAP + DEPTH) * (1.0 - np.cos(2.0 * np.pi * 8.0 * frame * DT))


def press(
    hand: str,
    every: int,
    stiffness: float = 5e3,
    *,
    told: float = 1.0,
    passivity: bool = True,
    coupling: VirtualCoupling | None = None,
) -> Press:
    """Lead the blade of a Touch against a wall, and let go of it where the hand does."""
    arm = Arm("touch")
    start = arm.blade.segment()
    normal = np.array([0.0, -1.0, 0.0])
    front = max(start.tip[1], start.heel[1])
    wall = Wall(np.array([0.0, front + GAP, 0.0]), normal, stiffness, told)
    bridge = Bridge(
        wall, limits=arm.limits, tissue_every=every, passivity=passivity, coupling=coupling
    )
    force, energy, account = np.zeros((3, N_FRAMES))
    for frame in range(N_FRAMES):
        way = tap(frame) if hand == "taps" else hold(frame)
        if hand == "lets go" and frame == LET_GO:
            let_go(arm)
        arm.hand.follow(shifted(start, way))
        arm.step1()
        wrench = bridge.step(arm.blade.segment(), DT)
        arm.blade.apply(wrench)
        arm.step2()
        arm.check()
        force[frame], energy[frame] = wrench.force @ normal, kinetic_energy(arm)
        account[frame] = bridge.counters.passivity.energy
    return Press(force, energy, account, bridge.counters)


def shifted(segment: BladeSegment, way: float) -> BladeSegment:
    by = np.array([0.0, way, 0.0])
    return segment._replace(tip=segment.tip + by, heel=segment.heel + by)


def let_go(arm: Arm) -> None:
    """The hand does nothing any more."""
    for name in ACTUATORS:
        arm.model.actuator(name).gainprm[:] = 0.0
        arm.model.actuator(name).biasprm[:] = 0.0


def kinetic_energy(arm: Arm) -> float:
    mass = np.zeros((arm.model.nv, arm.model.nv))
    mujoco.mj_fullM(arm.model, arm.data, mass)
    return float(0.5 * arm.data.qvel @ mass @ arm.data.qvel)


HANDS = ("holds", "lets go", "taps")


@pytest.mark.parametrize("stiffness", [500.0, 5e3])
@pytest.mark.parametrize("every", [1, 5, 10, 33])
@pytest.mark.parametrize("hand", HANDS)
def test_no_hand_gets_energy_out_of_a_wall(hand, every, stiffness):
    found = press(hand, every, stiffness)
    assert found.force.max() > 0.1
    assert found.counters.passivity.least_energy >= NEVER_LESS


@pytest.mark.parametrize("every", [1, 5, 10])
def test_an_arm_that_is_let_go_flies_off_with_no_more_than_it_stored(every):
    """Told by MuJoCo's masses and speeds alone, of which the observer knows nothing.

    But for the frame in which it lets go: nobody could know.
    """
    found = press("lets go", every)
    stored = found.account[LET_GO]
    assert stored > 5e-5
    assert 0.8 * stored < found.energy[LET_GO + 1 :].max() <= stored - NEVER_LESS


@pytest.mark.parametrize("stiffness", [5e3, 18e3])
@pytest.mark.parametrize("every", [5, 10, 33])
def test_with_the_stiffness_of_the_wall_a_held_blade_rests_without_the_controller(every, stiffness):
    found = press("holds", every, stiffness, passivity=False)
    assert np.std(found.force[-100:]) < 5e-3
    assert found.counters.passivity.least_energy >= NEVER_LESS


@pytest.mark.parametrize("every", [5, 10, 33])
def test_a_wrench_that_is_only_held_makes_energy(every):
    """What the other tests would see if the stiffness were not used and nothing was damped."""
    found = press("lets go", every, told=0.0, passivity=False)
    assert found.counters.passivity.least_energy < -1e-3
    assert found.energy[LET_GO:].max() > 2.0 * press("lets go", every).energy[LET_GO:].max()


@pytest.mark.parametrize("every", [1, 5, 10, 33])
@pytest.mark.parametrize("hand", HANDS)
def test_a_wrench_that_is_only_held_makes_none_under_the_controller(hand, every):
    assert press(hand, every, told=0.0).counters.passivity.least_energy >= NEVER_LESS


@pytest.mark.parametrize("every", [1, 10])
@pytest.mark.parametrize("hand", HANDS)
def test_through_a_virtual_coupling_no_energy_is_made_without_the_controller(hand, every):
    found = press(hand, every, passivity=False, coupling=VirtualCoupling())
    assert found.counters.passivity.least_energy >= NEVER_LESS
    assert found.force.max() < 700.0 * DEPTH


TISSUE = changed(SCENES["grid2"], stroke="press", stretch=0.0, gravity=0.0, arm="touch", speed=0.2)
"""A blade of 38 mm on gel of 10 kPa; what is between them has 1.5 kN/m."""


def press_tissue(every: int, hand: str) -> Simulation:
    """Press, and then for 0.2 s hold, let go, or tap where the blade is."""
    simulation = prepare(changed(TISSUE, tissue_every=every))
    pressed = simulation.stroke.duration
    if hand == "taps":
        simulation.stroke = with_taps(simulation.stroke)
    simulation.run(pressed)
    if hand == "lets go":
        let_go(simulation.arm)
    simulation.run(pressed + 0.2)
    return simulation


def with_taps(stroke: Stroke) -> Stroke:
    """The stroke, and then twice 6 mm back and in again."""
    times = np.linspace(0.0, 0.2, 101)[1:]
    ways = -3e-3 * (1.0 - np.cos(2.0 * np.pi * 10.0 * times))
    last = stroke.pose(stroke.duration)
    before = np.linspace(0.0, stroke.duration, 200)
    return Stroke(
        np.append(before, stroke.duration + times),
        [stroke.pose(t) for t in before] + [shifted(last, way) for way in ways],
    )


@pytest.mark.parametrize("every", [1, 10, 33])
@pytest.mark.parametrize("hand", HANDS)
def test_no_hand_gets_energy_out_of_tissue(hand, every):
    simulation = press_tissue(every, hand)
    forces = np.linalg.norm(simulation.recording.vector("force"), axis=1)
    assert forces.max() > 0.15
    assert simulation.bridge.counters.passivity.least_energy >= NEVER_LESS
