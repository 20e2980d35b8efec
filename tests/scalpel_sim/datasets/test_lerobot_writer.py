import io
import json
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from scalpel_sim.datasets import lerobot_writer
from scalpel_sim.datasets.lerobot_writer import LeRobotWriter
from scalpel_sim.errors import UsageError
from tests.scalpel_sim.datasets.drawn_demonstrations import LAYOUT, DrawnDemonstration

pq = pytest.importorskip("pyarrow.parquet")

IMAGES = "observation.images.endoscope"


@dataclass
class Dataset:
    folder: Path
    episodes: list[DrawnDemonstration]

    def read(self, name: str) -> Any:
        path = self.folder / name
        return json.loads(path.read_text()) if path.suffix == ".json" else pq.read_table(path)

    def column(self, name: str) -> np.ndarray:
        files = sorted((self.folder / "data").rglob("*.parquet"))
        return np.array([row for file in files for row in pq.read_table(file)[name].to_pylist()])

    @property
    def rows(self) -> list[dict[str, Any]]:
        return self.read("meta/episodes/chunk-000/file-000.parquet").to_pylist()


def written(folder: Path, episodes: list[DrawnDemonstration], **options: Any) -> Dataset:
    folder.mkdir()
    writer = LeRobotWriter(folder, LAYOUT, **options)
    for episode in episodes:
        writer.add(episode)
    writer.finish()
    return Dataset(folder, episodes)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    episodes = [DrawnDemonstration(seed, n) for seed, n in enumerate((5, 9, 3))]
    return written(tmp_path_factory.mktemp("lerobot") / "drawn", episodes)


def all_seen(dataset: Dataset) -> list[Any]:
    return [seen for each in dataset.episodes for seen in each.seen[:-1]]


def test_each_frame_has_what_was_observed_and_done(dataset):
    seen = all_seen(dataset)
    of = {name: np.array([s.observations[name] for s in seen]) for name in seen[0].observations}
    state = np.concatenate([of["blade"], of["left"]], axis=1)
    assert np.array_equal(dataset.column("observation.state").astype(np.float32), state)
    wrench = dataset.column("observation.wrench").astype(np.float32)
    assert np.array_equal(wrench, of["wrench"])
    peak = dataset.column("observation.wrench_peak").astype(np.float32)
    assert np.array_equal(peak, of["wrench_peak"][:, 0])
    points = dataset.column("observation.tissue.points").astype(np.float32)
    assert np.array_equal(points, of["points:4"])
    for name, of_episode in (("action", "actions"), ("next.reward", "rewards")):
        expected = np.concatenate([getattr(each, of_episode) for each in dataset.episodes])
        assert np.array_equal(dataset.column(name).astype(np.float32), expected)


def test_images_are_png_files_in_the_table_without_loss(dataset):
    files = [row["bytes"] for row in dataset.column(IMAGES)]
    for file, seen in zip(files, all_seen(dataset), strict=True):
        image = Image.open(io.BytesIO(file))
        assert image.format == "PNG"
        assert np.array_equal(image, seen.images["endoscope"])


def test_indices_count_frames_in_the_episode_and_in_the_dataset(dataset):
    assert dataset.column("index").tolist() == list(range(17))
    assert dataset.column("episode_index").tolist() == [0] * 5 + [1] * 9 + [2] * 3
    assert dataset.column("frame_index").tolist() == [*range(5), *range(9), *range(3)]
    assert dataset.column("timestamp") == pytest.approx(dataset.column("frame_index") / 50)
    done = np.flatnonzero(dataset.column("next.done"))
    assert done.tolist() == [4, 13, 16]
    assert np.array_equal(dataset.column("next.success"), dataset.column("next.done"))
    bounds = [(row["dataset_from_index"], row["dataset_to_index"]) for row in dataset.rows]
    assert bounds == [(0, 5), (5, 14), (14, 17)]
    assert [row["length"] for row in dataset.rows] == [5, 9, 3]


def test_the_info_says_what_each_column_is(dataset):
    info = dataset.read("meta/info.json")
    assert info["codebase_version"] == "v3.0"
    assert (info["fps"], info["total_episodes"], info["total_frames"]) == (50, 3, 17)
    assert info["splits"] == {"train": "0:3"}
    assert info["video_path"] is None
    features = info["features"]
    schema = pq.read_schema(next((dataset.folder / "data").rglob("*.parquet")))
    assert list(features) == schema.names
    assert features[IMAGES]["dtype"] == "image"
    assert features[IMAGES]["shape"] == [12, 16, 3]
    assert features["observation.state"]["shape"] == [5]
    assert features["observation.state"]["names"][-1] == "left_open"
    assert features["observation.tissue.points"]["shape"] == [4, 3]


