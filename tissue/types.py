"""Values that cross the border of the engine. Plain data, no behaviour.

SI units. Every vector in this package is in the tissue frame. The suffixes `_t0` and `_t1` mean
the start and the end of a step.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tissue.core.array_types import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:  # loading trimesh takes 0.3 s, and only `Surface.to_trimesh` needs it
    from trimesh import Trimesh

SKIN_COLOUR = (156, 63, 50, 255)
CUT_COLOUR = (212, 68, 60, 255)
"""Red, green, blue and opacity of skin and of cut faces in exported meshes, 0 to 255 (sRGB)."""


class BladeSegment(NamedTuple):
    """The cutting edge at one instant: the paper's thin line, and the way it faces."""

    tip: FloatArray
    """Sharp end [m], shape (3,)."""
    heel: FloatArray
    """End nearest the handle [m], shape (3,)."""
    forward: FloatArray
    """Unit vector across the edge, in the plane of the blade, in which it cuts; shape (3,)."""


class BladeSweep(NamedTuple):
    """The cutting edge at the start and at the end of a step."""

    t0: BladeSegment
    t1: BladeSegment


class Wrench(NamedTuple):
    """A force and a torque, and the point they act at."""

    force: FloatArray
    """[N], shape (3,)."""
    torque: FloatArray
    """[N m] about `point`, shape (3,)."""
    point: FloatArray
    """[m], shape (3,)."""


class BladeContacts(NamedTuple):
    """Where the blade acts on the tissue at the end of a step. Views, valid until the next step.

    First the samples of the edge that hold tissue, then the points of the tissue that touch the
    faces of the blade.
    """

    point: FloatArray
    """[m], shape (n, 3)."""
    normal: FloatArray
    """Unit vector out of the blade into the tissue, shape (n, 3): forward for a sample of the
    edge, out of the face for another point."""
    normal_force: FloatArray
    """Of the blade on the tissue along the normal [N], shape (n,)."""
    friction: FloatArray
    """The rest of that force [N], shape (n, 3): friction, and at the edge what holds it sideways
    and along."""
    cut_area: FloatArray
    """Area that each sample of the edge has cut in this step [m2], 0 for others; shape (n,)."""


class Energies(NamedTuple):
    """Where the work of the blade went, since the body was made [J].

    work_of_blade = change of elastic, kinetic, potential and held + damping + cutting + breaking
    + friction + contact + topology + released + residual. Nodes that are fixed do not move, so
    that what holds them does no work.
    """

    work_of_blade: float
    """What the blade did to the tissue."""
    elastic: float
    """Stored in the tissue, less what was stored at first."""
    kinetic: float
    """The same of its motion."""
    potential: float
    """The same of its height."""
    held: float
    """Stored between blade and tissue: in what the edge holds, and the faces press."""
    damping: float
    """Taken by viscosity and drag."""
    cutting: float
    """Toughness times area."""
    breaking: float
    """What breaking the skin took beyond that."""
    friction: float
    """Taken by sliding along the faces of the blade."""
    contact: float
    """Taken where the body touches itself or the floor: impacts and friction."""
    topology: float
    """What changing the mesh took: impacts of nodes that part, and, under laws other than plain
    tetrahedra, elastic energy."""
    released: float
    """Held by what the blade let go of, and lost."""

    @property
    def residual(self) -> float:
        """What is not accounted for [J]: the error of the motion."""
        return self.work_of_blade - sum(self[1:])


class StageTimes(NamedTuple):
    """Wall time of the stages of one step [s], under the names of the paper's Table 1."""

    collision: float
    """CD: active tetrahedra and the edges that the blade crossed."""
    topology: float
    """GC: insertion of nodes, marking, un-gluing, and the springs and masses that changed."""
    relaxation: float
    """RX: forces, edge anchors, Runge-Kutta."""


class BodyContacts(NamedTuple):
    """How the body touched itself and the floor in one step."""

    n_contacts: int
    """Contacts that pressed at the end of the step: node on triangle, edge on edge, node on floor.
    Meshes that meet node on node share one contact among several."""
    penetration: float
    """Greatest depth that was left after a Runge-Kutta step [m]."""
    force: float
    """Sum of the normal forces between faces of the body, averaged over the step [N]."""
    force_of_floor: FloatArray
    """What the floor does to the body, averaged over the step [N], shape (3,): from outside, unlike
    the forces between its faces, which add up to zero."""


class StepResult(NamedTuple):
    """What one step did."""

    wrench: Wrench
    """What the tissue does to the blade, averaged over the step; `point` is the tip at t1."""
    wrench_t1: Wrench
    """The same at t1, the end of the step."""
    stiffness: FloatArray
    """How that changes as the blade moves by a small way and turn about the point: by -stiffness
    times (way [m], turn [rad]); shape (6, 6), symmetric and positive. Of what is between blade and
    tissue, while the tissue itself stays: an upper bound for slower motion."""
    contacts: BladeContacts
    force_on_tissue: FloatArray
    """Sum of the forces on the tissue's nodes that the blade exerts [N], shape (3,)."""
    bounds: FloatArray
    """Lowest and highest corner of the tissue at t1 [m], shape (2, 3). Where parts of it sleep or
    are frozen, of a box that holds it and may be a little larger."""
    n_tetrahedra: int
    n_nodes: int
    n_active: int
    """How many active tetrahedra there are: those that the cutting edge passes through."""
    active_point_tetrahedron: int
    """The tetrahedron that holds the tip, or -1 (paper, section 3)."""
    anchored_length: float
    """Length of the cutting edge that is in the tissue [m]."""
    cut_area: float
    """Area of the faces cut since the start, at rest, one side of each [m2]."""
    work_of_blade: float
    """Work that the blade has done on the tissue since the start [J]."""
    work_of_cutting: float
    """Work that slipping through the material took, since the start [J]: toughness times area."""
    n_substeps: int
    """Runge-Kutta steps taken in this step."""
    touch: BodyContacts
    profile: StageTimes
    energies: Energies | None
    """Where the work went; None without an audit."""


