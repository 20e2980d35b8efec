"""Writes datasets as robomimic reads them: one file of HDF5, with a group for each episode."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scalpel_sim.datasets.demonstration import DatasetLayout, Demonstration, Seen, Transition

FILE = "demonstrations.hdf5"
"""Name of the file."""

_GYM = 2
"""Number that robomimic gives to environments of Gymnasium."""

_ENVIRONMENT = "scalpel_sim/Scene-v0"
"""Environment of a scene."""

_VALID_EVERY = 10
"""One of so many episodes validates a policy, and does not train it: robomimic's own share."""

_BATCH = 64
"""Number of control steps that are written together."""


class RobomimicWriter:
    """Writes episodes as a file of robomimic. See `DatasetWriter`.

    Args:
        folder: An empty folder.
        layout: What each control step has.
    """

    def __init__(self, folder: Path, layout: DatasetLayout) -> None:
        import h5py

        self._layout = layout
        self._file = h5py.File(folder / FILE, "w")
        self._data = self._file.create_group("data")
        self._names: list[str] = []
        self.n_steps = 0
        """Number of control steps."""

    @property
    def n_episodes(self) -> int:
        """Number of episodes that are whole."""
        return len(self._names)

    def add(self, episode: Demonstration) -> None:
        """Add an episode. One that is not taken to its end, by an error, is left out."""
        name = f"demo_{self.n_episodes}"
        group = self._data.create_group(name)
        try:
            n = _write(group, episode)
        except BaseException:
            del self._data[name]
            raise
        group.attrs["num_samples"] = n
        group.attrs["scene"] = episode.scene_text
        group.attrs["task"] = episode.task
        if not self._names:
            kwargs = {"scene": episode.scene_text}
            told = {"env_name": _ENVIRONMENT, "type": _GYM, "env_kwargs": kwargs}
            self._data.attrs["env_args"] = json.dumps(told)
        self._names.append(name)
        self.n_steps += n

    def finish(self) -> None:
        """Write what is about all episodes, of which there is at least one."""
        self._data.attrs["total"] = self.n_steps
        valid = self._names[_VALID_EVERY - 1 :: _VALID_EVERY] or self._names[1:][-1:]
        train = [name for name in self._names if name not in valid]
        for part, names in (("train", train), ("valid", valid)):
            self._file.create_dataset(f"mask/{part}", data=np.array(names, dtype="S"))
        self.close()

    def close(self) -> None:
        """Close the file. May be called twice."""
        self._file.close()


def _write(group: Any, episode: Demonstration) -> int:
    """Write the control steps of an episode, and return their number."""
    n, batch = 0, list[Transition]()
    for transition in episode.transitions():
        batch.append(transition)
        if len(batch) == _BATCH:
            n += _append(group, batch)
            batch = []
    return n + _append(group, batch)


def _append(group: Any, batch: Sequence[Transition]) -> int:
    """Add control steps to the tables of an episode, and return their number."""
    if batch:
        tables = {
            "actions": np.array([each.action for each in batch]),
            "states": np.array([each.before.hands for each in batch]),
            "rewards": np.array([each.reward for each in batch]),
            "dones": np.array([each.is_done for each in batch], np.int64),
            "successes": np.array([each.is_success for each in batch], np.int64),
        }
        tables |= _observed("obs", [each.before for each in batch])
        tables |= _observed("next_obs", [each.after for each in batch])
        for name, rows in tables.items():
            _extend(group, name, rows)
    return len(batch)


def _observed(where: str, seen: Sequence[Seen]) -> dict[str, np.ndarray]:
    """Return the tables of what was observed, by name; numbers are vectors."""
    first = seen[0]
    found = {
        f"{where}/{_key(name)}": np.array([each.observations[name].ravel() for each in seen])
        for name in first.observations
    }
    for camera in first.images:
        found[f"{where}/{camera}_image"] = np.array([each.images[camera] for each in seen])
    return found


def _key(name: str) -> str:
    """Return the name that an observation has in the file."""
    return name.partition(":")[0]


def _extend(group: Any, name: str, rows: np.ndarray) -> None:
    """Add rows to a table, which is made with the first of them."""
    if name in group:
        table = group[name]
        table.resize(len(table) + len(rows), axis=0)
        table[-len(rows) :] = rows
        return
    packed = {"compression": "gzip"} if rows.dtype == np.uint8 else {}
    chunks = (1, *rows.shape[1:]) if packed else None
    group.create_dataset(
        name, data=rows, maxshape=(None, *rows.shape[1:]), chunks=chunks or True, **packed
    )
