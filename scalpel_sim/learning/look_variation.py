"""`LookVariation`: what differs from episode to episode in images alone."""

from collections.abc import Mapping

import numpy as np

from bridge import TissueFrame
from scalpel_sim.camera.camera import Camera
from scalpel_sim.scene.scene import Scene
from scalpel_sim.scene.vary_table import OF_CAMERA, OF_COLOUR, OF_LIGHT, OF_LOOK, VaryTable


class LookVariation:
    """Places of cameras, light and colours that `[[vary]]` of a scene draws for each episode.

    Args:
        scene: The scene.
        frame: Where the tissue lies in the world.
    """

    def __init__(self, scene: Scene, frame: TissueFrame) -> None:
        self._rows = [row for row in scene.vary if row.what in OF_LOOK]
        self._frame = frame

    def apply(self, cameras: Mapping[str, Camera], drawn: Mapping[str, float]) -> None:
        """Change cameras that come of one another.

        Args:
            cameras: All cameras of `[observe]`, by name.
            drawn: All numbers of the episode, by name.

        Raises:
            UsageError: one that is to be elsewhere is a camera of the model, or the body has no
                such part.
        """
        for name, camera in cameras.items():
            by = np.zeros(3)
            rows = [row for row in self._rows_of(OF_CAMERA) if row.camera in (None, name)]
            for row in rows:
                by[OF_CAMERA.index(row.what)] += drawn[row.name]
            if rows:
                camera.move_eye(self._frame.vectors_to_world(by))
        shared = next(iter(cameras.values()), None)
        if shared is not None and self._rows:
            brightness = [drawn[row.name] for row in self._rows_of((OF_LIGHT,))]
            shared.change_look(float(np.prod(brightness)), self._tints(shared, drawn))

    def _rows_of(self, quantities: tuple[str, ...]) -> list[VaryTable]:
        """Return the rows of some quantities."""
        return [row for row in self._rows if row.what in quantities]

    def _tints(self, camera: Camera, drawn: Mapping[str, float]) -> dict[str, list[float]]:
        """Return the factors of colours by the names of the parts of the body."""
        found: dict[str, list[float]] = {}
        for row in self._rows_of(OF_COLOUR):
            for part in camera.parts_of(row.label):
                factors = found.setdefault(part, [1.0, 1.0, 1.0])
                factors[OF_COLOUR.index(row.what)] *= drawn[row.name]
        return found
