"""Blade and graspers as a person leads them, and records of where they were led."""

import abc

import mujoco
import numpy as np

from bridge import TissueFrame
from scalpel_sim.arm.grasper import HALF_PAD, GuidedGrasper
from scalpel_sim.arm.hand import Hand
from scalpel_sim.hands.limited_pose import LimitedPose
from scalpel_sim.instruments.blade_instrument import BLADE
from scalpel_sim.instruments.stroke_follower import StrokeFollower
from scalpel_sim.strokes.grasp_motion import GraspMotion, Waypoint, edge_of_grasper
from scalpel_sim.strokes.stroke import Stroke, poses_of_edges
from scalpel_sim.tables.values import WIDEST_OPENING
from tissue import BladeSegment, FloatArray

JAW_SPEED = 0.03
"""Speed at which the pads come together, and apart [m/s]: the scripts of the scenes close them by
9 mm in 0.3 s."""


class LiveInstrument(abc.ABC):
    """An instrument that a person leads when they have chosen it, and which rests else.

    Its pose leads the hand to the same bits as a stroke with that pose in a row does.

    Args:
        name: Name on the page.
        hand: Holds the instrument already, at the start.
        start: Its edge at first, tissue frame.
        frame: Where the tissue lies in the world.
        workspace: Lowest and highest place of the middle of the edge [m], shape (2, 3).
        dt: Length of a frame [s].
    """

    def __init__(
        self,
        name: str,
        hand: Hand,
        start: BladeSegment,
        frame: TissueFrame,
        workspace: FloatArray,
        dt: float,
    ) -> None:
        self.name = name
        """Name on the page."""
        self._frame, self._dt = frame, dt
        path = Stroke([0.0, 1.0], [start, start])
        self._row = path.path[0]
        self._follower = StrokeFollower(hand, path, frame)
        self.half = float(self._row[2])
        """Half the length of the edge [m]."""
        # The edge is turned so: its +y is along it, and its -z cuts.
        self.pose = LimitedPose(self._row[10:13], self._row[3:7], workspace, dt)
        """Where it is, and where it is wanted."""
        self._record = PoseRecord()

    @property
    @abc.abstractmethod
    def is_closed(self) -> bool | None:
        """Whether its jaws are closed, or on their way there; None: it has none."""

    @property
    @abc.abstractmethod
    def numbers(self) -> list[float]:
        """Where it is led, tissue frame, what of it is led first, and how far its jaws are open."""

    @property
    def tip(self) -> FloatArray:
        """Place of it that is led, in the world [m], shape (3,)."""
        return self._frame.points_to_world(np.array(self.numbers[:3]))

    @property
    def back(self) -> FloatArray:
        """Direction from what is led back along the instrument, world frame, shape (3,)."""
        return self._frame.vectors_to_world(-self.axes[1])

    @property
    @abc.abstractmethod
    def normal(self) -> FloatArray:
        """Unit normal of the plane in which it works, world frame, shape (3,).

        A blade cuts in its own plane. A grasper goes to tissue, closes and lifts in that of its
        jaws.
        """

    def put(self, by: FloatArray) -> None:
        """Put it elsewhere at once, as far as its workspace goes: by a displacement [m].

        Args:
            by: Tissue frame, shape (3,).
        """
        self.pose.put(by)
        self._take_edge(self._edge_at(self.pose.middle, self.axes))

    def aim(self, to: FloatArray) -> None:
        """Want what is led to be at a place [m], world frame."""
        lever = np.array(self.numbers[:3]) - self.pose.middle
        self.pose.aim(self._frame.points_to_tissue(to) - lever)

    @abc.abstractmethod
    def close_jaws(self, closed: bool) -> None:
        """Close or open its jaws, if it has any."""

    def advance(self, t: float, *, is_engaged: bool, moves: bool) -> None:
        """Continue to time `t` [s], and record where it is.

        Args:
            t: A frame after the last one [s].
            is_engaged: Whether a person leads it.
            moves: Whether it continues; else it rests where it is.
        """
        if moves and self._record.has_begun:  # the record begins at the start
            if self.pose.step():
                self._take_edge(self._edge_at(self.pose.middle, self.axes))
            self._move_jaws()
        self._record.add(t, [*self.numbers, float(is_engaged)])

    @property
    def axes(self) -> FloatArray:
        """Directions across the edge, along it and back from it, tissue frame, shape (3, 3)."""
        axes = np.empty(9)
        mujoco.mju_quat2Mat(axes, self.pose.rotation)
        return axes.reshape(3, 3).T

    @abc.abstractmethod
    def _edge_at(self, middle: FloatArray, axes: FloatArray) -> BladeSegment:
        """Return the edge of the pose that leads, as it is read from the record, and keep the pose.

        Args:
            middle: The middle of the edge [m], shape (3,).
            axes: Directions across it, along it and back from it, shape (3, 3).
        """

    def _take_edge(self, edge: BladeSegment) -> None:
        """Lead to an edge of the same length."""
        tip, heel, forward = (part[None] for part in edge)
        middles, rotations, _ = poses_of_edges(tip, heel, forward)
        self._row[3:7], self._row[10:13] = rotations[0], middles[0]

    @abc.abstractmethod
    def _move_jaws(self) -> None:
        """Move its jaws by one frame, if it has any."""

    def lead(self, t: float) -> None:
        """Lead it to its pose at time `t` [s], a step after the last one."""
        self._follower.lead(t)

    def finish(self, t: float) -> None:
        """End its record at time `t` [s]."""
        self._record.finish(t)

    def state(self) -> dict[str, list[float]]:
        """Return what leads it on from here, besides its record and a way that it was sent."""
        pose = self.pose
        places = (pose.middle, pose.rotation, pose.wanted, pose.wanted_rotation)
        return {"row": self._row.tolist(), "pose": np.concatenate(places).tolist()}

    def return_to(self, state: dict[str, list[float]]) -> None:
        """Return to what `state` returned; the record begins there."""
        pose = self.pose
        pose.rest()
        self._row[:] = state["row"]
        places = np.split(np.array(state["pose"]), (3, 7, 10))
        for array, now in zip(
            (pose.middle, pose.rotation, pose.wanted, pose.wanted_rotation), places, strict=True
        ):
            array[:] = now
        self._record.take_rows()

    def take_rows(self) -> list[list[float]]:
        """Return the rows that were recorded since the last call."""
        return self._record.take_rows()


