"""Frames attached to tissue, and geoms that touch it, which the arm's side drives."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bridge.driven import (
    NO_GEOMS,
    FrameAttachment,
    FrameLoad,
    FramePose,
    FrameTie,
    GeomLoads,
    GeomPoses,
    combined_loads,
    expect_pose_of_each,
    mean_geom_loads,
    no_geom_loads,
)
from bridge.link import TissueLink
from bridge.poses import FRAME_TOLERANCE, finite
from bridge.poses import rotation as checked_rotation
from tissue import FloatArray, Geom, GeomForces, StepResult, Wrench, are_rotations


class DrivenPoses(NamedTuple):
    """Poses of all driven frames and geoms."""

    frames: tuple[FramePose, ...] = ()
    """Poses of the frames, in the order in which they were attached."""
    geoms: GeomPoses = NO_GEOMS
    """Poses of the geoms."""


_NO_POSES = DrivenPoses()


class DrivenLoads(NamedTuple):
    """Loads of the tissue on frames and geoms in a step."""

    frames: Sequence[FrameLoad]
    """Loads on all frames; those of the tissue's own scene come first."""
    geoms: GeomLoads
    """Loads on the driven geoms."""


def loads_over(link: TissueLink) -> DrivenLoads:
    """Return the loads of the tissue behind a link in its last step."""
    return DrivenLoads(link.loads(), link.geom_loads())


def mean_loads(
    parts: Sequence[DrivenLoads], poses: Sequence[DrivenPoses], seconds: Sequence[float]
) -> DrivenLoads:
    """Return the mean loads over several steps.

    Args:
        parts: The loads in each step.
        poses: Where all was at the end of each.
        seconds: How long each lasted [s].
    """
    origins = [pose.geoms.origins for pose in poses]
    return DrivenLoads(
        combined_loads([part.frames for part in parts], seconds),
        mean_geom_loads([part.geoms for part in parts], origins, seconds),
    )


class DrivenFrame:
    """A frame that is attached to tissue and driven from here: `tissue.Attachment` over any link.

    Args:
        number: Number of the frame.
        load: Load on the frame at first.
    """

    def __init__(self, number: int, load: FrameLoad) -> None:
        self.number = number
        """Number of the frame among all that act on the tissue."""
        self.load = load
        """Load on the frame in the tissue's last answer; tissue frame."""
        self.pose = FramePose(load.wrench.point, np.eye(3))
        """Pose to which the frame moves; tissue frame."""

    @property
    def n_points(self) -> int:
        """Number of attached points; 0 after the frame has released them."""
        return self.load.n_points

    @property
    def wrench(self) -> Wrench:
        """Mean wrench of the tissue on the frame in the last answer, about its origin then."""
        return self.load.wrench

    def move(
        self, origin: Sequence[float] | FloatArray, rotation: npt.ArrayLike | None = None
    ) -> None:
        """Move the frame in the next step, at an even speed, to where it then stays.

        Args:
            origin: Its origin at the end of the step [m], shape (3,), tissue frame.
            rotation: Its axes as columns, shape (3, 3); at first they are those of the tissue.
                None: as they are.

        Raises:
            ValueError: a number is not finite, or it is no rotation.
        """
        at = finite(np.asarray(origin), (3,), "the origin of a frame")
        axes = self.pose.rotation
        if rotation is not None:
            axes = checked_rotation(np.asarray(rotation), "the rotation of a frame")
        self.pose = FramePose(at, axes)


class DrivenContact:
    """Contact of geoms with tissue, and their driven poses; tissue frame.

    Args:
        geoms: The geoms.
        poses: Where they are at first.
    """

    def __init__(self, geoms: Sequence[Geom], poses: GeomPoses) -> None:
        self.geoms = tuple(geoms)
        """The geoms, in the order of their numbers."""
        self.poses = _checked(poses, self.geoms)
        """Poses to which the geoms move."""
        self.loads: GeomLoads = no_geom_loads(len(self.geoms))
        """Loads on the geoms in the tissue's last answer."""
        self._result: StepResult | None = None

    def move(self, poses: GeomPoses) -> None:
        """Move the geoms in the next step, at even speeds, to where they then stay.

        Raises:
            ValueError: there is another number of poses, a number is not finite, or a rotation is
                none.
        """
        self.poses = _checked(poses, self.geoms)

    def take(self, loads: GeomLoads, result: StepResult) -> None:
        """Take what the tissue did to the geoms."""
        self.loads, self._result = loads, result

    def forces(self) -> GeomForces:
        """Return where the tissue touched them in its last step, and with which forces."""
        if self._result is None:
            return GeomForces(np.zeros(0, np.int64), *(np.zeros((0, 3)) for _ in range(3)))
        found = self._result.contacts
        rows = np.flatnonzero(found.geom >= 0)
        press = found.normal_force[rows, None] * found.normal[rows]
        force = press + found.friction[rows]
        return GeomForces(found.geom[rows], found.point[rows], found.normal[rows], force)


