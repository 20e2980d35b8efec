"""A grip on a tissue behind any link: a frame that the arm's side leads."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from bridge.input_checks import finite
from bridge.input_checks import rotation as checked_rotation
from bridge.led_frames import FrameLoad, FramePose
from tissue import FloatArray, Wrench


class LedGrip:
    """Tissue that a frame holds, which is moved from here: as `tissue.Attachment`, over any link.

    Args:
        number: Number of the frame.
        load: What the tissue does to it at first.
    """

    def __init__(self, number: int, load: FrameLoad) -> None:
        self.number = number
        """Number of the frame among all that act on the tissue."""
        self.load = load
        """What the tissue did to it in its last answer; tissue frame."""
        self.pose = FramePose(load.wrench.point, np.eye(3))
        """Where the frame is led; tissue frame."""

    @property
    def n_points(self) -> int:
        """Number of points that it holds; 0 after it was released, or has let go."""
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
        at = finite(np.asarray(origin), (3,), "the origin of a grip")
        axes = self.pose.rotation
        if rotation is not None:
            axes = checked_rotation(np.asarray(rotation), "the rotation of a grip")
        self.pose = FramePose(at, axes)
