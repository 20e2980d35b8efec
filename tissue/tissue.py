"""`Tissue`: a tetrahedral body that a blade can cut."""

import math
from collections.abc import Sequence

import numpy.typing as npt

from tissue.blade.prescribed_cut import checked_edges
from tissue.blade_shape import BladeShape
from tissue.body_view import BodyView
from tissue.contact.geoms.geom import Geom
from tissue.contact.geoms.geom_contact import GeomContact
from tissue.core.array_types import BoolArray, FloatArray
from tissue.core.memento import Spares
from tissue.core.three_vectors import BladeSweep
from tissue.cut_settings import CutReport
from tissue.loads.attachment import Attachment, Ligament
from tissue.loads.load import Load
from tissue.loads.material_points import MaterialPoints
from tissue.loads.support_path import SupportPath
from tissue.material import Material
from tissue.mesh.validation import expect_sound
from tissue.solver_settings import SolverSettings
from tissue.state.identity import Identity
from tissue.state.tissue_state import Around, TissueState
from tissue.stepping.acting_forces import ActingForce, acting_forces
from tissue.stepping.assembly import assembled
from tissue.stepping.checked_steps import CheckedSteps
from tissue.stepping.given_layers import MaterialOf, materials_and_layers
from tissue.stepping.material_changes import scale_materials
from tissue.types import Chunks, SchemeStatistics, StepResult, TetrahedralMesh


