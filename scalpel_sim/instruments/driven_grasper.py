"""A grasper that is driven along a motion, and grips what its jaws close on."""

import logging
import math
from typing import NamedTuple

import mujoco
import numpy as np

from bridge import Bridge, TissueFrame
from scalpel_sim.arm.grasper import HALF_PAD, GuidedGrasper, Pads
from scalpel_sim.instruments.grip import Grip, frame_of
from scalpel_sim.instruments.instrument import Controller
from scalpel_sim.instruments.stroke_follower import StrokeFollower
from scalpel_sim.recording.columns import ColumnGroup, FrameData, grasper_quantities
from scalpel_sim.strokes.grasp_motion import GraspMotion
from tissue import FloatArray, Tissue, Wrench

_SPACING = 1e-3
"""Distance between the points that are looked for between the pads [m]: a fifth of the width of a
pad. Farther apart they miss a thin edge; nearer they take time and hold the same."""

_MOST_ACROSS = 5
"""Points from pad to pad at most: tissue that is gripped reaches from one to the other. More take
time and hold the same."""

_ROUNDING = 1e-9
"""Barycentric weight below zero at which a point still is in a tetrahedron: else rounding leaves
out points on the faces between two."""

_MEETING = 1e-4
"""Opening below which pads have met [m]. Tissue between them keeps them farther apart; the equality
that couples the jaws gives by less."""

_log = logging.getLogger("scalpel_sim")


_NOTHING_THERE = "the jaws of the grasper '%s' closed, and no tissue was there"


class GripSettings(NamedTuple):
    """Attachment of tissue to a grasper whose jaws have closed on it."""

    stiffness: float = 2000.0
    """Total stiffness of its springs [N/m]."""
    damping: float = 2.0
    """Total damping of its dampers [N s/m]."""
    breaks_at: float = math.inf
    """Force at which the tissue slips out [N]."""
    closed: float = 0.006
    """Distance between the pads below which they hold what is between them [m]."""


class MotionFollower:
    """Leads a grasper along a motion.

    Args:
        grasper: The grasper.
        motion: Where it goes, tissue frame.
        frame: Where the tissue lies in the world.
    """

    def __init__(self, grasper: GuidedGrasper, motion: GraspMotion, frame: TissueFrame) -> None:
        self._grasper, self._motion = grasper, motion
        self._follower = StrokeFollower(grasper.hand, motion.stroke(HALF_PAD, HALF_PAD), frame)

    def lead(self, t: float) -> None:
        """Lead it to its pose and opening at time `t` [s], a step after the last one."""
        self._follower.lead(t)
        self._grasper.open_to(self._motion.opening(t))


