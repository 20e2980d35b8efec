"""Checks of keys of a scene that make no sense together: each stands here, once."""

import math
import os
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import msgspec
import numpy as np

from bridge import VirtualCoupling
from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.scene.arm_tables import ArmTable, GrasperTable, WaypointTable
from scalpel_sim.scene.schema import (
    AttachmentTable,
    LabelTable,
    LedSupportTable,
    SolverTable,
    ViewTable,
    WorldTable,
)
from tissue import ELEMENTS, PRECISIONS, RELAXATIONS, SCHEMES, Material

COUPLINGS = ("rigid", "virtual")
"""Names of the couplings between the arm's blade and the one that cuts."""

ARM_CHOICES = ("auto", "touch", "premium", "psm")
"""Names of the arms, and `auto`: the first of them that reaches."""

LONGEST_RUN = 3600.0
"""Longest simulated time of a run [s]: more is taken for a typing error."""

_SMALLEST_TILT = 1e-6
"""Sine of the angle between the line of sight and `up` below which a picture has no upper side."""

_OF_OWN_BLADE = ("heel", "tip")
"""Keys of `[arm]` that name the blade of such an arm that has one."""

OF_OWN_ARM = ("mount", *_OF_OWN_BLADE, "forward", "force", "torque")
"""Keys of `[arm]` that describe an arm of the user's own."""

OF_PLACE = ("pos", "quat")
"""Keys of `[world]` that place the tissue in the world of such an arm."""

_OF_LIGAMENT = ("area", "toughness")
"""Keys that a ligament has, which has a `to`, and no other attachment."""

_OF_MODEL = ("at", "pos", "quat")
_OF_HOLD = ("stiffness", "damping", "breaks_at", "closed")


def moves_together(relaxation: str) -> bool:
    """Return whether all nodes move together: so on threads, and with an account of energy."""
    return relaxation in ("global", "verlet")


def check_choice(kind: str, name: str, choices: Sequence[str]) -> None:
    """Check that a name is one of some choices.

    Raises:
        UsageError: it is none; the message lists them, the nearest first.
    """
    if name not in choices:
        raise unknown(kind, name, choices)


def check_solver(solver: SolverTable, material: Material) -> None:
    """Check that the settings of the solver exist, and go with each other and the material.

    Raises:
        UsageError: they do not; the message says why.
    """
    relaxation, threads = solver.relaxation, solver.threads
    check_choice("scheme", solver.scheme, SCHEMES)
    check_choice("relaxation", relaxation, tuple(RELAXATIONS))
    check_choice("element", solver.element, ELEMENTS)
    check_choice("precision", solver.precision, PRECISIONS)
    if threads != 1 and not moves_together(relaxation):
        raise UsageError(
            f"--threads {threads} is for --relaxation global or verlet; {relaxation} runs on one"
        )
    cores = os.cpu_count() or 1
    if not 1 <= threads <= cores:
        raise UsageError(
            f"--threads is {threads}; it must be from 1 to {cores}, the number of cores"
        )
    if solver.audit and not moves_together(relaxation):
        raise UsageError(
            f"--audit needs --relaxation global or verlet, not {relaxation}; omit "
            "--audit, or choose one of those"
        )
    if relaxation == "verlet" and material.stiffens:
        raise UsageError(
            f"--relaxation verlet gains energy under law {material.law.name}; use global"
        )


def check_arm(arm: ArmTable, world: WorldTable) -> None:
    """Check which arm there is, and its coupling to the tissue.

    Raises:
        UsageError: there is no such arm or coupling, or a key is about another.
    """
    check_choice("arm", arm.preset, ARM_CHOICES)
    virtual_coupling(arm)
    _check_trocar(arm, "[arm]")
    if arm.model is not None:
        if arm.preset != "auto":
            raise UsageError("[arm] has a preset and a model; choose one")
        if not any(world.quat):
            raise UsageError("[world] quat is [0, 0, 0, 0]; it is a rotation: w, x, y, z")
        for key in _OF_OWN_BLADE:
            if arm.mount is not None and getattr(arm, key) != getattr(ArmTable(), key):
                raise UsageError(
                    f"[arm] has mount = '{arm.mount}', which holds a scalpel, and {key} = "
                    f"'{getattr(arm, key)}', of a blade of its own; omit one of them"
                )
        return
    for name, table, keys in (("arm", arm, OF_OWN_ARM), ("world", world, OF_PLACE)):
        usual = type(table)()
        for key in keys:
            if getattr(table, key) != getattr(usual, key):
                raise UsageError(
                    f"[{name}] {key} is for an arm of your own; add [arm] model, or omit it"
                )