def test_the_statistics_are_those_of_all_frames(dataset):
    found = dataset.read("meta/stats.json")
    for column in ("observation.state", "action", "timestamp", "next.done"):
        values = dataset.column(column).astype(float)
        assert found[column]["count"] == [17]
        assert found[column]["mean"] == pytest.approx(np.atleast_1d(values.mean(axis=0)))
        assert found[column]["std"] == pytest.approx(np.atleast_1d(values.std(axis=0)))
    images = np.array([seen.images["endoscope"] for seen in all_seen(dataset)]) / 255.0
    assert np.ravel(found[IMAGES]["mean"]) == pytest.approx(images.mean(axis=(0, 1, 2)))
    of_first = np.array([seen.observations["wrench"] for seen in dataset.episodes[0].seen[:-1]])
    assert dataset.rows[0]["stats/observation.wrench/max"] == of_first.max(axis=0).tolist()


def test_a_task_is_there_once_and_is_the_index_of_its_table(dataset):
    table = dataset.read("meta/tasks.parquet")
    assert table.to_pylist() == [{"task_index": 0, "task": DrawnDemonstration.task}]
    told = json.loads(table.schema.metadata[b"pandas"])
    assert told["index_columns"] == ["task"]
    assert [row["tasks"] for row in dataset.rows] == [[DrawnDemonstration.task]] * 3
    assert set(dataset.column("task_index").tolist()) == {0}


def test_a_file_that_would_be_too_large_is_followed_by_another(tmp_path, monkeypatch):
    monkeypatch.setattr(lerobot_writer, "_FILE_MB", 0.02)
    dataset = written(tmp_path / "many", [DrawnDemonstration(seed, 8) for seed in range(4)])
    places = [row["data/file_index"] for row in dataset.rows]
    assert places == [0, 0, 0, 1]
    assert dataset.column("index").tolist() == list(range(32))


def test_an_episode_that_fails_is_left_out(tmp_path):
    writer = LeRobotWriter(tmp_path, LAYOUT)
    writer.add(DrawnDemonstration(0, 3))
    with pytest.raises(RuntimeError, match="the tissue tore"):
        writer.add(DrawnDemonstration(1, 3, RuntimeError("the tissue tore")))
    writer.add(DrawnDemonstration(2, 4))
    writer.finish()
    dataset = Dataset(tmp_path, [])
    assert dataset.column("episode_index").tolist() == [0] * 3 + [1] * 4
    assert dataset.column("index").tolist() == list(range(7))


def test_the_same_episodes_give_the_same_bytes(tmp_path, dataset):
    again = written(tmp_path / "again", dataset.episodes)
    files = [path for path in dataset.folder.rglob("*") if path.is_file()]
    assert len(files) == 5
    for path in files:
        there = again.folder / path.relative_to(dataset.folder)
        assert path.read_bytes() == there.read_bytes()


def test_a_video_of_odd_sides_is_refused(tmp_path):
    odd = LAYOUT._replace(images={"endoscope": (12, 15)})
    with pytest.raises(UsageError, match=r"15x12.*even"):
        LeRobotWriter(tmp_path, odd, is_video=True)


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_videos_have_a_frame_for_each_control_step_of_an_episode(tmp_path):
    dataset = written(
        tmp_path / "film", [DrawnDemonstration(0, 5), DrawnDemonstration(1, 9)], is_video=True
    )
    info = dataset.read("meta/info.json")
    assert info["features"][IMAGES]["dtype"] == "video"
    assert info["features"][IMAGES]["info"]["video.fps"] == 50
    for row in dataset.rows:
        place = {key: row[f"videos/{IMAGES}/{key}"] for key in ("chunk_index", "file_index")}
        path = dataset.folder / info["video_path"].format(video_key=IMAGES, **place)
        assert len(frames_of(path)) == row["length"]
        assert row[f"videos/{IMAGES}/to_timestamp"] == pytest.approx(row["length"] / 50)
    assert IMAGES not in dataset.read("data/chunk-000/file-000.parquet").schema.names


def test_a_video_of_an_episode_that_fails_is_not_there(tmp_path):
    if shutil.which("ffmpeg") is None:
        pytest.skip("ffmpeg is not installed")
    writer = LeRobotWriter(tmp_path, LAYOUT, is_video=True)
    with pytest.raises(RuntimeError, match="the tissue tore"):
        writer.add(DrawnDemonstration(1, 3, RuntimeError("the tissue tore")))
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


def frames_of(path: Path) -> np.ndarray:
    """Return the frames of a video as bytes, shape (n, height, width, 3)."""
    command = ["ffmpeg", "-loglevel", "error", "-i", str(path), "-f", "rawvideo"]
    raw = subprocess.run([*command, "-pix_fmt", "rgb24", "-"], capture_output=True, check=True)
    return np.frombuffer(raw.stdout, np.uint8).reshape(-1, 12, 16, 3)