class TetrahedralMesh(NamedTuple):
    """A mesh as it comes from a file or a generator."""

    positions: FloatArray
    """[m], shape (n_nodes, 3)."""
    tetrahedra: IntArray
    """Node indices, shape (n_tets, 4); signed volumes are positive."""


class Snapshot(NamedTuple):
    """The whole state of the body at one instant. Copies."""

    positions: FloatArray
    """[m], shape (n_nodes, 3)."""
    rest_positions: FloatArray
    """[m], shape (n_nodes, 3)."""
    velocities: FloatArray
    """[m/s], shape (n_nodes, 3)."""
    masses: FloatArray
    """[kg], shape (n_nodes,)."""
    tetrahedra: IntArray
    """Shape (n_tets, 4)."""
    fixed: BoolArray
    """Nodes that do not move, shape (n_nodes,)."""


class Surface(NamedTuple):
    """The boundary triangles of the body: its skin and the faces that the blade made. Copies."""

    positions: FloatArray
    """[m], shape (n_vertices, 3)."""
    rest_positions: FloatArray
    """[m], shape (n_vertices, 3): three-dimensional texture coordinates, and what does not move."""
    triangles: IntArray
    """Indices into the vertices, shape (n_triangles, 3), counter-clockwise seen from outside."""
    is_cut: BoolArray
    """Whether the triangle is a face of a cut rather than skin, shape (n_triangles,)."""

    def to_trimesh(self) -> "Trimesh":
        """Return the surface as a trimesh mesh [m], tissue frame, with all its pieces.

        Each face has a colour, and the face attribute `is_cut`: 1 for a face of a cut, 0 for skin.
        Vertices are neither merged nor reordered: the sides of a cut that is not open stay apart.
        The surface is closed. Where a cut ends inside the body, four triangles can share an edge,
        and trimesh then does not call the mesh watertight.
        """
        from trimesh import Trimesh

        return Trimesh(
            vertices=self.positions,
            faces=self.triangles,
            face_colors=np.where(self.is_cut[:, None], CUT_COLOUR, SKIN_COLOUR).astype(np.uint8),
            face_attributes={"is_cut": self.is_cut.astype(np.uint8)},
            process=False,
        )


class Chunks(NamedTuple):
    """Boxes around parts of the body, which together hold all of it. Copies."""

    boxes: FloatArray
    """Lowest and highest corner of each [m], shape (n, 2, 3)."""
    fastest: float
    """Speed of the fastest node [m/s]."""


class Piece(NamedTuple):
    """A connected piece of the body and its mass properties; its mass is at its nodes. Copies."""

    n_tetrahedra: int
    n_nodes: int
    is_held: bool
    """Whether one of its nodes is fixed. A piece that is not falls."""
    rest_volume: float
    """[m3]."""
    volume: float
    """Now [m3]."""
    mass: float
    """[kg]."""
    centre: FloatArray
    """Centre of mass [m], shape (3,)."""
    velocity: FloatArray
    """Of the centre of mass [m/s], shape (3,)."""
    angular_momentum: FloatArray
    """About the centre of mass [kg m2/s], shape (3,)."""
    inertia: FloatArray
    """Tensor of inertia about the centre of mass [kg m2], shape (3, 3)."""

    @property
    def angular_velocity(self) -> FloatArray:
        """That of a rigid body of this momentum and inertia [rad/s], shape (3,)."""
        return np.asarray(np.linalg.lstsq(self.inertia, self.angular_momentum)[0])


class SchemeStatistics(NamedTuple):
    """What the paper's scheme did to a mesh since the body was made, and what it left behind."""

    n_cut: int
    """Tetrahedra of the initial mesh that were split."""
    n_of_case: dict[str, int]
    """How many of them were split by each case, A to E."""
    paper_count: int
    """Tetrahedra in the paper's counting, in which a parent stays: initial + 17 a split one. The
    mesh has one less a split, since child 0 takes the place of its parent."""
    n_hanging_edge_nodes: int
    """Edges with a node, some tetrahedron around which is whole."""
    n_hanging_face_nodes: int
    """Faces with a node, the tetrahedron on one side of which is whole; and `n_own_face_nodes`."""
    n_guarded: int
    """Split tetrahedra whose centre would have been flat or inverted, and whose face nodes were
    drawn to the centroids."""
    n_own_face_nodes: int
    """Face nodes that the guard made for one tetrahedron alone, beside that of its neighbour."""
    n_unsupported: int
    """Tetrahedra that were left whole because their cut edges are none of the 37 codes."""
    n_waiting: int
    """Tetrahedra that the blade is still in, or was when it was last seen."""
    n_ignored_crossings: int
    """Crossings with edges of tetrahedra that were already split: each is processed only once."""
