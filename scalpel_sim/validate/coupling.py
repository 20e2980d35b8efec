"""Coupling to an arm: a hand that presses, releases or taps gains no energy from the tissue."""

import itertools
from typing import NamedTuple

import numpy as np

from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.scene.read import SCENES
from scalpel_sim.scene.scene import changed
from scalpel_sim.simulation import Simulation
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.validate.findings import Check, Curve, Findings, Plot, lines_of
from tissue import FloatArray, Wrench

_LINES = lines_of("coupling")
_LEAST_SHARE = 0.05
"""Share of all energy put in from which on the share that came back is looked at."""
_AFTERWARDS = 0.2
"""Time for which the hand holds, releases, or taps after the press [s]."""
_TAP_DISTANCE = 6e-3
"""Distance by which a tap withdraws the blade [m]."""
_TAP_RATE = 10.0
"""Taps per second [Hz]."""
_HANDS = ("holds", "releases", "taps")
"""Action of the hand after the press."""
_PRESS = changed(
    SCENES["grid2"], stroke="press", stretch=0.0, gravity=0.0, preset="touch", speed=0.2
)
"""A blade of 38 mm on a block of 10 kPa."""
_UJ_PER_J = 1e6


class _Press(NamedTuple):
    """A press, and what was observed."""

    simulation: Simulation
    energy: FloatArray
    """Energy of the passivity observer in each frame [J]."""
    work: FloatArray
    """Work that the arm has done on the tissue so far, in each frame [J]; see `work_on_tissue`."""


def _press(hand: str, every: int) -> _Press:
    """Press on tissue that answers every `every` ms, and then do what the hand does."""
    simulation = prepare(changed(_PRESS, tissue_every=every))
    pressed = simulation.stroke.duration
    if hand == "taps":
        simulation.stroke = _with_taps(simulation.stroke)
    energies: list[float] = []
    wrenches: list[Wrench] = []
    poses: list[FloatArray] = []

    def observe(now: Simulation) -> None:
        energies.append(now.bridge.counters.passivity.energy)
        wrenches.append(now.wrench)
        poses.append(np.array(now.arm.blade.segment()))

    simulation.pictures.append(observe)
    simulation.run(pressed)
    if hand == "releases":
        simulation.arm.model.actuator_gainprm[simulation.arm.hand.actuators] = 0.0
        simulation.arm.model.actuator_biasprm[simulation.arm.hand.actuators] = 0.0
    simulation.run(pressed + _AFTERWARDS)
    places, forces = np.array(poses), np.array([wrench.force for wrench in wrenches])
    arms = np.array([wrench.point for wrench in wrenches]) - places[:, 0]
    torques = np.array([wrench.torque for wrench in wrenches]) + np.cross(arms, forces)
    work = work_on_tissue(forces, torques, places)
    return _Press(simulation, np.array(energies), work)


def _with_taps(stroke: Stroke) -> Stroke:
    """Return the stroke with two taps after it: the blade goes back and in again."""
    times = np.linspace(0.0, _AFTERWARDS, 101)[1:]
    shifts = -0.5 * _TAP_DISTANCE * (1.0 - np.cos(2.0 * np.pi * _TAP_RATE * times))
    last = stroke.pose(stroke.duration)
    before = np.linspace(0.0, stroke.duration, 200)
    poses = [stroke.pose(t) for t in before]
    for shift in shifts:
        vector = np.array([0.0, shift, 0.0])
        poses.append(last._replace(tip=last.tip + vector, heel=last.heel + vector))
    return Stroke(np.append(before, stroke.duration + times), poses)


def check_least_energy(hand: str, every: int, least_energy: float) -> Check:
    """Return the check of a press.

    Args:
        hand: What the hand does after it.
        every: Time between two answers of the tissue [ms].
        least_energy: Least energy of the passivity observer [J].
    """
    return _LINES["observer"].check(_case(hand, every), least_energy * _UJ_PER_J)


