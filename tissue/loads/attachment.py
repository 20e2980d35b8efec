"""Attachments of tissue to what moves from outside: a jaw, a hook, the world."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import FloatArray
from tissue.integrators.attachments import Attachments, frequency_squared, no_attachments
from tissue.loads.material_points import MaterialPoints
from tissue.mesh.body import Body
from tissue.types import Wrench

_ORTHONORMAL = 1e-6
"""How far a rotation may be from one, by rounding."""


class Attachment:
    """Points of a tissue that springs and dampers tie to a rigid frame, until it is released.

    Args:
        points: The points.
        positions: Where they are now [m], shape (n, 3): there the springs are at rest.
        stiffness: Of all springs together [N/m].
        damping: Of all dampers together [N s/m].
        rest_length: Length up to which each point is slack, in any direction [m]; 0: it is held
            where it is.
        breaks_at: Force at which it lets go [N].
        origin: Origin of the frame [m], shape (3,).

    Raises:
        ValueError: a number is not finite, or has the wrong sign.
    """

    def __init__(
        self,
        points: MaterialPoints,
        positions: FloatArray,
        *,
        stiffness: float,
        damping: float = 0.0,
        rest_length: float = 0.0,
        breaks_at: float = math.inf,
        origin: Sequence[float] | FloatArray | None = None,
    ) -> None:
        if not (math.isfinite(stiffness) and stiffness > 0.0):
            raise ValueError(f"stiffness is {stiffness} N/m; it must be positive and finite")
        for name, value in (("damping", damping), ("rest_length", rest_length)):
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} is {value}; it must be finite and not negative")
        if not breaks_at > 0.0:
            raise ValueError(f"breaks_at is {breaks_at} N; it must be positive")
        self.points = points
        self.stiffness, self.damping = float(stiffness), float(damping)
        self.rest_length, self.breaks_at = float(rest_length), float(breaks_at)
        self.is_released = False
        """Whether it holds no more: it was released, or the force was too large."""
        at = positions.mean(axis=0) if origin is None else np.array(origin, dtype=np.float64)
        self._local: FloatArray = positions - _triple("origin", at)
        self._begin = self._end = (np.eye(3), at)
        self._force: FloatArray = np.zeros(3)
        self._moment: FloatArray = np.zeros(3)

    @property
    def n_points(self) -> int:
        """Number of points that it holds; 0 after it was released."""
        return 0 if self.is_released else len(self.points)

    @property
    def wrench(self) -> Wrench:
        """Wrench of the tissue on the frame, averaged over the last step, about its origin then."""
        origin = self._begin[1]
        force = -self._force
        # Forces act where the points are: dampers pull beside the line to what they are tied to.
        return Wrench(force, -self._moment - np.cross(origin, force), origin.copy())

    def move(
        self, origin: Sequence[float] | FloatArray, rotation: npt.ArrayLike | None = None
    ) -> None:
        """Move the frame in the next step, at an even speed, to where it then stays.

        Args:
            origin: Its origin at the end of the step [m], shape (3,).
            rotation: Its axes as columns, shape (3, 3); at first they are those of the tissue.
                None: as they are.

        Raises:
            ValueError: a number is not finite, or it is no rotation.
        """
        axes = self._end[0] if rotation is None else np.array(rotation, dtype=np.float64)
        if axes.shape != (3, 3) or not np.abs(axes.T @ axes - np.eye(3)).max() <= _ORTHONORMAL:
            raise ValueError(f"rotation is {rotation!r}; it must be three axes as columns")
        self._end = (axes, _triple("origin", np.array(origin, dtype=np.float64)))

    def targets(self) -> tuple[FloatArray, FloatArray]:
        """Return what the points are tied to at the begin and the end of the next step [m]."""
        first, last = (self._local @ axes.T + origin for axes, origin in (self._begin, self._end))
        return first, last

    def stop(self) -> None:
        """Have the frame where it was to be at the end of the next step."""
        self._begin = self._end

    def end_step(self, force: FloatArray, moment: FloatArray) -> None:
        """Take what acted on the points, averaged over a step.

        Args:
            force: Sum of the forces [N], shape (3,).
            moment: Sum of their moments about the origin of the tissue's frame [N m], shape (3,).
        """
        self._begin, self._force, self._moment = self._end, force, moment
        if float(np.linalg.norm(force)) > self.breaks_at:
            self.is_released = True


class AttachmentList:
    """All attachments of a body, and their arrays."""

    def __init__(self) -> None:
        self._attachments: list[Attachment] = []
        self.arrays: Attachments = no_attachments()
        """What kernels work on; another one where attachments come or go."""
        self.added_frequency_squared = 0.0
        """What they add to w^2 of the body at most [1/s2]."""

    @property
    def act(self) -> bool:
        """Whether there are any."""
        return bool(self._attachments)

    def add(self, attachment: Attachment, body: Body) -> None:
        """Let an attachment hold from now on."""
        self._attachments.append(attachment)
        self._renew(body)

    def remove(self, attachment: Attachment, body: Body) -> None:
        """Let an attachment hold no longer.

        Raises:
            ValueError: it does not hold this body.
        """
        if attachment not in self._attachments:
            raise ValueError("it does not hold this tissue, or was released before")
        attachment.is_released = True
        self._attachments.remove(attachment)
        self._renew(body)

    def begin_step(self) -> None:
        """Write where the frames go in the next step."""
        if self._attachments:
            first, last = zip(*(each.targets() for each in self._attachments), strict=True)
            self.arrays.begin[:], self.arrays.end[:] = np.concatenate(first), np.concatenate(last)
            self.arrays.impulse[:] = self.arrays.turn[:] = 0.0

    def stop(self) -> None:
        """Have every frame where it was to be at the end of the next step."""
        for each in self._attachments:
            each.stop()
        self.begin_step()

    def locate(self, body: Body) -> None:
        """Find the points in the mesh, which a cut has changed."""
        row = 0
        for each in self._attachments:
            nodes, weights = each.points.nodes_and_weights(body)
            rows = slice(row, row + len(nodes))
            self.arrays.nodes[rows], self.arrays.weights[rows] = nodes, np.maximum(weights, 0.0)
            row += len(nodes)
        # A point in the middle of a cut tetrahedron may be outside of it by rounding.
        if row:
            self.arrays.weights /= self.arrays.weights.sum(axis=1, keepdims=True)
        own_masses = body.masses - body.added_masses
        self.added_frequency_squared = frequency_squared(self.arrays, own_masses)

    def end_step(self, body: Body, dt: float) -> None:
        """Tell each attachment the force on its points; drop those that have let go."""
        arrays, row = self.arrays, 0
        for each in self._attachments:
            rows = slice(row, row + len(each.points))
            impulse, turn = (part[rows].sum(axis=0) for part in (arrays.impulse, arrays.turn))
            each.end_step(impulse / dt, turn / dt)
            row += len(each.points)
        if any(each.is_released for each in self._attachments):
            self._attachments = [each for each in self._attachments if not each.is_released]
            self._renew(body)

    def _renew(self, body: Body) -> None:
        """Make arrays for the attachments that there are."""
        counts = [len(each.points) for each in self._attachments]
        self.arrays = no_attachments(sum(counts))
        row = 0
        for each, n in zip(self._attachments, counts, strict=True):
            rows = slice(row, row + n)
            self.arrays.stiffness[rows] = each.stiffness * each.points.shares
            self.arrays.damping[rows] = each.damping * each.points.shares
            self.arrays.length[rows] = each.rest_length
            row += n
        self.begin_step()
        self.locate(body)


def _triple(name: str, values: FloatArray) -> FloatArray:
    """Return three finite numbers."""
    if values.shape != (3,) or not np.isfinite(values).all():
        raise ValueError(f"{name} is {values.tolist()}; it is three finite numbers in m")
    return values