class Tissue(BodyView):
    """A soft body of tetrahedra: masses at nodes, a material between them, a blade that cuts it.

    Args:
        mesh: The body at rest.
        material: What it is made of: one material; or one for each label of the mesh, by number or
            name, and by None for all others, of the same law; and by two labels, for a layer
            between them that the cut follows, its toughness [J/m2].
        fixed: The supports, which stay or move as `move_supports` says, shape (n_nodes,).
        positions: Where the nodes are at first [m], shape (n_nodes, 3); default at rest. Fixed
            nodes stay there: the paper's displacement boundary conditions.
        gravity: Acceleration of free fall [m/s2].
        floor: Height of a floor, for example a table, below the body [m]; None for no floor.
        blade: Body of the blade, whose faces part and rub the tissue; None: a line (the paper).
        solver: How the body is cut and moved.

    Raises:
        MeshError: the mesh is broken or needs repair (`tissue.mesh_from_arrays`).
        ValueError: another argument does not fit the mesh, or is not finite.
    """

    def __init__(
        self,
        mesh: TetrahedralMesh,
        material: MaterialOf | None = None,
        *,
        fixed: BoolArray | None = None,
        positions: FloatArray | None = None,
        gravity: Sequence[float] = (0.0, 0.0, -9.81),
        floor: float | None = None,
        blade: BladeShape | None = None,
        solver: SolverSettings = SolverSettings(),
    ) -> None:
        mesh, averages_shear = expect_sound(mesh), solver.element == "averaged"
        parts = materials_and_layers(mesh, material or Material(), averages_shear=averages_shear)
        self.material = parts[0].reference
        self.blade, self.floor, self.solver = others = (blade, floor, solver)
        self.label_names = dict(mesh.label_names)
        """Names of labels, of those that have one."""
        self._stages = assembled(mesh, fixed, positions, gravity, parts, *others)
        self._steps = CheckedSteps(self._stages)
        self._model = model = self._stages.model
        self.node_size = model.node_size
        """Mean node size of the body before any cut [m]."""
        gravity_now = model.surroundings.gravity
        self._identity = Identity.of(model.body, gravity_now, parts[0].by_label, *others)
        self._spares = Spares()

    def step(self, sweep: BladeSweep | None, dt: float) -> StepResult:
        """Advance the body by `dt` [s] while the blade does `sweep`.

        A step that goes wrong (`stepping.judgement`) is done again in shorter ones, up to three
        times. If that fails, the body stays as before, and is only read until `load_state`.

        Args:
            sweep: Motion of the cutting edge, or None where no blade is near.
            dt: Length of the step [s]. It is divided as stability and the speed of the blade need.

        Raises:
            ValueError: the blade has no length or does not fit the mesh, or a number is not finite.
            TissueError: the motion of the tissue became unstable, now or before; it names nodes.
        """
        return self._steps.step(sweep, dt)

    @property
    def n_repeated_steps(self) -> int:
        """Number of steps that went wrong, and were done again in shorter ones."""
        return self._steps.n_repeated

    def incise(self, edges: npt.ArrayLike, forward: npt.ArrayLike) -> float:
        """Cut along a given surface in the body at rest; return the area of one side [m2].

        There is no blade and no force, and no time passes: for tissue that was cut before. The edge
        goes in straight lines from place to place, and follows no layer. As with a blade only its
        front cuts: a point that goes back cuts nothing until it is ahead of where it has been.

        Args:
            edges: Places of the cutting edge in the body at rest [m], from tip to heel, shape
                (n_places, n_points, 3), at least two of each.
            forward: Direction in which the edge faces, shape (3,); or in each place, (n_places, 3).

        Raises:
            ValueError: an array has another shape, is not finite, or an edge faces along itself.
        """
        rows, directions = checked_edges(edges, forward)
        return self._steps.with_room(lambda: self._stages.cut_along(rows, directions))

    def settle(self) -> int:
        """Relax to equilibrium under gravity, loads and supports; return the steps it took.

        Dynamic relaxation of all nodes together (`tissue.integrators.equilibrium`). Stress that
        relaxes (`Material.prony`) has relaxed wholly. A body that still moves gets a warning.

        Raises:
            TissueError: nothing holds the body, or a piece of it, against its weight and its loads,
                its motion became unstable, or it does not come to rest. It is then where it was.
        """
        self._steps.release_edge(lambda: self._stages.take_edge(None))
        return self._stages.settle(self.floor)

    def push(self, where: str | npt.ArrayLike | MaterialPoints, force: npt.ArrayLike) -> Load:
        """Push material points with a force, until `release`; return the load.

        Its force can be changed between steps (`Load.force`); frozen nodes do not feel it
        (`Hierarchical(far="frozen")`). Its work is in the account of energy.

        Args:
            where: Material points, or what `material_points` takes. On a region the force is a
                traction, the same on each area of the skin at rest.
            force: Total force [N], shape (3,); or one on each point, shape (n, 3).

        Raises:
            ValueError: no point is there or one is outside the body; a force that `Load` refuses.
        """
        points = where if isinstance(where, MaterialPoints) else self.material_points(where)
        return self._steps.begin_change().handles.push(Load(points, force))

    def attach(
        self,
        where: str | npt.ArrayLike | MaterialPoints,
        *,
        stiffness: float,
        damping: float = 0.0,
        rest_length: float = 0.0,
        breaks_at: float = math.inf,
        origin: Sequence[float] | None = None,
    ) -> Attachment:
        """Tie points of the tissue by springs to a frame that is moved from outside; return it.

        The frame stays where it is until `Attachment.move`: an attachment to the world. Each side
        of a cut through its points keeps its own. Its work is in the account of energy.

        Args:
            where: Points as `push` takes them, but of a region its nodes, inside the body as well.
            stiffness: Of all springs together [N/m].
            damping: Of all dampers together [N s/m].
            rest_length: Length up to which each point is slack, in any direction [m].
            breaks_at: Force at which the attachment releases the tissue [N].
            origin: Origin of the frame, and of torques on it [m]; None: the mean of the points.

        Raises:
            ValueError: no point is there, one is outside the body, a number is not finite or has
                the wrong sign, or the relaxation is `hierarchical`, which has no attachments.
        """
        points = self._stages.handles.points_to_hold(where)
        numbers = (stiffness, damping, rest_length, breaks_at, origin)
        attachment = Attachment(points, self.positions_of(points), *numbers)
        return self._steps.begin_change().handles.attach(attachment)

    def tie(
        self,
        where: str | npt.ArrayLike | MaterialPoints,
        to: npt.ArrayLike | MaterialPoints,
        *,
        stiffness: float,
        area: float,
        toughness: float,
        damping: float = 0.0,
        rest_length: float | None = None,
        breaks_at: float = math.inf,
    ) -> Ligament:
        """Tie points of the tissue by fibres to the world, or to another body; return the ligament.

        The edge of the blade cuts the fibres that it sweeps across (`tissue.forces.fibres`):
        cross-section times toughness is in `Energies.breaking`. Fibres between bodies tear too.

        Args:
            where: Points as `attach` takes them.
            to: Where the fibres end [m], shape (3,), or one place for each point, (n, 3); or points
                of the tissue, one or one for each, such as those of `facing`.
            stiffness: Of all fibres together, along them [N/m].
            area: Cross-section of all fibres together [m2].
            toughness: Energy of cutting them [J/m2].
            damping: Of all of them together, along them [N s/m].
            rest_length: Length up to which each is slack [m]; None: the distance of its ends now.
            breaks_at: Force of all of them at which they release the tissue [N].

        Raises:
            ValueError: see `attach`; or `to` has another shape.
        """
        numbers = stiffness, area, toughness, damping, breaks_at
        ligament = self._stages.handles.ligament(where, to, rest_length, numbers)
        return self._steps.begin_change().handles.attach(ligament)

    def collide_with(
        self,
        geoms: Sequence[Geom],
        origins: npt.ArrayLike | None = None,
        rotations: npt.ArrayLike | None = None,
    ) -> GeomContact:
        """Make the tissue touch rigid geoms from now on, and no others; return the contact.

        Skin and lips stay outside the geoms, and rub on them by Coulomb's law: what sticks does not
        creep. `GeomContact.move` moves the geoms. In the account of energy their work is that of
        loads, and what friction and impacts take that of contact.

        Args:
            geoms: What the tissue can touch.
            origins: Origin of each [m], shape (n, 3); None: that of the tissue's frame.
            rotations: Axes of each as columns, shape (n, 3, 3); None: those of the tissue's frame.

        Raises:
            ValueError: a geom makes no sense or is inside; `hierarchical` relaxation has no geoms.
        """
        self._stages.handles.expect_all_nodes_move("tissue does not touch geoms")
        return self._steps.begin_change().model.touch(geoms, origins, rotations)

    @property
    def attachments(self) -> tuple[Attachment, ...]:
        """The attachments and ligaments that hold, in the order in which they were made."""
        return self._stages.handles.attachments.all

    def release(self, held: Load | Attachment) -> None:
        """End a load of `push`, or release an attachment.

        Raises:
            ValueError: it does not act on this tissue, or was released before.
        """
        self._steps.begin_change().handles.release(held)

    def set_material(
        self, where: int | str | npt.ArrayLike | None = None, **factors: npt.ArrayLike
    ) -> None:
        """Multiply quantities of the material by factors, for example between two episodes.

        Nodes keep their places and velocities; the blade lets go of the tissue, and the account of
        energy begins again. The time step follows. Materials are a part of the state: `load_state`
        puts them back. Factors of two calls multiply.

        Args:
            where: A label, by number or name; a mask of tetrahedra, shape (n_tets,); None: all; or
                two labels, for the layer between them, which has `toughness`.
            factors: Factors of `young_modulus`, `density`, `toughness`, `stiffening` or
                `retardation_time`: a number, or one for each of these tetrahedra.

        Raises:
            ValueError: there is no such label or quantity, no tetrahedron is there, or a factor is
                not finite and positive, or has another shape.
        """
        names = self.label_names
        self._steps.release_edge(lambda: scale_materials(self._stages, names, where, factors))

    def move_supports(self, where: str | npt.ArrayLike, velocity: npt.ArrayLike) -> None:
        """Move fixed nodes at a velocity, from the next step on until it is given again.

        Their displacement in a step is the velocity times its length. Nodes that a cut puts between
        them move with them. `settle` stops them. Their work is in the account of energy.

        Args:
            where: A region as text (`fixed_nodes`) or as a mask, shape (n_nodes,), of which the
                fixed nodes are moved; or numbers of nodes, shape (n,), all fixed.
            velocity: [m/s], shape (3,), or one for each of these nodes, shape (n, 3).

        Raises:
            ValueError: no node there is fixed, one of a list is not, the velocity has another shape
                or is not finite, or the relaxation is `hierarchical`, which moves no support.
        """
        self._stages.handles.expect_all_nodes_move("supports do not move")
        self._steps.expect_moving()
        self._stages.handles.move_supports(where, velocity)

    def lead_supports(self, where: str | npt.ArrayLike, path: SupportPath) -> None:
        """Move, turn and stretch fixed nodes along a path, from the next step on.

        At the end of each step they are where the path has them, and in between on a straight line.
        `move_supports` ends it. Nodes that a cut puts between them are led with them; `settle`
        stops them until the next step. Their work is in the account of energy.

        Args:
            where: As `move_supports` takes it.
            path: Where they go, and when.

        Raises:
            ValueError: no node there is fixed, one of a list is not, or the relaxation is
                `hierarchical`, which moves no support.
        """
        self._stages.handles.expect_all_nodes_move("supports do not move")
        self._steps.begin_change().handles.lead_supports(where, path)

    def make_rigid(self, where: str | npt.ArrayLike, *, density: float | None = None) -> int:
        """Make a region one rigid body from now on, such as a bone or a stone; return its number.

        It is made of the tetrahedra of which all nodes are in the region, keeps the shape that they
        have now, and turns and moves with what acts on its nodes. The blade does not cut it. The
        account of energy begins again. `cores` says where it is.

        Args:
            where: A region as text (`fixed_nodes`), or as a mask, shape (n_nodes,).
            density: [kg/m3], at least that of the tissue; None: the same.

        Raises:
            ValueError: no tetrahedron is there, one of its nodes is fixed, on the skin or in
                another core, the density is too low, or the relaxation is `hierarchical`.
        """
        self._stages.handles.expect_all_nodes_move("cores do not move")
        own = self.material.density
        if density is not None and not own <= density < math.inf:
            raise ValueError(
                f"density is {density} kg/m3; a core is at least as dense as the tissue, "
                f"{own:g} kg/m3: the steps of the integrator are chosen for that"
            )
        added = 0.0 if density is None else density - own
        stages = self._steps.begin_change()
        core = stages.handles.make_rigid(where, added)
        stages.global_stepper.wake()
        stages.audit.begin(stages.context, stages.model.interaction.edge_now[0])
        return core

    def support_forces(self) -> FloatArray:
        """Return the force of the supports on each fixed node now [N], shape (n_nodes, 3).

        Zero for nodes that are not fixed. It balances elastic and viscous forces, weight, loads,
        the blade, and contacts of the body with itself and the floor.
        """
        return self._stages.handles.support_forces()

    def acting_forces(self) -> list[ActingForce]:
        """Return each force from outside on the body in the last step, those of the blade first."""
        return acting_forces(self._stages)

    def chunks(self) -> Chunks:
        """Return boxes that hold the body and its ligaments: a blade outside touches nothing."""
        return self._stages.chunks_now()

    def cut_report(self) -> CutReport:
        """Return the path error of the cuts so far, and what they did to elements and time step."""
        return self._stages.cut_report(self.solver)

    def scheme_statistics(self) -> SchemeStatistics | None:
        """Return what the paper's scheme did so far; None where another scheme cuts."""
        return self._stages.incision.scheme.statistics(self._body)

    def save_state(self) -> TissueState:
        """Return the state between two steps: what follows depends on it alone.

        The same steps after `load_state` give the same bits. It costs less than a step.

        Raises:
            TissueError: the body has stopped (`step`).
        """
        self._steps.expect_moving()
        return TissueState.of(self, self._identity, self._spares)

    def load_state(self, state: TissueState, around: Around | None = None) -> None:
        """Put the body to a state, its own or that of an equal tissue, as often as wanted.

        A body that has stopped continues. Loads, attachments and geoms are again those of then: in
        the tissue that was saved the same objects; in another one those with the same number, in
        the order in which they were made, or new ones. What was made later no longer acts.

        Args:
            state: The state.
            around: What refers to the tissue, and was written with it: see `TissueState.to_bytes`.

        Raises:
            StateError: it is no state, or of another version, body or settings; nothing changes.
        """
        before = self.attachments
        state.load_into(self, self._identity, around)
        self._steps.state_loaded()
        self._stages.handles.forget_later(before)

    def expect_state(self, state: TissueState) -> None:
        """Raise StateError for a state of another body, settings or version; change nothing."""
        state.expect_of(self._identity)
