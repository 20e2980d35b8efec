"""Writes datasets as LeRobot reads them, in version 3.0 of its format.

meta/info.json                              what each column is, and how many frames there are
meta/stats.json                             statistics of all episodes
meta/tasks.parquet                          the tasks in words
meta/episodes/chunk-000/file-000.parquet    a row for each episode: where it is, its statistics
data/chunk-000/file-000.parquet             a row for each frame, of several episodes a file
videos/CAMERA/chunk-000/file-000.mp4        with videos alone, a file for each episode
"""

import io
import json
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from scalpel_sim.camera.canvas import PixelSize
from scalpel_sim.camera.film_files import FilmFile, codec_of, open_film
from scalpel_sim.datasets.demonstration import (
    IMAGE_CHANNELS,
    DatasetLayout,
    Demonstration,
    Transition,
)
from scalpel_sim.datasets.lerobot_columns import ACTION, OUTCOME, LeRobotColumns, schema_of
from scalpel_sim.datasets.statistics import (
    ImageCounts,
    Statistics,
    statistics_of,
    statistics_together,
)
from scalpel_sim.errors import UsageError

FORMAT_VERSION = "v3.0"
"""Version of the format."""

_FILES_A_CHUNK = 1000
"""Number of files in a folder `chunk-...`, at most."""

_FILE_MB, _VIDEO_MB = 100, 200
"""Size of a file of frames, and of a video, at most [MiB]; one episode may be more."""

_MIB = 2**20

_DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_VIDEO = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
_EPISODES = "meta/episodes/chunk-000/file-000.parquet"

_MP4 = ".mp4"

_KEYFRAME_EVERY = 2
"""Frames of a video from one that stands for itself to the next, as LeRobot has them: a reader
that draws frames by chance need not decode others."""


class _Place(NamedTuple):
    """Where a file is."""

    chunk_index: int = 0
    file_index: int = 0

    @classmethod
    def number(cls, i: int) -> "_Place":
        """Return the place of the file of a number, from 0."""
        return cls(*divmod(i, _FILES_A_CHUNK))


