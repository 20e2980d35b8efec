"""What the live viewer and its process say to each other."""

from typing import NamedTuple

import msgspec

from bridge import TissueFrame
from scalpel_sim.viewer.model_shapes import Shape
from scalpel_sim.viewer.scene3d import Readings
from tissue import FloatArray, Surface

UPDATES_PER_SECOND = 25.0
"""Pictures a second of wall time."""


class Setting(NamedTuple):
    """What is said once, before the first picture."""

    title: str
    shapes: list[Shape]
    frame: TissueFrame
    wireframe: bool
    port: int | None
    """Where to listen; None: at the first free port."""


class Picture(NamedTuple):
    """One instant of the run."""

    surface: Surface
    body_poses: FloatArray
    readings: Readings | None


class Greeting(msgspec.Struct):
    """Where the page is, or why there is none."""

    url: str = ""
    error: str = ""
