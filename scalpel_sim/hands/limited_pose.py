"""A pose that follows a wanted one: in its workspace, at a limited speed, never far behind."""

import math
from collections import deque
from itertools import pairwise

import mujoco
import numpy as np

from tissue import FloatArray

MOST_SPEED = 0.2
"""Highest speed of the middle of the edge [m/s]: three times that of an unhurried incision, and a
tenth of `FASTEST`. A faster blade would skip elements in a frame."""

MOST_TURN_RATE = 2.0
"""Highest rate at which the blade turns [rad/s]: the ends of an edge of 80 mm then move at 0.08 m/s
more."""

FOLLOWING_TIME = 0.02
"""Time constant with which the hand follows [s]: a page sends a move every 16 ms, and between two
of them the blade should not stop."""

FARTHEST_AHEAD, MOST_AHEAD_TURN = 0.04, 0.4
"""Lead of the wanted pose over the hand, at most [m, rad]: what it does in a fifth of a second.
What is requested beyond is lost, so that the blade stops soon after the person does."""

PASSES_AT = MOST_SPEED * FOLLOWING_TIME
"""Distance from a place of a way at which it goes on to the next one [m]: nearer it would slow
down."""

MOST_WAY_AHEAD = 0.4
"""Longest way along the places that it was sent to [m]: what it does in two seconds. Of a longer
one the oldest places are left out, so that it is never farther behind."""

ARRIVED, ARRIVED_TURN = 1e-7, 1e-6
"""Distance [m] and angle [rad] from the wanted pose at which the hand is there: a thousandth of a
frame's motion."""


class LimitedPose:
    """The pose of an instrument that goes towards where it is wanted. Tissue frame.

    It starts at rest.

    Attributes:
        most_speed: Highest speed of its middle [m/s].
        most_turn_rate: Highest rate at which it turns [rad/s].
        farthest_ahead: Lead of the wanted place over it, at most [m].
        most_ahead_turn: Lead of the wanted rotation over it, at most [rad].

    Args:
        middle: Where the middle of the instrument is [m], shape (3,).
        rotation: How it is turned (w, x, y, z).
        workspace: Lowest and highest place of its middle [m], shape (2, 3).
        dt: Length of a frame [s].
    """

    most_speed, most_turn_rate = MOST_SPEED, MOST_TURN_RATE
    farthest_ahead, most_ahead_turn = FARTHEST_AHEAD, MOST_AHEAD_TURN

    def __init__(
        self, middle: FloatArray, rotation: FloatArray, workspace: FloatArray, dt: float
    ) -> None:
        self.middle, self.rotation = middle.copy(), rotation.copy()
        """Where it is [m], and how it is turned."""
        self.wanted, self.wanted_rotation = middle.copy(), rotation.copy()
        """Where it is wanted."""
        self.dt = dt
        """Time that passes in a frame, for speeds and for the time constant [s]."""
        self.following_time = FOLLOWING_TIME
        """Time constant with which it follows [s]."""
        self.workspace = workspace
        """Lowest and highest place of its middle [m], shape (2, 3)."""
        self._way: deque[FloatArray] = deque()
        self._is_limited = False

    def move(self, by: FloatArray) -> None:
        """Move the wanted pose by a displacement [m], as far as it may be ahead."""
        self._way.clear()
        requested = self.wanted + by
        ahead = np.clip(requested, *self.workspace) - self.middle
        self.wanted[:] = self.middle + _shortened(ahead, self.farthest_ahead)
        self._is_limited |= math.dist(requested.tolist(), self.wanted.tolist()) > ARRIVED

    def aim(self, to: FloatArray) -> None:
        """Want it to be at a place [m], as near as its workspace goes, by way of those before.

        Unlike a displacement a place may be far ahead: there it stops.
        """
        place = np.clip(to, *self.workspace)
        self._is_limited |= math.dist(to.tolist(), place.tolist()) > ARRIVED
        self._way.append(place)
        self._shorten_way()

    def turn(self, by: FloatArray) -> None:
        """Turn the wanted pose by a rotation vector [rad], as far as it may be ahead."""
        turn, turned = np.array([1.0, 0.0, 0.0, 0.0]), np.empty(4)
        mujoco.mju_quatIntegrate(turn, by, 1.0)
        mujoco.mju_mulQuat(turned, turn, self.wanted_rotation)
        ahead = np.empty(3)
        mujoco.mju_subQuat(ahead, turned, self.rotation)
        self._is_limited |= math.hypot(*ahead.tolist()) > self.most_ahead_turn
        self.wanted_rotation[:] = self.rotation
        mujoco.mju_quatIntegrate(self.wanted_rotation, _shortened(ahead, self.most_ahead_turn), 1.0)

    def want(self, middle: FloatArray, rotation: FloatArray) -> None:
        """Want it at a pose, however far ahead, as near as the room allows.

        Args:
            middle: Where its middle is to be [m], shape (3,).
            rotation: How it is to be turned (w, x, y, z).
        """
        self._way.clear()
        np.clip(middle, *self.workspace, out=self.wanted)
        self.wanted_rotation[:] = rotation
        self._is_limited |= math.dist(middle.tolist(), self.wanted.tolist()) > ARRIVED

    def put(self, by: FloatArray) -> None:
        """Put it elsewhere at once, by a displacement [m], as far as its workspace goes."""
        self.middle[:] = np.clip(self.middle + by, *self.workspace)
        self.wanted[:] = self.middle
        self._way.clear()

    def rest(self) -> None:
        """Want it to be where it is."""
        self._way.clear()
        self.wanted[:] = self.middle
        self.wanted_rotation[:] = self.rotation

    def step(self) -> bool:
        """Go one frame towards the wanted pose; return whether it was elsewhere."""
        while self._way and math.dist(self.middle.tolist(), self.wanted.tolist()) < PASSES_AT:
            self.wanted[:] = self._way.popleft()
        way, turn = self.wanted - self.middle, np.empty(3)
        mujoco.mju_subQuat(turn, self.wanted_rotation, self.rotation)
        distance, angle = math.hypot(*way.tolist()), math.hypot(*turn.tolist())
        share = self.share()
        if distance > ARRIVED:
            most = self.most_speed * self.dt / distance
            self._is_limited |= most < share
            self.middle += way * min(share, most)
        if angle > ARRIVED_TURN:
            most = self.most_turn_rate * self.dt / angle
            self._is_limited |= most < share
            mujoco.mju_quatIntegrate(self.rotation, turn, min(share, most))
            mujoco.mju_normalize4(self.rotation)
        return distance > ARRIVED or angle > ARRIVED_TURN

    def share(self) -> float:
        """Return the share of the way to the wanted pose that it goes in this frame."""
        return 1.0 - math.exp(-self.dt / self.following_time)

    def _shorten_way(self) -> None:
        """Leave out the oldest places of a way that is too long."""
        places = [self.wanted, *self._way]
        length = sum(math.dist(a.tolist(), b.tolist()) for a, b in pairwise(places))
        while length > MOST_WAY_AHEAD and len(self._way) > 1:
            length -= math.dist(self.wanted.tolist(), self._way[0].tolist())
            self.wanted[:] = self._way.popleft()

    def was_limited(self) -> bool:
        """Return whether a limit has held it back since the last call."""
        was_limited, self._is_limited = self._is_limited, False
        return was_limited


def _shortened(vector: FloatArray, longest: float) -> FloatArray:
    """Return a vector of at most that length."""
    length = math.hypot(*vector.tolist())
    return vector if length <= longest else vector * (longest / length)