def _check_trocar(table: ArmTable | GrasperTable, where: str) -> None:
    """Refuse a trocar for an arm that goes through none."""
    if table.trocar is not None and table.preset != "psm":
        raise UsageError(f'{where} trocar is for preset = "psm"; choose that, or omit it')


def virtual_coupling(arm: ArmTable) -> VirtualCoupling | None:
    """Return the coupling of the arm's blade to the one that cuts; None where they are one.

    Raises:
        UsageError: there is no such coupling, or it cannot have such a stiffness or damping.
    """
    check_choice("coupling", arm.coupling, COUPLINGS)
    numbers = {"stiffness": arm.coupling_stiffness, "damping": arm.coupling_damping}
    given = {name: value for name, value in numbers.items() if value is not None}
    if arm.coupling == "virtual":
        try:
            return VirtualCoupling(**given)
        except ValueError as error:
            raise UsageError(str(error)) from None
    for name in given:
        raise UsageError(f"--coupling-{name} is for --coupling virtual; a rigid one has none")
    return None


def check_range(stretch: float, gravity: Sequence[float], seconds: float | None) -> None:
    """Check numbers whose range is wider than any scene needs.

    Raises:
        UsageError: one is out of its range.
    """
    if not -0.5 <= stretch <= 1.0:
        raise UsageError(f"stretch is {stretch}; it is a fraction from -0.5 to 1")
    if not math.hypot(*gravity) <= 100.0:
        raise UsageError(f"gravity is {math.hypot(*gravity):g} m/s2; it must be at most 100")
    if seconds is not None and not 0.0 < seconds <= LONGEST_RUN:
        raise UsageError(f"seconds is {seconds}; it must be above 0 and at most {LONGEST_RUN:g}")


def check_support(table: LedSupportTable, where: str) -> None:
    """Check that the rows of a support make sense together: see `check_rows`."""
    fields = (table.displacements, table.rotations_degrees, table.stretches)
    if all(rows is None for rows in fields):
        raise UsageError(f"{where} has no displacements, rotations_degrees or stretches")
    for rows in fields:
        if rows is not None and len(rows) != len(table.times):
            raise UsageError(f"{where} has {len(table.times)} times and {len(rows)} rows of a key")
    if table.times[0] <= 0.0 or any(b <= a for a, b in pairwise(table.times)):
        raise UsageError(f"{where} has the times {table.times}; they begin above 0 and increase")


def check_label(table: LabelTable, where: str) -> None:
    """Check that the keys of a label make sense together: see `check_rows`."""
    if table.label is not None and table.region is not None:
        raise UsageError(
            f"{where} has label and region; one says which elements it is: label, a number of the "
            "mesh file, or region, a box or a sphere"
        )
    region = table.region
    if region is not None and (":" not in region or region.lower().startswith("label:")):
        raise UsageError(
            f"{where} has region '{table.region}'; it is a box (\"0,0,0:0.01,0.02,0.03\") or a "
            'sphere ("sphere:0.01,0.02,0.03,0.005")'
        )


def check_attachment(table: AttachmentTable, where: str) -> None:
    """Check that the keys of an attachment make sense together: see `check_rows`."""
    if table.to_body is not None:
        _check_tie(table, where)
        return
    for key in _OF_LIGAMENT:
        if (getattr(table, key) is None) != (table.to is None):
            given, missing = (key, "to") if table.to is None else ("to", key)
            raise UsageError(
                f"{where} has {given} and no {missing}; a ligament, which the blade can cut, has "
                "to, area and toughness"
            )
    if table.displacements is None:
        for key in ("times", "speed"):
            if getattr(table, key) is not None:
                raise UsageError(f"{where} has {key} and no displacements; give them too")
        return
    if (table.times is None) == (table.speed is None):
        raise UsageError(f"{where} has displacements; give either times or a speed with them")
    if table.times is None:
        if any(here == there for here, there in pairwise([(0.0, 0.0, 0.0), *table.displacements])):
            raise UsageError(
                f"{where} has two displacements in turn that are equal, which takes no time at a "
                "speed; give times"
            )
        return
    if len(table.times) != len(table.displacements):
        raise UsageError(
            f"{where} has {len(table.times)} times for {len(table.displacements)} displacements; "
            "give one for each"
        )
    if not all(here < there for here, there in pairwise([0.0, *table.times])):
        raise UsageError(f"{where} has times {table.times}; they begin above 0 and increase")


def _check_tie(table: AttachmentTable, where: str) -> None:
    """Check that an attachment that ties two bodies has all that it needs, and no frame."""
    if table.body is None or table.body == table.to_body:
        raise UsageError(
            f"{where} has to_body and no other body; body is the one that it begins at"
        )
    if table.toughness is None:
        raise UsageError(f"{where} has to_body and no toughness, the energy of cutting it [J/m2]")
    for key in ("to", "displacements", "times", "speed"):
        if getattr(table, key) is not None:
            raise UsageError(f"{where} has to_body and {key}; what ties two bodies moves with them")


