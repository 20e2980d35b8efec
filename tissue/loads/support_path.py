"""Supports that are led along a field over time: moved, turned about a point and stretched.

At a time t after the start a point of the field that was at X is at

    x = p + d(t) + R(t) S(t) (X - p)

with the point p, the displacement d, the rotation R and the stretch S along the axes. The field is
affine, so that it says where any fixed node goes, also one that a cut makes later: from x, by what
leads back to X. In a step a node goes in a straight line to where the field has it at the end.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import FloatArray, IntArray
from tissue.mesh.body import Body


class SupportPath:
    """A field over time that leads supports, row by row; then they stay.

    From row to row displacement, rotation vector and stretch change evenly: rows that turn about
    one axis turn at an even rate, by several turns too.

    Args:
        times: When the supports are there, after the start [s], shape (n,), increasing, above 0.
        displacements: How far they are moved then [m], shape (n, 3); None: not.
        rotations: Rotation vectors, along the axis and as long as the angle [rad], shape (n, 3);
            None: they do not turn.
        stretches: Lengths over those at the start along x, y and z, before they are turned, above
            0, shape (n, 3); None: all 1.
        about: The point about which they are turned and stretched [m], shape (3,).

    Raises:
        ValueError: the shapes do not fit, a number is not finite, the times do not increase, or a
            stretch is not positive.
    """

    def __init__(
        self,
        times: npt.ArrayLike,
        displacements: npt.ArrayLike | None = None,
        rotations: npt.ArrayLike | None = None,
        stretches: npt.ArrayLike | None = None,
        *,
        about: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        at = np.array(times, dtype=np.float64)
        if at.ndim != 1 or not len(at):
            raise ValueError(f"times have shape {at.shape}; give one or more, (n,)")
        if not (np.isfinite(at).all() and (np.diff(at, prepend=0.0) > 0.0).all()):
            raise ValueError(
                f"times are {at.tolist()}; they are finite, begin above 0 and increase"
            )
        self._times: FloatArray = np.concatenate(([0.0], at))
        zero, one = np.zeros(3), np.ones(3)
        self._moved = _rows("displacements", displacements, zero, len(at))
        self._turned = _rows("rotations", rotations, zero, len(at))
        self._stretched = _rows("stretches", stretches, one, len(at))
        if not (self._stretched > 0.0).all():
            raise ValueError("a stretch is not above 0; 1 is as long as at the start")
        self._about: FloatArray = np.array(about, dtype=np.float64)
        if self._about.shape != (3,) or not np.isfinite(self._about).all():
            raise ValueError(f"about is {about!r}; it is three finite numbers in m")

    @property
    def duration(self) -> float:
        """When the last row is reached, after the start [s]."""
        return float(self._times[-1])

    def at(self, seconds: float) -> tuple[FloatArray, FloatArray]:
        """Return the field at a time after the start: x = A X + b.

        Returns:
            A, shape (3, 3), and b [m], shape (3,).
        """
        moved, turned, stretched = (
            np.array([np.interp(seconds, self._times, row) for row in rows.T])
            for rows in (self._moved, self._turned, self._stretched)
        )
        matrix = _rotation(turned) * stretched
        return matrix, self._about + moved - matrix @ self._about


class LedSupports:
    """The fixed nodes that are led along paths, each along one of them."""

    def __init__(self) -> None:
        self._paths: list[SupportPath] = []
        self._seconds: list[float] = []
        self._path_of: IntArray = np.empty(0, dtype=np.int64)
        """Path of each node, shape (n_nodes,); -1 where there is none."""

    @property
    def act(self) -> bool:
        """Whether there is a path that has not ended."""
        return bool(self._paths)

    def lead(self, body: Body, nodes: IntArray, path: SupportPath) -> None:
        """Lead some nodes along a path from now on, and no other."""
        self.forget(body, nodes)
        self._path_of[nodes] = len(self._paths)
        self._paths.append(path)
        self._seconds.append(0.0)

    def forget(self, body: Body, nodes: IntArray) -> None:
        """Lead some nodes no more."""
        self._follow_mesh(body)
        self._path_of[nodes] = -1

    def write_velocities(self, body: Body, dt: float) -> None:
        """Write the velocities that lead nodes to their places at the end of a step of `dt` [s]."""
        self._follow_mesh(body)
        for k, (path, seconds) in enumerate(zip(self._paths, self._seconds, strict=True)):
            nodes = np.flatnonzero(self._path_of == k)
            (before, from_there), (after, to) = path.at(seconds), path.at(seconds + dt)
            x = body.positions[nodes]
            at_start = np.linalg.solve(before, (x - from_there).T)
            body.velocities[nodes] = ((after @ at_start).T + to - x) / dt
            if np.array_equal(before, after) and np.array_equal(from_there, to):
                body.velocities[nodes] = 0.0

    def end_step(self, body: Body, dt: float) -> None:
        """Go on by a step of `dt` [s]; nodes whose path has ended stand still."""
        self._seconds = [seconds + dt for seconds in self._seconds]
        has_ended = [
            path.duration <= seconds
            for path, seconds in zip(self._paths, self._seconds, strict=True)
        ]
        if not any(has_ended):
            return
        self._follow_mesh(body)
        number = np.cumsum([not each for each in has_ended]) - 1
        number[has_ended] = -1
        led = self._path_of >= 0
        body.velocities[np.flatnonzero(led)[number[self._path_of[led]] < 0]] = 0.0
        self._path_of[led] = number[self._path_of[led]]
        kept = [k for k, each in enumerate(has_ended) if not each]
        self._paths = [self._paths[k] for k in kept]
        self._seconds = [self._seconds[k] for k in kept]

    def _follow_mesh(self, body: Body) -> None:
        """Lead new fixed nodes as the fixed node next to them at rest."""
        known, n = len(self._path_of), body.n_nodes
        if known == n:
            return
        found = np.full(n, -1, dtype=np.int64)
        found[:known] = self._path_of
        new = known + np.flatnonzero(body.fixed[known:n])
        old = np.flatnonzero(body.fixed[:known])
        if known and len(new) and len(old):
            from scipy.spatial import cKDTree  # 0.2 s, and only here

            _, next_to = cKDTree(body.rest[old]).query(body.rest[new])
            found[new] = self._path_of[old[next_to]]
        self._path_of = found


def _rows(name: str, rows: npt.ArrayLike | None, first: FloatArray, n: int) -> FloatArray:
    """Return rows of three numbers after a first one, shape (n + 1, 3)."""
    if rows is None:
        return np.tile(first, (n + 1, 1))
    array = np.array(rows, dtype=np.float64)
    if array.shape != (n, 3) or not np.isfinite(array).all():
        raise ValueError(
            f"{name} have shape {array.shape}; give three finite numbers for each time"
        )
    return np.vstack([first, array])


def _rotation(vector: FloatArray) -> FloatArray:
    """Return the matrix of a rotation vector [rad], by Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(
        np.eye(3) + np.sin(angle) * across + 2.0 * np.sin(0.5 * angle) ** 2 * (across @ across)
    )
