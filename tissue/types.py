"""Plain data that the engine takes and returns: mesh, results of a step, state of the body.

SI units. Every vector in this package is in the tissue frame. The suffixes `_t0` and `_t1` mean
the start and the end of a step.
"""

from typing import TYPE_CHECKING, Final, Literal, NamedTuple, Self

import numpy as np

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.core.tetrahedral_mesh import TetrahedralMesh as TetrahedralMesh
from tissue.core.three_vectors import Wrench

if TYPE_CHECKING:  # loading trimesh takes 0.3 s, and only `Surface.to_trimesh` needs it
    from trimesh import Trimesh

BoxNumbers = tuple[tuple[float, float, float], tuple[float, float, float]]
"""Lowest and highest corner of a box [m], in plain numbers."""

SurfaceQuantity = Literal["displacement", "strain", "stress"]
"""Measures of deformation that a picture can show: see `Tissue.surface_values`."""

SKIN_COLOUR = (156, 63, 50, 255)
CUT_COLOUR = (212, 68, 60, 255)
"""Red, green, blue and opacity of skin and of cut faces in exported meshes, 0 to 255 (sRGB)."""


class TissueError(RuntimeError):
    """The tissue cannot continue: motion became unstable. What it was before can still be read."""


class RigidContacts(NamedTuple):
    """Where the blade and rigid geoms act on the tissue. Valid until the next step.

    First the samples of the edge that hold tissue, or have cut some in the step, then the points of
    the tissue that touch the faces of the blade: views, at the end of the step. Then contacts with
    geoms, averaged over it.
    """

    point: FloatArray
    """Points of contact [m], shape (n, 3)."""
    normal: FloatArray
    """Unit normals into the tissue, shape (n, 3): forward at the edge, else out of the face."""
    normal_force: FloatArray
    """Force on the tissue along the normal [N], shape (n,)."""
    friction: FloatArray
    """Force on it across the normal [N], shape (n, 3): friction; at the edge also elastic force."""
    cut_area: FloatArray
    """Area that each sample of the edge has cut in this step [m2], 0 for others; shape (n,)."""
    geom: IntArray
    """Number of the geom in the order of `Tissue.collide_with`, -1 for the blade; shape (n,)."""

    @property
    def of_blade(self) -> "RigidContacts":
        """Those of the blade."""
        if not len(self.geom) or self.geom.item(-1) < 0:
            return self
        return RigidContacts._make(each[: np.searchsorted(self.geom, 0)] for each in self)


N_WORKS = 3
"""Number of works in an energy balance; they come first."""


class Energies(NamedTuple):
    """The energy balance since the body was made [J].

    work_of_blade + work_of_loads + work_of_supports = change of elastic, kinetic, potential and
    held + damping + cutting + breaking + friction + contact + topology + released + residual.
    """

    work_of_blade: float
    """Work that the blade did on the tissue."""
    work_of_loads: float
    """Work of the forces of `Tissue.push`, and of the frames of attachments that are moved."""
    work_of_supports: float
    """Work of the fixed nodes that `Tissue.move_supports` moves; 0 where they rest."""
    elastic: float
    """Change of the elastic energy of the tissue, and of that in the springs of Maxwell elements
    where stress relaxes."""
    kinetic: float
    """Change of the kinetic energy of the tissue, without that of fixed nodes."""
    potential: float
    """Change of the energy of the tissue in gravity."""
    held: float
    """Change of the elastic energy of the contact of edge and faces of the blade with the tissue,
    of contacts of the tissue that act as springs, and of attachments."""
    damping: float
    """Energy dissipated by viscosity, drag, Maxwell elements and the dampers of attachments."""
    cutting: float
    """Energy of cutting: toughness times area."""
    breaking: float
    """Energy of breaking the skin beyond that of cutting, and of cutting ligaments."""
    friction: float
    """Energy dissipated by sliding along the faces of the blade."""
    contact: float
    """Energy dissipated where the body touches itself or the floor: impacts and friction."""
    topology: float
    """Energy lost as the mesh changes: impacts of nodes that part, and, under laws other than plain
    tetrahedra, elastic energy."""
    released: float
    """Energy of contacts and fibres that the blade released, and of released attachments, which
    is lost; less that of attachments that began under tension."""

    @property
    def residual(self) -> float:
        """Work done on the tissue less all other terms [J]: the error of time integration."""
        done, spent = 0.0, 0.0
        for work in self[:N_WORKS]:
            done += work
        for energy in self[N_WORKS:]:  # one after the other, as kernels add them
            spent += energy
        return done - spent