def check_parts(bodies: Sequence[str], arrays: Mapping[str, Sequence[Any]]) -> None:
    """Check that rows that are about a part name a body that there is.

    Args:
        bodies: Names of the bodies, where there are several.
        arrays: Rows with a `body`, by the name of their array.

    Raises:
        UsageError: one names no body, or a label with a region says nothing of which body it is.
    """
    for kind, rows in arrays.items():
        for i, row in enumerate(rows):
            where = f"[[{kind}]] number {i + 1}"
            for name in (row.body, getattr(row, "to_body", None)):
                if name is not None and name not in bodies:
                    if not bodies:
                        raise UsageError(f"{where} has a body, and the scene has one; omit it")
                    raise UsageError(f"{where}: {unknown('body', name, bodies)}")
            is_own = isinstance(row, LabelTable) and (row.label, row.region) != (None, None)
            if bodies and is_own and row.body is None:
                raise UsageError(
                    f"{where} has no body; with several it says of which: {', '.join(bodies)}"
                )


def check_rows(
    kind: str, rows: Sequence[msgspec.Struct], check: Callable[[Any, str], None]
) -> None:
    """Check each row of an array of tables, and that names differ where rows have names.

    Args:
        kind: Name of the array.
        rows: The rows.
        check: Checks a row; its second argument is the name of the row, as a file writes it.

    Raises:
        UsageError: one makes no sense; the message says which.
    """
    for i, row in enumerate(rows):
        check(row, f"[[{kind}]] number {i + 1}")
    bodies = [getattr(row, "body", None) for row in rows]
    names = [
        row.name if body is None else f"{body}/{row.name}"
        for row, body in zip(rows, bodies, strict=True)
        if hasattr(row, "name")
    ]
    check_different(kind, names)


def check_different(kind: str, names: Iterable[str]) -> None:
    """Check that no two tables of a kind have one name.

    Raises:
        UsageError: two do.
    """
    for name, n in Counter(names).items():
        if n > 1:
            raise UsageError(f"two of [[{kind}]] are called {name}; choose another name for one")


def check_grasper(grasper: GrasperTable, where: str) -> None:
    """Check that the keys of a grasper belong together: see `check_rows`."""
    if grasper.recorded is not None and grasper.motion:
        raise UsageError(f"{where} has a motion and a recorded one; choose one")
    if grasper.recorded is None:
        _check_motion(grasper.motion, where)
    if grasper.model is not None:
        if grasper.preset is not None:
            raise UsageError(f"{where} has a preset and a model; choose one")
        if grasper.at is None:
            raise UsageError(
                f"{where} has a model and no at: the site, body, frame or link that holds it"
            )
    _check_trocar(grasper, where)
    for key in _OF_MODEL:
        if grasper.model is None and getattr(grasper, key) is not None:
            raise UsageError(f"{where} {key} is for an arm of your own; add a model, or omit it")
    for key in _OF_HOLD:
        if grasper.holds == "friction" and getattr(grasper, key) is not None:
            raise UsageError(f'{where} {key} is for holds = "attachment"; friction has none')
    if grasper.quat is not None and not any(grasper.quat):
        raise UsageError(f"{where} quat is [0, 0, 0, 0]; it is a rotation: w, x, y, z")


def _check_motion(motion: Sequence[WaypointTable], where: str) -> None:
    if not motion:
        raise UsageError(f"{where} has no motion: rows such as {{time = 0.0, at = [0, 0, 0.1]}}")
    for key in ("at", "opening"):
        if getattr(motion[0], key) is None:
            raise UsageError(f"the first row of motion of {where} has no {key}")


def check_view(view: ViewTable, where: str) -> None:
    """Check that a view shows something, the right way up: see `check_rows`."""
    distance = math.dist(view.eye, view.target)
    if distance == 0.0:
        raise UsageError(f"{where} has its eye at its target, {list(view.eye)}; move one of them")
    length = math.hypot(*view.up)
    if not (math.isfinite(distance) and math.isfinite(length)):
        raise UsageError(f"{where} has an eye, a target or an up that is too large")
    if length == 0.0:
        raise UsageError(f"{where} up is [0, 0, 0]; it is a direction, such as [0, 0, 1]")
    sight = (np.array(view.target) - np.array(view.eye)) / distance
    if np.linalg.norm(np.cross(sight, np.array(view.up) / length)) < _SMALLEST_TILT:
        across = [0, 1, 0] if abs(sight[1]) < abs(sight[2]) else [0, 0, 1]
        raise UsageError(
            f"{where} looks along its up, {list(view.up)}; give another up, such as {across}"
        )
