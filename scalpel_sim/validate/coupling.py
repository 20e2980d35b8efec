"""Coupling to an arm: pressing, letting go and tapping never get more energy out than went in."""

import numpy as np

from scalpel_sim.arm.hand import ACTUATORS
from scalpel_sim.preparation import prepare
from scalpel_sim.scenes import SCENES, changed
from scalpel_sim.simulation import Simulation
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.validate.findings import Curve, Findings, Line, Plot, Scene, Source
from tissue import FloatArray

LEAST = -1e-6
"""Energy that the arm may have got out beyond what it put in [J]: the issue's bound."""
AFTERWARDS = 0.2
"""How long the hand holds, lets go, or taps after the press [s]."""
BACK = 6e-3
"""How far a tap goes back [m]."""
TAPS = 10.0
"""[Hz]."""
HANDS = ("holds", "lets go", "taps")
PRESS = changed(SCENES["grid2"], stroke="press", stretch=0.0, gravity=0.0, arm="touch", speed=0.2)
"""A blade of 38 mm on a block of 10 kPa."""
UJ_PER_J = 1e6


def _press(hand: str, every: int) -> tuple[Simulation, FloatArray]:
    """Press on tissue that answers every `every` ms, and then do what the hand does.

    Returns:
        The simulation, and the observer's energy in each frame [J].
    """
    simulation = prepare(changed(PRESS, tissue_every=every))
    pressed = simulation.stroke.duration
    if hand == "taps":
        simulation.stroke = _with_taps(simulation.stroke)
    seen: list[float] = []

    def observe(now: Simulation) -> None:
        seen.append(now.bridge.counters.passivity.energy)

    simulation.pictures.append(observe)
    simulation.run(pressed)
    if hand == "lets go":
        for name in ACTUATORS:
            simulation.arm.model.actuator(name).gainprm[:] = 0.0
            simulation.arm.model.actuator(name).biasprm[:] = 0.0
    simulation.run(pressed + AFTERWARDS)
    return simulation, np.array(seen)


def _with_taps(stroke: Stroke) -> Stroke:
    """Return the stroke, and then twice back and in again."""
    times = np.linspace(0.0, AFTERWARDS, 101)[1:]
    ways = -0.5 * BACK * (1.0 - np.cos(2.0 * np.pi * TAPS * times))
    last = stroke.pose(stroke.duration)
    before = np.linspace(0.0, stroke.duration, 200)
    poses = [stroke.pose(t) for t in before]
    for way in ways:
        by = np.array([0.0, way, 0.0])
        poses.append(last._replace(tip=last.tip + by, heel=last.heel + by))
    return Stroke(np.append(before, stroke.duration + times), poses)


def judge(hand: str, every: int, least_energy: float) -> Line:
    """Return the line of a press."""
    name = f"the hand {hand}, the tissue answers every {every} ms: least energy of the observer"
    return Line(name, least_energy * UJ_PER_J, LEAST * UJ_PER_J, np.inf, "µJ")


def measure(quick: bool) -> Findings:
    """Press with an answer every 1, 5, 10 and 33 ms."""
    lines, curves, notes = [], [], []
    for hand in ("lets go",) if quick else HANDS:
        for every in (1, 33) if quick else (1, 5, 10, 33):
            simulation, energy = _press(hand, every)
            counters = simulation.bridge.counters.passivity
            lines.append(judge(hand, every, counters.least_energy))
            force = np.linalg.norm(simulation.recording.vector("force"), axis=1).max()
            notes.append(
                f"The hand {hand}, every {every} ms: up to {force:.2f} N; the controller acted in "
                f"{counters.frames} frames and took {counters.injected_away * UJ_PER_J:.3g} µJ"
            )
            if hand == "lets go":
                time: FloatArray = np.linspace(0.0, simulation.time, len(energy))
                curves.append(Curve(f"answer every {every} ms", time, energy * UJ_PER_J))
    title = "Energy that a Touch has put into tissue; the hand lets go"
    return Findings(lines, [Plot(title, "time [s]", "energy [µJ]", curves)], notes)


SCENE = Scene(
    name="coupling",
    title="Coupling of an arm and tissue that answers late",
    about=(
        "A Touch arm at 1 kHz presses the edge against a block of 10 kPa and then holds, lets go, "
        "or taps. The tissue answers every 1, 5, 10 or 33 ms; between answers the bridge goes by "
        "its last wrench and stiffness. An observer adds up the work at the blade: below zero the "
        "coupling would have made energy, which a hand feels as buzzing. Walls of up to 5 kN/m, "
        "and what happens without any of this, are in `tests/test_passive_coupling.py`."
    ),
    measure=measure,
    sources=[
        Source(
            "Hannaford and Ryu 2002, Time-domain passivity control of haptic interfaces",
            "the observer and the controller",
            is_confirmed=False,
        )
    ],
)
