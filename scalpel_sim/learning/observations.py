"""Observations of a policy: arrays of fixed shapes, tissue frame, single precision."""

import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from bridge import InProcessLink
from scalpel_sim.arm.hand import edge_rotation
from scalpel_sim.instruments.driven_grasper import DrivenGrasper
from scalpel_sim.recording.observations import farthest_points
from scalpel_sim.scene.arm_tables import BLADE_NAME
from scalpel_sim.scene.observe_table import POINTS_KEY, SensorTable
from scalpel_sim.scoring.plan import Plan
from scalpel_sim.scoring.score import Score
from scalpel_sim.simulation import Simulation
from tissue import FloatArray, IntArray

N_STATIONS = 16
"""Places of the plan that are shown."""

FARTHEST_SHOWN = 0.5
"""Farthest place from the origin of the tissue that is expected [m]."""

FASTEST_SHOWN, FASTEST_TURN = 2.0, 40.0
"""Highest speed [m/s] and turn rate [rad/s] that are expected."""

LARGEST_FORCE, LARGEST_TORQUE = 100.0, 10.0
"""Largest force [N] and torque [N m] that are expected."""


class Shown(NamedTuple):
    """Shape and bounds of a quantity."""

    names: tuple[str, ...]
    """Name of each number of a row."""
    low: FloatArray
    """Lower bounds, of its shape."""
    high: FloatArray
    """Upper bounds."""


def _shown(names: str, *bounds: tuple[int, float]) -> Shown:
    """Return a quantity of one row.

    Args:
        names: Names of its numbers.
        bounds: How many numbers in turn are within plus or minus a bound.
    """
    high = np.concatenate([np.full(n, bound) for n, bound in bounds])
    return Shown(tuple(names.split()), -high, high)


_BLADE = _shown(
    "x y z qw qx qy qz vx vy vz wx wy wz",
    (3, FARTHEST_SHOWN),
    (4, 1.0),
    (3, FASTEST_SHOWN),
    (3, FASTEST_TURN),
)
_WRENCH = _shown("fx fy fz tx ty tz", (3, LARGEST_FORCE), (3, LARGEST_TORQUE))
_PEAK = Shown(("force",), np.zeros(1), np.full(1, LARGEST_FORCE))
_GRASPER = _shown(
    "x y z qw qx qy qz opening force holds",
    (3, FARTHEST_SHOWN),
    (4, 1.0),
    (1, 0.1),
    (1, 100.0),
    (1, 1.0),
)
_DEPTH = _shown("below_skin below_plan", (2, FARTHEST_SHOWN))


class PlanView:
    """The plan as a policy sees it: places of the line on the skin, or of the surface.

    Args:
        simulation: At its start.
        score: Its score.
    """

    def __init__(self, simulation: Simulation, score: Score) -> None:
        self._link, self._score, plan = simulation.link, score, score.plan
        assert plan is not None
        self.plan = plan
        """The plan."""
        self._rest = stations_of(plan)
        self._nearest = _nearest(plan.surface.points, self._rest, plan.into)
        self._areas = plan.surface.areas
        self._total = np.maximum(np.bincount(self._nearest, self._areas, N_STATIONS), 1e-30)
        self._into = plan.into
        self._depths = _depths(plan, self._rest, self._nearest)
        self._holders: IntArray = np.full(N_STATIONS, -1)
        self._link.positions_of(self._rest, self._holders)
        self._first_holders = self._holders.copy()

    def begin(self) -> None:
        """Begin another episode with this plan."""
        self._holders[:] = self._first_holders

    def rows(self) -> FloatArray:
        """Return where the places are [m], and the share of the plan near each that is cut."""
        at = self._link.positions_of(self._rest, self._holders)
        cut = np.bincount(self._nearest, self._areas * self._score.is_covered, N_STATIONS)
        return np.column_stack([at, cut / self._total])

    @property
    def holders(self) -> IntArray:
        """The tetrahedron that held each place when it was looked up last, or -1."""
        return self._holders

    def depth(self, rows: FloatArray, tip: FloatArray) -> FloatArray:
        """Return how deep the tip is below the nearest place, and below the plan there [m].

        Args:
            rows: What `rows` returned.
            tip: The tip [m], tissue frame.
        """
        ways = tip - rows[:, :3]
        deep = ways @ self._into
        aside = ways - deep[:, None] * self._into
        i = int(np.argmin((aside * aside).sum(axis=1)))
        return np.array([deep[i], deep[i] - self._depths[i]])


