"""The distance that an arm of the user's own lacks to a stroke, and where it would reach it."""

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from bridge import TissueFrame
from scalpel_sim.arm.chain_kinematics import (
    LONGEST_STEP,
    NEAR_PLACE,
    NEAR_TURN,
    ChainKinematics,
    Miss,
)
from tissue import BladeSegment, FloatArray

_TRIED: Final = 8
"""Configurations from which a place in reach is sought."""
_POSES: Final = 5
"""Poses, from the first to the last, that are looked at in that."""
_PULLED, _LEFT = 80, 40
"""Steps of it in which the displacement is made smaller, and then, at most, in which it is not:
bends that those make in the ways of the joints are undone."""
_CLOSE: Final = 0.5
"""Tolerance of each pose in it, see `Miss.size`."""
_CUTOFF: Final = 1e-3
"""Singular value, over the largest, below which no motion in it is required of joints."""
_FARTHER: Final = (0.0, 1e-3, 5e-3, 0.02, 0.05)
"""Distance by which poses beyond reach are moved into it [m], one after the other: at the border,
where an arm is stretched, the search for a configuration may end just next to it."""
_DECIMALS: Final = 4
"""Decimals of a place that a message gives [m]: a fifth of `NEAR_PLACE`."""


class PlaceInScene(NamedTuple):
    """Words of a scene for where the tissue lies from an arm, so that it can be corrected."""

    table: str
    """The table of the scene whose `pos` that is."""
    pos: FloatArray
    """Its `pos` [m], shape (3,)."""
    axes: FloatArray
    """Axes of the arm's world in the frame of `pos`, as columns, shape (3, 3)."""
    frame: str
    """That frame, in words."""
    is_of_tissue: bool
    """Whether `pos` places the tissue; else it places the arm."""

    def moved(self, shift: FloatArray) -> FloatArray:
        """Return the `pos` that displaces the tissue in the arm's world [m], shape (3,)."""
        change = self.axes @ shift
        return np.asarray(self.pos + (change if self.is_of_tissue else -change))

    def shift_to(self, pos: FloatArray) -> FloatArray:
        """Return by how much a `pos` displaces the tissue in the arm's world [m], shape (3,)."""
        change = pos - self.pos
        return np.asarray(self.axes.T @ (change if self.is_of_tissue else -change))


def place_of_tissue(frame: TissueFrame) -> PlaceInScene:
    """Return how a scene places the tissue in the world of an arm."""
    return PlaceInScene("[world]", frame.origin, np.eye(3), "the world", is_of_tissue=True)


def place_of_arm(table: str, base: TissueFrame) -> PlaceInScene:
    """Return how a scene places an arm in the frame of the tissue.

    Args:
        table: Its table.
        base: Where the origin of its model lies in the frame of the tissue.
    """
    axes, where = base.rotation, "the tissue's frame"
    return PlaceInScene(table, base.origin, axes, where, is_of_tissue=False)


def what_it_lacks(
    solver: ChainKinematics,
    times: FloatArray,
    poses: Sequence[BladeSegment],
    place: PlaceInScene,
) -> str:
    """Return by how much poses are out of reach, and what to do, for an error message.

    Args:
        solver: For the arm, which does not reach the poses.
        times: When it should be at each [s], shape (n,).
        poses: World frame of the arm.
        place: What can be corrected.
    """
    pos = _place_in_reach(solver, poses, place)
    if pos is None:
        return _unreachable(solver, times, poses, place)
    lacking = -place.axes @ place.shift_to(pos)
    numbers = ", ".join(f"{x:.{_DECIMALS}f}".rstrip("0").rstrip(".") for x in pos + 0.0)
    return (
        f"it lies {_distance(lacking)} out of reach, in the direction {_direction(lacking)} of "
        f"{place.frame}. With {place.table} pos = [{numbers}] it is reached"
    )


def _place_in_reach(
    solver: ChainKinematics, poses: Sequence[BladeSegment], place: PlaceInScene
) -> FloatArray | None:
    """Return a `pos` with which all poses are reached, not far from its own; None: none is known.

    It is tried as the next run tries it, with the decimals that the message has.
    """
    moves, _ = solver.movable()
    some = [poses[i] for i in np.linspace(0, len(poses) - 1, _POSES).astype(int)]
    shifts = [_shift_into_reach(solver, start, some) for start in solver.starts()[:_TRIED]]
    found = [shift for shift in shifts if shift is not None]
    for shift in sorted(found, key=lambda each: float(np.linalg.norm(each))):
        inwards = moves @ shift / max(float(np.linalg.norm(shift)), 1e-12)
        for farther in _FARTHER:
            pos = np.round(place.moved(shift + farther * inwards), _DECIMALS)
            if solver.find(_moved(poses, place.shift_to(pos))).is_whole:
                return np.asarray(pos)
    return None


