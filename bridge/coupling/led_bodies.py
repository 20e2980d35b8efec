"""What the arm's side leads beside the blade: frames that hold tissue, and geoms that touch it."""

from collections.abc import Sequence
from typing import NamedTuple

from bridge.coupling.led_contact import LedContact
from bridge.coupling.led_grip import LedGrip
from bridge.led_frames import FrameHold, FrameLoad, FramePose, FrameTie, combined_loads
from bridge.led_geoms import NO_GEOMS, GeomLoads, GeomPoses, mean_geom_loads
from bridge.link import TissueLink
from tissue import Geom, StepResult


class LedPoses(NamedTuple):
    """Where all that is led is."""

    frames: tuple[FramePose, ...] = ()
    """The frames, in the order in which they were attached."""
    geoms: GeomPoses = NO_GEOMS
    """The geoms."""


class LedLoads(NamedTuple):
    """What the tissue did in a step."""

    frames: Sequence[FrameLoad]
    """To all frames, also those of the tissue's own scene, which come first."""
    geoms: GeomLoads
    """To the geoms that are led."""


def loads_over(link: TissueLink) -> LedLoads:
    """Return what the tissue behind a link did in its last step."""
    return LedLoads(link.loads(), link.geom_loads())


def mean_loads(
    parts: Sequence[LedLoads], poses: Sequence[LedPoses], seconds: Sequence[float]
) -> LedLoads:
    """Return the mean loads over several steps.

    Args:
        parts: The loads in each step.
        poses: Where all was at the end of each.
        seconds: How long each lasted [s].
    """
    origins = [pose.geoms.origins for pose in poses]
    return LedLoads(
        combined_loads([part.frames for part in parts], seconds),
        mean_geom_loads([part.geoms for part in parts], origins, seconds),
    )


class LedBodies:
    """The grips of a bridge, and the geoms that touch tissue.

    Args:
        link: To the tissue.
    """

    def __init__(self, link: TissueLink) -> None:
        self._link = link
        self._grips: list[LedGrip] = []
        self._contact: LedContact | None = None
        self._answer_is_older = False
        self.loads: Sequence[FrameLoad] = link.loads()
        """What the tissue did to all frames in its last answer; tissue frame."""

    @property
    def poses(self) -> LedPoses:
        """Where the frames and the geoms are led; tissue frame."""
        frames = tuple([grip.pose for grip in self._grips])
        return LedPoses(frames, NO_GEOMS if self._contact is None else self._contact.poses)

    def attach(self, hold: FrameHold) -> LedGrip:
        """Let a frame hold tissue; see `TissueLink.attach`."""
        return self._added(self._link.attach(hold))

    def tie(self, tie: FrameTie) -> LedGrip:
        """Tie tissue by strands to a frame; see `TissueLink.tie`."""
        return self._added(self._link.tie(tie))

    def _added(self, number: int) -> LedGrip:
        """Return the grip of a new frame."""
        self.loads = self._link.loads()
        grip = LedGrip(number, self.loads[number])
        self._grips.append(grip)
        return grip

    def release(self, grip: LedGrip) -> None:
        """Let go; see `TissueLink.release`.

        Raises:
            ValueError: it is none of these grips.
        """
        if grip not in self._grips:
            raise ValueError("the grip is not one of this bridge")
        self._link.release(grip.number)
        self._take_loads(self._link.loads())

    def collide_with(
        self, geoms: Sequence[Geom], poses: GeomPoses, *, answer_is_due: bool
    ) -> LedContact:
        """Let tissue touch geoms, and no others; see `TissueLink.collide_with`.

        Args:
            geoms: The geoms.
            poses: Where they are.
            answer_is_due: Whether the next answer is to what was asked before.
        """
        contact = LedContact(geoms, poses)
        self._link.collide_with(contact.geoms, contact.poses)
        self._contact, self._answer_is_older = contact, answer_is_due
        return contact

    def take(self, loads: LedLoads, result: StepResult) -> None:
        """Take what the tissue did in its last answer."""
        # What was asked before a frame was attached says nothing of that.
        self._take_loads([*loads.frames, *self.loads[len(loads.frames) :]])
        if self._contact is not None and not self._answer_is_older:
            self._contact.take(loads.geoms, result)
        self._answer_is_older = False

    def _take_loads(self, loads: Sequence[FrameLoad]) -> None:
        self.loads = loads
        for grip in self._grips:
            grip.load = loads[grip.number]
