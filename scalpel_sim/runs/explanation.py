"""Explanation of one frame of a run: it is done again there, from its folder, which stays as it is.

A run is put to the last checkpoint before the frame, or to its start, and the frames until there
are repeated. They give the same bits, which is checked against `forces.csv`.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bridge import InProcessLink
from scalpel_sim.errors import UsageError
from scalpel_sim.output.report import SATURATIONS
from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.recording.columns import ForceParts
from scalpel_sim.recording.growing_file import FileSum
from scalpel_sim.recording.recording import Recording, read_forces
from scalpel_sim.runs.checkpoints import Checkpoint, Checkpoints
from scalpel_sim.runs.file_names import FORCES, INITIAL, SCENE
from scalpel_sim.runs.resumption import RepeatedFrames, Resumption
from scalpel_sim.scene.read import read_scene
from scalpel_sim.scene.scene import Scene
from scalpel_sim.simulation import Simulation, no_garbage_collection
from tissue import ActingForce, FloatArray, Wrench

OF_BLADE = ("edge", "face", "back", "end", "fibre")
"""Kinds of forces of the blade, which add up to the wrench on it."""

LIMITS = (*SATURATIONS, "not_finite")
"""Counters of the bridge that rise where a wrench is changed on its path to the arm."""

_UNITS = {"point": "_m", "force": "_n", "friction": "_n", "depth": "_m", "limit": "_n"}
"""Ends of the keys of an acting force in JSON."""

_COLUMNS_OF_PARTS = ("edge_force", "pressing_force", "friction_force")
"""Names of the columns of `ForceParts`."""

_SAME_INSTANT = 1e-6
"""Part of a frame by which a time may be before the begin of a frame: rounding of decimals."""


class ToExplain(NamedTuple):
    """A frame of a run, as its folder has it."""

    folder: Path
    scene: Scene
    recorded: Recording
    """The rows of `forces.csv`."""
    n_before: int
    """Number of frames before it."""
    checkpoint: Checkpoint | None
    """Where the run is resumed; None: at its start."""


class Explanation(NamedTuple):
    """Forces that acted in one frame. World frame, as in `forces.csv`."""

    folder: Path
    scene: str
    frame: int
    """Number of the frame, from 1 on."""
    time: float
    """Simulated time at which it began [s]."""
    resumed_from: int
    """Number of frames that a checkpoint had; 0: the run was done from its start."""
    answered: bool
    """Whether the tissue was queried in this frame; if not, its forces are of the last answer."""
    felt: Wrench
    """Wrench that the arm felt."""
    raw: Wrench
    """The same before any limit."""
    mean: FloatArray
    """Mean force of the tissue on the blade over its last step [N], shape (3,)."""
    at_end: FloatArray
    """The same at the end of that step [N], shape (3,): the sum of the forces of the blade."""
    parts: ForceParts
    """The parts of that sum, as the row of `forces.csv` has them."""
    forces: list[ActingForce]
    """All that acted on the tissue."""
    limits: dict[str, float]
    """Limits that acted in this frame, by name; energy in J, impulse in N s."""
    coupling: dict[str, str]
    """Settings of the coupling of arm and tissue, as text."""

    def of_kinds(self, *kinds: str) -> list[ActingForce]:
        """Return the forces of these kinds, the largest first."""
        found = [each for each in self.forces if each.kind in kinds]
        return sorted(found, key=lambda each: -float(np.linalg.norm(each.force)))

    def as_numbers(self) -> dict[str, Any]:
        """Return all of it as one object of plain numbers: SI units in the names of its keys."""
        return {
            "folder": str(self.folder),
            "scene": self.scene,
            "frame": self.frame,
            "time_s": self.time,
            "resumed_from_frame": self.resumed_from,
            "tissue_answered": self.answered,
            "felt": _numbers_of(self.felt),
            "raw": _numbers_of(self.raw),
            "tissue_force_mean_n": self.mean.tolist(),
            "tissue_force_at_end_n": self.at_end.tolist(),
            "parts_n": {key: part.tolist() for key, part in self.parts._asdict().items()},
            "limits": self.limits,
            "coupling": self.coupling,
            "forces": [
                {key + _UNITS.get(key, ""): _plain(value) for key, value in each._asdict().items()}
                for each in self.forces
            ],
        }


def frame_to_explain(folder: Path, seconds: float) -> ToExplain:
    """Return the frame of a run that begins at a time, or in which that time is. Nothing is done.

    Args:
        folder: The folder of the files of the run.
        seconds: Simulated time [s].

    Raises:
        UsageError: there is no such run, or it has no such time; the message says what to do.
        OSError: a file cannot be read.
    """
    if not folder.is_dir():
        raise UsageError(f"{folder}: there is no such folder; give one that `run --out` wrote")
    if not (folder / FORCES).exists():
        raise UsageError(f"{folder}: it has no {FORCES}, and so no run; give one that `run` wrote")
    if not (folder / SCENE).exists():
        why = "the tissue of its run was in another process (--connect), or the file was removed"
        if not (folder / INITIAL).exists():
            why = "its run ended before it began"
        raise UsageError(
            f"{folder}: it has no {SCENE}, from which the frame would be done again: {why}. Do the "
            "run with the tissue in its own process"
        )
    recorded = read_forces(folder / FORCES)
    if not len(recorded):
        raise UsageError(f"{folder / FORCES}: it has no frame; do the run first")
    times = recorded.column("time_s")
    last = float(times[-1])
    dt = last / max(len(times) - 1, 1)
    if not 0.0 <= seconds < last + max(dt, _SAME_INSTANT):
        raise UsageError(
            f"--at is {seconds:g} s, and the frames in {folder / FORCES} begin at 0 to {last:g} s; "
            "give one of these times"
        )
    n_before = int(np.searchsorted(times, seconds + _SAME_INSTANT * dt, side="right")) - 1
    with Checkpoints(folder) as checkpoints:
        before = [each for each in checkpoints.read() if each.mark.n_frames <= n_before]
    return ToExplain(
        folder, read_scene(folder / SCENE), recorded, n_before, next(iter(before), None)
    )


def explanation_of(asked: ToExplain, every_frame: Callable[[Simulation], None]) -> Explanation:
    """Do a run again until a frame, and that frame; return what acted in it.

    Args:
        asked: The frame.
        every_frame: Called after each frame that is done.

    Raises:
        StateError: this is another version of the program, or something that the run reads, such as
            its mesh, is another one now.
        RunError: a frame that is done again is not what it was.
    """
    folder, scene, recorded, n_before, checkpoint = asked
    tissue = make_tissue(scene)
    simulation = prepare(scene, InProcessLink(tissue, scene.name))
    resumption = Resumption(None, None, recorded, FileSum(), 0, checkpoint)
    resumption.load_into(simulation)
    repeated = RepeatedFrames(resumption, folder)
    with no_garbage_collection():
        while len(simulation.recording) < n_before:
            simulation.step()
            repeated.check(simulation.recording)
            every_frame(simulation)
        before = simulation.bridge.counters.as_numbers()
        simulation.step()
    forces, result = tissue.acting_forces(), simulation.result
    limits = _limits_between(before, simulation.bridge.counters.as_numbers())
    felt, raw = simulation.wrench, simulation.bridge.wrench_raw
    repeated.check(simulation.recording)
    row = simulation.recording
    to_world = simulation.frame.vectors_to_world
    return Explanation(
        folder,
        scene.name,
        n_before + 1,
        n_before * simulation.dt,
        resumption.n_frames,
        simulation.bridge.answered,
        felt,
        raw,
        to_world(result.wrench.force),
        to_world(result.wrench_t1.force),
        ForceParts._make(row.vector(name)[-1] for name in _COLUMNS_OF_PARTS),
        [_in_world(each, simulation) for each in forces],
        limits,
        simulation.coupled,
    )


def _in_world(each: ActingForce, simulation: Simulation) -> ActingForce:
    """Return a force in the world; an attachment of a grasper has its name."""
    frame = simulation.frame
    held = {
        f"attachment {grasper.grip.attachment.number}": grasper.name
        for grasper in simulation.graspers
        if grasper.grip is not None
    }
    if each.name in held:
        each = each._replace(kind="grasper", name=held[each.name])
    return each._replace(
        point=frame.points_to_world(each.point), force=frame.vectors_to_world(each.force)
    )


def _limits_between(before: dict[str, Any], after: dict[str, Any]) -> dict[str, float]:
    """Return the limits of the bridge that acted between two instants, by their counters."""
    found = {name: after[name] - before[name] for name in (*LIMITS, "impulse_written_off")}
    of_passivity = {
        f"passivity_{name}": after["passivity"][name] - before["passivity"][name]
        for name in ("frames", "injected_away")
    }
    return {name: amount for name, amount in (found | of_passivity).items() if amount}


def _numbers_of(wrench: Wrench) -> dict[str, list[float]]:
    """Return a wrench by names with units; the torque is about the tip."""
    return {"force_n": wrench.force.tolist(), "torque_nm": wrench.torque.tolist()}


def _plain(value: Any) -> Any:
    """Return a value for JSON: None for a number that is not finite, which JSON has not."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    return None if isinstance(value, float) and not math.isfinite(value) else value
