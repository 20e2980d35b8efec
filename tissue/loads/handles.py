"""`Handles`: what moves a body from outside but the blade, step by step."""

from collections.abc import Iterable
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.core.simd import room_for_points
from tissue.core.three_vectors import BladeSweep
from tissue.forces.step_context import Increment
from tissue.forces.terms import write_support_forces
from tissue.integrators.model import TissueModel
from tissue.loads.attachment import Attachment, Ligament, ends_of_fibres
from tissue.loads.attachment_list import AttachmentList
from tissue.loads.load import Load, Loads
from tissue.loads.material_points import MaterialPoints, points_to_hold, region_mask
from tissue.loads.support_path import LedSupports, SupportPath
from tissue.mesh.body import Body
from tissue.mesh.changes import ChangedMesh

Held = TypeVar("Held", bound=Attachment)
_HOLDS = "nodes are supports where `Tissue(fixed=...)` says so"


class StepInputs(NamedTuple):
    """Start of a step outside the body: references to what is never written."""

    sweep: BladeSweep | None
    """Motion of the blade."""
    dt: float
    """Length of the step [s]."""
    forces: tuple[FloatArray, ...] = ()
    """Forces of the loads on their points [N]."""
    frames: tuple[tuple[Any, ...], ...] = ()
    """Where the frames of attachments go."""
    geoms: tuple[FloatArray, FloatArray, IntArray] | None = None
    """Where geoms go, and which of them may be touched; None where there are none."""
    supports: FloatArray | None = None
    """Velocities of the fixed nodes [m/s]; None where all stand still."""


