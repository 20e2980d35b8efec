"""`RunRecorder`: writes a simulation to a file, step by step, while it runs."""

import json
import logging
import math
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
import numpy.typing as npt

from bridge import InProcessLink
from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.saved_run.arm_rows import contact_rows, poses_and_forces
from scalpel_sim.saved_run.body_writer import BodyWriter
from scalpel_sim.saved_run.growing_tables import GrowingTables
from scalpel_sim.saved_run.layout import (
    CONTACTS,
    ENDS,
    FORM,
    OWN,
    ROWS,
    VERSION,
    VTK,
    VTKHDF_SUFFIX,
    Sizes,
    tables_of,
)
from scalpel_sim.saved_run.preallocated_file import STEP_TIMES
from scalpel_sim.saved_run.stage import rows_of, stage_of
from scalpel_sim.scene.write import scene_text
from scalpel_sim.simulation import Simulation
from scalpel_sim.version import version
from scalpel_sim.viewer.model_shapes import perspective_cameras

if TYPE_CHECKING:
    import h5py

STEPS_PER_SECOND = 25.0
"""Steps in a second of simulated time: as many as pages and films show."""

USUAL_SECONDS = 30.0
"""Length of a run of which none is known [s]: for so long the first file lasts."""

_log = logging.getLogger(__name__)


