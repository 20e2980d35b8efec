"""Messages between a run and the process of its live viewer."""

from collections import deque
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import msgspec

from bridge import TissueFrame
from scalpel_sim.hands.commands import Command, DrawnLine
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.viewer.looks import ORGAN_LOOK, Look
from scalpel_sim.viewer.model_shapes import Shape
from scalpel_sim.viewer.scene3d import JudgedState, LiveState, Readings
from tissue import FloatArray, Surface, SurfaceQuantity

UPDATES_PER_SECOND = 25.0
"""Rate at which the pages are updated, per second of wall time."""


MOST_ROWS_OF_FORCES = 5000
"""Rows of forces that wait for a page at most: those of the seconds that its plot shows, in frames
of a millisecond."""


NO_VALUES: Mapping[SurfaceQuantity, FloatArray] = {}
"""No quantities."""


class Choices(NamedTuple):
    """Choices of a page for the next run, and those of this one."""

    first: str
    """Name of the scene of the command line."""
    scenes: list[str]
    """Scenes; empty: that of the command line."""
    scene: str
    materials: list[str]
    material: str
    """Empty: as in the scene."""
    toughness: float
    """Fracture toughness [J/m2]."""
    blade_thickness: float
    """Thickness of the blade [m]."""
    is_led: bool
    """Whether the page leads the blade."""
    lines: Sequence[DrawnLine] = ()
    """Lines along which the script cuts, as the page has drawn them."""
    tasks: Sequence[str] = ()
    """Tasks, which are scenes too."""


class PageControls(NamedTuple):
    """Controls of a page over the run that it shows."""

    commands: deque[Command]
    """Receives its commands."""
    is_led: bool = False
    """Whether it leads the blade."""
    choices: Choices | None = None
    """Choices for the next run; None: there is none."""
    look: Look = ORGAN_LOOK
    """Look of the body's material."""


class ViewerSettings(NamedTuple):
    """The first message to the viewer's process, and of each run that follows in the same page."""

    title: str
    """Heading of the page."""
    shapes: list[Shape]
    """Visible shapes of the MuJoCo model."""
    frame: TissueFrame
    """Pose of the tissue frame in the world."""
    wireframe: bool = False
    """Whether the edges of the tissue's triangles are drawn at the start."""
    port: int | None = None
    """Port of the page; None for the first free port. That of the first run stays."""
    views: Sequence[ViewTable] = ()
    """Cameras that the page offers."""
    has_controls: bool = False
    """Whether the page controls the run."""
    is_led: bool = False
    """Whether it leads the blade, too."""
    choices: Choices | None = None
    """Choices for the next run; None: there is none."""
    look: Look = ORGAN_LOOK
    """Look of the body's material."""


class SceneState(NamedTuple):
    """A message for each update: the state of the scene at one instant."""

    surface: Surface
    """Surface of the body, tissue frame."""
    body_poses: FloatArray
    """Poses of all bodies of the MuJoCo model, see `model_shapes.body_poses`."""
    readings: Readings | None = None
    """Numbers to show next to the picture."""
    live: LiveState | None = None
    """State of the run, if the page controls it."""
    values: Mapping[SurfaceQuantity, FloatArray] = NO_VALUES
    """Quantities at the vertices of the surface, for pages that show them as colours, SI."""
    judged: JudgedState | None = None
    """Plan and score of the run; None: it has no task."""


class ForceRows(NamedTuple):
    """A message before that of a state: the forces of all frames since the last one."""

    rows: list[tuple[float, ...]]
    """Of each frame: time [s], force on the blade [N], and on each grasper [N]."""


class StartReply(msgspec.Struct):
    """The reply of the viewer's process when it has started, or when it could not."""

    url: str = ""
    """Address of the page; empty if there is none."""
    error: str = ""
    """Reason why there is no page."""
