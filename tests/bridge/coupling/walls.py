"""A wall that pushes back like a spring: a tissue without memory, with exactly known answers."""

import numpy as np

from bridge.description import TissueDescription
from bridge.driven import GeomLoads, no_geom_loads
from tissue import (
    AddedMass,
    BladeSegment,
    BladeSweep,
    BodyContacts,
    Chunks,
    FloatArray,
    Material,
    RigidContacts,
    StageTimes,
    StepResult,
    Wrench,
)

N_POINTS = 5
"""Number of points on the edge, equally spaced from tip to heel; they share the stiffness."""


class Wall:
    """A half-space behind a plane, which pushes points of the edge out, without friction.

    Args:
        point: Point on the plane [m].
        normal: Unit vector out of the wall.
        stiffness: Stiffness against the whole edge [N/m].
        reported: Share of the stiffness that results report. With 0 the last wrench can only be
            held.
    """

    def __init__(
        self, point: FloatArray, normal: FloatArray, stiffness: float, reported: float = 1.0
    ) -> None:
        self._point, self._normal = np.array(point, float), np.array(normal, float)
        self._stiffness = stiffness
        self._reported = reported
        self._work = 0.0
        self.impulse = np.zeros(3)
        """Impulse of the wall on the edge since the start [N s]."""

    def describe(self) -> TissueDescription:
        everywhere = np.array([[-1.0] * 3, [1.0] * 3])
        return TissueDescription("wall", Material(), everywhere, 1, 4)

    def chunks(self) -> Chunks:
        return Chunks(np.array([[[-1.0] * 3, [1.0] * 3]]), 0.0)

    def loads(self) -> tuple[()]:
        return ()

    def geom_loads(self) -> GeomLoads:
        return no_geom_loads(0)

    def step(self, sweep: BladeSweep | None, dt: float, *led: object) -> StepResult:
        assert sweep is not None
        start, end = _points(sweep.t0), _points(sweep.t1)
        each = self._stiffness / N_POINTS
        depth_t0, depth_t1 = (self._depth(points) for points in (start, end))
        mean_forces = each * _mean_of_positive(depth_t0, depth_t1)
        forces_t1 = each * np.maximum(depth_t1, 0.0)
        pressed = np.maximum(depth_t1, 0.0) ** 2 - np.maximum(depth_t0, 0.0) ** 2
        self._work += 0.5 * each * pressed.sum()
        lever = end - sweep.t1.tip
        turning = np.concatenate(
            [np.tile(self._normal, (N_POINTS, 1)), np.cross(lever, self._normal)], axis=1
        )
        touching = turning[depth_t1 > 0.0]
        wrench = self._wrench(mean_forces, lever, sweep.t1.tip)
        self.impulse += dt * wrench.force
        n = len(touching)
        return StepResult(
            wrench=wrench,
            wrench_t1=self._wrench(forces_t1, lever, sweep.t1.tip),
            stiffness=self._reported * each * touching.T @ touching,
            contacts=RigidContacts(
                point=end[depth_t1 > 0.0],
                normal=np.tile(-self._normal, (n, 1)),
                normal_force=forces_t1[depth_t1 > 0.0],
                friction=np.zeros((n, 3)),
                cut_area=np.zeros(n),
                geom=np.full(n, -1),
            ),
            force_on_tissue=-wrench.force,
            bounds=self.describe().bounds,
            n_tetrahedra=1,
            n_nodes=4,
            n_active=0,
            active_point_tetrahedron=-1,
            anchored_length=n / N_POINTS * float(np.linalg.norm(sweep.t1.heel - sweep.t1.tip)),
            cut_area=0.0,
            finished_area=0.0,
            work_of_blade=self._work,
            work_of_cutting=0.0,
            n_substeps=1,
            body_contacts=BodyContacts(0, 0.0, 0.0, np.zeros(3)),
            stage_times=StageTimes(0.0, 0.0, 0.0),
            added_mass=AddedMass(0.0, *np.zeros((4, 3))),
            energies=None,
            cutting_of_labels=np.zeros(0),
            force_of_labels=np.zeros(0),
        )

    def _depth(self, points: FloatArray) -> FloatArray:
        return (self._point - points) @ self._normal

    def _wrench(self, sizes: FloatArray, lever: FloatArray, tip: FloatArray) -> Wrench:
        forces = sizes[:, None] * self._normal
        return Wrench(forces.sum(axis=0), np.cross(lever, forces).sum(axis=0), tip.copy())


def _points(segment: BladeSegment) -> FloatArray:
    along = np.linspace(0.0, 1.0, N_POINTS)[:, None]
    return segment.tip + along * (segment.heel - segment.tip)


def _mean_of_positive(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the mean of max(0, x) while x changes from a to b at a constant rate."""
    inside = np.maximum(np.maximum(a, b), 0.0) ** 2 - np.maximum(np.minimum(a, b), 0.0) ** 2
    span = np.abs(b - a)
    return np.where(span > 1e-15, 0.5 * inside / np.maximum(span, 1e-15), np.maximum(a, 0.0))
