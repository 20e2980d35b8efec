"""Facts about a tissue that the side of the arm must know before the first step."""

from typing import NamedTuple

from tissue import BladeShape, FloatArray, Material


class SceneView(NamedTuple):
    """A camera of a scene, which stands still in the frame of the tissue."""

    name: str
    """Name of it."""
    eye: tuple[float, float, float]
    """Where it is [m]."""
    target: tuple[float, float, float]
    """The point in the middle of its picture [m]."""
    up: tuple[float, float, float]
    """Direction that points to the upper side of the picture."""
    fov_degrees: float
    """Angle from the lower to the upper side of the picture."""


class NamedLabel(NamedTuple):
    """A label of a body, and its name."""

    label: int
    """The label."""
    name: str
    """Its name; empty if it has none."""


class TissueDescription(NamedTuple):
    """Description of a body in another process, for the side of the arm."""

    scene: str
    """Scene that was built, as the command line names it."""
    material: Material
    """Material of the body."""
    bounds: FloatArray
    """Lowest and highest corner now [m], shape (2, 3)."""
    n_tetrahedra: int
    """Number of tetrahedra now."""
    n_nodes: int
    """Number of nodes now."""
    blade: BladeShape | None = None
    """Shape of the blade that cuts the body; None for the paper's blade, a line."""
    floor: float | None = None
    """Height of the floor that pieces land on [m]; None for no floor."""
    views: tuple[SceneView, ...] = ()
    """Cameras of the scene; the first of them at the start."""
    labels: tuple[NamedLabel, ...] = ()
    """Labels of the body, in order; none of a body with one label that has no name."""
    n_cut_faces: int = 0
    """Number of faces that cuts have opened so far."""