class RunRecorder:
    """Writes a simulation to one file, which ParaView plays: see `docs/recordings.md`.

    The state at the start is the first step; a step follows every 40 ms of simulated time, and one
    at the end. A step is in the file as soon as its frame is done, and if the process is killed the
    file has all steps before. Where the simulation goes back, so does the recording.

    ```python
    with RunRecorder(simulation, "run.vtkhdf"):
        simulation.run(2.0)
    ```

    Args:
        simulation: Where the recording begins.
        path: The file, whose name ends in `.vtkhdf`.
        seconds: Length that is expected [s]; None: none is.
        continues: Whether the steps of the file stay that are there, as far as the simulation is.

    Raises:
        UsageError: the name ends otherwise.
        RunError: the system refuses.
    """

    def __init__(
        self,
        simulation: Simulation,
        path: str | Path,
        *,
        seconds: float | None = None,
        continues: bool = False,
    ) -> None:
        self.path = Path(path)
        if self.path.suffix.lower() != VTKHDF_SUFFIX:
            raise UsageError(f"{path}: the name of a recording must end in {VTKHDF_SUFFIX}")
        self._simulation = simulation
        self._stage = stage_of(simulation).to_bytes()
        self._title = simulation.title
        # Of a tissue elsewhere nobody says how it is held or solved.
        is_here = isinstance(simulation.link, InProcessLink)
        scene = simulation.scene if is_here else None
        self._scene_text = None if scene is None else scene_text(scene, self.path)
        self._every = max(1, round(1.0 / (STEPS_PER_SECOND * simulation.dt)))
        self._tables = tables_of(self._sizes(USUAL_SECONDS if seconds is None else seconds))
        self._file = GrowingTables(self.path, self._tables, self._describe)
        self._body = BodyWriter(self._file)
        self._ends: list[tuple[int, tuple[int, ...]]] = []  # of each step: frames, lengths
        try:
            if continues:
                self._continue()
            if not self._ends:
                self._add(simulation.n_frames)
        except BaseException:
            self._file.close()
            raise
        simulation.pictures.append(self._after_frame)

    def _sizes(self, seconds: float) -> Sizes:
        """Return the sizes of the run."""
        simulation = self._simulation
        body = simulation.link.describe()
        return Sizes(
            math.ceil(seconds / (self._every * simulation.dt)) + 2,
            body.n_nodes,
            body.n_tetrahedra,
            int(simulation.arm.model.nbody),
            len(simulation.graspers),
            len(perspective_cameras(simulation.arm.model)),
            len(simulation.recording.columns),
            self._every,
        )

    def close(self) -> None:
        """Write the last step, and end the recording. May be called twice.

        Raises:
            RunError: the system refuses; the file has all steps that were written.
        """
        simulation = self._simulation
        if self._after_frame not in simulation.pictures:
            return
        simulation.pictures.remove(self._after_frame)
        try:
            self._cut_back(simulation.n_frames)
            if self._ends[-1][0] < simulation.n_frames:
                self._add(simulation.n_frames)
            self._write_rows()
            self._file.commit()
            self._file.finish()
        finally:
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _after_frame(self, simulation: Simulation) -> None:
        """Write the frame that was done, if a step is due."""
        n_frames = simulation.n_frames + 1  # it is counted after it is drawn
        self._cut_back(n_frames - 1)
        if n_frames % self._every == 0:
            self._add(n_frames)

    def _add(self, n_frames: int) -> None:
        """Write a step; of one that is not written whole nothing stays.

        Args:
            n_frames: Number of frames that were done.
        """
        try:
            self._write(n_frames)
        except BaseException:
            if self._ends:
                with suppress(RunError):
                    self._take_off(self._ends[-1][1])
            raise

    def _write(self, n_frames: int) -> None:
        """Write a step: the body, the arm, and the rows of the frames before."""
        simulation, file = self._simulation, self._file
        time = n_frames * simulation.dt
        self._body.add(simulation.link, time)
        result = simulation.bridge.result
        contacts = np.empty((0, 6))
        if result is not None:
            contacts = contact_rows(result.contacts_of_blade, simulation.frame)
        first = file.append(f"{OWN}/{CONTACTS.name}", contacts)
        self._write_rows()
        own: dict[str, npt.ArrayLike] = {
            **poses_and_forces(simulation),
            "steps/frame": n_frames,
            f"steps/{CONTACTS.name}": (first, len(contacts)),
            "steps/rows": file.length(f"{OWN}/{ROWS}"),
        }
        for name, row in own.items():
            if file.has(f"{OWN}/{name}"):
                file.append(f"{OWN}/{name}", row)
        file.append(STEP_TIMES, time)
        lengths = (*file.lengths[:-1], file.length(ENDS) + 1)
        file.append(ENDS, lengths)
        file.commit()
        self._ends.append((n_frames, lengths))

    def _write_rows(self) -> None:
        """Write the rows of the frames since the last call."""
        self._file.append(
            f"{OWN}/{ROWS}", self._simulation.recording.since(self._file.length(f"{OWN}/{ROWS}"))
        )

    def _cut_back(self, n_frames: int) -> None:
        """Take off the steps after so many frames, where the simulation has gone back."""
        if self._ends[-1][0] <= n_frames:
            return
        while len(self._ends) > 1 and self._ends[-1][0] > n_frames:
            self._ends.pop()
        self._take_off(self._ends[-1][1])

    def _take_off(self, lengths: Sequence[int]) -> None:
        """Take off all that was added since the tables had these lengths."""
        self._file.cut_back(lengths)
        self._body.begin_again(self.path)

    def _continue(self) -> None:
        """Keep the steps of the file that is there, as far as the simulation has got."""
        import h5py

        try:
            with h5py.File(self.path) as file:
                names = list(file[OWN].attrs["tables"])
                if names != [table.name for table in self._tables]:
                    raise KeyError("other tables")
                n = int(file[VTK]["Steps"].attrs["NSteps"])
                frames = file[f"{OWN}/steps/frame"][:n].tolist()
                ends = [tuple(map(int, row)) for row in file[ENDS][:n]]
                starts = {name: file[name].id.get_offset() or 0 for name in names}
        except (OSError, KeyError) as error:
            _log.warning(
                "%s: cannot be continued (%s); it begins anew at %.3f s",
                self.path,
                error,
                self._simulation.time,
            )
            return
        found = zip(frames, ends, strict=True)
        self._ends = [each for each in found if each[0] <= self._simulation.n_frames]
        if self._ends:
            self._file.take(starts, self._ends[-1][1])
            self._body.begin_again(self.path)

    def _describe(self, file: "h5py.File") -> None:
        """Write what does not change."""
        simulation = self._simulation
        vtk, own = file.require_group(VTK), file.require_group(OWN)
        vtk.attrs["Version"] = np.array(VERSION, "i8")
        vtk.attrs["Type"] = np.bytes_("UnstructuredGrid")
        model = simulation.arm.model
        names = {str(label): name for label, name in simulation.link.label_names.items()}
        own.attrs["format"] = FORM
        own.attrs["version"] = version("scalpel-sim")
        own.attrs["title"] = self._title
        own.attrs["frame"] = rows_of(simulation.frame)
        own.attrs["dt"] = simulation.dt
        own.attrs["columns"] = list(simulation.recording.columns)
        own.attrs["bodies"] = [model.body(i).name for i in range(model.nbody)]
        own.attrs["graspers"] = [each.name for each in simulation.graspers]
        own.attrs["tables"] = [table.name for table in self._tables]
        own["label_names"] = json.dumps(names)
        own["stage"] = np.frombuffer(self._stage, np.uint8)
        if self._scene_text is not None:
            own["scene"] = self._scene_text