class StageTimes(NamedTuple):
    """Wall time of the stages of one step [s]: CD, GC and RX of the paper's Table 1."""

    collision: float
    """Time of CD, collision detection [s]: active tetrahedra, and edges that the blade crossed."""
    topology: float
    """Time of GC, the change of topology [s]: insertion of nodes, separation, and the update of
    springs, elements and masses."""
    relaxation: float
    """Time of RX, relaxation [s]: forces, contact, anchors of the edge, time integration."""


class BodyContacts(NamedTuple):
    """Contact of the body with itself and the floor in one step."""

    n_contacts: int
    """Number of contacts that pressed at the end of the step: node on triangle, edge on edge, node
    on floor. Where meshes touch node on node, one contact is shared among several."""
    penetration: float
    """Greatest penetration that was left after a Runge-Kutta step [m]."""
    force: float
    """Sum of the normal forces between faces of the body, averaged over the step [N]."""
    force_of_floor: FloatArray
    """Force of the floor on the body, averaged over the step [N], shape (3,). Unlike it, the forces
    between the body's faces add up to zero."""


N_OF_ADDED_MASS: Final = 13
"""Numbers of `AddedMass`."""


class AddedMass(NamedTuple):
    """Mass that mass scaling has added to nodes, which moves with them and has no weight.

    The momentum of the own mass and of this one together changes by the impulses of all forces on
    the tissue, of which weight acts on the own mass alone, and by `impulse`.
    """

    mass: float
    """All of it [kg]."""
    momentum: FloatArray
    """Its momentum [N s], shape (3,)."""
    angular_momentum: FloatArray
    """Its angular momentum about the origin [N m s], shape (3,)."""
    impulse: FloatArray
    """Impulse of mass scaling since the body was made [N s], shape (3,): where nodes keep their
    velocities as mass is added or taken back, that mass comes and goes with its momentum."""
    angular_impulse: FloatArray
    """Angular impulse of mass scaling about the origin [N m s], shape (3,)."""

    @classmethod
    def of_numbers(cls, numbers: FloatArray) -> Self:
        """Return added mass from all its numbers, shape (`N_OF_ADDED_MASS`,)."""
        return cls(float(numbers[0]), *numbers[1:].reshape(4, 3))

    @property
    def numbers(self) -> FloatArray:
        """All numbers in order, shape (`N_OF_ADDED_MASS`,)."""
        return np.concatenate(([self.mass], *self[1:]))


