"""Images, numbers and poses of hands that are taken of a simulation, whoever leads it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import NamedTuple, Protocol

import numpy as np

from scalpel_sim.camera.camera import Camera
from scalpel_sim.datasets.demonstration import (
    DatasetLayout,
    DatasetQuantity,
    Demonstration,
    Seen,
)
from scalpel_sim.datasets.hand_poses import HandPose, action_names
from scalpel_sim.errors import UsageError
from scalpel_sim.learning.images import cameras_of
from scalpel_sim.learning.observations import Shown
from scalpel_sim.scene.arm_tables import BLADE_NAME
from scalpel_sim.scene.observe_table import CameraTable
from scalpel_sim.simulation import Simulation

AfterFrame = Callable[[Simulation], None]
"""Called after each frame."""

ShowProgress = Callable[[float], AbstractContextManager[AfterFrame]]
"""Returns what is called after each frame of so many seconds, while it is entered."""

_WORDS = {
    "hands": "hands",
    "keys": "observations",
    "cameras": "cameras",
    "fps": "control steps a second",
}
"""Words for what all demonstrations of a dataset have alike."""


class DatasetRequest(NamedTuple):
    """Request of what is taken of demonstrations."""

    cameras: Sequence[CameraTable] | None = None
    """Cameras and the sizes of their images; None: those of `[observe]` of the scene."""
    fps: int | None = None
    """Control steps a second; None: as `[act]` of the scene has it."""
    task: str | None = None
    """The task in words; None: what the scene says it is about."""


class TakenDemonstration(Demonstration, Protocol):
    """A demonstration that is simulated, as a request wants it."""

    @property
    def name(self) -> str:
        """Name of it in messages."""

    @property
    def hands(self) -> Sequence[str]:
        """Names of the hands whose actions are taken."""

    @property
    def keys(self) -> Sequence[str]:
        """Names of the numbers that are observed."""

    @property
    def cameras(self) -> Sequence[CameraTable]:
        """Cameras and the sizes of their images."""

    @property
    def fps(self) -> int:
        """Control steps a second."""

    def layout(self) -> DatasetLayout:
        """Return what each control step has.

        Raises:
            UsageError: no camera has such a name.
        """


def unseen_progress(seconds: float) -> AbstractContextManager[AfterFrame]:
    """Return a progress that nobody sees."""
    return nullcontext(lambda simulation: None)


@contextmanager
def open_cameras(
    simulation: Simulation, rows: Sequence[CameraTable]
) -> Iterator[dict[str, Camera]]:
    """Yield cameras of a simulation by name, and close them.

    Raises:
        UsageError: no camera has such a name.
    """
    found = cameras_of(simulation, rows)
    try:
        yield found
    finally:
        if found:
            next(iter(found.values())).close()


def layout_of(
    simulation: Simulation, shapes: Mapping[str, Shown], taken: TakenDemonstration
) -> DatasetLayout:
    """Return what each control step of a demonstration has.

    Args:
        simulation: Its simulation.
        shapes: Shapes of what is observed.
        taken: The demonstration.
    """
    of_hands = (BLADE_NAME, *(each.name for each in simulation.graspers))
    quantities = []
    for name, shown in shapes.items():
        names = tuple(f"{name}_{each}" for each in shown.names)
        shape = shown.low.shape
        quantities.append(
            DatasetQuantity(name, shape, names if len(shape) == 1 else None, name in of_hands)
        )
    names = action_names(taken.hands)
    return DatasetLayout(
        taken.fps,
        simulation.arm.name,
        tuple(quantities),
        {row.name: (row.size[1], row.size[0]) for row in taken.cameras},
        DatasetQuantity("action", (len(names),), names),
    )


def seen_now(
    simulation: Simulation,
    observations: Mapping[str, np.ndarray],
    poses: Mapping[str, HandPose],
    cameras: Mapping[str, Camera],
) -> Seen:
    """Return what is observed of a simulation now.

    Args:
        simulation: The simulation.
        observations: Numbers by name.
        poses: Poses of the hands by name.
        cameras: Cameras by name.
    """
    numbers = [simulation.time]
    for pose in poses.values():
        numbers += pose.numbers
    images = {name: camera.rgb() for name, camera in cameras.items()}
    return Seen(observations, images, np.array(numbers))


def expect_alike(demonstrations: Sequence[TakenDemonstration]) -> None:
    """Refuse demonstrations of which there is no one dataset.

    Raises:
        UsageError: two have other hands, numbers, cameras or control steps.
    """
    first = demonstrations[0]
    for other in demonstrations[1:]:
        for what, words in _WORDS.items():
            ours, theirs = (getattr(each, what) for each in (first, other))
            if ours != theirs:
                raise UsageError(
                    f"{other.name} has other {words} than {first.name}: {theirs}, not {ours}; make "
                    "a dataset of each"
                )
