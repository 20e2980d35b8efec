"""A recorded run as a page that plays it."""

from pathlib import Path

from scalpel_sim.errors import writing
from scalpel_sim.recording.columns import ForceParts
from scalpel_sim.saved_run.saved_run import SavedRun
from scalpel_sim.saved_run.saved_step import SavedStep
from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.replay import ReplayWriter
from scalpel_sim.viewer.scene3d import Readings
from tissue.support import whole_file

_OUT = "--out"


def write_replay(run: SavedRun, path: Path) -> None:
    """Write a page that plays a run.

    Raises:
        RunError: the file cannot be written.
    """
    stage = run.stage
    replay = ReplayWriter(
        stage.shapes, title=run.title, frame=run.frame, views=stage.views, look=stage.look
    )
    for number in range(len(run)):
        step = run.step(number)
        replay.add(step.time, scene_state(run, step))
    with writing(path, f"another {_OUT}"), whole_file(path) as unfinished:
        replay.write(unfinished)


def scene_state(run: SavedRun, step: SavedStep) -> SceneState:
    """Return what a page shows of a step.

    Args:
        run: The run.
        step: Of it.
    """
    readings = Readings(
        step.time,
        step.wrench.force,
        step.wrench.point,
        step.cut_area,
        len(step.snapshot.tetrahedra),
        step.contact_points,
        step.contact_forces,
        ForceParts(*step.force_parts),
        [
            (name, float((force @ force) ** 0.5))
            for name, force in zip(run.graspers, step.grasper_forces, strict=True)
        ],
        step.energies,
    )
    return SceneState(step.surface, step.body_poses, readings, None, step.surface_values)