class StepResult(NamedTuple):
    """The result of one step."""

    wrench: Wrench
    """Wrench of the tissue on the blade, averaged over the step; `point` is the tip at t1."""
    wrench_t1: Wrench
    """Wrench of the tissue on the blade at t1, the end of the step."""
    stiffness: FloatArray
    """Stiffness of the contacts of blade and tissue while the tissue itself stands still, shape (6,
    6), symmetric and positive. A small displacement [m] and rotation [rad] of the blade about the
    point change `wrench_t1` by -stiffness times them. For slower motion it is an upper bound."""
    contacts: RigidContacts
    """Where blade and rigid geoms act on the tissue."""
    force_on_tissue: FloatArray
    """Sum of the forces on the tissue's nodes that the blade exerts [N], shape (3,)."""
    bounds: FloatArray
    """Lowest and highest corner of a box around the tissue and its ligaments at t1 [m], shape (2,
    3). Where parts of the tissue are frozen the box may be a little larger than the tissue."""
    n_tetrahedra: int
    """Number of tetrahedra."""
    n_nodes: int
    """Number of nodes."""
    n_active: int
    """Number of active tetrahedra, through which the cutting edge passes."""
    active_point_tetrahedron: int
    """The tetrahedron that holds the tip, or -1 (paper, section 3)."""
    anchored_length: float
    """Length of the cutting edge that is in the tissue [m]."""
    cut_area: float
    """Area of the faces cut since the start, at rest, one side of each [m2]."""
    finished_area: float
    """The part of `cut_area` that no blade cut [m2]: small bridges that the blade passed over, and
    that were parted where an incision ended. No work was done for them."""
    work_of_blade: float
    """Work that the blade has done on the tissue since the start [J]."""
    work_of_cutting: float
    """Work of cutting since the start [J]: toughness times area."""
    n_substeps: int
    """Runge-Kutta steps taken in this step."""
    body_contacts: BodyContacts
    """Contacts of the body with itself and the floor."""
    stage_times: StageTimes
    """Wall time of the stages."""
    added_mass: AddedMass
    """Mass that mass scaling has added, at t1."""
    energies: Energies | None
    """Energy balance since the body was made; None without an audit."""
    cutting_of_labels: FloatArray
    """`work_of_cutting` in each label of the body, in order [J]; no numbers where it has one."""
    force_of_labels: FloatArray
    """Force of each on the edge at t1, against its motion [N]; on no faces, back or ends of it."""

    @property
    def contacts_of_blade(self) -> RigidContacts:
        """Where the blade acts on the tissue: without contacts of geoms, which take time."""
        return self.contacts.of_blade

    @property
    def box(self) -> BoxNumbers:
        """`bounds` in plain numbers."""
        low, high = self.bounds.tolist()
        return low, high

    @property
    def numbers_at_end(self) -> FloatArray:
        """The numbers of `stiffness`, row by row, and then of `added_mass`, in one array."""
        return np.concatenate((self.stiffness.ravel(), self.added_mass.numbers))

    @property
    def account(self) -> FloatArray | None:
        """The numbers of `energies`, and their residual [J]; None without an audit."""
        energies = self.energies
        return None if energies is None else np.array((*energies, energies.residual))


class Snapshot(NamedTuple):
    """The whole state of the body at one instant. Copies."""

    positions: FloatArray
    """Positions of the nodes [m], shape (n_nodes, 3)."""
    rest_positions: FloatArray
    """Positions of the nodes in the body at rest [m], shape (n_nodes, 3)."""
    velocities: FloatArray
    """Velocities of the nodes [m/s], shape (n_nodes, 3)."""
    masses: FloatArray
    """Masses of the nodes [kg], shape (n_nodes,): their own."""
    added_masses: FloatArray
    """Masses that mass scaling has added to them [kg], shape (n_nodes,); see `AddedMass`."""
    tetrahedra: IntArray
    """Node indices, shape (n_tets, 4)."""
    fixed: BoolArray
    """Whether each node is fixed, shape (n_nodes,)."""
    labels: IntArray
    """Label of each tetrahedron, shape (n_tets,); 0 in a mesh without labels."""


