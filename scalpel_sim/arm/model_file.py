"""Models of arms from files: MJCF as it is, URDF with its meshes found and its links kept.

MuJoCo reads URDF, but knows neither packages nor COLLADA, and merges links that do not move.
"""

import logging
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Final
from urllib.parse import unquote

import mujoco
import numpy as np

_READ: Final = (".obj", ".stl", ".msh")
"""Endings of files of meshes that MuJoCo reads."""

_KEPT: Final = {"fusestatic": "false", "discardvisual": "false", "strippath": "false"}
"""Options of MuJoCo's compiler with which links, their visible shapes and paths stay, unless the
file says otherwise."""

_MOMENTS: Final = ("xx", "yy", "zz", "xy", "xz", "yz")
"""Entries of an inertia in a URDF file, after an i."""

_NAMED: Final = 3
"""Meshes, or links, that a warning names."""

_log = logging.getLogger("scalpel_sim")


class ModelFileError(ValueError):
    """A file is no model of an arm."""


def spec_of_file(path: Path) -> mujoco.MjSpec:
    """Return the model of an MJCF or URDF file, yet to be compiled.

    Of a URDF all links are kept, those that are fixed too; a link that has a shape to collide with
    is drawn as that. A warning says which meshes are left out, since they are not found or not of a
    kind that MuJoCo reads.

    Args:
        path: The file.

    Raises:
        ModelFileError: of a URDF file: it is to be expanded by xacro first, or a link that moves
            has no mass.
        ValueError: the file cannot be read, or is no model.
    """
    try:
        robot = ET.parse(path).getroot()
    except (OSError, ET.ParseError, LookupError):
        robot = None
    if robot is None or robot.tag != "robot":
        return mujoco.MjSpec.from_file(str(path))
    if any(isinstance(part.tag, str) and "xacro" in part.tag for part in robot.iter()):
        raise ModelFileError(
            "it is a xacro file, which programs of ROS expand: xacro FILE > robot.urdf. Give that"
        )
    _prefer_collision(robot)
    options = _options(robot)
    folder = path.resolve().parent
    _leave_out(robot, _take_meshes(robot, folder, folder / options.get("meshdir", "")))
    for key, value in _KEPT.items():
        options.attrib.setdefault(key, value)
    _balance(robot, options)
    spec = mujoco.MjSpec.from_string(ET.tostring(robot, encoding="unicode"))
    spec.modelfiledir = str(path.resolve().parent)
    _expect_masses(spec, robot)
    return spec


def _options(robot: ET.Element) -> ET.Element:
    """Return the options of MuJoCo's compiler in a robot, which has none yet where they are new."""
    options = robot.find("mujoco/compiler")
    if options is None:
        own = robot.find("mujoco")
        options = ET.SubElement(ET.SubElement(robot, "mujoco") if own is None else own, "compiler")
    return options


def _balance(robot: ET.Element, options: ET.Element) -> None:
    """Replace inertias that no solid can have, and report whose.

    Each principal moment is at most the sum of the others. MuJoCo takes their mean instead.
    """
    wrong = []
    for link in robot.iter("link"):
        given = link.find("inertial/inertia")
        if given is None:
            continue
        xx, yy, zz, xy, xz, yz = (float(given.get(f"i{key}", 0.0)) for key in _MOMENTS)
        moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if moments[0] + moments[1] < moments[2]:
            wrong.append(link.get("name", ""))
    if wrong and "balanceinertia" not in options.attrib:
        options.set("balanceinertia", "true")
        more = f" and {len(wrong) - _NAMED} more" if len(wrong) > _NAMED else ""
        _warn_once(
            f"no solid has the inertia that the robot '{robot.get('name', '')}' gives for "
            f"{', '.join(wrong[:_NAMED])}{more}: the largest principal moment is more than the sum "
            "of the others. The mean of the three is taken"
        )


def _prefer_collision(robot: ET.Element) -> None:
    """Take what is only seen out of links that can collide: both would be drawn."""
    for link in robot.iter("link"):
        if link.find("collision") is not None:
            for visual in link.findall("visual"):
                link.remove(visual)


def _take_meshes(robot: ET.Element, folder: Path, meshes: Path) -> list[ET.Element]:
    """Give meshes the paths of their files; return those of which there is none.

    Args:
        robot: The robot.
        folder: Its folder.
        meshes: Where its options say that meshes are.
    """
    missing = []
    for mesh in robot.iter("mesh"):
        file = _file_of(mesh.get("filename", ""), folder, meshes)
        if file is None or file.suffix.lower() not in _READ:
            missing.append(mesh)
        else:
            mesh.set("filename", file.as_posix())
    return missing


def _file_of(uri: str, folder: Path, meshes: Path) -> Path | None:
    """Return the file of a mesh; None where there is none.

    A package is looked for next to the file of the robot and in all folders above, by its name;
    there its folder may have another name too.

    Args:
        uri: What the robot calls it: `package://NAME/PATH`, `file://PATH`, or a path.
        folder: Folder of the robot.
        meshes: Folder of meshes, where it is of that name or path; MuJoCo looks nowhere else.
    """
    scheme, _, rest = uri.rpartition("://")
    path = Path(unquote(rest) if scheme else rest)
    tried = [folder / path, meshes / path, meshes / path.name]
    if scheme in ("package", "model"):
        inside = Path(*path.parts[1:])
        above = [each / part for each in (folder, *folder.parents) for part in (path, inside)]
        tried = [*above, meshes / path.name]
    return next((each for each in tried if each.is_file()), None)


def _leave_out(robot: ET.Element, missing: Sequence[ET.Element]) -> None:
    """Take shapes out whose mesh is missing, and say so."""
    if not missing:
        return
    for link in robot.iter("link"):
        for kind in ("visual", "collision"):
            for shape in link.findall(kind):
                if shape.find("geometry/mesh") in missing:
                    link.remove(shape)
    names = sorted({mesh.get("filename", "") for mesh in missing})
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    _warn_once(
        f"the robot '{robot.get('name', '')}' is simulated without {len(names)} of its meshes, "
        f"which are neither drawn nor touch anything: {', '.join(names[:_NAMED])}{more}. MuJoCo "
        f"reads {', '.join(_READ)}; a package is looked for next to the file and in the folders "
        "above it"
    )


@cache
def _warn_once(text: str) -> None:
    """Warn: a run reads the model of its arm up to three times."""
    _log.warning("%s", text)


def _expect_masses(spec: mujoco.MjSpec, robot: ET.Element) -> None:
    """Refuse links that move and have no mass, with all their names.

    What is fixed to a link moves with it: its mass counts.

    Raises:
        ModelFileError: there is one.
    """
    massive = {
        link.get("name")
        for link in robot.iter("link")
        if float(getattr(link.find("inertial/mass"), "attrib", {}).get("value", 0.0)) > 0.0
    }

    def has_mass(body: mujoco.MjsBody) -> bool:
        return (
            body.name in massive
            or any(geom.density > 0.0 for geom in body.geoms)
            or any(has_mass(each) for each in body.bodies if not each.joints)
        )

    lacking = [body.name for body in spec.bodies if body.joints and not has_mass(body)]
    if lacking:
        raise ModelFileError(
            f"links that move have no mass: {', '.join(lacking)}. Give each an <inertial> with "
            "mass and inertia; MuJoCo does not move what has none"
        )
