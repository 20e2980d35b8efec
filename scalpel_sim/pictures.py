"""What the 3D views are handed of a running simulation."""

from scalpel_sim.model_shapes import body_poses
from scalpel_sim.replay import ReplayWriter
from scalpel_sim.scene3d import Readings
from scalpel_sim.simulation import Picture, Simulation


def readings(simulation: Simulation) -> Readings:
    """Return the numbers that are shown beside the picture of this instant."""
    wrench, result = simulation.wrench, simulation.result
    return Readings(
        simulation.time, wrench.force, wrench.point, result.cut_area, result.n_tetrahedra
    )


def into_replay(replay: ReplayWriter) -> Picture:
    """Return what keeps a replay up to date."""

    def picture(simulation: Simulation) -> None:
        if replay.is_due(simulation.time):
            replay.add(
                simulation.time,
                simulation.link.surface(),
                body_poses(simulation.arm.data),
                readings(simulation),
            )

    return picture