def stations_of(plan: Plan) -> FloatArray:
    """Return places that stand for a plan, in the body at rest [m], shape (N_STATIONS, 3).

    They are evenly along its line on the skin, in order; of a surface without a line they are
    spread over it.
    """
    if len(plan.line) < 2:
        points = plan.surface.points
        found = farthest_points(points, min(N_STATIONS, len(points)))
        return np.resize(found, (N_STATIONS, 3))
    along = np.append(0.0, np.linalg.norm(np.diff(plan.line, axis=0), axis=1).cumsum())
    at = np.linspace(0.0, along[-1], N_STATIONS)
    return np.stack([np.interp(at, along, plan.line[:, k]) for k in range(3)], axis=1)


def _nearest(points: FloatArray, stations: FloatArray, into: FloatArray) -> IntArray:
    """Return the nearest station of each place, as seen along the depth, shape (n,)."""
    seen = [each - np.outer(each @ into, into) for each in (points, stations)]
    # |p - s|^2 without |p|^2, which is the same for all stations.
    squares = (seen[1] ** 2).sum(axis=1) - 2.0 * seen[0] @ seen[1].T
    return np.asarray(squares.argmin(axis=1))


def _depths(plan: Plan, stations: FloatArray, nearest: IntArray) -> FloatArray:
    """Return the planned depth below each station [m], shape (N_STATIONS,)."""
    below = ((plan.surface.points - stations[nearest]) * plan.into).sum(axis=1)
    found = np.zeros(N_STATIONS)
    np.maximum.at(found, nearest, below)
    return found


class Sensor:
    """The force sensor of the blade, with its noise and its delay.

    Args:
        settings: Its errors.
        step: Length of a control step [s].
        rng: Draws the noise.
    """

    def __init__(self, settings: SensorTable, step: float, rng: np.random.Generator) -> None:
        self._scale = np.repeat([settings.force, settings.torque], 3)
        self._has_noise, self._rng = bool(self._scale.any()), rng
        self._past = deque[FloatArray](maxlen=round(settings.delay / step) + 1)

    def read(self, wrench: FloatArray) -> FloatArray:
        """Return what it shows where the wrench is this, shape (6,)."""
        self._past.append(wrench)
        shown = self._past[0]
        return shown + self._scale * self._rng.standard_normal(6) if self._has_noise else shown

    def state(self) -> list[list[float]]:
        """Return the wrenches that it has yet to show."""
        return [each.tolist() for each in self._past]

    def return_to(self, state: list[list[float]]) -> None:
        """Return to what `state` returned."""
        self._past.clear()
        self._past.extend(np.array(each) for each in state)