def _checked(poses: GeomPoses, geoms: Sequence[Geom]) -> GeomPoses:
    """Return copies of poses.

    Raises:
        ValueError: see `DrivenContact.move`.
    """
    origins, axes = (np.array(each, np.float64) for each in poses)
    found = GeomPoses(origins, axes)
    expect_pose_of_each(found, len(geoms))
    if not np.isfinite(origins).all():
        g = int(np.argmin(np.isfinite(origins).all(axis=1)))
        raise ValueError(f"the origin of geom '{geoms[g].name}' is {origins[g].tolist()} m")
    wrong = ~are_rotations(axes, FRAME_TOLERANCE)
    if wrong.any():
        g = int(np.argmax(wrong))
        raise ValueError(
            f"the rotation of geom '{geoms[g].name}' is {axes[g].tolist()}; it is three axes as "
            "columns, right-handed"
        )
    return found


class DrivenBodies:
    """The driven frames and geoms of a bridge.

    Args:
        link: To the tissue.
    """

    def __init__(self, link: TissueLink) -> None:
        self._link = link
        self._frames: list[DrivenFrame] = []
        self._contact: DrivenContact | None = None
        self._answer_is_older = False
        self.loads: Sequence[FrameLoad] = link.loads()
        """Loads on all frames in the tissue's last answer; tissue frame."""

    @property
    def poses(self) -> DrivenPoses:
        """Poses to which frames and geoms move; tissue frame."""
        if not (self._frames or self._contact):
            return _NO_POSES
        frames = tuple([frame.pose for frame in self._frames])
        return DrivenPoses(frames, NO_GEOMS if self._contact is None else self._contact.poses)

    @property
    def are_loaded(self) -> bool:
        """Whether the tissue's next answer has loads on anything."""
        return bool(self.loads or self._contact)

    def attach(self, attachment: FrameAttachment) -> DrivenFrame:
        """Attach a frame to tissue; see `TissueLink.attach`."""
        return self._added(self._link.attach(attachment))

    def tie(self, tie: FrameTie) -> DrivenFrame:
        """Tie tissue by fibres to a frame; see `TissueLink.tie`."""
        return self._added(self._link.tie(tie))

    def _added(self, number: int) -> DrivenFrame:
        """Return the new frame of that number."""
        self.loads = self._link.loads()
        frame = DrivenFrame(number, self.loads[number])
        self._frames.append(frame)
        return frame

    def release(self, frame: DrivenFrame) -> None:
        """Release a frame; see `TissueLink.release`.

        Raises:
            ValueError: it is none of these frames.
        """
        if frame not in self._frames:
            raise ValueError("the frame is not one of this bridge")
        self._link.release(frame.number)
        self._take_loads(self._link.loads())

    def collide_with(
        self, geoms: Sequence[Geom], poses: GeomPoses, *, answer_is_due: bool
    ) -> DrivenContact:
        """Replace the geoms that tissue touches; see `TissueLink.collide_with`.

        Args:
            geoms: The geoms.
            poses: Where they are.
            answer_is_due: Whether the next answer is to an earlier query.
        """
        contact = DrivenContact(geoms, poses)
        self._link.collide_with(contact.geoms, contact.poses)
        self._contact, self._answer_is_older = contact, answer_is_due
        return contact

    def take(self, loads: DrivenLoads, result: StepResult) -> None:
        """Take the loads of the tissue's last answer."""
        # The answer to an earlier query has no load on a frame that is newer.
        self._take_loads([*loads.frames, *self.loads[len(loads.frames) :]])
        if self._contact is not None and not self._answer_is_older:
            self._contact.take(loads.geoms, result)
        self._answer_is_older = False

    def _take_loads(self, loads: Sequence[FrameLoad]) -> None:
        self.loads = loads
        for frame in self._frames:
            frame.load = loads[frame.number]
