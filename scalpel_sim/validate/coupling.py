"""Coupling to an arm: a hand that presses, lets go or taps gains no energy from the tissue."""

import numpy as np

from scalpel_sim.arm.hand import ACTUATORS
from scalpel_sim.preparation import prepare
from scalpel_sim.scenes import SCENES, changed
from scalpel_sim.simulation import Simulation
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.validate.findings import Check, Curve, Findings, Plot, Reference, ValidationScene
from tissue import FloatArray

_LEAST_ENERGY = -1e-6
"""Least energy of the observer [J]: below zero the arm has got out more than it put in."""
_AFTERWARDS = 0.2
"""How long the hand holds, lets go, or taps after the press [s]."""
_TAP_DISTANCE = 6e-3
"""How far a tap withdraws the blade [m]."""
_TAP_RATE = 10.0
"""Taps per second [Hz]."""
_HANDS = ("holds", "lets go", "taps")
"""What the hand does after the press."""
_PRESS = changed(SCENES["grid2"], stroke="press", stretch=0.0, gravity=0.0, arm="touch", speed=0.2)
"""A blade of 38 mm on a block of 10 kPa."""
_UJ_PER_J = 1e6


def _press(hand: str, every: int) -> tuple[Simulation, FloatArray]:
    """Press on tissue that answers every `every` ms, and then do what the hand does.

    Returns:
        The simulation, and the energy of the passivity observer in each frame [J].
    """
    simulation = prepare(changed(_PRESS, tissue_every=every))
    pressed = simulation.stroke.duration
    if hand == "taps":
        simulation.stroke = _with_taps(simulation.stroke)
    energies: list[float] = []

    def observe(now: Simulation) -> None:
        energies.append(now.bridge.counters.passivity.energy)

    simulation.pictures.append(observe)
    simulation.run(pressed)
    if hand == "lets go":
        for name in ACTUATORS:
            simulation.arm.model.actuator(name).gainprm[:] = 0.0
            simulation.arm.model.actuator(name).biasprm[:] = 0.0
    simulation.run(pressed + _AFTERWARDS)
    return simulation, np.array(energies)


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
    name = f"the hand {hand}, the tissue answers every {every} ms: least energy of the observer"
    return Check(name, least_energy * _UJ_PER_J, _LEAST_ENERGY * _UJ_PER_J, np.inf, "µJ")


def _measure(quick: bool) -> Findings:
    """Press with an answer of the tissue every 1, 5, 10 and 33 ms."""
    checks, curves, notes = [], [], []
    for hand in ("lets go",) if quick else _HANDS:
        for every in (1, 33) if quick else (1, 5, 10, 33):
            simulation, energy = _press(hand, every)
            counters = simulation.bridge.counters.passivity
            checks.append(check_least_energy(hand, every, counters.least_energy))
            force = np.linalg.norm(simulation.recording.vector("force"), axis=1).max()
            notes.append(
                f"The hand {hand}, every {every} ms: up to {force:.2f} N; the controller acted in "
                f"{counters.frames} frames and took {counters.injected_away * _UJ_PER_J:.3g} µJ"
            )
            if hand == "lets go":
                time: FloatArray = np.linspace(0.0, simulation.time, len(energy))
                curves.append(Curve(f"answer every {every} ms", time, energy * _UJ_PER_J))
    title = "Energy that a Touch has put into tissue; the hand lets go"
    return Findings(checks, [Plot(title, "time [s]", "energy [µJ]", curves)], notes)


COUPLING_SCENE = ValidationScene(
    name="coupling",
    title="Coupling of an arm and tissue that answers late",
    about=(
        "A Touch arm at 1 kHz presses the edge against a block of 10 kPa and then holds, lets go, "
        "or taps. The tissue answers every 1, 5, 10 or 33 ms; between answers the bridge "
        "extrapolates from its last wrench and stiffness. An observer adds up the work at the "
        "blade: below zero the coupling would have created energy, which a hand feels as buzzing. "
        "`tests/test_passive_coupling.py` has walls of up to 5 kN/m, and what happens without any "
        "of this."
    ),
    measure=_measure,
    references=[
        Reference(
            "Hannaford and Ryu 2002, Time-domain passivity control of haptic interfaces",
            "the observer and the controller",
            is_confirmed=False,
        )
    ],
)