class Deformation(NamedTuple):
    """Stress and strain of each tetrahedron. Copies."""

    stress: FloatArray
    """Elastic Cauchy stress [Pa], shape (n_tets, 3, 3), less what has relaxed, pull positive: that
    of which the forces on the corners are made (`tissue.fields.tetrahedron_fields`). A row is a
    component of the force, a column one of the normal. Of shear that is averaged around nodes it is
    symmetric in the sum over tetrahedra, and in each of them as far as the strain is even."""
    strain: FloatArray
    """Green-Lagrange strain, (F^T F - 1) / 2, of the axes of the body at rest, same shape."""

    def von_mises(self) -> FloatArray:
        """Return the equivalent stress of von Mises [Pa], shape (n_tets,)."""
        symmetric = 0.5 * (self.stress + self.stress.swapaxes(1, 2))
        pressure = np.trace(symmetric, axis1=1, axis2=2) / 3.0
        deviator = symmetric - pressure[:, None, None] * np.eye(3)
        return np.asarray(np.sqrt(1.5 * (deviator * deviator).sum(axis=(1, 2))))


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
    labels: IntArray | None = None
    """Label of the tetrahedron that each triangle is a face of; None where the body has one."""

    def part(self, chosen: BoolArray) -> "Surface":
        """Return some of the triangles, shape (n_triangles,), between the same vertices."""
        labels = None if self.labels is None else self.labels[chosen]
        triangles, is_cut = self.triangles[chosen], self.is_cut[chosen]
        return self._replace(triangles=triangles, is_cut=is_cut, labels=labels)

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
    """Lowest and highest corner of each box [m], shape (n, 2, 3)."""
    fastest: float
    """Speed of the fastest node [m/s]."""


class Piece(NamedTuple):
    """A connected piece of the body and its mass properties; its mass is at its nodes. Copies."""

    n_tetrahedra: int
    """Number of tetrahedra."""
    n_nodes: int
    """Number of nodes."""
    is_held: bool
    """Whether one of its nodes is fixed. A piece without a fixed node falls."""
    rest_volume: float
    """Volume at rest [m3]."""
    volume: float
    """Volume now [m3]."""
    mass: float
    """Mass [kg]."""
    centre: FloatArray
    """Centre of mass [m], shape (3,)."""
    velocity: FloatArray
    """Velocity of the centre of mass [m/s], shape (3,)."""
    angular_momentum: FloatArray
    """Angular momentum about the centre of mass [kg m2/s], shape (3,)."""
    inertia: FloatArray
    """Tensor of inertia about the centre of mass [kg m2], shape (3, 3)."""

    @property
    def angular_velocity(self) -> FloatArray:
        """Angular velocity of a rigid body of this momentum and inertia [rad/s], shape (3,)."""
        return np.asarray(np.linalg.lstsq(self.inertia, self.angular_momentum)[0])


class SchemeStatistics(NamedTuple):
    """Work of the paper's scheme on a mesh since the body was made, and what it left behind."""

    n_cut: int
    """Tetrahedra of the initial mesh that were split."""
    n_of_case: dict[str, int]
    """Number of tetrahedra that were split by each case, A to E."""
    paper_count: int
    """Tetrahedra as the paper counts them, in which parents stay: the initial ones, and 17 for each
    split. The mesh has one less for each split, since child 0 replaces its parent."""
    n_hanging_edge_nodes: int
    """Edges with a node and with a tetrahedron around them that is whole."""
    n_hanging_face_nodes: int
    """Faces with a node and with a whole tetrahedron on one side, plus `n_own_face_nodes`."""
    n_guarded: int
    """Split tetrahedra whose centre would have been flat or inverted, so that their face nodes were
    moved towards the centroids."""
    n_own_face_nodes: int
    """Face nodes that the guard made for one tetrahedron, besides the node of its neighbour."""
    n_unsupported: int
    """Tetrahedra that stayed whole because their cut edges are none of the 37 codes."""
    n_waiting: int
    """Tetrahedra that the blade is still in, or was when it was last seen."""
    n_ignored_crossings: int
    """Crossings of edges of tetrahedra that were split already: each is processed only once."""
    n_local_searches: int
    """Steps in which the point of the blade was in the tetrahedron of the step before, or in a
    neighbour of it."""
    n_global_searches: int
    """Steps in which the whole body was searched for the blade."""
