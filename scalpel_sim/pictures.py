"""What the 3D views are handed of a running simulation."""

from scalpel_sim.model_shapes import body_poses
from scalpel_sim.replay import ReplayWriter
from scalpel_sim.scene3d import Readings
from scalpel_sim.simulation import Picture, Simulation
from scalpel_sim.viewer import Viewer


def readings(simulation: Simulation) -> Readings | None:
    """Return the numbers to show beside the picture of now; None before the first frame."""
    wrench, result = simulation.wrench, simulation.bridge.result
    if result is None:
        return None
    return Readings(
        simulation.time, wrench.force, wrench.point, result.cut_area, result.n_tetrahedra
    )


def into_replay(replay: ReplayWriter) -> Picture:
    """Return what keeps a replay up to date."""

    def picture(simulation: Simulation) -> None:
        if replay.is_due(simulation.time):
            add_to(replay, simulation)

    return picture


def add_to(replay: ReplayWriter, simulation: Simulation) -> None:
    """Add a simulation as it is now; before its first frame too."""
    replay.add(
        simulation.time,
        simulation.link.surface(),
        body_poses(simulation.arm.data),
        readings(simulation),
    )


def into_viewer(viewer: Viewer) -> Picture:
    """Return what keeps a live viewer up to date."""

    def picture(simulation: Simulation) -> None:
        if viewer.is_due():
            show(viewer, simulation)

    return picture


def show(viewer: Viewer, simulation: Simulation) -> None:
    """Show a simulation as it is now; before its first frame too."""
    viewer.show(simulation.link.surface(), body_poses(simulation.arm.data), readings(simulation))
