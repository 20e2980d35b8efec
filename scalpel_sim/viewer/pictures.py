"""Callbacks that hand a running simulation to the live viewer and to the replay."""

import math
from collections.abc import Callable, Iterable
from typing import get_args

import numpy as np

from scalpel_sim.hands.run_controls import RunControls
from scalpel_sim.hands.teleoperation import Teleoperation
from scalpel_sim.recording.columns import force_parts
from scalpel_sim.simulation import DrawFrame, Simulation
from scalpel_sim.viewer.judged import judged_state
from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.model_shapes import body_poses
from scalpel_sim.viewer.replay import ReplayWriter
from scalpel_sim.viewer.scene3d import HandState, LiveState, Readings, RunState
from scalpel_sim.viewer.viewer import Viewer
from tissue import SurfaceQuantity


def readings(simulation: Simulation) -> Readings:
    """Return the numbers to show next to the picture."""
    wrench, result, frame = simulation.wrench, simulation.bridge.result, simulation.frame
    if result is None:  # before the first frame
        n_tetrahedra = simulation.link.describe().n_tetrahedra
        return Readings(0.0, np.zeros(3), np.zeros(3), 0.0, n_tetrahedra)
    contacts = result.contacts.of_blade
    on_tissue = contacts.normal_force[:, None] * contacts.normal + contacts.friction
    forward = frame.vectors_to_tissue(simulation.arm.blade.segment().forward)
    return Readings(
        simulation.time,
        wrench.force,
        wrench.point,
        result.cut_area,
        result.n_tetrahedra,
        contact_points=frame.points_to_world(contacts.point),
        contact_forces=frame.vectors_to_world(-on_tissue),
        parts=force_parts(contacts, forward),
        hands=[(each.name, math.hypot(*each.wrench.force)) for each in simulation.graspers],
        energies=result.energies,
    )


def into_replay(replay: ReplayWriter) -> DrawFrame:
    """Return a callback that adds a simulation to a replay after each frame."""

    def draw(simulation: Simulation) -> None:
        if replay.is_due(simulation.time):
            add_to(replay, simulation)

    return draw


def add_to(replay: ReplayWriter, simulation: Simulation) -> None:
    """Add the present state of a simulation to a replay, also before the first frame."""
    replay.add(simulation.time, state_of(simulation, get_args(SurfaceQuantity)))


def into_viewer(
    viewer: Viewer, live_state: Callable[[], LiveState | None] = lambda: None
) -> DrawFrame:
    """Return a callback that shows a simulation in a live viewer after each frame.

    Args:
        viewer: The viewer.
        live_state: Returns how the run is that the page controls.
    """

    def draw(simulation: Simulation) -> None:
        on_graspers = (math.hypot(*each.wrench.force) for each in simulation.graspers)
        viewer.add_forces(simulation.time, math.hypot(*simulation.wrench.force), *on_graspers)
        if viewer.is_due():
            show_in(viewer, simulation, live_state())

    return draw


def show_in(viewer: Viewer, simulation: Simulation, live: LiveState | None = None) -> None:
    """Show the present state of a simulation in a live viewer, also before the first frame."""
    viewer.show(*state_of(simulation, sorted(viewer.wanted), live))


def show_run(viewer: Viewer, simulation: Simulation, controls: RunControls) -> Callable[[], None]:
    """Show a run in a live viewer now, after each frame, and after each change by the page.

    Args:
        viewer: Its page controls the run.
        simulation: The run, at its start.
        controls: Obey that page.

    Returns:
        A function that shows the run as it then is.
    """

    def show() -> None:
        show_in(viewer, simulation, live_state(controls))

    show()
    controls.on_change = show
    controls.on_wait = lambda: show() if viewer.lacks_values else None
    simulation.pictures.append(into_viewer(viewer, lambda: live_state(controls)))
    return show


def state_of(
    simulation: Simulation,
    quantities: Iterable[SurfaceQuantity] = (),
    live: LiveState | None = None,
) -> SceneState:
    """Return what a picture of a simulation shows now, with quantities on the surface."""
    return SceneState(
        simulation.link.surface(),
        body_poses(simulation.arm.data),
        readings(simulation),
        live,
        {each: simulation.link.surface_values(each) for each in quantities},
        judged_state(simulation),
    )


def live_state(controls: RunControls) -> LiveState:
    """Return how a run is, for the page that controls it."""
    hand, pace, history = controls.hand, controls.pace, controls.history
    run = RunState(
        controls.is_paused,
        pace.rate,
        pace.factor,
        history.can_go_back,
        history.n_strokes,
        controls.has_ended,
        controls.notice,
        controls.results,
        0.0 if hand is None else hand.stylus_distance,
    )
    return LiveState(run, None if hand is None else _state_of_hand(hand))


def _state_of_hand(hand: Teleoperation) -> HandState:
    """Return how a hand is, for the page that leads it."""
    chosen = hand.instruments[hand.chosen]
    return HandState(
        chosen.tip,
        chosen.back,
        2.0 * chosen.half,
        chosen.normal,
        hand.is_engaged,
        hand.ended_at is not None,
        hand.stamp,
        [each.name for each in hand.instruments],
        hand.chosen,
        chosen.is_closed,
    )
