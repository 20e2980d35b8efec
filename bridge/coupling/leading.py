"""`Leading`: the methods of `Bridge` that hold and touch tissue."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bridge.coupling.led_bodies import LedBodies, LedPoses
from bridge.coupling.led_contact import LedContact
from bridge.coupling.led_grip import LedGrip
from bridge.coupling.query import Query
from bridge.input_checks import finite
from bridge.led_frames import FrameHold, FrameLoad, FrameTie, plain_region
from bridge.led_geoms import GeomPoses
from bridge.link import TissueLink
from bridge.poses import Pose
from tissue import Geom, Snapshot


class PathPart(NamedTuple):
    """A part of the path that the tissue has not been asked for yet."""

    blade: Pose
    """The blade at its end."""
    seconds: float
    """How long it takes [s]."""
    led: LedPoses
    """Where frames and geoms are at its end."""


class Leading:
    """A bridge whose arm's side leads frames and geoms, beside the blade."""

    _link: TissueLink
    _query: Query
    _led: LedBodies
    _path: list[PathPart]

    def attach(
        self,
        where: str | npt.ArrayLike,
        *,
        stiffness: float,
        damping: float = 0.0,
        breaks_at: float = math.inf,
        origin: Sequence[float] | None = None,
    ) -> LedGrip:
        """Let a frame hold tissue, over any link; return the grip, which is moved in each step.

        Args:
            where: A region as text, a mask of nodes, numbers of nodes, or places in the body at
                rest [m], as for `tissue.Tissue.attach`; tissue frame.
            stiffness: Of all springs together [N/m].
            damping: Of all dampers together [N s/m].
            breaks_at: Force at which it lets go [N].
            origin: Origin of the frame [m], tissue frame; None: the mean of the points.

        Raises:
            ValueError: see `tissue.Tissue.attach`, where the tissue is in this process.
            LinkError: the tissue is in another one, and refuses that or did not answer.
        """
        self._query.wait()
        grip = self._led.attach(
            FrameHold(plain_region(where), stiffness, damping, breaks_at, origin)
        )
        self._add_to_path(grip)
        return grip

    def tie(
        self,
        where: str | npt.ArrayLike,
        to: npt.ArrayLike,
        *,
        stiffness: float,
        area: float,
        toughness: float,
        damping: float = 0.0,
        rest_length: float | None = None,
        breaks_at: float = math.inf,
    ) -> LedGrip:
        """Tie tissue by strands that the blade can cut, over any link; return what they end at.

        That is a frame at rest, until it is moved; `n_points` is the number of strands.

        Args:
            where: What `attach` takes.
            to: Where the strands end [m], tissue frame, shape (3,), or one place for each, (n, 3).
            stiffness: Of all strands together, along them [N/m].
            area: Cross-section of all strands together [m2].
            toughness: Energy of cutting them [J/m2].
            damping: Of all of them together, along them [N s/m].
            rest_length: Length up to which each is slack [m]; None: the distance of its ends now.
            breaks_at: Force of all of them at which they let go [N].

        Raises:
            ValueError: see `tissue.Tissue.tie`, where the tissue is in this process.
            LinkError: the tissue is in another one, and refuses that or did not answer.
        """
        self._query.wait()
        ends = finite(np.atleast_2d(np.asarray(to)), (None, 3), "where strands end").tolist()
        of_strands = (stiffness, area, toughness, damping, rest_length, breaks_at)
        grip = self._led.tie(FrameTie(plain_region(where), ends, *of_strands))
        self._add_to_path(grip)
        return grip

    def release(self, held: LedGrip) -> None:
        """Let go what a grip holds; again it does nothing.

        Raises:
            ValueError: it is none of this bridge.
            LinkError: the tissue is in another process, and did not answer.
        """
        self._query.wait()
        self._led.release(held)

    def collide_with(self, geoms: Sequence[Geom], poses: GeomPoses) -> LedContact:
        """Let the tissue touch rigid geoms, over any link, and no others; return the contact.

        The contact is moved in each step. What the tissue's own scene had it touch, such as a
        table, must be among the geoms.

        Args:
            geoms: What the tissue can touch from now on.
            poses: Where they are; tissue frame.

        Raises:
            ValueError: see `tissue.Tissue.collide_with`, where the tissue is in this process.
            LinkError: the tissue is in another one, and refuses that or did not answer.
        """
        self._query.wait()
        contact = self._led.collide_with(geoms, poses, answer_is_due=self._query.is_pending)
        at_rest = contact.poses
        self._path = [part._replace(led=part.led._replace(geoms=at_rest)) for part in self._path]
        return contact

    def snapshot(self) -> Snapshot:
        """Return the whole state of the tissue, after its last answer; tissue frame.

        Raises:
            LinkError: the tissue is in another process, and did not answer.
        """
        self._query.wait()
        return self._link.snapshot()

    @property
    def frame_loads(self) -> Sequence[FrameLoad]:
        """What the tissue did to each frame that acts on it, in its last answer; tissue frame.

        First come those of the tissue's own scene, then the grips.
        """
        return self._led.loads

    def _add_to_path(self, grip: LedGrip) -> None:
        """Have a frame that is new at rest in the part of the path that is yet to be done."""
        self._path = [
            part._replace(led=part.led._replace(frames=(*part.led.frames, grip.pose)))
            for part in self._path
        ]