def check_returned(hand: str, every: int, work: FloatArray) -> Check:
    """Return the check of the energy that came back from the tissue.

    Args:
        hand: What the hand does after the press.
        every: Time between two answers of the tissue [ms].
        work: Work that the arm has done on the tissue so far, in each frame [J].
    """
    steps = np.diff(work, prepend=0.0)
    put_in, returned = (np.cumsum(np.clip(sign * steps, 0.0, None)) for sign in (1.0, -1.0))
    counts = put_in >= _LEAST_SHARE * put_in[-1]
    largest = float((returned[counts] / put_in[counts]).max()) if put_in[-1] > 0.0 else np.inf
    return _LINES["returned"].check(_case(hand, every), largest)


def _case(hand: str, every: int) -> str:
    """Return the name of a press."""
    return f"the hand {hand}, the tissue answers every {every} ms"


def work_on_tissue(forces: FloatArray, torques: FloatArray, poses: FloatArray) -> FloatArray:
    """Return the work that the arm has done on the tissue so far, in each frame [J].

    It follows from what was applied to the arm and where MuJoCo moved the blade, without anything
    that the bridge adds up. MuJoCo applies a force at the begin of a frame and moves on at the
    velocity that results: the energy that the arm gets is that of the mean of the velocities before
    and after.

    Args:
        forces: Force on the blade in each frame [N], shape (n, 3).
        torques: Torque on it about its tip [N m], shape (n, 3).
        poses: Tip, heel and forward at the begin of each frame, shape (n, 3, 3).
    """
    means = 0.5 * (poses + np.concatenate((poses[:1], poses[:-1])))
    moved = np.diff(means[:, 0], axis=0)
    linear = np.einsum("ij,ij->i", forces[:-1], moved)
    turns = np.array([_turn(t0, t1) for t0, t1 in itertools.pairwise(means)])
    angular = np.einsum("ij,ij->i", torques[:-1], turns)
    return np.asarray(-np.cumsum(linear + angular))


def _turn(before: FloatArray, after: FloatArray) -> FloatArray:
    """Return the small rotation between two poses [rad], shape (3,)."""
    turn: FloatArray = np.zeros(3)
    for t0, t1 in zip(_axes(before), _axes(after), strict=True):
        turn += 0.5 * np.cross(t0, t1)
    return turn


def _axes(pose: FloatArray) -> FloatArray:
    """Return the right-handed axes of a blade: along its edge, forward, and across it."""
    along = (pose[1] - pose[0]) / np.linalg.norm(pose[1] - pose[0])
    forward = pose[2] - (pose[2] @ along) * along
    forward /= np.linalg.norm(forward)
    return np.array([along, forward, np.cross(along, forward)])


def measure_coupling(quick: bool) -> Findings:
    """Press with an answer of the tissue every 1, 5, 10 and 33 ms."""
    checks, curves, notes = [], [], []
    for hand in ("releases",) if quick else _HANDS:
        for every in (1, 33) if quick else (1, 5, 10, 33):
            simulation, energy, work = _press(hand, every)
            counters = simulation.bridge.counters.passivity
            checks.append(check_returned(hand, every, work))
            checks.append(check_least_energy(hand, every, counters.least_energy))
            force = np.linalg.norm(simulation.recording.vector("force"), axis=1).max()
            notes.append(
                f"The hand {hand}, every {every} ms: up to {force:.2f} N; the controller acted in "
                f"{counters.frames} frames and took {counters.injected_away * _UJ_PER_J:.3g} µJ"
            )
            if hand == "releases":
                time: FloatArray = np.linspace(0.0, simulation.time, len(energy))
                curves.append(Curve(f"answer every {every} ms", time, energy * _UJ_PER_J))
    title = "Energy that a Touch has put into tissue; the hand releases"
    return Findings(checks, [Plot(title, "time [s]", "energy [µJ]", curves)], notes)