def _shift_into_reach(
    solver: ChainKinematics, start: FloatArray, poses: Sequence[BladeSegment]
) -> FloatArray | None:
    """Return by how much to move poses so that each is reached, as little as is found [m].

    Newton's method for a configuration at each pose and the displacement of all together. What the
    poses leave free makes the displacement smaller: task priority (Nakamura 1987, Int. J. Robotics
    Research 6:3). Joints at an end of their range, that would continue, take no part in a step.

    Args:
        solver: For the arm.
        start: Configuration at all poses at first.
        poses: World frame.

    Returns:
        The displacement, shape (3,); None where not all are reached.
    """
    n, size = len(start), len(poses) * len(start)
    shift = -solver.lacks(start, poses[0])[0].shift
    qpos = np.tile(start, len(poses))
    rows = np.zeros((6 * len(poses), size + 3))
    for i in range(len(poses)):
        rows[6 * i : 6 * i + 3, size:] = -np.eye(3)
    for n_steps in range(_PULLED + _LEFT):
        misses = []
        for i, pose in enumerate(_moved(poses, shift)):
            own = slice(n * i, n * (i + 1))
            miss, rows[6 * i : 6 * (i + 1), own] = solver.lacks(qpos[own], pose)
            misses.append(miss)
        if n_steps >= _PULLED and max(miss.size for miss in misses) <= _CLOSE:
            return shift
        wanted = np.concatenate([miss.weighed for miss in misses])
        pull = -shift if n_steps < _PULLED else np.zeros(3)
        step = _step(solver, qpos.reshape(-1, n), rows, wanted, pull)
        qpos = solver.within_ranges((qpos + step[:size]).reshape(-1, n)).ravel()
        shift = shift + step[size:]
    return None


def _step(
    solver: ChainKinematics,
    qpos: FloatArray,
    rows: FloatArray,
    wanted: FloatArray,
    pull: FloatArray,
) -> FloatArray:
    """Return a step of all joints and of the displacement: see `_shift_into_reach`.

    Args:
        solver: For the arm.
        qpos: The configurations, shape (n_poses, n_joints).
        rows: How joints and displacement change what is wanted.
        wanted: What all poses lack.
        pull: How the displacement should change where the poses leave it free [m], shape (3,).
    """
    free = np.ones(qpos.size + 3)
    pulled = np.append(np.zeros(qpos.size), pull)
    while True:
        inverse = np.linalg.pinv(rows * free, rcond=_CUTOFF)
        step = _limited(free * (inverse @ wanted), qpos.size)
        step = step + _limited(free * (pulled - inverse @ (rows @ pulled)), qpos.size)
        moves = step[: qpos.size].reshape(qpos.shape)
        stops = np.append(solver.stops(qpos, moves).ravel(), [False, False, False])
        if not (stops & (free > 0.0)).any():
            return np.asarray(step)
        free[stops] = 0.0


def _limited(step: FloatArray, n_joints: int) -> FloatArray:
    """Return a step in which no joint moves farther than `LONGEST_STEP`: they are its first."""
    return step * min(1.0, LONGEST_STEP / max(float(np.abs(step[:n_joints]).max()), 1e-12))


def _unreachable(
    solver: ChainKinematics,
    times: FloatArray,
    poses: Sequence[BladeSegment],
    place: PlaceInScene,
) -> str:
    """Return the message for poses that are not reached wherever they are moved to."""
    qpos, misses = solver.find(poses).first, []
    for pose in poses:
        qpos, miss = solver.solve(qpos, pose)
        misses.append(miss)
    worst = int(np.argmax([miss.size for miss in misses]))
    lacking, lacks = [], []
    shift, turn = (place.axes @ part for part in misses[worst])
    moves, turns = (place.axes @ part @ place.axes.T for part in solver.movable())
    rest = Miss(shift - moves @ shift, turn - turns @ turn)
    if np.linalg.norm(shift) > NEAR_PLACE:
        lacking.append(f"{_distance(shift)} away, in the direction {_direction(shift)}")
    if np.linalg.norm(rest.shift) > NEAR_PLACE:
        lacks.append(
            f"moves it by {_distance(rest.shift)} in the direction {_direction(rest.shift)}"
        )
    if np.linalg.norm(turn) > NEAR_TURN:
        lacking.append(f"turned away by {_angle(turn)} about {_direction(turn)}")
    if np.linalg.norm(rest.turn) > NEAR_TURN:
        lacks.append(f"turns it by {_angle(rest.turn)} about {_direction(rest.turn)}")
    missing = f" None of its joints {', and none '.join(lacks)}." if lacks else ""
    return (
        f"at {times[worst]:.2f} s of it the edge stays {', and '.join(lacking)} of "
        f"{place.frame}, and no other pos is found with which it is reached.{missing} Turn the "
        f"tissue or the arm ({place.table} quat), or choose a smaller stroke"
    )


def _moved(poses: Sequence[BladeSegment], shift: FloatArray) -> list[BladeSegment]:
    """Return poses moved by a displacement [m]."""
    return [pose._replace(tip=pose.tip + shift, heel=pose.heel + shift) for pose in poses]


def _distance(vector: FloatArray) -> str:
    """Return a length [m] in words."""
    length = 1e3 * float(np.linalg.norm(vector))
    return f"{length:.0f} mm" if length >= 1e3 else f"{length:.4g} mm"


def _angle(vector: FloatArray) -> str:
    """Return the angle of a rotation vector [rad] in words."""
    return f"{math.degrees(float(np.linalg.norm(vector))):.3g} degrees"


def _direction(vector: FloatArray) -> str:
    """Return the direction of a vector in words."""
    numbers = np.round(vector / np.linalg.norm(vector), 2) + 0.0  # no -0.00
    return f"({', '.join(f'{x:.2f}' for x in numbers)})"
