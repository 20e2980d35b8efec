"""`COLUMNS`: what a row of `forces.csv` holds, a group of columns each.

To add a column, add a `ColumnGroup` to `COLUMNS`: see `docs/extend.md`.
"""

import math
import re
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from bridge import NamedLabel, TissueFrame
from tissue import BladeSegment, Energies, FloatArray, RigidContacts, StepResult, Wrench
from tissue.support import kernel

EDGE_COSINE = 0.9
"""Cosine of the angle between a contact's normal and the blade's forward direction above which the
contact is one of the edge. Contacts of the edge have 1; a bevel of 60 degrees, the steepest, has
0.87 at most."""


ACCOUNT = (*(f"{term}_j" for term in Energies._fields[1:]), "residual_j")
"""Columns of the energy account since the start: the terms of `tissue.Energies`, and the residual.
NaN without an audit."""

WALL_TIMES = ("cd_s", "gc_s", "rx_s", "rd_s", "frame_s", "recording_s")
"""Columns that differ from run to run: what frames took."""

MOST_LABELS = 64
"""Labels of a body that have columns of their own. In a mesh with more they are no parts."""

_NO_ACCOUNT = (math.nan,) * len(ACCOUNT)
"""The energies of a frame without an audit."""


class WallTimes(NamedTuple):
    """Wall times of one frame [s], in the order of the columns."""

    collision: float = 0.0
    """Collision detection (CD)."""
    topology: float = 0.0
    """Geometric changes (GC)."""
    relaxation: float = 0.0
    """Relaxation (RX)."""
    pictures: float = 0.0
    """Rendering (RD)."""
    frame: float = 0.0
    """The whole frame, without pictures and without its recording."""


class HeldLoad(Protocol):
    """Load of the tissue on an attachment."""

    @property
    def wrench(self) -> Wrench:
        """Wrench of the tissue on it in the frame, tissue frame."""


class FrameData(NamedTuple):
    """One frame at its end: what the numbers of its row are made from."""

    time: float
    """Simulated time at which the frame began [s]."""
    blade: BladeSegment
    """Edge of the blade at the end of the frame, world frame."""
    felt: Wrench
    """Wrench that the arm felt in the frame, world frame, about the tip."""
    raw: Wrench
    """That wrench before any limit of the device; the same object where none acted."""
    result: StepResult
    """Last result of the tissue, tissue frame."""
    tissue_frame: TissueFrame
    """Pose of the tissue in the world."""
    loads: Sequence[HeldLoad]
    """Load on each frame that acts on the tissue, those of its own scene first; tissue frame."""
    wall_times: WallTimes
    """Wall times of the frame and of its stages."""
    recorded_since: float
    """Wall clock when the recording of the frame began [s]: `time.perf_counter`."""


class ColumnGroup(NamedTuple):
    """Quantities of a frame that are computed together, as columns of `forces.csv`."""

    quantities: Mapping[str, Sequence[str]]
    """Columns of each quantity, by its name. A column ends with its unit: `force_x_n` is in N."""
    values: Callable[[FrameData], Sequence[float]]
    """Return the numbers of a frame, one for each column, in order."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of all columns."""
        return columns_in(self.quantities)


