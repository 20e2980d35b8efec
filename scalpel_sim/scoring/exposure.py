"""Share of a target that the camera of a task sees, by rays and without a picture."""

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from bridge import TissueFrame
from scalpel_sim.errors import unknown
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.scoring.sampled_surface import parts_of_triangles
from scalpel_sim.simulation import Simulation
from scalpel_sim.vectors import cross_rows
from tissue import BoolArray, FloatArray, IntArray, MaterialPoints, Snapshot, Tissue, boundary_faces

_PLACES = 200
"""Places on the outside of a target to which rays go, about: a share is then right to some 0.01."""

_INSIDE = 1e-6
"""Depth of a place below the outside of the target [m]: a cut along it leaves it with the target,
and nobody sees a micrometre."""

_COVER = 1e-4
"""Distance before a place at which a triangle hides it [m]: twice the depth to which bodies that
lie on each other press in; a place that is seen is `_INSIDE` behind its own triangle."""

_SAME_PLACE = 1e-9
"""Distance in a picture that is rounding, over the size of the target in it."""

_BITS = np.array([1, 2])
"""Bits of two sides of a rectangle."""

_DRAWN = np.array([1, 1, 1, 0, 0, 0], np.uint8)
"""Groups of geoms that cameras see, as MuJoCo's viewers have them."""


class Sight(NamedTuple):
    """Where a camera is, and what it sees: what lies in a cone."""

    eye: FloatArray
    """Where it is [m], tissue frame, shape (3,)."""
    forward: FloatArray
    """Unit vector to the middle of its picture, tissue frame, shape (3,)."""
    half_angle: float
    """From there to the upper side of the picture [rad]."""


class TaskCamera:
    """The camera of a task: a view of the scene, or a camera of the arm's model, which may move.

    Args:
        name: Its name.
        views: Views of the scene.
        model: Model of the arm.

    Raises:
        UsageError: there is no such camera; the message names all.
    """

    def __init__(self, name: str, views: Sequence[ViewTable], model: mujoco.MjModel) -> None:
        cameras = {model.camera(i).name: i for i in range(model.ncam)}
        self._number = cameras.get(name)
        self._view = next((view for view in views if view.name == name), None)
        if self._view is None and self._number is None:
            known = [*(view.name for view in views), *(each for each in cameras if each)]
            raise unknown("camera of [task]", name, known)

    def sight(self, model: mujoco.MjModel, data: mujoco.MjData, frame: TissueFrame) -> Sight:
        """Return what it sees now.

        Args:
            model: Model of the arm.
            data: Where that is.
            frame: Where the tissue lies in the world.
        """
        if self._view is not None:
            eye, way = (
                np.array(self._view.eye, float),
                np.subtract(self._view.target, self._view.eye),
            )
            angle = self._view.fov_degrees
        else:
            number = self._number
            eye = frame.points_to_tissue(data.cam_xpos[number][None])[0]
            way = frame.vectors_to_tissue(-data.cam_xmat[number].reshape(3, 3)[:, 2])
            angle = float(model.cam_fovy[number])
        return Sight(eye, way / np.linalg.norm(way), 0.5 * np.radians(angle))


class TargetOutside(NamedTuple):
    """Places on the skin of a target, each on a triangle of it. They never change.

    Of a target that has none, as it is within other tissue, they are on all of its outside.
    """

    labels: tuple[int, ...]
    """Labels of the target."""
    rest: FloatArray
    """The places, and then the corners of the triangles, at rest [m], shape (n + 3 m, 3)."""
    triangle: IntArray
    """The triangle of each place, shape (n,)."""
    shares: FloatArray
    """Share of each in the area of its triangle, shape (n,)."""


