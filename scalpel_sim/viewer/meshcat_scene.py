"""Draws a run into a meshcat scene that someone else owns, by meshcat's own Python package.

meshcat's server answers each request, and its sockets belong to one thread. So a thread of its own
sends, over a connection of its own, and the run never waits.
"""

import logging
import threading
from collections.abc import Sequence
from typing import Generic, TypeVar

import meshcat.geometry as mc
import numpy as np
import zmq
from meshcat.visualizer import ViewerWindow, Visualizer

from bridge import TissueFrame
from scalpel_sim.errors import UsageError
from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.model_shapes import Shape, position_and_rotation
from scalpel_sim.viewer.scene3d import Readings
from scalpel_sim.viewer.scene_packets import ARROW_LENGTH, TARGET_OPACITY
from tissue import CUT_COLOUR, SKIN_COLOUR, FloatArray, Surface

_log = logging.getLogger(__name__)

PATIENCE = 3.0
"""Time in which meshcat's server answers, before it counts as gone [s]. It usually takes a
millisecond."""

HEAD_LENGTH = 0.3
"""Length of the head of the force arrow, over that of the arrow."""

SHAFT_RADIUS = 0.04

HEAD_RADIUS = 0.1
"""Radii of the force arrow, over the length that stands for a newton."""

ARROW_COLOUR = 0xFFB000

SHORTEST_ARROW = 1e-6
"""Length of the arrow of no force [m]: the matrix of one without a length has no inverse."""

_Message = TypeVar("_Message")


def expect_visualizer(candidate: object) -> None:
    """Raise a `UsageError` where something is no meshcat scene."""
    if not isinstance(candidate, Visualizer):
        raise UsageError(
            f"visualizer: a {type(candidate).__name__} is no meshcat scene; give it a "
            "meshcat.Visualizer(), or a part of one such as meshcat.Visualizer()['tissue']"
        )


class MeshcatScene:
    """Draws scene states below a path of a meshcat scene, in a thread of its own.

    The path is in the world frame. Below it are `body`, `bodies/NUMBER/NAME` for the shapes of the
    MuJoCo model, and `force`. What the owner draws elsewhere is left alone.

    Args:
        visualizer: The owner's `meshcat.Visualizer`, or a part of one.
        shapes: Visible shapes of the MuJoCo model.
        frame: Pose of the tissue frame in the world.
    """

    def __init__(self, visualizer: Visualizer, shapes: Sequence[Shape], frame: TissueFrame) -> None:
        self._address, self._path = visualizer.window.zmq_url, visualizer.path
        self._shapes, self._frame = shapes, frame
        self._bodies = sorted({shape.body for shape in shapes})
        self._states: NewestMessage[SceneState] = NewestMessage()
        self._sender = threading.Thread(target=self._send_states, name="meshcat", daemon=True)
        self._sender.start()

    @property
    def is_drawn(self) -> bool:
        """Whether states are drawn: until it is closed, or meshcat's server does not answer."""
        return self._sender.is_alive()

    def show(self, state: SceneState) -> None:
        """Draw a state. Returns immediately; one that still waits is dropped."""
        self._states.put(state)

    def close(self) -> None:
        """Draw the last state, and end. The scene stays as it is."""
        self._states.close()
        self._sender.join(PATIENCE)

    def _send_states(self) -> None:
        """Draw the states that come, until there are no more or the server does not answer."""
        scene = Visualizer.view_into(_Connection(self._address), self._path)
        try:
            self._draw_what_stays(scene)
            while (state := self._states.take()) is not None:
                self._draw(scene, state)
        except zmq.ZMQError as error:
            fault = "does not answer" if isinstance(error, zmq.Again) else f"fails ({error})"
            _log.warning(
                "meshcat's server at %s %s; nothing more is drawn there", self._address, fault
            )
        finally:
            scene.window.zmq_socket.close()

    def _draw_what_stays(self, scene: Visualizer) -> None:
        """Draw the shapes of the model, and the arrow of the force."""
        scene["body"].set_transform(_matrix(self._frame.origin, self._frame.rotation))
        for shape in self._shapes:
            at = scene["bodies"][str(shape.body)][shape.name.replace("/", "_")]
            mesh = shape.mesh
            at.set_object(mc.TriangularMeshGeometry(mesh.positions, mesh.triangles), _paint(shape))
            at.set_transform(_matrix(*position_and_rotation(shape.pose)))
        paint = mc.MeshLambertMaterial(color=ARROW_COLOUR)
        shaft_length = 1.0 - HEAD_LENGTH
        for name, middle, geometry in (
            ("shaft", shaft_length / 2.0, mc.Cylinder(shaft_length)),
            ("head", 1.0 - HEAD_LENGTH / 2.0, mc.Cylinder(HEAD_LENGTH, 1.0, 0.0, 1.0)),
        ):
            radius = SHAFT_RADIUS if name == "shaft" else HEAD_RADIUS
            part = scene["force"][name]
            part.set_object(geometry, paint)
            part.set_transform(
                _matrix(np.array([0.0, middle, 0.0]), np.diag([radius, 1.0, radius]))
            )
        scene["force"].set_transform(_matrix(np.zeros(3), SHORTEST_ARROW * np.eye(3)))

    def _draw(self, scene: Visualizer, state: SceneState) -> None:
        """Draw one state."""
        scene["body"].set_object(
            _tissue_geometry(state.surface), mc.MeshPhongMaterial(vertexColors=True)
        )
        for body in self._bodies:
            pose = position_and_rotation(state.body_poses[body])
            scene["bodies"][str(body)].set_transform(_matrix(*pose))
        if state.readings is not None:
            newton = ARROW_LENGTH * float(np.linalg.norm(np.ptp(state.surface.positions, axis=0)))
            scene["force"].set_transform(_arrow(state.readings, newton))


