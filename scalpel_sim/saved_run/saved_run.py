"""`SavedRun`: a run that was recorded, read back without simulating."""

import json
import tomllib
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import msgspec
import numpy as np
import numpy.typing as npt

from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.saved_run.layout import (
    CONNECTIVITY,
    CONNECTIVITY_OFFSETS,
    COUNTS,
    FORM,
    OWN,
    PART_OFFSETS,
    POINT_OFFSETS,
    POSITIONS,
    ROWS,
    VTK,
    field_offsets,
    field_table,
)
from scalpel_sim.saved_run.preallocated_file import STEP_TIMES
from scalpel_sim.saved_run.saved_step import SavedStep
from scalpel_sim.saved_run.stage import Stage, frame_from
from scalpel_sim.scene.read import SceneFile, scene_in
from scalpel_sim.scene.scene import Scene
from tissue import (
    BladeSegment,
    Deformation,
    Energies,
    FloatArray,
    Snapshot,
    Surface,
    Wrench,
)

_ROUNDING = 1e-9
"""Difference of times that are the same [s]."""

_FULL = (0, 3, 5, 3, 1, 4, 5, 4, 2)
"""Places of the components of a tensor, row by row, among xx, yy, zz, xy, yz, xz."""


class SavedRun:
    """A recorded run. Its file may still grow: what it has when it is opened is read.

    ```python
    with SavedRun("run.vtkhdf") as run:
        step = run.at(0.8)
        print(run.times[-1], step.wrench.force, step.snapshot.positions.max(axis=0))
    ```

    Args:
        path: The file, which `--record` or a `RunRecorder` wrote.

    Raises:
        UsageError: there is no such file, a part of it is missing, or it is no recording.
    """

    def __init__(self, path: str | Path) -> None:
        import h5py

        self.path = Path(path)
        if not self.path.is_file():
            raise UsageError(f"{path}: there is no such file")
        try:
            self._file = h5py.File(self.path)
        except OSError as error:
            raise UsageError(
                f"{path}: is no recording of a run, or a part of it is missing ({error})"
            ) from error
        try:
            self._begin()
        except (KeyError, json.JSONDecodeError) as error:
            self.close()
            raise UsageError(
                f"{path}: is no recording of a run ({error}); `scalpel-sim run --record "
                "run.vtkhdf` writes one"
            ) from error
        except BaseException:
            self.close()
            raise

    def _begin(self) -> None:
        """Read what does not change."""
        own = self._file[OWN]
        form = int(own.attrs["format"])
        if form != FORM:
            raise UsageError(
                f"{self.path}: is a recording of another version of the program (form {form}, and "
                f"this one reads {FORM})"
            )
        self.times: FloatArray = self._file[STEP_TIMES][:]
        """Times of the steps [s]."""
        self.dt = float(own.attrs["dt"])
        """Length of a frame of the simulation [s]."""
        self.version = str(own.attrs["version"])
        """Version of the program that simulated it."""
        self.columns = tuple(map(str, own.attrs["columns"]))
        """Columns of `rows`, which are those of `forces.csv`."""
        self.bodies = tuple(map(str, own.attrs["bodies"]))
        """Names of the bodies of the arm's model."""
        self.graspers = tuple(map(str, own.attrs["graspers"]))
        """Names of the graspers."""
        names = json.loads(own["label_names"][()])
        self.label_names = {int(label): str(name) for label, name in names.items()}
        """Names of labels of the body."""
        self.title = str(own.attrs["title"])
        """Heading: the scene and the stroke."""
        self.frame = frame_from(own.attrs["frame"])
        """Pose of the tissue in the world."""
        self.scene_text = own["scene"][()].decode() if "scene" in own else None
        """Text of the scene, whose files are relative to the folder of the recording; None: it is
        not known, or its body is in no table."""

    def __len__(self) -> int:
        """Return the number of steps."""
        return len(self.times)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file. What was read stays. May be called twice."""
        self._file.close()

    @cached_property
    def stage(self) -> Stage:
        """Shapes of the arm, views, and the look of the body: for pages.

        Raises:
            UsageError: another version of the program wrote them, in another form.
        """
        try:
            return Stage.from_bytes(self._file[f"{OWN}/stage"][:].tobytes())
        except msgspec.ValidationError as error:
            raise UsageError(
                f"{self.path}: version {self.version} of the program wrote the shapes of the arm "
                f"in another form ({error}), so that they cannot be drawn; all else can be read"
            ) from error

    @property
    def scene_name(self) -> str:
        """Name of the scene."""
        return self.title.partition(":")[0]

    @cached_property
    def scene(self) -> Scene | None:
        """The scene; None: it is not known.

        Raises:
            UsageError: it cannot be read, as where one of its files is missing.
        """
        if self.scene_text is None:
            return None
        content = tomllib.loads(self.scene_text)
        return scene_in(SceneFile(content, self.scene_name, self.path.parent, str(self.path)))

    @property
    def rows(self) -> FloatArray:
        """A row for each frame of the simulation, shape (n_frames, n_columns).

        The last step may have a frame more than rows: of a frame that is drawn there is none yet.
        """
        return np.asarray(self._file[f"{OWN}/{ROWS}"][: self._n_rows])

    @property
    def _n_rows(self) -> int:
        """Number of rows. Of a run that has not ended an empty table shows one."""
        n_shown = len(self._file[f"{OWN}/{ROWS}"])
        return n_shown if n_shown > 1 else int(self._own("steps/rows", -1))

    def column(self, name: str) -> FloatArray:
        """Return one column of `rows`, shape (n_frames,).

        Raises:
            UsageError: there is none of that name.
        """
        if name not in self.columns:
            raise unknown("column", name, self.columns)
        return np.asarray(self._file[f"{OWN}/{ROWS}"][: self._n_rows, self.columns.index(name)])

    def at(self, time: float) -> SavedStep:
        """Return the last step that is not after a time [s].

        Raises:
            UsageError: the time is before the first step, or after the last one.
        """
        first, last = float(self.times[0]), float(self.times[-1])
        if not first - _ROUNDING <= time <= last + _ROUNDING:
            raise UsageError(
                f"{self.path}: has no instant {time:g} s; it goes from {first:g} to {last:g} s"
            )
        return self.step(int(np.searchsorted(self.times, time + _ROUNDING, "right")) - 1)

    def step(self, number: int) -> SavedStep:
        """Return a step by its number, from 0; one below 0 counts from the end.

        Raises:
            UsageError: there is no such step.
        """
        n = len(self)
        if not -n <= number < n:
            raise UsageError(f"{self.path}: has no step {number}; there are {n}")
        i = number % n
        snapshot, cut_age = self._snapshot(i)
        wrench, blade = (
            self._own(f"steps/{name}", i).reshape(3, 3) for name in ("wrench", "blade")
        )
        energies = self._own("steps/energies", i)
        hands = self._own("steps/grasper_forces", i) if self.graspers else np.empty((0, 3))
        has_cameras = f"{OWN}/steps/cameras" in self._file
        cameras = self._own("steps/cameras", i) if has_cameras else np.empty((0, 7))
        contacts = self._span("contacts", i)
        return SavedStep(
            number=i,
            time=float(self.times[i]),
            snapshot=snapshot,
            deformation=self._deformation(i, len(snapshot.tetrahedra)),
            cut_age=cut_age,
            surface=(surface := self._surface(i)),
            surface_values={
                "displacement": np.linalg.norm(surface.positions - surface.rest_positions, axis=1),
                "strain": self._span("surface/strain", i).astype(float),
                "stress": self._span("surface/stress", i).astype(float),
            },
            wrench=Wrench(*wrench),
            blade=BladeSegment(*blade),
            body_poses=self._own("steps/poses", i),
            camera_poses=cameras,
            cut_area=float(self._own("steps/cut_area", i)),
            force_parts=self._own("steps/force_parts", i).reshape(3, 3),
            energies=None if np.isnan(energies).any() else Energies(*energies.tolist()),
            grasper_forces=hands,
            contact_points=contacts[:, :3],
            contact_forces=contacts[:, 3:],
        )

    def _own(self, name: str, step: int) -> Any:
        """Return the row of a step in one of our own tables."""
        return self._file[f"{OWN}/{name}"][step]

    def _span(self, name: str, step: int) -> npt.NDArray[Any]:
        """Return the rows of a table that belong to a step."""
        first, count = self._own(f"steps/{name}", step)
        return np.asarray(self._file[f"{OWN}/{name}"][first : first + count])

    def _field(self, where: str, name: str, step: int, count: int) -> npt.NDArray[Any]:
        """Return a field of nodes or of tetrahedra."""
        first = int(self._file[field_offsets(where, name)][step])
        return np.asarray(self._file[field_table(where, name)][first : first + count])

    def _snapshot(self, step: int) -> tuple[Snapshot, FloatArray]:
        """Return the body, and the age of cuts at its nodes [s]."""
        file = self._file
        mesh = int(file[PART_OFFSETS][step])
        n_points, n_cells, n_ids = (int(file[f"{VTK}/{each}"][mesh]) for each in COUNTS)
        first = int(file[POINT_OFFSETS][step])
        ids = int(file[CONNECTIVITY_OFFSETS][step, 0])

        def of_nodes(name: str) -> npt.NDArray[Any]:
            return self._field("PointData", name, step, n_points)

        snapshot = Snapshot(
            file[POSITIONS][first : first + n_points].astype(float),
            of_nodes("rest_position").astype(float),
            of_nodes("velocity").astype(float),
            of_nodes("mass").astype(float),
            np.zeros(n_points),
            file[CONNECTIVITY][ids : ids + n_ids].reshape(n_cells, 4),
            of_nodes("fixed").astype(bool),
            self._field("CellData", "label", step, n_cells),
        )
        return snapshot, of_nodes("cut_age").astype(float)

    def _deformation(self, step: int, n_cells: int) -> Deformation:
        """Return stress and strain."""
        stress, strain = (
            self._field("CellData", name, step, n_cells).astype(float)
            for name in ("stress", "strain")
        )
        return Deformation(stress.reshape(-1, 3, 3), strain[:, _FULL].reshape(-1, 3, 3))

    def _surface(self, step: int) -> Surface:
        """Return the surface."""
        labels = self._span("surface/labels", step)
        return Surface(
            self._span("surface/positions", step).astype(float),
            self._span("surface/rest_positions", step).astype(float),
            self._span("surface/triangles", step).astype(np.int64),
            self._span("surface/is_cut", step).astype(bool),
            labels if len(labels) else None,
        )
