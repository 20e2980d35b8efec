"""Images that a policy is shown, at each control step."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from scalpel_sim.camera.camera import Camera
from scalpel_sim.errors import UsageError
from scalpel_sim.learning.episode import Episode
from scalpel_sim.learning.look_variation import LookVariation
from scalpel_sim.scene.observe_table import CameraTable, ObserveTable
from scalpel_sim.simulation import Simulation

FARTHEST_SEEN = 10.0
"""Depth that is shown at most [m]: that of what has nothing behind it."""


class ImageShape(NamedTuple):
    """Shape, type and bounds of an image."""

    shape: tuple[int, ...]
    """Height, width, and numbers of a pixel."""
    kind: Any
    """Type of its numbers."""
    low: float
    """Lowest number."""
    high: float
    """Highest number."""


class ImageTaker:
    """Takes the images of the cameras of `[observe]`.

    They are named after the camera: `endoscope_rgb`, `endoscope_depth`, `endoscope_segmentation`.

    Args:
        episode: The task.

    Raises:
        UsageError: the scene names no camera.
    """

    def __init__(self, episode: Episode) -> None:
        scene = episode.scene
        self._rows = (scene.observe or ObserveTable()).cameras
        if not self._rows:
            raise UsageError(
                f"the scene '{scene.name}' has no camera in [observe]: add "
                'cameras = [{ name = "endoscope" }]'
            )
        self._episode = episode
        self._look = LookVariation(scene, episode.simulation.frame)
        self._cameras: dict[str, Camera] = {}

    @property
    def shapes(self) -> dict[str, ImageShape]:
        """Shape, type and bounds of each image, by name."""
        found = {}
        for row in self._rows:
            width, height = row.size
            if row.rgb:
                found[f"{row.name}_rgb"] = ImageShape((height, width, 3), np.uint8, 0, 255)
            if row.depth:
                shape = ImageShape((height, width), np.float32, 0.0, FARTHEST_SEEN)
                found[f"{row.name}_depth"] = shape
            if row.segmentation:
                shape = ImageShape((height, width, 1), np.uint8, 0, 255)
                found[f"{row.name}_segmentation"] = shape
        return found

    def begin(self) -> None:
        """Begin an episode: cameras, light and colours are as its `[[vary]]` has them.

        The cameras are made in the process that takes their first image.

        Raises:
            UsageError: no camera has such a name, or one is to be elsewhere that cannot.
        """
        if not self._cameras:
            self._cameras = cameras_of(self._episode.simulation, self._rows)
        self._look.apply(self._cameras, self._episode.drawn)

    def take(self) -> dict[str, np.ndarray]:
        """Return the images of this instant, by name."""
        if not self._cameras:
            self.begin()
        found: dict[str, np.ndarray] = {}
        for row in self._rows:
            found |= _taken(row, self._cameras[row.name])
        return found

    def close(self) -> None:
        """Free what OpenGL holds."""
        for camera in self._cameras.values():
            camera.close()
        self._cameras.clear()


def cameras_of(simulation: Simulation, rows: Sequence[CameraTable]) -> dict[str, Camera]:
    """Return cameras of a simulation by name, which come of one another.

    Args:
        simulation: The simulation.
        rows: Their names and sizes.

    Raises:
        UsageError: no camera has such a name.
    """
    found: dict[str, Camera] = {}
    for row in rows:
        width, height = row.size
        first = next(iter(found.values()), None)
        found[row.name] = (
            Camera(simulation, row.name, width=width, height=height)
            if first is None
            else first.another(row.name, width=width, height=height)
        )
    return found


def _taken(row: CameraTable, camera: Camera) -> dict[str, np.ndarray]:
    """Return the images of a camera that its row asks for, by name."""
    if (row.rgb, row.depth, row.segmentation) == (True, False, False):
        return {f"{row.name}_rgb": camera.rgb()}
    rgb, depth, segmentation = camera.image()
    found: dict[str, np.ndarray] = {}
    if row.rgb:
        found[f"{row.name}_rgb"] = rgb
    if row.depth:
        found[f"{row.name}_depth"] = np.minimum(depth, np.float32(FARTHEST_SEEN))
    if row.segmentation:
        found[f"{row.name}_segmentation"] = segmentation[:, :, None].astype(np.uint8)
    return found
