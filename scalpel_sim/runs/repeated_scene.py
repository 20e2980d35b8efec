"""The scene of a run that a hand leads, so that the run can be done again by its script."""

from msgspec import structs

from scalpel_sim.recording.growing_file import FileSum, sum_of
from scalpel_sim.runs.file_names import PLAN, STROKE, grasp_file
from scalpel_sim.runs.run_folder import Outputs
from scalpel_sim.scene.scene import Scene
from scalpel_sim.scene.write import relative_path
from scalpel_sim.scoring.score import Score
from scalpel_sim.simulation import Simulation
from scalpel_sim.strokes.kind import StrokeTable


def repeated_scene(scene: Scene, simulation: Simulation, outputs: Outputs) -> Scene:
    """Return the scene that repeats what a hand will have done, and is scored by the same plan.

    Raises:
        RunError: the system refuses to write the plan.
    """
    scene = _with_plan(scene, simulation, outputs)
    recorded = StrokeTable(kind="recorded", file=str(outputs.path(STROKE)))
    graspers = [
        structs.replace(each, motion=[], recorded=str(outputs.path(grasp_file(each.name))))
        for each in scene.graspers
    ]
    return structs.replace(scene, strokes=(recorded,), graspers=tuple(graspers), seconds=None)


def _with_plan(scene: Scene, simulation: Simulation, outputs: Outputs) -> Scene:
    """Return a scene whose task keeps the plan of strokes that a hand replaces.

    Raises:
        RunError: the system refuses to write the plan.
    """
    task, score = scene.task, simulation.score
    if task is None or task.line is not None or task.surface is not None:
        return scene
    if not isinstance(score, Score) or score.plan is None:
        return scene
    outputs.write_plan(score.plan)
    return structs.replace(scene, task=structs.replace(task, surface=str(outputs.path(PLAN))))


def sums_of_recorded(scene: Scene, outputs: Outputs) -> dict[str, FileSum]:
    """Return the checksums of the motions that a run repeats, by path seen from its folder.

    No state knows them: that of a run that a hand led is of a stroke which is not recorded yet.

    Raises:
        OSError: one cannot be read.
    """
    return {relative_path(path, outputs.folder): sum_of(path) for path in scene.recorded_files}