class Exposure:
    """The share of a target that the camera of a task sees.

    Args:
        camera: The camera.
        body: The body before any cut.
        labels: Labels of the target.
    """

    def __init__(self, camera: TaskCamera, body: Snapshot, labels: tuple[int, ...]) -> None:
        self._camera = camera
        self._outside = _outside_of(body, labels)
        n = len(self._outside.rest)
        # `_points` finds its points from here, so that a state that is put back has them too.
        self._holders: IntArray = np.full(n, -1)
        self._points = MaterialPoints(self._outside.rest, self._holders, np.zeros(n))

    def look(self, tissue: Tissue, simulation: Simulation) -> float:
        """Return the share that the camera sees now, as it would see the target alone.

        Each place counts by the angle that it fills at the eye: a place that is turned away does
        not, and one that the target itself hides does not either.
        """
        arm, outside = simulation.arm, self._outside
        sight = self._camera.sight(arm.model, arm.data, simulation.frame)
        n = len(outside.triangle)
        points = tissue.positions_of(self._points) - sight.eye
        places, corners = points[:n], points[n:].reshape(-1, 3, 3)
        sides = cross_rows(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        distances = np.linalg.norm(places, axis=1)
        facing = -(sides[outside.triangle] * places).sum(axis=1)
        angles = outside.shares * np.maximum(facing, 0.0) / distances**3
        surface = tissue.surface()
        hides, triangle = hiding(places, surface.positions - sight.eye, surface.triangles)
        assert surface.labels is not None
        labels = surface.labels[triangle]
        is_own = (labels[:, None] == outside.labels).any(axis=1)
        angles[hides[:, is_own].any(axis=1)] = 0.0
        whole = float(angles.sum())
        if whole == 0.0:
            return 0.0
        is_seen = places @ sight.forward >= np.cos(sight.half_angle) * distances
        is_seen &= ~hides[:, ~is_own].any(axis=1)
        is_seen &= ~_hidden_by_arms(sight.eye, places, distances, simulation)
        return float(angles @ is_seen) / whole


def _outside_of(body: Snapshot, labels: tuple[int, ...]) -> TargetOutside:
    """Return places on the skin of a target; of one that has none, on all of its outside."""
    faces = boundary_faces(body.tetrahedra[np.isin(body.labels, labels)])
    skin = {tuple(face) for face in np.sort(boundary_faces(body.tetrahedra), axis=1).tolist()}
    is_skin = np.array([tuple(face) in skin for face in np.sort(faces, axis=1).tolist()])
    if is_skin.any():
        faces = faces[is_skin]
    corners = body.rest_positions[faces]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = 0.5 * np.linalg.norm(sides, axis=1)
    inward = -_INSIDE * sides / (2.0 * areas[:, None])
    # Parts of a triangle are about half the square of their longest side.
    spacing = (2.0 * float(areas.sum()) / _PLACES) ** 0.5
    parts = [parts_of_triangles(each, spacing) for each in corners]
    triangle = np.repeat(np.arange(len(faces)), [len(each.areas) for each in parts])
    middles = np.concatenate([each.middles for each in parts]) + inward[triangle]
    shares = np.concatenate([each.areas for each in parts]) / areas[triangle]
    # Corners move a little to the middle of their triangle too: on the rim they are in the target.
    middle = corners.mean(axis=1, keepdims=True)
    near = corners + _INSIDE * (middle - corners) / np.linalg.norm(
        middle - corners, axis=2, keepdims=True
    )
    near += inward[:, None]
    return TargetOutside(labels, np.concatenate([middles, near.reshape(-1, 3)]), triangle, shares)


def hiding(
    places: FloatArray, vertices: FloatArray, triangles: IntArray
) -> tuple[BoolArray, IntArray]:
    """Return which triangles hide which places from an eye at the origin.

    What a ray enters first faces the eye, so only such triangles are looked at; and of them only
    those that are before some place as the eye sees it.

    Args:
        places: Where they are [m], shape (n, 3).
        vertices: Corners of the triangles [m], shape (n_vertices, 3).
        triangles: Counter-clockwise seen from outside, shape (n_triangles, 3).

    Returns:
        Whether each hides each place, shape (n, m), and which triangles these are, shape (m,).
    """
    before = np.flatnonzero(_may_be_before(places, vertices, triangles))
    a, b, c = (vertices[triangles[before, i]] for i in range(3))
    over = cross_rows(b, c)
    # Six times the volume between eye and triangle: below 0 where its outside faces the eye.
    volumes = (a * over).sum(axis=1)
    facing = np.flatnonzero(volumes < 0.0)
    a, b, c, volumes = a[facing], b[facing], c[facing], volumes[facing]
    sides = [places @ each.T for each in (over[facing], cross_rows(c, a), cross_rows(a, b))]
    hides = (sides[0] <= 0.0) & (sides[1] <= 0.0) & (sides[2] <= 0.0)
    # The ray meets it at volume / whole of the way to the place.
    whole = sides[0] + sides[1] + sides[2]
    hides &= whole * (1.0 - _COVER / np.linalg.norm(places, axis=1))[:, None] < volumes
    return hides, before[facing]


def _may_be_before(places: FloatArray, vertices: FloatArray, triangles: IntArray) -> BoolArray:
    """Return which triangles may be on a ray to a place; see `hiding`. Shape (n_triangles,).

    The picture of a triangle is within the rectangle around those of its corners. Triangles that
    are not wholly before the eye have no such picture: of them none is left out.
    """
    forward = places.mean(axis=0)
    right = cross_rows(forward, np.eye(3)[np.argmin(np.abs(forward))])
    axes = np.stack([right, cross_rows(right, forward), forward], axis=1)
    seen, of_places = vertices @ axes, places @ axes
    if not (of_places[:, 2] > 0.0).all():
        return np.ones(len(triangles), np.bool_)
    is_ahead = seen[:, 2] > 0.0
    pictures = seen[:, :2] / np.where(is_ahead, seen[:, 2], 1.0)[:, None]
    of_places = of_places[:, :2] / of_places[:, 2:]
    low, high = of_places.min(axis=0), of_places.max(axis=0)
    margin = _SAME_PLACE * (high - low)
    # A bit for each side of the rectangle on which a corner is.
    sides = (pictures < low - margin) @ _BITS + (pictures > high + margin) @ (4 * _BITS)
    sides[~is_ahead] = 0
    common = sides[triangles[:, 0]] & sides[triangles[:, 1]] & sides[triangles[:, 2]]
    return np.asarray(common == 0)


def _hidden_by_arms(
    eye: FloatArray, ways: FloatArray, distances: FloatArray, simulation: Simulation
) -> BoolArray:
    """Return which places a part of an arm or of what stands around hides.

    Args:
        eye: Where the camera is [m], tissue frame, shape (3,).
        ways: From there to the places [m], shape (n, 3).
        distances: Their lengths [m], shape (n,).
        simulation: With the arms as they are.
    """
    arm, frame, n = simulation.arm, simulation.frame, len(ways)
    from_eye = frame.points_to_world(eye[None])[0]
    along = np.ascontiguousarray(frame.vectors_to_world(ways / distances[:, None])).ravel()
    met, found = np.empty(n, np.int32), np.empty(n)
    farthest = float(distances.max())
    mujoco.mj_multiRay(
        arm.model, arm.data, from_eye, along, _DRAWN, True, -1, met, found, None, n, farthest
    )
    return np.asarray((found >= 0.0) & (found < distances - _COVER))
