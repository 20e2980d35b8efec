"""`Driving`: the methods of `Bridge` that attach frames, and geoms that touch tissue."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bridge.coupling.driven_bodies import DrivenBodies, DrivenContact, DrivenFrame, DrivenPoses
from bridge.coupling.query import Query
from bridge.driven import FrameAttachment, FrameLoad, FrameTie, GeomPoses, plain_region
from bridge.link import TissueLink
from bridge.poses import Pose, finite
from tissue import Geom, Snapshot


class PathPart(NamedTuple):
    """A part of the path that the tissue has not done yet."""

    blade: Pose
    """The blade at its end."""
    seconds: float
    """How long it takes [s]."""
    driven: DrivenPoses
    """Poses of the driven frames and geoms at its end."""


class Driving:
    """A bridge whose arm's side drives frames and geoms besides the blade."""

    _link: TissueLink
    _query: Query
    _driven: DrivenBodies
    _path: list[PathPart]

    def attach(
        self,
        where: str | npt.ArrayLike,
        *,
        stiffness: float,
        damping: float = 0.0,
        breaks_at: float = math.inf,
        origin: Sequence[float] | None = None,
    ) -> DrivenFrame:
        """Attach a frame to tissue, over any link; return the frame, which is moved in each step.

        Args:
            where: A region as text, a mask of nodes, numbers of nodes, or places in the body at
                rest [m], as for `tissue.Tissue.attach`; tissue frame.
            stiffness: Total stiffness of the springs [N/m].
            damping: Total damping of the springs [N s/m].
            breaks_at: Force at which the frame releases the tissue [N].
            origin: Origin of the frame [m], tissue frame; None: the mean of the points.

        Raises:
            ValueError: see `tissue.Tissue.attach`, where the tissue is in this process.
            LinkError: the tissue is in another one, and refuses that or did not answer.
        """
        self._query.wait()
        at = None if origin is None else np.asarray(origin, np.float64)
        frame = self._driven.attach(
            FrameAttachment(plain_region(where), stiffness, damping, breaks_at, at)
        )
        self._add_to_path(frame)
        return frame

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
    ) -> DrivenFrame:
        """Tie tissue by strands that the blade can cut, over any link; return their frame.

        The strands end at the frame, which rests until it is moved; `n_points` is the number of
        strands.

        Args:
            where: Where the strands begin; as for `attach`.
            to: Where the strands end [m], tissue frame, shape (3,), or one place for each, (n, 3).
            stiffness: Total stiffness of the strands along them [N/m].
            area: Total cross-section of the strands [m2].
            toughness: Energy of cutting a strand [J/m2].
            damping: Total damping of the strands along them [N s/m].
            rest_length: Length up to which each is slack [m]; None: the distance of its ends now.
            breaks_at: Total force of the strands at which they break [N].

        Raises:
            ValueError: see `tissue.Tissue.tie`, where the tissue is in this process.
            LinkError: the tissue is in another one, and refuses that or did not answer.
        """
        self._query.wait()
        ends = finite(np.atleast_2d(np.asarray(to)), (None, 3), "where strands end")
        of_strands = (stiffness, area, toughness, damping, rest_length, breaks_at)
        frame = self._driven.tie(FrameTie(plain_region(where), ends, *of_strands))
        self._add_to_path(frame)
        return frame

    def release(self, frame: DrivenFrame) -> None:
        """Release what a frame is attached to; again it does nothing.

        Raises:
            ValueError: it is none of this bridge.
            LinkError: the tissue is in another process, and did not answer.
        """
        self._query.wait()
        self._driven.release(frame)

    def collide_with(self, geoms: Sequence[Geom], poses: GeomPoses) -> DrivenContact:
        """Replace the rigid geoms that the tissue touches, over any link; return the contact.

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
        contact = self._driven.collide_with(geoms, poses, answer_is_due=self._query.is_pending)
        at_rest = contact.poses
        self._path = [
            part._replace(driven=part.driven._replace(geoms=at_rest)) for part in self._path
        ]
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
        """Load on each frame that acts on the tissue, in its last answer; tissue frame.

        First come those of the tissue's own scene, then the driven ones.
        """
        return self._driven.loads

    def _add_to_path(self, frame: DrivenFrame) -> None:
        """Add a new frame, at rest, to the part of the path that is yet to be done."""
        self._path = [
            part._replace(driven=part.driven._replace(frames=(*part.driven.frames, frame.pose)))
            for part in self._path
        ]