class Handles:
    """Loads, attachments, rigid geoms and supports of one body.

    Args:
        model: The body, with its geoms and supports.
    """

    def __init__(self, model: TissueModel) -> None:
        self._model = model
        self.loads = Loads()
        """All loads."""
        self.led_supports = LedSupports()
        """Supports that follow a path."""
        self.attachments = AttachmentList()
        """All attachments and ligaments."""
        self.act = False
        """Whether there is a load or an attachment, or one was released since the last step."""

    def push(self, load: Load) -> Load:
        """Add a load, which acts from now on; return it."""
        self.loads.add(load)
        self.act = True
        return load

    def points_to_hold(self, where: str | npt.ArrayLike | MaterialPoints) -> MaterialPoints:
        """Return the points by which an attachment holds: of a region its nodes.

        Raises:
            ValueError: no point is there, one is outside the body, or the relaxation is
                `hierarchical`.
        """
        self.expect_all_nodes_move("tissue is not attached")
        return points_to_hold(self._model.body, where)

    def ligament(
        self,
        where: str | npt.ArrayLike | MaterialPoints,
        to: npt.ArrayLike | MaterialPoints,
        rest_length: float | None,
        numbers: tuple[float, float, float, float, float],
    ) -> Ligament:
        """Return fibres that are to hold; see `tissue.Tissue.tie`.

        Args:
            where: Where they begin.
            to: Where they end.
            rest_length: Length up to which each is slack [m]; None: the distance of its ends now.
            numbers: Stiffness [N/m], cross-section [m2], toughness [J/m2], damping [N s/m], and the
                force at which they release the tissue [N].

        Raises:
            ValueError: an end is not there, or a number has the wrong sign.
        """
        body, points = self._model.body, self.points_to_hold(where)
        begin = points.positions(body)
        if not isinstance(to, MaterialPoints):
            return Ligament(points, *ends_of_fibres(begin, to, rest_length), *numbers)
        inside = to.repeated(len(points))
        ends = ends_of_fibres(begin, inside.positions(body), rest_length)
        ligament = Ligament(points, *ends, *numbers)
        ligament.to = inside
        return ligament

    def attach(self, attachment: Held) -> Held:
        """Add an attachment, which holds from now on; return it."""
        model, attachments = self._model, self.attachments
        attachments.add(attachment, model.body)
        self._hand_over()
        model.interaction.make_room_for_fibres(attachments.n_fibres)
        return attachment

    def release(self, held: Load | Attachment) -> None:
        """End a load or an attachment.

        Raises:
            ValueError: it does not act on this tissue, or was released before.
        """
        model = self._model
        if isinstance(held, Load):
            self.loads.remove(held, model.stages.loads)
        else:
            self.attachments.remove(held, model.body)
        self._hand_over()

    def move_supports(self, where: str | npt.ArrayLike, velocity: npt.ArrayLike) -> None:
        """Move fixed nodes at a velocity [m/s]; see `tissue.Tissue.move_supports`."""
        body = self._model.body
        nodes = _supports_at(body, where)
        array = np.array(velocity, dtype=np.float64)
        if array.shape not in ((3,), (len(nodes), 3)) or not np.isfinite(array).all():
            raise ValueError(
                f"velocity is {velocity!r}; it is three finite numbers in m/s, or three for each "
                f"of the {len(nodes)} nodes"
            )
        if self.led_supports.act:
            self.led_supports.forget(body, nodes)
        body.velocities[nodes] = array
        self._note_moving()

    def lead_supports(self, where: str | npt.ArrayLike, path: SupportPath) -> None:
        """Lead fixed nodes along a path; see `tissue.Tissue.lead_supports`."""
        body = self._model.body
        self.led_supports.lead(body, _supports_at(body, where), path)

    def make_rigid(self, where: str | npt.ArrayLike, added_density: float) -> int:
        """Make tetrahedra rigid; see `tissue.Tissue.make_rigid`."""
        body = self._model.body
        mask = region_mask(body, where if isinstance(where, str) else np.asarray(where))
        return self._model.cores.add(body, mask, added_density)

    def _note_moving(self) -> None:
        """Note whether a support moves."""
        body = self._model.body
        n = body.n_nodes
        self._model.supports.is_moving = int(body.velocities[:n][body.fixed[:n]].any())

    def expect_all_nodes_move(self, what: str) -> None:
        """Refuse the relaxation that moves nodes level by level.

        Raises:
            ValueError: the body is relaxed by it.
        """
        if not self._model.moves_together:
            raise ValueError(f"{what} with relaxation='hierarchical'; use 'global' or 'verlet'")

    def support_forces(self) -> FloatArray:
        """Return the force of the supports on each fixed node now [N], shape (n_nodes, 3)."""
        body = self._model.body
        self.spread_loads()
        out = room_for_points(len(body.rest))
        write_support_forces(self._model.context, out)
        return out[: body.n_nodes].copy()

    def forget_later(self, before: Iterable[Attachment]) -> None:
        """End those of the attachments before a state was loaded that are not in it."""
        for each in before:
            if each not in self.attachments.all:
                each.is_released = True
                each.forget()

    def stop(self) -> None:
        """Stop all that moves where it was to be at the end of the next step; loads stay."""
        model = self._model
        self.spread_loads()
        self.attachments.stop(model.body)
        model.geoms.stop()

    def spread_loads(self) -> None:
        """Write the loads to the nodes around their points."""
        self.loads.spread(self._model.body, self._model.stages.loads)

    # a step

    def begin_step(self, dt: float) -> None:
        """Move attachments that follow a path in a step of that length [s]."""
        if not self.attachments.is_idle:
            self.attachments.begin_step(self._model.body, dt)
            self._hand_over()

    def begin_increment(self, increment: Increment, has_blade: bool) -> float:
        """Begin an increment; return the loads times the positions of their points [J]."""
        model, loads = self._model, self.loads
        self.attachments.begin_increment(model.body, increment, has_blade)
        model.added_by_attachments = self.attachments.added_frequency_squared
        self.spread_loads()
        return loads.virtual_work(model.body)

    def end_increment(self, before: float, increment: Increment) -> float:
        """End an increment; return the work of loads and of frames that are moved [J].

        `before`: what `begin_increment` returned.
        """
        model = self._model
        self.attachments.end_increment(model.body, increment)
        of_loads = self.loads.virtual_work(model.body) - before
        return of_loads + model.attachments.work

    def end_step(self, dt: float) -> None:
        """Write to attachments what they did in a step of that length [s]."""
        if self.attachments.act:
            self.attachments.end_step(self._model.body, dt)
            self._hand_over()

    def end_support_step(self, dt: float) -> None:
        """Note that supports were led for a step of that length [s]."""
        if self.led_supports.act:
            self.led_supports.end_step(self._model.body, dt)
            self._note_moving()

    def inputs(self, sweep: BladeSweep | None, dt: float) -> StepInputs:
        """Return what acts on the body in the next step, so that the step can be repeated.

        Args:
            sweep: Motion of the blade.
            dt: Length of the step [s].
        """
        loads, attachments, model = self.loads, self.attachments, self._model
        if self.led_supports.act and dt > 0.0:
            self.led_supports.write_velocities(model.body, dt)
            self._note_moving()
        geoms, supports, body = model.geoms, model.supports, model.body
        if not (self.act or geoms.geoms or supports.is_moving):
            return StepInputs(sweep, dt)
        n = body.n_nodes
        return StepInputs(
            sweep,
            dt,
            loads.forces if loads.act else (),
            tuple([each.way for each in attachments.all]) if attachments.act else (),
            geoms.target if geoms.geoms else None,
            body.velocities[:n][body.fixed[:n]] if supports.is_moving else None,
        )

    def give(self, inputs: StepInputs) -> None:
        """Make what acts on the body in the next step what `inputs` returned."""
        model = self._model
        self.loads.forces = inputs.forces
        for each, way in zip(self.attachments.all, inputs.frames, strict=True):
            each.way = way
        if inputs.geoms is not None:
            model.geoms.target = inputs.geoms
        is_moving = inputs.supports is not None
        if is_moving or model.supports.is_moving:
            body = model.body
            fixed = body.fixed[: body.n_nodes]
            body.velocities[: body.n_nodes][fixed] = inputs.supports if is_moving else 0.0
        model.supports.is_moving = int(is_moving)

    # changes of the mesh

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Find what attachments hold in a mesh that has changed."""
        if self.act and self.attachments.act:
            self.attachments.locate(changed.body)
            self._hand_over()

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Do nothing: rows are those of points."""

    def _hand_over(self) -> None:
        """Hand the arrays of the attachments over to the model, on which the integrator works."""
        held = self.attachments
        self.act = self.loads.act or not held.is_idle
        self._model.take_attachments(held.arrays, held.has_fibres, held.added_frequency_squared)


def _supports_at(body: Body, where: str | npt.ArrayLike) -> IntArray:
    """Return the fixed nodes of a region, or of a list.

    Raises:
        ValueError: there is none, or a node of the list is not fixed.
    """
    fixed: BoolArray = body.fixed[: body.n_nodes]
    array = np.asarray(where)
    if array.dtype.kind in "iu":
        nodes = np.atleast_1d(array).astype(np.int64)
        wrong = nodes[(nodes < 0) | (nodes >= body.n_nodes)]
        if wrong.size:
            raise ValueError(f"there is no node {wrong[0]}; the last is {body.n_nodes - 1}")
        free = nodes[~fixed[nodes]]
        if free.size:
            raise ValueError(f"node {free[0]} is not fixed and cannot be moved; {_HOLDS}")
        return nodes
    region = where if isinstance(where, str) else np.asarray(where, dtype=np.bool_)
    found: IntArray = np.flatnonzero(region_mask(body, region) & fixed)
    if not found.size:
        raise ValueError(f"no node of the region {where!r} is fixed; {_HOLDS}")
    return found
