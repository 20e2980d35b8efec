"""`SavedStep`: one instant of a recorded run."""

from collections.abc import Mapping
from typing import NamedTuple

from tissue import (
    BladeSegment,
    Deformation,
    Energies,
    FloatArray,
    Snapshot,
    Surface,
    SurfaceQuantity,
    Wrench,
)


class SavedStep(NamedTuple):
    """A run at one instant. Copies; lengths, forces and fields of the body in single precision."""

    number: int
    """Number of the step, from 0."""
    time: float
    """Simulated time [s]."""
    snapshot: Snapshot
    """The body, tissue frame. Masses that mass scaling added are not recorded: they are 0."""
    deformation: Deformation
    """Stress and strain of the tetrahedra."""
    cut_age: FloatArray
    """Time since which each node is on a face of a cut [s]; NaN: it is on none."""
    surface: Surface
    """The surface, tissue frame."""
    surface_values: Mapping[SurfaceQuantity, FloatArray]
    """Quantities at the vertices of the surface; see `tissue.Tissue.surface_values`."""
    wrench: Wrench
    """Wrench of the tissue on the blade, world frame."""
    blade: BladeSegment
    """Edge of the blade, world frame."""
    body_poses: FloatArray
    """Position [m] and quaternion (w, x, y, z) of the bodies of the arm's model, world frame, shape
    (n_bodies, 7)."""
    camera_poses: FloatArray
    """The same of the cameras of the model, which look along their -z: see `Stage.cameras`; shape
    (n_cameras, 7)."""
    cut_area: float
    """Area cut since the start [m2]."""
    force_parts: FloatArray
    """Force of the tissue on the blade in parts, of the edge, of the faces, and of friction [N],
    tissue frame, shape (3, 3); NaN before the first frame."""
    energies: Energies | None
    """Energy balance; None without an audit."""
    grasper_forces: FloatArray
    """Force of the tissue on each grasper [N], world frame, shape (n_graspers, 3)."""
    contact_points: FloatArray
    """Points at which the tissue acts on the blade [m], world frame, shape (n, 3)."""
    contact_forces: FloatArray
    """Force on the blade at each of these points [N], world frame, shape (n, 3)."""