class LeRobotWriter:
    """Writes episodes as a LeRobot dataset. See `DatasetWriter`.

    Args:
        folder: An empty folder.
        layout: What each control step has.
        is_video: Whether images become videos, by the user's ffmpeg; else they are in the table.

    Raises:
        UsageError: no video has the size of an image.
        RunError: ffmpeg has no encoder.
    """

    def __init__(self, folder: Path, layout: DatasetLayout, *, is_video: bool = False) -> None:
        self._folder, self._layout, self._is_video = folder, layout, is_video
        self._columns = LeRobotColumns.of(layout)
        video = None
        if is_video:
            expect_even(layout)
            video = {
                "video.codec": codec_of(_MP4),
                "video.pix_fmt": "yuv420p",
                "video.is_depth_map": False,
                "video.fps": layout.fps,
                "video.channels": IMAGE_CHANNELS,
                "has_audio": False,
            }
        self._features = self._columns.features(video)
        self._schema = schema_of(self._features)
        self._file: Any = None
        self._n_files = self._n_bytes = 0
        self._tasks: dict[str, int] = {}
        self._episodes: list[dict[str, Any]] = []
        self._statistics: list[dict[str, Statistics]] = []
        self.n_steps = 0
        """Number of frames."""

    @property
    def n_episodes(self) -> int:
        """Number of episodes that are whole."""
        return len(self._episodes)

    def add(self, episode: Demonstration) -> None:
        """Add an episode. One that is not taken to its end, by an error, is left out."""
        number = self.n_episodes
        frames = _Frames(self._columns, is_video=self._is_video)
        with ExitStack() as stack:
            videos = {
                column: stack.enter_context(self._video(column, number))
                for column in (self._columns.cameras if self._is_video else ())
            }
            for transition in episode.transitions():
                frames.add(transition)
                for column, video in videos.items():
                    video.add(transition.before.images[self._columns.cameras[column]])
        n = frames.n
        task = self._tasks.setdefault(episode.task, len(self._tasks))
        values = frames.values | {
            "timestamp": np.arange(n, dtype=np.float32) / np.float32(self._layout.fps),
            "frame_index": np.arange(n),
            "episode_index": np.full(n, number),
            "index": self.n_steps + np.arange(n),
            "task_index": np.full(n, task),
        }
        place = self._write_frames(values, frames.pictures, n)
        statistics = {column: statistics_of(array) for column, array in values.items()}
        statistics |= {column: each.statistics() for column, each in frames.counts.items()}
        row: dict[str, Any] = {
            "episode_index": number,
            "tasks": [episode.task],
            "length": n,
            "data/chunk_index": place.chunk_index,
            "data/file_index": place.file_index,
            "dataset_from_index": self.n_steps,
            "dataset_to_index": self.n_steps + n,
            "meta/episodes/chunk_index": 0,
            "meta/episodes/file_index": 0,
        }
        for column in videos:
            chunk, file = _Place.number(number)
            where = {"chunk_index": chunk, "file_index": file, "from_timestamp": 0.0}
            where |= {"to_timestamp": n / self._layout.fps}
            row |= {f"videos/{column}/{key}": value for key, value in where.items()}
        for column, each in statistics.items():
            row |= {f"stats/{column}/{key}": value for key, value in each.as_lists().items()}
        self._episodes.append(row)
        self._statistics.append(statistics)
        self.n_steps += n

    def finish(self) -> None:
        """Write what is about all episodes, of which there is at least one."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        self.close()
        path = self._folder / _EPISODES
        path.parent.mkdir(parents=True)
        pq.write_table(pa.Table.from_pylist(self._episodes), path)
        pq.write_table(_table_of_tasks(self._tasks), self._folder / "meta" / "tasks.parquet")
        columns = self._statistics[0]
        statistics = {
            column: statistics_together([each[column] for each in self._statistics]).as_lists()
            for column in columns
        }
        info = {
            "codebase_version": FORMAT_VERSION,
            "robot_type": self._layout.robot,
            "fps": self._layout.fps,
            "total_episodes": self.n_episodes,
            "total_frames": self.n_steps,
            "total_tasks": len(self._tasks),
            "chunks_size": _FILES_A_CHUNK,
            "data_files_size_in_mb": _FILE_MB,
            "video_files_size_in_mb": _VIDEO_MB,
            "data_path": _DATA,
            "video_path": _VIDEO if self._is_video else None,
            "splits": {"train": f"0:{self.n_episodes}"},
            "features": self._features,
        }
        for name, content in (("info", info), ("stats", statistics)):
            text = json.dumps(content, indent=4, allow_nan=False)
            (self._folder / "meta" / f"{name}.json").write_text(f"{text}\n", encoding="utf-8")

    def close(self) -> None:
        """Close the file of frames that is open. May be called twice."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _video(self, column: str, number: int) -> FilmFile:
        """Return the video of a camera and an episode, which is yet to be entered."""
        chunk, file = _Place.number(number)
        name = _VIDEO.format(video_key=column, chunk_index=chunk, file_index=file)
        path = self._folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        height, width = self._layout.images[self._columns.cameras[column]]
        size = PixelSize(width, height)
        return open_film(path, size, self._layout.fps, keyframe_every=_KEYFRAME_EVERY)

    def _write_frames(
        self, values: Mapping[str, np.ndarray], pictures: Mapping[str, list[bytes]], n: int
    ) -> _Place:
        """Write the frames of an episode as one group of rows, and return in which file."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        arrays = []
        for field in self._schema:
            if field.name in pictures:
                names = [f"frame-{i:06d}.png" for i in range(n)]
                parts = [pa.array(pictures[field.name], pa.binary()), pa.array(names)]
                arrays.append(pa.StructArray.from_arrays(parts, fields=list(field.type)))
            else:
                arrays.append(pa.array(values[field.name].tolist(), field.type))
        table = pa.Table.from_arrays(arrays, schema=self._schema)
        if self._file is not None and self._n_bytes + table.nbytes > _FILE_MB * _MIB:
            self.close()
        if self._file is None:
            place = _Place.number(self._n_files)
            path = self._folder / _DATA.format(**place._asdict())
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file, self._n_bytes = pq.ParquetWriter(path, self._schema), 0
            self._n_files += 1
        self._file.write_table(table, row_group_size=n)
        self._n_bytes += table.nbytes
        return _Place.number(self._n_files - 1)


class _Frames:
    """The frames of an episode.

    Args:
        columns: LeRobotColumns of the dataset.
        is_video: Whether images are in videos.
    """

    def __init__(self, columns: LeRobotColumns, *, is_video: bool) -> None:
        self._columns, self._is_video = columns, is_video
        self._rows: dict[str, list[Any]] = {
            column: [] for column in (*columns.observed, ACTION, *OUTCOME)
        }
        self.pictures: dict[str, list[bytes]] = {
            column: [] for column in (() if is_video else columns.cameras)
        }
        """Files of images, by column."""
        self.counts = {column: ImageCounts() for column in columns.cameras}
        """Counts of the colours of images, by column."""
        self.n = 0
        """Number of frames."""

    def add(self, transition: Transition) -> None:
        """Add a control step."""
        seen, rows = transition.before, self._rows
        for column in self._columns.observed:
            rows[column].append(self._columns.row(column, seen))
        rows[ACTION].append(transition.action)
        outcome = (transition.reward, transition.is_done, transition.is_success)
        for column, value in zip(OUTCOME, outcome, strict=True):
            rows[column].append(value)
        for column, camera in self._columns.cameras.items():
            image = seen.images[camera]
            self.counts[column].add(image)
            if not self._is_video:
                self.pictures[column].append(_png(image))
        self.n += 1

    @property
    def values(self) -> dict[str, np.ndarray]:
        """Numbers of all frames, by column."""
        types = dict.fromkeys(self._rows, "float32") | OUTCOME
        return {
            column: _as_column(np.array(rows, types[column])) for column, rows in self._rows.items()
        }


def expect_even(layout: DatasetLayout) -> None:
    """Refuse images of which there is no video: its colours are at half the resolution.

    Raises:
        UsageError: a side has an odd number of pixels.
    """
    for camera, (height, width) in layout.images.items():
        if height % 2 or width % 2:
            raise UsageError(
                f"--cameras {camera}:{width}x{height}: the sides of a video are even numbers of "
                "pixels; change them, or omit --video"
            )


def _as_column(values: np.ndarray) -> np.ndarray:
    """Return rows of one number as numbers."""
    return values[:, 0] if values.ndim > 1 and values.shape[1:] == (1,) else values


def _png(image: np.ndarray) -> bytes:
    """Return an image as the bytes of a PNG file."""
    file = io.BytesIO()
    Image.fromarray(image).save(file, "PNG")
    return file.getvalue()


def _table_of_tasks(tasks: Iterable[str]) -> Any:
    """Return the table of tasks, whose words are its index for pandas."""
    import pyarrow as pa

    words = list(tasks)
    table = pa.table({"task_index": pa.array(range(len(words)), pa.int64()), "task": words})
    of_index = {"name": "task", "field_name": "task", "pandas_type": "unicode"}
    of_number = {"name": "task_index", "field_name": "task_index", "pandas_type": "int64"}
    told = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [
            of_number | {"numpy_type": "int64", "metadata": None},
            of_index | {"numpy_type": "object", "metadata": None},
        ],
    }
    return table.replace_schema_metadata({"pandas": json.dumps(told)})