def columns_in(quantities: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """Return the names of the columns of quantities, in order."""
    return tuple(name for columns in quantities.values() for name in columns)


def columns_of(groups: Iterable[ColumnGroup]) -> tuple[str, ...]:
    """Return the names of the columns of groups, in order."""
    return tuple(name for group in groups for name in group.columns)


def frame_row(groups: Iterable[ColumnGroup], frame: FrameData) -> list[float]:
    """Return the numbers of a frame, one for each column of the groups, in order."""
    row: list[float] = []
    for group in groups:
        row += group.values(frame)
    return row


def vector_columns(name: str, unit: str) -> tuple[str, ...]:
    """Return the three columns of a vector quantity."""
    return tuple(f"{name}_{axis}_{unit}" for axis in "xyz")


def held_group(n: int) -> ColumnGroup:
    """Return the group of a run with `n` attachments of its scene.

    Each has the force of the tissue on it [N], world frame, averaged over the frame.
    """

    def forces(frame: FrameData) -> list[float]:
        to_world = frame.tissue_frame.vectors_to_world
        loads = frame.loads[:n]
        return [x for load in loads for x in to_world(load.wrench.force).tolist()]

    return ColumnGroup({f"held_{i}": vector_columns(f"held_{i}", "n") for i in range(n)}, forces)


def label_group(labels: Sequence[NamedLabel]) -> ColumnGroup:
    """Return the group of a run through a body of several labels.

    Of one label, and of more than `MOST_LABELS`, it has no columns.

    Of each label the work of cutting in it since the start [J], and its force on the edge against
    the direction in which that cuts, at the end of the frame [N].
    """
    if not 2 <= len(labels) <= MOST_LABELS:
        return ColumnGroup({}, lambda _: ())
    names = [_in_column(label) for label in labels]

    def values(frame: FrameData) -> list[float]:
        result = frame.result
        return [*result.cutting_of_labels.tolist(), *result.force_of_labels.tolist()]

    return ColumnGroup(
        {
            "cutting_of_labels": [f"cutting_{name}_j" for name in names],
            "force_of_labels": [f"edge_{name}_n" for name in names],
        },
        values,
    )


def label_of_column(column: str) -> int | None:
    """Return the label that a column of `label_group` is of; None: it is of none."""
    found = re.fullmatch(r"(?:cutting|edge)_(\d+)(?:_\w+)?_[jn]", column, re.ASCII)
    return None if found is None else int(found[1])


def _in_column(label: NamedLabel) -> str:
    """Return a label as names of columns have it: its number, and letters of its name."""
    name = re.sub(r"[^A-Za-z0-9]+", "_", label.name).strip("_")
    return f"{label.label}_{name}" if name else f"{label.label}"


def grasper_quantities(name: str) -> dict[str, tuple[str, ...]]:
    """Return the quantities of a grasper, which follow after all others.

    Force and torque of the tissue on it in the frame, about the middle between the pads, world
    frame; the distance between the pads; and how many points of the tissue are attached to it.
    """
    return {
        f"{name}_force": vector_columns(f"{name}_force", "n"),
        f"{name}_torque": vector_columns(f"{name}_torque", "nm"),
        f"{name}_opening": (f"{name}_opening_m",),
        f"{name}_points": (f"{name}_points",),
    }


def _motion(frame: FrameData) -> list[float]:
    """Return the time, the place of the tip, and the wrench as it is felt and as it is exerted."""
    return [
        frame.time,
        *frame.blade.numbers[:3],
        *frame.felt.numbers[:6],
        *frame.raw.numbers[:6],
    ]


def _force_parts(frame: FrameData) -> list[float]:
    """Return the parts of the force [N], and the stiffness against displacement [N/m]."""
    there, result = frame.tissue_frame, frame.result
    forward = there.vectors_to_tissue(frame.blade.forward)
    parts = np.array(force_parts(result.contacts_of_blade, forward))
    stiffness = there.matrix_to_world(result.stiffness[:3, :3])
    xx, xy, xz, _, yy, yz, _, _, zz = stiffness.ravel().tolist()
    return [*there.vectors_to_world(parts).ravel().tolist(), xx, yy, zz, xy, xz, yz]


def _cut(frame: FrameData) -> tuple[float, ...]:
    """Return what the blade has done to the tissue since the start."""
    result = frame.result
    return (
        result.cut_area,
        result.finished_area,
        result.n_tetrahedra,
        result.anchored_length,
        result.work_of_blade,
    )


def _added_mass(frame: FrameData) -> list[float]:
    """Return the mass that mass scaling has added, its momenta, and the impulses it gave."""
    there, added = frame.tissue_frame, frame.result.added_mass.numbers
    added[1:] = there.vectors_to_world(added[1:].reshape(4, 3)).ravel()
    move_moments(added, there.numbers_of_origin)
    return list(added.tolist())


def _account(frame: FrameData) -> tuple[float, ...]:
    """Return the terms of the energy account, and the residual [J]."""
    energies = frame.result.energies
    return _NO_ACCOUNT if energies is None else (*energies[1:], energies.residual)


def _wall_times(frame: FrameData) -> tuple[float, ...]:
    """Return the wall times of the frame [s], and that of its recording so far."""
    return (*frame.wall_times, time.perf_counter() - frame.recorded_since)


COLUMNS: dict[str, ColumnGroup] = {
    "motion": ColumnGroup(
        {
            "time": ("time_s",),
            "tip": vector_columns("tip", "m"),
            "force": vector_columns("force", "n"),
            "torque": vector_columns("torque", "nm"),
            "tissue_force": vector_columns("tissue_force", "n"),
            "tissue_torque": vector_columns("tissue_torque", "nm"),
        },
        _motion,
    ),
    "force_parts": ColumnGroup(
        {
            "edge_force": vector_columns("edge_force", "n"),
            "pressing_force": vector_columns("pressing_force", "n"),
            "friction_force": vector_columns("friction_force", "n"),
            "stiffness": [f"stiffness_{ij}_n_m" for ij in ("xx", "yy", "zz", "xy", "xz", "yz")],
        },
        _force_parts,
    ),
    "cut": ColumnGroup(
        {
            "cut_area": ("cut_area_m2",),
            "finished_area": ("finished_area_m2",),
            "tetrahedra": ("tetrahedra",),
            "anchored_length": ("anchored_length_m",),
            "work_of_blade": ("work_of_blade_j",),
        },
        _cut,
    ),
    "account": ColumnGroup({"account": ACCOUNT}, _account),
    "added_mass": ColumnGroup(
        {
            "added_mass": ("added_mass_kg",),
            "added_momentum": vector_columns("added_momentum", "ns"),
            "added_angular_momentum": vector_columns("added_angular_momentum", "nms"),
            "scaling_impulse": vector_columns("scaling_impulse", "ns"),
            "scaling_angular_impulse": vector_columns("scaling_angular_impulse", "nms"),
        },
        _added_mass,
    ),
    "wall_times": ColumnGroup({"wall_times": WALL_TIMES}, _wall_times),
}
"""Groups of columns that each run records, in order. Those of attachments and of instruments follow
after them. Vectors are in the world frame. `force` and `torque` are what the arm feels, averaged
over the frame, the torque about the tip; `tissue_force` and `tissue_torque` are what the tissue
exerts, before the limits of the device. `edge_force`, `pressing_force` and `friction_force` are
what the tissue does to the blade's edge, to its faces, and along them, at the end of the frame;
`stiffness` is how fast that force changes with the blade's position. `added_mass` is the mass that
mass scaling has added, then its momentum and its angular momentum about the origin of the world, in
N s and N m s, and what mass scaling gave of both since the start: see `tissue.AddedMass`. `cd_s` to
`rd_s` are wall times of the stages that the paper's Table 1 names: collision detection, geometric
changes, relaxation and rendering. `frame_s` is the wall time of the whole frame without rendering
(`rd_s`) and without the recording of its row (`recording_s`: of the columns up to there)."""


def shared_columns() -> tuple[str, ...]:
    """Return the names of the columns that each run has."""
    return columns_of(COLUMNS.values())


class ForceParts(NamedTuple):
    """Forces of the tissue on the blade, whose sum is the wrench's at the end of the step."""

    edge: FloatArray
    """Force on the edge: the resistance to cutting, and what the edge bends aside [N]; (3,)."""
    pressing: FloatArray
    """Normal force on the faces of the blade [N], shape (3,)."""
    friction: FloatArray
    """Friction along the faces of the blade [N], shape (3,)."""


def force_parts(contacts: RigidContacts, forward: FloatArray) -> ForceParts:
    """Return the parts of the force that these contacts add up to.

    Args:
        contacts: Contacts of the blade in one step.
        forward: Unit vector in which the blade cuts at the end of the step, in the frame of the
            contacts; shape (3,).
    """
    parts = np.empty(9)
    add_up(contacts.normal, contacts.normal_force, contacts.friction, forward, parts)
    return ForceParts(*parts.reshape(3, 3))


@kernel
def add_up(
    normal: FloatArray,
    normal_force: FloatArray,
    friction: FloatArray,
    forward: FloatArray | tuple[float, float, float],
    parts: FloatArray,
) -> None:
    """Write `ForceParts`, one vector after the other, contact by contact.

    Args:
        normal: See `RigidContacts`.
        normal_force: See `RigidContacts`.
        friction: See `RigidContacts`.
        forward: Unit vector in which the blade cuts.
        parts: The first nine numbers are written [N].
    """
    for i in range(9):
        parts[i] = 0.0
    for i in range(len(normal_force)):
        cosine = 0.0
        for axis in range(3):
            cosine += normal[i, axis] * forward[axis]
        for axis in range(3):
            pressing = normal_force[i] * normal[i, axis]
            if cosine > EDGE_COSINE:
                parts[axis] -= pressing + friction[i, axis]
            else:
                parts[3 + axis] -= pressing
                parts[6 + axis] -= friction[i, axis]


@kernel
def move_moments(added: FloatArray, origin: tuple[float, float, float]) -> None:
    """Move angular momenta of `tissue.AddedMass` to the origin of the world.

    Args:
        added: Its numbers, along the axes of the world; written.
        origin: Origin of the tissue in the world [m].
    """
    for k in (1, 7):
        x, y, z = added[k], added[k + 1], added[k + 2]
        added[k + 3] += origin[1] * z - origin[2] * y
        added[k + 4] += origin[2] * x - origin[0] * z
        added[k + 5] += origin[0] * y - origin[1] * x