class LiveBlade(LiveInstrument):
    """A blade that a person leads. Its rows are those of `LED_COLUMNS`.

    Args:
        hand: Holds the blade already, at the start.
        start: Where it rests at first, tissue frame.
        frame: Where the tissue lies in the world.
        workspace: Lowest and highest place of the middle of the edge [m], shape (2, 3).
        dt: Length of a frame [s].
    """

    is_closed = None

    def __init__(
        self,
        hand: Hand,
        start: BladeSegment,
        frame: TissueFrame,
        workspace: FloatArray,
        dt: float,
    ) -> None:
        super().__init__(BLADE, hand, start, frame, workspace, dt)
        self._numbers = [float(number) for part in start for number in part]

    @property
    def numbers(self) -> list[float]:
        """Tip, heel and forward of the pose that leads, tissue frame."""
        return self._numbers

    @property
    def normal(self) -> FloatArray:
        """See `LiveInstrument.normal`."""
        return self._frame.vectors_to_world(self.axes[0])

    def state(self) -> dict[str, list[float]]:
        """See `LiveInstrument.state`."""
        return super().state() | {"numbers": self._numbers}

    def return_to(self, state: dict[str, list[float]]) -> None:
        """See `LiveInstrument.return_to`."""
        super().return_to(state)
        self._numbers = list(state["numbers"])

    def close_jaws(self, closed: bool) -> None:
        """Do nothing: it has none."""

    def _move_jaws(self) -> None:
        """Do nothing: it has none."""

    def _edge_at(self, middle: FloatArray, axes: FloatArray) -> BladeSegment:
        """See `LiveInstrument._edge_at`: a `Stroke` rounds the pose once more."""
        _, along, back = axes
        to_tip = self.half * along
        edge = BladeSegment(middle + to_tip, middle - to_tip, -back)
        self._numbers = [number for part in edge for number in part.tolist()]
        return edge


