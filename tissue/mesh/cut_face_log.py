"""The faces that cuts have opened since the body was made, in the body at rest, in order.

A face is listed once, in the pass that opens it. What later cuts make of its tetrahedra opens
nothing there. So the areas add up to the area that was cut.
"""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import SameTypes, kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.geometry.tetrahedron import face_area
from tissue.mesh.body import Body
from tissue.mesh.changes import Change
from tissue.mesh.cut_faces import BY_BLADE, FINISHED, GIVEN, CutFaces

_ROOM = 256
"""Faces that there is room for at first."""


class FaceList(Arrays):
    """Faces that were cut. Rows beyond `n` are room to grow."""

    corners: FloatArray = sized("faces", 9)
    """Corners at rest [m], shape (room, 9)."""
    area: FloatArray = sized("faces")
    """Areas at rest [m2], shape (room,)."""
    labels: IntArray = sized("faces", 2)
    """Labels of both sides, shape (room, 2)."""
    cause: IntArray = sized("faces")
    """Causes, shape (room,)."""
    time: FloatArray = sized("faces")
    """When they were cut [s], shape (room,)."""
    n: IntCell
    """Number of faces."""
    finished_area: FloatCell
    """Area of finished bridges until now [m2]."""
    now: FloatCell
    """End of the present step [s], since the body was made."""


@kernel
def list_faces(faces: FaceList, body: Body, change: Change, is_given: bool) -> None:
    """List the faces that a pass has opened, for which there is room.

    A pass that finishes bridges opens no other faces.
    """
    cause = GIVEN if is_given else BY_BLADE
    if change.finished_area > faces.finished_area and not is_given:
        cause = FINISHED
    faces.finished_area = change.finished_area
    for row in range(change.n_faces):
        t, f = change.faces[row, 0], change.faces[row, 1]
        if f < 0:  # linked again
            continue
        n, place = faces.n, 0
        for k in range(4):
            if k != f:
                for x in range(3):
                    faces.corners[n, place] = body.rest[body.tetrahedra[t, k], x]
                    place += 1
        faces.area[n] = face_area(body.rest, body.tetrahedra, t, f)
        label = body.materials.label
        faces.labels[n, 0] = label[body.material[t]]
        faces.labels[n, 1] = label[body.material[change.faces[row, 2]]]
        faces.cause[n] = cause
        faces.time[n] = faces.now
        faces.n += 1


_LIST = SameTypes(list_faces)


class CutFaceLog:
    """The list of all faces that were cut in a body, which grows with them."""

    def __init__(self) -> None:
        self._faces = FaceList.new({"faces": _ROOM})
        self.is_given = False
        """Whether faces are now cut along a given surface."""

    def pass_time(self, dt: float) -> None:
        """Begin a step of `dt` [s]."""
        self._faces.now += dt

    def add(self, body: Body, change: Change) -> None:
        """List the faces that a pass of a cut has opened."""
        if change.n_faces == 0:
            return
        room = len(self._faces.area)
        if self._faces.n + change.n_faces > room:
            self._faces = self._faces.grown({"faces": 2 * room + change.n_faces})
        _LIST.call(self._faces, body, change, self.is_given)

    def __len__(self) -> int:
        return self._faces.n

    def since(self, first: int) -> CutFaces:
        """Return the faces from number `first` on.

        Raises:
            ValueError: there are fewer.
        """
        faces, n = self._faces, self._faces.n
        if not 0 <= first <= n:
            raise ValueError(f"there is no face number {first}: {n} were cut so far")
        return CutFaces(
            faces.corners[first:n].reshape(-1, 3, 3).copy(),
            faces.area[first:n].copy(),
            faces.labels[first:n].copy(),
            faces.cause[first:n].copy(),
            faces.time[first:n].copy(),
        )