class DrivenGrasper:
    """A grasper that is led along a motion, and the tissue that it holds. See `Instrument`.

    Args:
        grasper: The grasper.
        data: Data of its model.
        motion: Where it goes, tissue frame; its name is that of the grasper.
        tissue: What it may hold: a tissue in this process, or a bridge to one anywhere.
        frame: Where the tissue lies in the world; of a bridge it is that of the bridge.
        settings: Attachment to what it closes on; None: there is none, and friction alone holds.
        workspace: Where a person may lead it: see `HeldArm.workspace`.
    """

    def __init__(
        self,
        grasper: GuidedGrasper,
        data: mujoco.MjData,
        motion: GraspMotion,
        tissue: Tissue | Bridge,
        frame: TissueFrame = TissueFrame(),
        settings: GripSettings | None = GripSettings(),
        workspace: FloatArray | None = None,
    ) -> None:
        self.name = motion.name
        self.grasper = grasper
        self.motion = motion
        self.grip: Grip | None = None
        """Grip on the tissue now; None while the grasper holds none."""
        self._data, self._tissue, self._settings = data, tissue, settings
        self._frame = frame = frame_of(tissue, frame)
        self._was_closed = False
        self._had_met = False
        self._has_held = False
        self.workspace = workspace
        """Where a person may lead the middle of the pads [m], shape (2, 3); None: nowhere."""
        self.controller: Controller = MotionFollower(grasper, motion, frame)
        """Leads the grasper in each frame."""

    @property
    def n_points(self) -> int:
        """Number of points of the tissue that are tied to it."""
        return 0 if self.grip is None else self.grip.n_points

    @property
    def holds(self) -> bool:
        """Whether it held tissue in the last frame: by its attachment, or between its pads."""
        return self.n_points > 0 or self.grasper.is_pushed_apart

    @property
    def wrench(self) -> Wrench:
        """Wrench of the tissue on it in the last frame: see `Grasper.wrench`."""
        return self.grasper.wrench

    @property
    def duration(self) -> float:
        """Simulated time at which the motion ends [s]."""
        return self.motion.duration

    @property
    def columns(self) -> ColumnGroup:
        """Force [N] and torque [N m] of the tissue on it, its opening [m], and `n_points`.

        World frame, about the middle between the pads.
        """
        return ColumnGroup(grasper_quantities(self.name), self._numbers)

    def _numbers(self, _: FrameData) -> list[float]:
        """Return the numbers of its columns."""
        return [*self.wrench.numbers[:6], self.grasper.opening, float(self.n_points)]

    def lead(self, t: float) -> None:
        """Lead it to its pose and opening at time `t` [s], a step after the last one."""
        self.controller.lead(t)

    def follow(self) -> None:
        """Grip tissue where the jaws have closed, release it where they have opened, and lead it.

        It is said where the jaws have closed on nothing, and where what they held slipped out.

        Raises:
            ValueError: the tissue cannot be held; see `tissue.Tissue.attach`.
            LinkError: it is in another process, and did not answer.
        """
        if self._settings is None:
            has_met = self.grasper.opening < _MEETING
            if has_met and not self._had_met:
                _log.warning(_NOTHING_THERE, self.name)
            self._had_met = has_met
        else:
            is_closed = self.grasper.opening < self._settings.closed
            if is_closed and not self._was_closed:
                self._take(self._settings)
            elif self._was_closed and not is_closed:
                self.release()
            self._was_closed = is_closed
        if self.grip is not None:
            self.grip.follow()
            if self._has_held and not self.n_points:
                _log.warning(
                    "at %.3f s the tissue slipped out of the grasper '%s': it pulled with more "
                    "than its breaks_at",
                    self._data.time,
                    self.name,
                )
        self._has_held = self.n_points > 0

    def apply(self) -> None:
        """Apply to it what the tissue did in the last step.

        Raises:
            GripError: that wrench is not finite, or too large.
        """
        if self.grip is not None:
            self.grip.apply()

    def release(self) -> None:
        """Release the tissue that it holds."""
        if self.grip is not None:
            self.grip.release()
            self.grip = None

    def _take(self, settings: GripSettings) -> None:
        """Tie what lies between the pads to the grasper."""
        places = between_pads(self._tissue, self.grasper.pads, self._frame)
        if not len(places):
            _log.warning(_NOTHING_THERE, self.name)
            return
        self.grip = Grip(
            self._data,
            self.grasper.body,
            self._tissue,
            places,
            frame=self._frame,
            stiffness=settings.stiffness,
            damping=settings.damping,
            breaks_at=settings.breaks_at,
        )


def between_pads(
    tissue: Tissue | Bridge, pads: Pads, frame: TissueFrame = TissueFrame()
) -> FloatArray:
    """Return points of the tissue between the pads: where they are in the body at rest [m], (n, 3).

    They are on a grid across the space between the pads, so that their number and their places
    depend on the pads and not on the mesh.

    Args:
        tissue: The tissue, or a bridge to it.
        pads: The space between the pads, world frame.
        frame: Where the tissue lies in the world; of a bridge it is that of the bridge.
    """
    frame = frame_of(tissue, frame)
    counts = np.maximum(1, np.rint(2.0 * pads.half_size / _SPACING)).astype(int)
    counts[0] = min(counts[0], _MOST_ACROSS)
    steps = [
        (np.arange(n) + 0.5) / n * 2.0 * half - half
        for n, half in zip(counts, pads.half_size, strict=True)
    ]
    grid = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)
    points = frame.points_to_tissue(pads.centre + grid @ pads.axes.T)
    body = tissue.snapshot()
    corners = body.positions[body.tetrahedra]
    low, high = points.min(axis=0), points.max(axis=0)
    near = ((corners.min(axis=1) <= high) & (corners.max(axis=1) >= low)).all(axis=1)
    rest = body.rest_positions[body.tetrahedra[near]]
    found = np.full((len(points), 3), np.nan)
    for now, then in zip(corners[near], rest, strict=True):
        edges = (now[1:] - now[0]).T
        if np.linalg.det(edges) <= 0.0:  # it is inside out, and holds no point
            continue
        weights = np.linalg.solve(edges, (points - now[0]).T).T
        inside = (weights >= -_ROUNDING).all(axis=1) & (weights.sum(axis=1) <= 1.0 + _ROUNDING)
        found[inside] = then[0] + weights[inside] @ (then[1:] - then[0])
    return np.asarray(found[np.isfinite(found).all(axis=1)])