class Observer:
    """Observes a simulation at the end of each control step.

    Args:
        simulation: At its start.
        keys: Names of what is shown.
        step: Length of a control step [s].
    """

    def __init__(self, simulation: Simulation, keys: Sequence[str], step: float) -> None:
        self._simulation, self.keys, self._step = simulation, tuple(keys), step
        self._graspers = {each.name: each for each in simulation.graspers}
        self._makers: dict[str, Callable[[], FloatArray]] = {
            BLADE_NAME: self._blade,
            "wrench": self._wrench,
            "wrench_peak": self._wrench_peak,
            "target": self._target,
            "depth": self._depth,
        }
        self._bounds = {key: (each.low, each.high) for key, each in self.shapes().items()}
        self._plan: PlanView | None = None
        self._sensor: Sensor | None = None
        self._rows: FloatArray | None = None
        self.force = np.zeros(6)
        """Wrench on the blade, mean of the last control step, about its tip, tool frame."""
        self.peak = 0.0
        """Largest force in it [N]."""

    def begin(self, sensor: Sensor) -> None:
        """Begin an episode."""
        score = self._simulation.score
        if not isinstance(score, Score) or score.plan is None:
            self._plan = None
        elif self._plan is not None and self._plan.plan is score.plan:
            self._plan.begin()
        else:
            self._plan = PlanView(self._simulation, score)
        self._sensor = sensor
        self.force, self.peak = np.zeros(6), 0.0
        self._shown_force = sensor.read(self.force)
        self._last = self._now = self._edge()

    def state(self) -> dict[str, Any]:
        """Return what the next observation depends on besides the simulation, as JSON has it."""
        assert self._sensor is not None
        tip, rotation = self._last
        samples = self._simulation.samples.holders()
        return {
            "force": self.force.tolist(),
            "peak": self.peak,
            "sensor": self._sensor.state(),
            "shown_force": self._shown_force.tolist(),
            "last": [tip.tolist(), rotation.tolist()],
            "plan": [] if self._plan is None else self._plan.holders.tolist(),
            "samples": [[n, holders] for n, holders in samples.items()],
        }

    def return_to(self, state: dict[str, Any]) -> None:
        """Return to what `state` returned, after `begin`, in the simulation of then."""
        assert self._sensor is not None
        simulation, link = self._simulation, self._simulation.link
        self.force, self.peak = np.array(state["force"]), state["peak"]
        self._sensor.return_to(state["sensor"])
        self._shown_force = np.array(state["shown_force"])
        tip, rotation = state["last"]
        self._last = np.array(tip), np.array(rotation)
        if self._plan is not None:
            self._plan.holders[:] = state["plan"]
        assert isinstance(link, InProcessLink)
        simulation.samples.hold(link, dict(state["samples"]))

    def shapes(self) -> dict[str, Shown]:
        """Return shape and bounds of each quantity."""
        return {key: self._shape(key) for key in self.keys}

    def _shape(self, key: str) -> Shown:
        if key.startswith(POINTS_KEY):
            return _places(int(key.partition(":")[2]), ("x", "y", "z"))
        if key == "target":
            rows = _places(N_STATIONS, ("x", "y", "z", "cut"))
            rows.low[:, 3], rows.high[:, 3] = 0.0, 1.0
            return rows
        known = {BLADE_NAME: _BLADE, "wrench": _WRENCH, "wrench_peak": _PEAK, "depth": _DEPTH}
        return known.get(key, _GRASPER)

    def after_step(self, force: FloatArray, peak: float) -> dict[str, FloatArray]:
        """Observe the end of a control step.

        Args:
            force: Mean wrench on the blade in it, about its tip, tool frame, shape (6,).
            peak: Largest force in it [N].

        Returns:
            The arrays by name, shape of each as `shapes` has it, single precision. Copies.
        """
        assert self._sensor is not None
        self.force, self.peak = force, peak
        self._shown_force = self._sensor.read(force)
        return self.now()

    def now(self) -> dict[str, FloatArray]:
        """Return the arrays by name, as things are; see `after_step`."""
        self._rows, self._now = None, self._edge()
        found = {key: self._made(key) for key in self.keys}
        self._last = self._now
        shown: dict[str, FloatArray] = {}
        for key, each in found.items():
            low, high = self._bounds[key]
            shown[key] = np.minimum(np.maximum(each, low), high).astype(np.float32)
        return shown

    def _made(self, key: str) -> FloatArray:
        if key in self._makers:
            return self._makers[key]()
        if key in self._graspers:
            return self._grasper(self._graspers[key])
        simulation, n = self._simulation, int(key.partition(":")[2])
        return simulation.samples.positions(simulation.link, n)

    def _edge(self) -> tuple[FloatArray, FloatArray]:
        """Return the tip [m] and the rotation of the blade (w, x, y, z), tissue frame."""
        edge = self._simulation.frame.segment_to_tissue(self._simulation.blade.segment)
        return edge.tip, _canonical(np.array(edge_rotation(edge.numbers)))

    def _blade(self) -> FloatArray:
        (before, turned_before), (tip, rotation) = self._last, self._now
        turn = _turn_between(turned_before, rotation)
        return np.concatenate([tip, rotation, (tip - before) / self._step, turn / self._step])

    def _wrench(self) -> FloatArray:
        return self._shown_force

    def _wrench_peak(self) -> FloatArray:
        return np.array([self.peak])

    def _target_rows(self) -> FloatArray:
        if self._rows is None:
            self._rows = np.zeros((N_STATIONS, 4)) if self._plan is None else self._plan.rows()
        return self._rows

    def _target(self) -> FloatArray:
        return self._target_rows()

    def _depth(self) -> FloatArray:
        if self._plan is None:
            return np.zeros(2)
        return self._plan.depth(self._target_rows(), self._now[0])

    def _grasper(self, grasper: DrivenGrasper) -> FloatArray:
        frame, pads = self._simulation.frame, grasper.grasper.pads
        axes = frame.rotation.T @ pads.axes
        force = math.hypot(*grasper.wrench.numbers[:3])
        return np.concatenate(
            [
                frame.points_to_tissue(pads.centre),
                _canonical(_quaternion(axes)),
                [grasper.grasper.opening, force, float(grasper.holds)],
            ]
        )


def _places(n: int, names: tuple[str, ...]) -> Shown:
    high = np.full((n, len(names)), FARTHEST_SHOWN)
    return Shown(names, -high, high)


def _canonical(rotation: FloatArray) -> FloatArray:
    """Return a quaternion, or its negative, whose first number that is not 0 is positive."""
    first = next(each for each in rotation.tolist() if each != 0.0)
    return -rotation if first < 0.0 else rotation


def _quaternion(axes: FloatArray) -> FloatArray:
    """Return the rotation (w, x, y, z) of axes as columns."""
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(axes).ravel())
    return quaternion


def _turn_between(before: FloatArray, after: FloatArray) -> FloatArray:
    """Return the rotation vector from one rotation to another [rad], shape (3,)."""
    turn, found = np.zeros(3), np.zeros(3)
    mujoco.mju_subQuat(turn, after, before)
    mujoco.mju_rotVecQuat(found, turn, before)
    return found
