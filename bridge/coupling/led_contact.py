"""Contact with a tissue behind any link: geoms that the arm's side leads."""

from collections.abc import Sequence

import numpy as np

from bridge.input_checks import FRAME_TOLERANCE
from bridge.led_geoms import GeomLoads, GeomPoses, expect_pose_of_each, no_geom_loads
from tissue import Geom, GeomForces, StepResult, are_rotations


class LedContact:
    """Contact of geoms with tissue, and where the geoms are led; tissue frame.

    Args:
        geoms: The geoms.
        poses: Where they are at first.
    """

    def __init__(self, geoms: Sequence[Geom], poses: GeomPoses) -> None:
        self.geoms = tuple(geoms)
        """The geoms, in the order of their numbers."""
        self.poses = _checked(poses, self.geoms)
        """Where they are led."""
        self.loads: GeomLoads = no_geom_loads(len(self.geoms))
        """What the tissue did to them in its last answer."""
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
        ValueError: see `LedContact.move`.
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
