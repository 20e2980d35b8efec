"""The columns of a LeRobot dataset: their names, their types, and what `meta/info.json` says."""

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from scalpel_sim.datasets.demonstration import IMAGE_CHANNELS, DatasetLayout, DatasetQuantity, Seen

if TYPE_CHECKING:
    import pyarrow as pa

_STATE = "observation.state"
"""Column of what is known of the instruments themselves, which policies take first."""

_IMAGES = "observation.images."
"""Beginning of the columns of cameras."""

_OBSERVATION = "observation."
_TISSUE = "observation.tissue."

_FORCES = ("wrench", "wrench_peak")
"""Observations that are of the instruments' sensors, and not of the tissue."""

ACTION = "action"

OUTCOME = {"next.reward": "float32", "next.done": "bool", "next.success": "bool"}
"""LeRobotColumns of what follows an action, and their types."""

INDICES = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
"""LeRobotColumns that LeRobot gives each frame, and their types."""


class LeRobotColumns(NamedTuple):
    """LeRobotColumns of a dataset, and the quantities in each."""

    observed: Mapping[str, tuple[DatasetQuantity, ...]]
    """Quantities of each column of numbers; those of instruments share one, as a vector."""
    cameras: Mapping[str, str]
    """Camera of each column of images."""
    layout: DatasetLayout

    @classmethod
    def of(cls, layout: DatasetLayout) -> "LeRobotColumns":
        """Return the columns of a layout."""
        observed: dict[str, tuple[DatasetQuantity, ...]] = {}
        for quantity in layout.observations:
            column = _column_of(quantity)
            observed[column] = (*observed.get(column, ()), quantity)
        return cls(observed, {f"{_IMAGES}{name}": name for name in layout.images}, layout)

    def shape(self, column: str) -> tuple[int, ...]:
        """Return the shape of a row of a column of numbers."""
        parts = self.observed[column]
        if len(parts) == 1 and column != _STATE:
            return parts[0].shape
        return (sum(int(np.prod(part.shape)) for part in parts),)

    def row(self, column: str, seen: Seen) -> np.ndarray:
        """Return the numbers of a column at an instant."""
        parts = [seen.observations[part.name].ravel() for part in self.observed[column]]
        return np.concatenate(parts).reshape(self.shape(column))

    def features(self, video: Mapping[str, Any] | None) -> dict[str, Any]:
        """Return what `info.json` says of each column.

        Args:
            video: What it says of the videos; None: images are in the table.
        """
        found: dict[str, Any] = {}
        for column in self.observed:
            found[column] = _feature("float32", self.shape(column), self._names(column))
        for column, camera in self.cameras.items():
            shape = (*self.layout.images[camera], IMAGE_CHANNELS)
            names = ("height", "width", "channels")
            found[column] = _feature("image" if video is None else "video", shape, names)
            if video is not None:
                height, width = self.layout.images[camera]
                size = {"video.height": height, "video.width": width}
                found[column]["info"] = {**size, **video}
        action = self.layout.action
        found[ACTION] = _feature("float32", action.shape, action.names)
        for column, dtype in (OUTCOME | INDICES).items():
            found[column] = _feature(dtype, (1,), None)
        return found

    def _names(self, column: str) -> tuple[str, ...] | None:
        """Return the names of the numbers of a column; None where one of them has none."""
        names: list[str] = []
        for part in self.observed[column]:
            if part.names is None:
                return None
            names += part.names
        return tuple(names)


def _column_of(quantity: DatasetQuantity) -> str:
    """Return the column that a quantity is in."""
    name = quantity.name.partition(":")[0]
    if quantity.is_of_hand:
        return _STATE
    return f"{_OBSERVATION}{name}" if name in _FORCES else f"{_TISSUE}{name}"


def _feature(dtype: str, shape: tuple[int, ...], names: tuple[str, ...] | None) -> dict[str, Any]:
    """Return what `info.json` says of a column."""
    named = None if names is None else list(names)
    return {"dtype": dtype, "shape": list(shape), "names": named}


def schema_of(features: Mapping[str, Any]) -> "pa.Schema":
    """Return the schema of the table of frames; videos are no column of it.

    Its metadata say to the library `datasets` what a plain schema does not: which are images.
    """
    import pyarrow as pa

    types = {"float32": pa.float32(), "int64": pa.int64(), "bool": pa.bool_()}
    fields, told = [], dict[str, Any]()
    for column, feature in features.items():
        dtype, shape = feature["dtype"], feature["shape"]
        if dtype == "video":
            continue
        if dtype == "image":
            fields.append((column, pa.struct([("bytes", pa.binary()), ("path", pa.string())])))
            told[column] = {"_type": "Image"}
            continue
        kind, value = types[dtype], {"dtype": dtype, "_type": "Value"}
        if shape == [1]:
            fields.append((column, kind))
            told[column] = value
        elif len(shape) == 1:
            fields.append((column, pa.list_(kind, shape[0])))
            told[column] = {"feature": value, "length": shape[0], "_type": "Sequence"}
        else:
            fields.append((column, pa.list_(pa.list_(kind))))
            told[column] = {"shape": shape, "dtype": dtype, "_type": f"Array{len(shape)}D"}
    metadata = {"huggingface": json.dumps({"info": {"features": told}})}
    return pa.schema(fields, metadata=metadata)
