"""A recorded run in other forms: a page that plays it, and files of one instant."""

from pathlib import Path

from scalpel_sim.errors import writing
from scalpel_sim.output.export import ENDINGS, check_exports, export_surface
from scalpel_sim.recording.columns import ForceParts
from scalpel_sim.saved_run.saved_run import SavedRun
from scalpel_sim.saved_run.saved_step import SavedStep
from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.replay import ReplayWriter
from scalpel_sim.viewer.scene3d import Readings
from tissue import write_vtu
from tissue.support import whole_file

VTU = ".vtu"
"""Ending of a file of the whole body with its fields."""

EXPORT_ENDINGS = (VTU, *ENDINGS)
"""Endings of the files to which an instant can be exported."""

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
            for name, force in zip(run.graspers, step.hand_forces, strict=True)
        ],
        step.energies,
    )
    return SceneState(step.surface, step.body_poses, readings, None, step.surface_values)


def export_step(run: SavedRun, time: float | None, path: Path) -> SavedStep:
    """Write the body at one instant to a file, in the format that the ending of its name requests.

    Args:
        run: The run.
        time: The last step that is not after it is written [s]; None: the last of all.
        path: The file.

    Returns:
        The step that was written.

    Raises:
        UsageError: the run has no such instant, or the ending is none of `EXPORT_ENDINGS`.
        RunError: the file cannot be written.
    """
    step = run.step(-1) if time is None else run.at(time)
    check_exports([path], _OUT, EXPORT_ENDINGS)
    if path.suffix.lower() == VTU:
        with writing(path, f"another {_OUT}"):
            write_vtu(path, step.snapshot, step.deformation, label_names=run.label_names)
    else:
        export_surface(step.surface, path, run.stage.look.labels)
    return step
