"""`DrivenBody`: the methods of `Tissue` that push it and move its supports."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from tissue.body_view import BodyQueries
from tissue.contact.geoms.geom import Geom
from tissue.contact.geoms.geom_contact import GeomContact
from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.core.simd import room_for_points
from tissue.integrators.attachments import strand_boxes
from tissue.integrators.global_stepper import GlobalStepper
from tissue.integrators.model import TissueModel
from tissue.integrators.options import Hierarchical
from tissue.integrators.step_context import Increment
from tissue.integrators.supports import write_support_forces
from tissue.loads.attachment import Attachment
from tissue.loads.attachment_list import AttachmentList
from tissue.loads.ligament import Ligament, ends_of_strands
from tissue.loads.load import Load, Loads
from tissue.loads.material_points import MaterialPoints, points_of, region_mask
from tissue.mesh.body import Body
from tissue.solver_settings import SolverSettings
from tissue.types import Chunks, TissueError

HOLDS = "nodes are supports where `Tissue(fixed=...)` says so"


class DrivenBody(BodyQueries):
    """A body that is pushed by loads and by supports that move."""

    _system: TissueModel
    _loads: Loads
    _attachments: AttachmentList
    _global_stepper: GlobalStepper
    solver: SolverSettings
    _is_changed = True
    """Whether it was changed by other than a step since a step was saved."""
    _stopped: TissueError | None = None
    """Why it has stopped; None: it has not."""

    @property
    def _body(self) -> Body:
        return self._system.body

    def material_points(self, where: str | npt.ArrayLike) -> MaterialPoints:
        """Return points of the material, which move with it and survive cuts.

        Args:
            where: A region as text (`fixed_nodes`) or as a mask of nodes, shape (n_nodes,): the
                centroids of the faces of the skin in it, each with its share of their area; or
                numbers of nodes, shape (n,); or places in the body at rest [m], shape (n, 3).

        Raises:
            ValueError: no point is there, or one is outside the body.
        """
        return points_of(self._body, where)

    def positions_of(self, points: MaterialPoints) -> FloatArray:
        """Return where material points are now [m], shape (n, 3)."""
        return points.positions(self._body)

    def push(self, where: str | npt.ArrayLike | MaterialPoints, force: npt.ArrayLike) -> Load:
        """Push material points with a force, until `release`; return the load.

        Its force can be changed between steps (`Load.force`). Its work is in the account of energy.
        Nodes that `Hierarchical(far="frozen")` freezes do not feel it.

        Args:
            where: Material points, or what `material_points` takes. On a region the force is a
                traction, the same on each area of the skin at rest.
            force: Total force [N], shape (3,); or one on each point, shape (n, 3).

        Raises:
            ValueError: no point is there, one is outside the body, or the force has another shape
                or is not finite.
        """
        self._begin_change()
        points = where if isinstance(where, MaterialPoints) else self.material_points(where)
        load = Load(points, force)
        self._loads.add(load)
        return load

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

        The frame stays where it is until `Attachment.move`: an attachment to the world. Its points
        are points of the material, so that each side of a cut through them keeps its own. Its work
        on the tissue is in the account of energy as that of a load.

        Args:
            where: Material points, or what `material_points` takes, except that a region holds its
                nodes, inside the body as well.
            stiffness: Of all springs together [N/m].
            damping: Of all dampers together [N s/m].
            rest_length: Length up to which each point is slack, in any direction [m].
            breaks_at: Force at which the attachment lets go [N].
            origin: Origin of the frame, about which `Attachment.wrench` has its torque [m]; None:
                the mean of the points.

        Raises:
            ValueError: no point is there, one is outside the body, a number is not finite or has
                the wrong sign, or the relaxation is `hierarchical`, which knows no attachments.
        """
        points = self._points_to_hold(where)
        attachment = Attachment(
            points,
            self.positions_of(points),
            stiffness=stiffness,
            damping=damping,
            rest_length=rest_length,
            breaks_at=breaks_at,
            origin=origin,
        )
        self._add(attachment)
        return attachment

    def tie(
        self,
        where: str | npt.ArrayLike | MaterialPoints,
        to: npt.ArrayLike,
        *,
        stiffness: float,
        area: float,
        toughness: float,
        damping: float = 0.0,
        rest_length: float | None = None,
        breaks_at: float = math.inf,
    ) -> Ligament:
        """Tie points of the tissue by strands to places in the world; return the ligament.

        The edge of the blade cuts the strands that it sweeps across, each for its cross-section
        times the toughness (`tissue.integrators.strands`): that energy is in
        `Energies.breaking`.

        Args:
            where: What `attach` takes.
            to: Where the strands end [m], shape (3,), or one place for each point, (n, 3).
            stiffness: Of all strands together, along them [N/m].
            area: Cross-section of all strands together [m2].
            toughness: Energy of cutting them [J/m2].
            damping: Of all of them together, along them [N s/m].
            rest_length: Length up to which each is slack [m]; None: the distance of its ends now.
            breaks_at: Force of all of them at which they let go [N].

        Raises:
            ValueError: see `attach`; or `to` has another shape.
        """
        points = self._points_to_hold(where)
        ligament = Ligament(
            points,
            *ends_of_strands(self.positions_of(points), to, rest_length),
            stiffness=stiffness,
            area=area,
            toughness=toughness,
            damping=damping,
            breaks_at=breaks_at,
        )
        self._add(ligament)
        return ligament

    def _add(self, attachment: Attachment) -> None:
        self._begin_change()
        self._attachments.add(attachment, self._body)
        self._take_attachments()
        self._system.interaction.make_room_for_strands(self._attachments.n_strands)

    def collide_with(
        self,
        geoms: Sequence[Geom],
        origins: npt.ArrayLike | None = None,
        rotations: npt.ArrayLike | None = None,
    ) -> GeomContact:
        """Let the tissue touch rigid geoms from now on, and no others; return the contact.

        Nodes and faces of the skin and of lips stay outside the geoms, and rub on them as Coulomb's
        law says: what sticks does not creep. Between steps `GeomContact.move` moves the geoms;
        until then they stay. Their work is in the account of energy as that of loads, what friction
        and impacts take as that of contact.

        Args:
            geoms: What the tissue can touch.
            origins: Origin of each [m], shape (n, 3); None: that of the tissue's frame.
            rotations: Axes of each as columns, shape (n, 3, 3); None: those of the tissue's frame.

        Raises:
            ValueError: a geom makes no sense or is inside the tissue, or the relaxation is
                `hierarchical`, which knows no geoms.
        """
        self._expect_all_nodes_move("tissue does not touch geoms")
        self._begin_change()
        system = self._system
        contact = GeomContact(geoms, system.body, system.node_size, origins, rotations)
        system.geoms = contact
        return contact

    @property
    def attachments(self) -> tuple[Attachment, ...]:
        """The attachments and ligaments that hold, in the order in which they were made."""
        return self._attachments.all

    def chunks(self) -> Chunks:
        """Return boxes that together hold the body and its ligaments; see `BodyQueries.chunks`."""
        found = super().chunks()
        if not self._system.has_strands:
            return found
        boxes = strand_boxes(self._system.attachments, self._body.positions)
        return found._replace(boxes=np.concatenate((found.boxes, boxes))) if len(boxes) else found

    def release(self, held: Load | Attachment) -> None:
        """End a load of `push`, or let go of an attachment.

        Raises:
            ValueError: it does not act on this tissue, or was released before.
        """
        self._begin_change()
        if isinstance(held, Load):
            self._loads.remove(held, self._system.stages.loads)
        else:
            self._attachments.remove(held, self._body)
            self._take_attachments()

    def move_supports(self, where: str | npt.ArrayLike, velocity: npt.ArrayLike) -> None:
        """Move fixed nodes at a velocity, from the next step on until it is given anew.

        Their displacement in a step is the velocity times its length. Nodes that a cut puts between
        them move with them. `settle` stops them. Their work is in the account of energy.

        Args:
            where: A region as text (`fixed_nodes`) or as a mask, shape (n_nodes,), of which the
                fixed nodes are moved; or numbers of nodes, shape (n,), all fixed.
            velocity: [m/s], shape (3,), or one for each of these nodes, shape (n, 3).

        Raises:
            ValueError: no node there is fixed, one of a list is not, the velocity has another shape
                or is not finite, or the relaxation is `hierarchical`, which moves no fixed node.
        """
        self._expect_all_nodes_move("supports do not move")
        self._expect_moving()
        system, body = self._system, self._body
        nodes = self._supports_at(where)
        array = np.array(velocity, dtype=np.float64)
        if array.shape not in ((3,), (len(nodes), 3)) or not np.isfinite(array).all():
            raise ValueError(
                f"velocity is {velocity!r}; it is three finite numbers in m/s, or three for each "
                f"of the {len(nodes)} nodes"
            )
        body.velocities[nodes] = array
        n = body.n_nodes
        system.supports.is_moving = int(body.velocities[:n][body.fixed[:n]].any())

    def support_forces(self) -> FloatArray:
        """Return the force of the supports on each fixed node now [N], shape (n_nodes, 3).

        Zero for nodes that are not fixed. It balances the elastic and viscous forces, the weight of
        the node, loads, the blade, and contacts of the body with itself and the floor.
        """
        system, n = self._system, self.n_nodes
        self._loads.spread(system.body, system.stages.loads)
        out = room_for_points(len(system.body.rest))
        write_support_forces(system.context, out)
        return out[:n].copy()

    def _begin_change(self) -> None:
        """Note that it is changed by other than a step.

        Raises:
            TissueError: it has stopped.
        """
        self._expect_moving()
        self._is_changed = True

    def _expect_moving(self) -> None:
        """Refuse what changes a body that has stopped.

        Raises:
            TissueError: it has.
        """
        if self._stopped is not None:
            raise TissueError(
                f"the tissue has stopped, and takes no step or change until a state is loaded "
                f"(`load_state`). Why it stopped: {self._stopped}"
            )

    def _expect_all_nodes_move(self, what: str) -> None:
        """Refuse the relaxation that moves nodes level by level."""
        chosen = self.solver.relaxation
        if chosen == "hierarchical" or isinstance(chosen, Hierarchical):
            raise ValueError(f"{what} with relaxation='hierarchical'; use 'global' or 'verlet'")

    def _points_to_hold(self, where: str | npt.ArrayLike | MaterialPoints) -> MaterialPoints:
        """Return material points; of a region those at its nodes."""
        self._expect_all_nodes_move("tissue is not attached")
        if isinstance(where, MaterialPoints):
            return where
        region = np.asarray(where)
        if not isinstance(where, str) and region.dtype != np.bool_:
            return self.material_points(where)
        mask = region_mask(self._body, where if isinstance(where, str) else region)
        if not mask.any():
            raise ValueError(
                f"no node is in the region {where!r}; take a larger one, or give points"
            )
        return self.material_points(np.flatnonzero(mask))

    @property
    def _is_driven(self) -> bool:
        """Whether there is anything that could act on the body, beside the blade."""
        return self._loads.act or self._attachments.act or bool(self._system.geoms.geoms)

    def _begin_driving(self, increment: Increment, has_blade: bool) -> float:
        """Let loads act, and what is held move, in an increment; return `Loads.virtual_work`."""
        if not self._is_driven:
            return 0.0
        loads, system = self._loads, self._system
        if loads.act or self._attachments.act or system.geoms.act:
            self._global_stepper.wake()
        self._attachments.begin_increment(system.body, increment, has_blade)
        system.added_by_attachments = self._attachments.added_frequency_squared
        touched = system.geoms.arrays
        touched.work = touched.dissipated = 0.0
        loads.spread(system.body, system.stages.loads)
        return loads.virtual_work(system.body)

    def _driven_work(self, before: float, increment: Increment) -> float:
        """End an increment; return the work of loads and of frames that are moved [J].

        `before`: what `_begin_driving` said.
        """
        if not self._is_driven:
            return 0.0
        system = self._system
        self._attachments.end_increment(system.body, increment)
        touched = system.geoms.arrays
        of_loads = self._loads.virtual_work(system.body) - before
        return of_loads + system.attachments.work + touched.work

    def _hold_again(self) -> None:
        """Find what attachments hold in a mesh that has changed."""
        if self._attachments.act:
            self._attachments.locate(self._body)
            self._take_attachments()

    def _begin_hold(self, dt: float) -> None:
        """Lead attachments that follow a path, and geoms, in a step of that length [s]."""
        self._system.geoms.begin_step(self._body, dt)
        if not self._attachments.is_idle:
            self._attachments.begin_step(self._body, dt)
            self._take_attachments()

    def _end_hold(self, dt: float) -> None:
        """Tell attachments what they did in a step of that length [s], and have geoms stay."""
        self._system.geoms.stop()
        if self._attachments.act:
            self._attachments.end_step(self._body, dt)
            self._take_attachments()

    def _take_attachments(self) -> None:
        """Let the integrator work on the arrays of the attachments."""
        system, attachments = self._system, self._attachments
        system.attachments, system.has_strands = attachments.arrays, attachments.has_strands
        system.added_by_attachments = attachments.added_frequency_squared

    def _supports_at(self, where: str | npt.ArrayLike) -> IntArray:
        """Return the fixed nodes of a region, or of a list."""
        body = self._body
        fixed: BoolArray = body.fixed[: body.n_nodes]
        array = np.asarray(where)
        if array.dtype.kind in "iu":
            nodes = np.atleast_1d(array).astype(np.int64)
            wrong = nodes[(nodes < 0) | (nodes >= body.n_nodes)]
            if wrong.size:
                raise ValueError(f"there is no node {wrong[0]}; the last is {body.n_nodes - 1}")
            free = nodes[~fixed[nodes]]
            if free.size:
                raise ValueError(f"node {free[0]} is not fixed and cannot be moved; {HOLDS}")
            return nodes
        region = where if isinstance(where, str) else np.asarray(where, dtype=np.bool_)
        found: IntArray = np.flatnonzero(region_mask(body, region) & fixed)
        if not found.size:
            raise ValueError(f"no node of the region {where!r} is fixed; {HOLDS}")
        return found