class _Connection(ViewerWindow):  # type: ignore[misc]
    """A connection to a server that runs. Unlike its base it does not print the address."""

    def __init__(self, address: str) -> None:
        self.zmq_url = address
        self.connect_zmq()
        self.zmq_socket.setsockopt(zmq.RCVTIMEO, round(1e3 * PATIENCE))
        self.zmq_socket.setsockopt(zmq.LINGER, 0)  # the end of the process waits for no server


class NewestMessage(Generic[_Message]):
    """Holds the newest message until it is taken. One that comes before replaces it."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._waiting: _Message | None = None
        self._is_closed = False

    def put(self, message: _Message) -> None:
        """Leave a message, and return immediately."""
        with self._changed:
            self._waiting = message
            self._changed.notify()

    def take(self) -> _Message | None:
        """Wait for a message and return it; None when it was closed and holds none."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting is not None or self._is_closed)
            message, self._waiting = self._waiting, None
            return message

    def close(self) -> None:
        """Inform the thread that takes that no more messages come."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()


def _tissue_geometry(surface: Surface) -> mc.TriangularMeshGeometry:
    """Return the triangles of skin and cut faces, which share no vertices, in two colours."""
    points, triangles = surface.positions, surface.triangles
    colours = np.array([SKIN_COLOUR[:3], CUT_COLOUR[:3]]) / 255.0
    return mc.TriangularMeshGeometry(
        np.concatenate([points, points]),
        triangles + len(points) * surface.is_cut[:, None],
        np.repeat(colours, len(points), axis=0),
    )


def _paint(shape: Shape) -> mc.MeshPhongMaterial:
    """Return the material of a shape of the model."""
    red, green, blue = (round(255.0 * float(c)) for c in np.clip(shape.colour[:3], 0.0, 1.0))
    opacity = float(shape.colour[3]) * (TARGET_OPACITY if shape.is_target else 1.0)
    return mc.MeshPhongMaterial(color=red << 16 | green << 8 | blue, opacity=opacity)


def _matrix(position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the homogeneous matrix, shape (4, 4), of a position and a rotation or scale."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, position
    return matrix


def _arrow(readings: Readings, newton: float) -> FloatArray:
    """Return the matrix that turns the unit arrow along y into that of the force.

    Args:
        readings: The force and its point.
        newton: Length of the arrow of a newton [m].
    """
    force = np.asarray(readings.force, float)
    size = float(np.linalg.norm(force))
    length = max(size * newton, SHORTEST_ARROW)
    along = force / size if size > 0.0 else np.array([0.0, 1.0, 0.0])
    side = np.cross(along, np.eye(3)[np.abs(along).argmin()])
    side /= np.linalg.norm(side)
    rotation = np.stack([side, along, np.cross(side, along)], axis=1)
    thickness = min(newton, length)
    return _matrix(readings.point, rotation * [thickness, length, thickness])