class LiveGrasper(LiveInstrument):
    """A grasper that a person leads. Its rows are those of `GRASP_COLUMNS`.

    Its jaws close and open as far as they do in a motion. Where they only rest there, they close
    and open as far as they can.

    Args:
        grasper: At the start of the motion.
        motion: Where it rests at first, tissue frame.
        frame: Where the tissue lies in the world.
        workspace: Lowest and highest place of the middle between the pads [m], shape (2, 3).
        dt: Length of a frame [s].
    """

    def __init__(
        self,
        grasper: GuidedGrasper,
        motion: GraspMotion,
        frame: TissueFrame,
        workspace: FloatArray,
        dt: float,
    ) -> None:
        edge = _edge_of(motion.start, motion.name)
        super().__init__(motion.name, grasper.hand, edge, frame, workspace, dt)
        self._grasper, self._at = grasper, motion.start
        has_moved_jaws = motion.pads[0] < motion.pads[1]
        self._closed, self._open = motion.pads if has_moved_jaws else (0.0, WIDEST_OPENING)
        self._wanted_opening = motion.start.opening

    @property
    def is_closed(self) -> bool:
        """Whether its jaws are closed, or on their way there."""
        return self._wanted_opening < 0.5 * (self._closed + self._open)

    @property
    def numbers(self) -> list[float]:
        """Place, approach, across and opening, tissue frame."""
        return [*(float(number) for part in self._at[1:4] for number in part), self._at.opening]

    @property
    def normal(self) -> FloatArray:
        """See `LiveInstrument.normal`."""
        return self._frame.vectors_to_world(self.axes[2])

    def state(self) -> dict[str, list[float]]:
        """See `LiveInstrument.state`."""
        jaws = [self._at.opening, self._wanted_opening]
        return super().state() | {"numbers": self.numbers[:9], "jaws": jaws}

    def return_to(self, state: dict[str, list[float]]) -> None:
        """See `LiveInstrument.return_to`."""
        super().return_to(state)
        at, approach, across = (state["numbers"][i : i + 3] for i in (0, 3, 6))
        opening, self._wanted_opening = state["jaws"]
        self._at = self._at._replace(at=at, approach=approach, across=across, opening=opening)

    def close_jaws(self, closed: bool) -> None:
        """Close or open the jaws."""
        self._wanted_opening = self._closed if closed else self._open

    def lead(self, t: float) -> None:
        """Lead it to its pose and opening at time `t` [s], a step after the last one."""
        super().lead(t)
        self._grasper.open_to(self._at.opening)

    def _edge_at(self, middle: FloatArray, axes: FloatArray) -> BladeSegment:
        """See `LiveInstrument._edge_at`: a `GraspMotion` reads it so."""
        across, along, _ = axes.tolist()
        self._at = self._at._replace(at=middle.tolist(), approach=along, across=across)
        return _edge_of(self._at, self.name)

    def _move_jaws(self) -> None:
        """Move the jaws by one frame towards the wanted opening."""
        step = JAW_SPEED * self._dt
        way = self._wanted_opening - self._at.opening
        to = self._wanted_opening if abs(way) <= step else self._at.opening + np.sign(way) * step
        self._at = self._at._replace(opening=float(to))


def _edge_of(at: Waypoint, name: str) -> BladeSegment:
    """Return the edge between the pads of a grasper."""
    return edge_of_grasper(at, HALF_PAD, HALF_PAD, name)


class PoseRecord:
    """Record of a hand, frame by frame. Of rows in turn that are the same, two are enough."""

    def __init__(self) -> None:
        self._rows: list[list[float]] = []
        self._last: tuple[float, list[float]] | None = None
        self._is_kept = False

    @property
    def has_begun(self) -> bool:
        """Whether there is a row yet."""
        return self._last is not None

    def add(self, t: float, row: list[float]) -> None:
        """Record a row at time `t` [s], and the one before where that had been left out.

        Of rows in turn that are the same, the first and the last are enough.
        """
        is_new = self._last is None or self._last[1] != row
        if is_new:
            if self._last is not None and not self._is_kept:
                self._rows.append([self._last[0], *self._last[1]])
            self._rows.append([t, *row])
        self._last, self._is_kept = (t, row), is_new

    def finish(self, t: float) -> None:
        """End the record at time `t` [s] with the last row."""
        if self._last is not None and (t > self._last[0] or not self._is_kept):
            self._rows.append([t, *self._last[1]])

    def take_rows(self) -> list[list[float]]:
        """Return the rows since the last call, each after its time."""
        rows, self._rows = self._rows, []
        return rows
