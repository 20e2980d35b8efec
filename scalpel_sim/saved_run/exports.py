"""Files of a recorded run for other programs: one instant, or all of them."""

from collections.abc import Iterator
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from bridge import TissueFrame
from scalpel_sim.errors import UsageError, writing
from scalpel_sim.output.export import ENDINGS, check_exports, export_surface
from scalpel_sim.output.rigid_bodies import ROUGHNESS, STEEL_ROUGHNESS, RigidBody, RigidPart
from scalpel_sim.saved_run.saved_run import SavedRun
from scalpel_sim.saved_run.saved_step import SavedStep
from scalpel_sim.viewer.model_shapes import Shape, position_and_rotation
from scalpel_sim.viewer.textures import even_colours
from tissue import FloatArray, write_vtu
from tissue.support import whole_file

VTU, PVD = ".vtu", ".pvd"
"""Endings of files of the whole body with its fields: at one instant, and at all."""

EXPORT_ENDINGS = (VTU, PVD, *ENDINGS)
"""Endings of the files to which a run can be exported."""

_OUT = "--out"

_MOST_BYTE = 255.0


def export_step(run: SavedRun, time: float | None, path: Path) -> SavedStep:
    """Write one instant to a file, in the format that the ending of its name requests.

    Args:
        run: The run.
        time: The last step that is not after it is written [s]; None: the last of all.
        path: The file.

    Returns:
        The step that was written.

    Raises:
        UsageError: the run has no such instant, or the ending is none of `EXPORT_ENDINGS` but
            `PVD`.
        RunError: the file cannot be written.
    """
    step = run.step(-1) if time is None else run.at(time)
    check_exports([path], _OUT, EXPORT_ENDINGS)
    if path.suffix.lower() == VTU:
        with writing(path, f"another {_OUT}"):
            _write_body(run, step, path)
    else:
        colours, beside = even_colours(run.stage.look), list(_rigid_bodies(run, step))
        export_surface(step.surface, path, colours, beside=beside, option=_OUT)
    return step


def export_series(run: SavedRun, path: Path) -> int:
    """Write the body at each instant, and a PVD file that names them all with their times.

    Args:
        run: The run.
        path: The PVD file. The others are in a folder beside it, which has its name and `_steps`.

    Returns:
        Number of instants.

    Raises:
        UsageError: there is no folder to write to, or a file has the name of the other one.
        RunError: the system refuses.
    """
    check_exports([path], _OUT, EXPORT_ENDINGS)
    folder = path.with_name(f"{path.stem}_steps")
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder}: is a file, where a folder is needed; choose another {_OUT}")
    digits = len(str(len(run) - 1))
    lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">', "<Collection>"]
    with writing(path, f"another {_OUT}"):
        folder.mkdir(exist_ok=True)
        for number, time in enumerate(run.times.tolist()):
            name = f"step_{number:0{digits}}{VTU}"
            _write_body(run, run.step(number), folder / name)
            file = quoteattr(f"{folder.name}/{name}")
            lines.append(f'<DataSet timestep="{time!r}" part="0" file={file}/>')
        with whole_file(path) as unfinished:
            unfinished.write_text("\n".join([*lines, "</Collection>", "</VTKFile>", ""]), "utf-8")
    return len(run)


def _write_body(run: SavedRun, step: SavedStep, path: Path) -> None:
    """Write the tetrahedra of a step with their fields."""
    write_vtu(path, step.snapshot, step.deformation, label_names=run.label_names)


def _rigid_bodies(run: SavedRun, step: SavedStep) -> Iterator[RigidBody]:
    """Yield the bodies of the arm and of what stands around, as they are at a step."""
    of_body: dict[int, list[Shape]] = {}
    for shape in run.stage.shapes:
        if not shape.is_target:
            of_body.setdefault(shape.body, []).append(shape)
    from_world = np.linalg.inv(_matrix(run.frame.rotation, run.frame.origin))
    for number, shapes in of_body.items():
        place, rotation = position_and_rotation(step.body_poses[number])
        yield RigidBody(
            run.bodies[number] or f"body_{number}",
            from_world @ _matrix(rotation, place),
            [_rigid_part(shape) for shape in shapes],
            is_fixed=number == 0,
        )


def _rigid_part(shape: Shape) -> RigidPart:
    """Return a shape of the arm's model as a part of its body."""
    place, rotation = position_and_rotation(shape.pose)
    frame = TissueFrame(rotation, place)
    return RigidPart(
        shape.name,
        frame.points_to_world(shape.mesh.positions),
        shape.mesh.triangles,
        frame.vectors_to_world(shape.mesh.normals),
        tuple(np.rint(_MOST_BYTE * shape.colour).astype(int).tolist()),
        STEEL_ROUGHNESS if shape.is_end else ROUGHNESS,
    )


def _matrix(rotation: FloatArray, place: FloatArray) -> FloatArray:
    """Return a rotation and a place [m] as a transform, shape (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, place
    return matrix
