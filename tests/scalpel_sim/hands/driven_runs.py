"""Runs of a scene that a script leads as a person would: by commands."""

import math
from pathlib import Path

import numpy as np

from scalpel_sim import SCENES, Simulation, prepare
from scalpel_sim.hands.commands import Engage, Move, Turn
from scalpel_sim.hands.run_controls import History, Pace, RunControls
from scalpel_sim.hands.teleoperation import LiveHand
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.runs.prepared_run import PreparedRun
from scalpel_sim.runs.run import perform
from scalpel_sim.scene.scene import changed

GRID2 = SCENES["grid2"]

DT = 1e-3
"""Length of a frame [s]."""

ROUNDING = 1e-12
"""By which a limit may be passed, in its unit."""

PERIOD = 16
"""Frames between two moves of a page that draws sixty pictures a second."""


class Clock:
    """Wall time [s] that passes where a test says so."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def led(scene=GRID2, clock=None, seconds=math.inf) -> tuple[Simulation, LiveHand]:
    """Return a simulation at its start, and the hand that leads it."""
    simulation = prepare(scene, is_led=True)
    hand = LiveHand(simulation, seconds=seconds, clock=clock or Clock())
    hand.take_over(simulation)
    return simulation, hand


def controls_of(simulation: Simulation, hand: LiveHand | None) -> RunControls:
    """Return the controls of a run, which has no page."""
    return RunControls(Pace(), History(simulation), hand)


def done(simulation: Simulation, folder: Path, scene=None, **others):
    """Do a run that writes its files to a folder; `scene.toml` is one of them if it is given."""
    with Plotter() as plotter:
        known = scene or changed(GRID2, seconds=None)
        perform(
            PreparedRun(simulation, known, folder, {}, plotter, is_here=scene is not None),
            **others,
        )


def poses(hand, n, first=0):
    """Return tip, heel and forward of the hand in `n` frames, shape (n, 9)."""
    found = []
    for k in range(first, first + n):
        hand.lead(k * DT)
        found.append(hand.blade.numbers)
    return np.array(found)


def move(x=0.0, y=0.0, z=0.0, stamp=0.0) -> Move:
    return Move([x, y, z], stamp)


def turn(x=0.0, y=0.0, z=0.0, stamp=0.0) -> Turn:
    return Turn([x, y, z], stamp)


def through_the_body(hand: LiveHand):
    """Return a callback that draws the blade through the body, in a bend and with a pause."""
    rng = np.random.default_rng(0)
    hand.commands.append(Engage())

    def command(simulation: Simulation) -> None:
        n = len(simulation.recording)
        if n % PERIOD == 0 and not 300 <= n < 350:
            x, z = rng.normal(0.0, 2e-4, 2)
            hand.commands.append(move(x, 1.6e-3, z, stamp=float(n)))
            hand.commands.append(turn(z=2e-3))

    return command
