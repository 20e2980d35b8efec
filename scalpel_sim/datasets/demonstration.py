"""Demonstrations as datasets have them: control steps, with what was seen and done in each."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np

from tissue import FloatArray

IMAGE_CHANNELS = 3
"""Numbers of a pixel: red, green and blue."""


class DatasetQuantity(NamedTuple):
    """An array of numbers that each control step has."""

    name: str
    """Name of it."""
    shape: tuple[int, ...]
    """Its shape."""
    names: tuple[str, ...] | None = None
    """Names of its numbers, where they have some."""
    is_of_hand: bool = False
    """Whether it is of an instrument: where it is, how it moves, how far it is open."""


class DatasetLayout(NamedTuple):
    """Contents of each control step of a dataset: the same in all its episodes."""

    fps: int
    """Control steps a second."""
    robot: str
    """Arm that holds the instruments."""
    observations: tuple[DatasetQuantity, ...]
    """Numbers that are observed."""
    images: Mapping[str, tuple[int, int]]
    """Height and width of the image of each camera [pixels]."""
    action: DatasetQuantity
    """Motions of the hands in it."""


class Seen(NamedTuple):
    """Observations of an instant."""

    observations: Mapping[str, np.ndarray]
    """Numbers by name, float32."""
    images: Mapping[str, np.ndarray]
    """Red, green and blue by camera, as bytes, shape (height, width, 3)."""
    hands: FloatArray
    """Time [s], and the pose of each hand that leads an instrument: from these, and the scene, the
    state is found again."""


class Transition(NamedTuple):
    """A control step."""

    before: Seen
    """Observations at its begin."""
    action: np.ndarray
    """Motions of the hands in it, float32."""
    reward: float
    """Reward for it."""
    is_done: bool
    """Whether it is the last one."""
    is_success: bool
    """Whether the task is done at its end."""
    after: Seen
    """Observations at its end."""


class Demonstration(Protocol):
    """A demonstration, which is done again while its control steps are taken."""

    @property
    def task(self) -> str:
        """The task in words."""

    @property
    def scene_text(self) -> str:
        """The scene, as its file has it."""

    def transitions(self) -> Iterator[Transition]:
        """Yield its control steps, once."""

    def provenance(self) -> dict[str, Any]:
        """Return where it comes from, and how it ended, once its steps were taken: for JSON."""


class DatasetWriter(Protocol):
    """Writes episodes to a folder, one after the other."""

    @property
    def n_episodes(self) -> int:
        """Number of episodes that are whole."""

    @property
    def n_steps(self) -> int:
        """Number of their control steps."""

    def add(self, episode: Demonstration) -> None:
        """Add an episode. One that is not taken to its end, by an error, is left out."""

    def finish(self) -> None:
        """Write what is about all episodes, of which there is at least one."""

    def close(self) -> None:
        """Close the files that are open. May be called twice."""
