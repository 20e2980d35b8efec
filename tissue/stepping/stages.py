"""`StepStages`: the stages of a time step, in the order in which `advance` lists them."""

from collections.abc import Sequence
from operator import is_
from time import perf_counter

import numpy as np

from tissue.blade.blade_context import NOT_ENGAGED, trace
from tissue.blade.edge import NOWHERE, Edge, edge_of, edge_or_error
from tissue.blade.path_tracing import forget_path
from tissue.blade.prescribed_cut import cut_along
from tissue.blade.toughness import expect_toughness_in_range
from tissue.body_view import BodyChunks, bounds_of_body
from tissue.core.array_types import FloatArray
from tissue.core.jit import SameTypes
from tissue.core.structs import Arrays
from tissue.core.three_vectors import BladeSweep
from tissue.cut_settings import CutReport
from tissue.cutting.incision import CutHooks, Incision
from tissue.forces.attachments import fibre_boxes
from tissue.forces.step_context import Increment, StepContext
from tissue.integrators.equilibrium import SETTLED, settle
from tissue.integrators.equilibrium_checks import support_of, warn_of_motion
from tissue.integrators.global_stepper import GlobalStepper, expect_few_steps
from tissue.integrators.integrator import Integrator, UnstableError
from tissue.integrators.model import TissueModel
from tissue.loads.handles import Handles
from tissue.material import Material
from tissue.mesh.body import Body
from tissue.mesh.bounding_boxes import write_bounds
from tissue.mesh.changes import ChangedMesh, Owner, room_for_a_pass, touched_nodes
from tissue.mesh.star import Visits
from tissue.mesh.surface import path_error
from tissue.solver_settings import SolverSettings
from tissue.stepping.energy_audit import Audit
from tissue.stepping.frame import (
    BEGUN,
    MANY_STEPS,
    NOT_FINITE_BEFORE,
    OTHER_EDGE,
    TOO_FAR,
    FrameContext,
    begin_frame,
    end_frame,
)
from tissue.stepping.lazy_result import LazyResult
from tissue.types import Chunks, StageTimes, StepResult

_TOUCHED = SameTypes(touched_nodes)

FAULT_BEFORE = "a number of its state was not finite before the step"


class StepStages:
    """The stages of the steps of one tissue. All that its next step depends on is here.

    Args:
        model: The body, and all that acts on it.
        materials: What it is made of, the stiffest first.
        incision: Brings the path of the blade into the mesh.
        global_stepper: Moves all nodes together, at least where the body settles.
        integrator: Moves the nodes in a step; it may be the same.
        audit: The account of the energy.
        slit_reach: Distance from a cut face up to which a point is in the slit [m]
            (`tissue.blade.edge_search.is_in_slit`).
    """

    def __init__(
        self,
        model: TissueModel,
        materials: Sequence[Material],
        incision: Incision,
        global_stepper: GlobalStepper,
        integrator: Integrator,
        audit: Audit,
        slit_reach: float,
    ) -> None:
        self.model = model
        self.materials = materials
        self.incision = incision
        self.global_stepper = global_stepper
        self.integrator = integrator
        self.audit = audit
        self.handles = Handles(model)
        """Loads, attachments and supports."""
        self.chunks = BodyChunks()
        """Boxes that together hold the body."""
        self._slit_reach = slit_reach
        self._frame: FrameContext | None = None
        self._parts: tuple[object, ...] = ()
        self._n_made = 0
        self._begin_frame, self._trace = SameTypes(begin_frame), SameTypes(trace)
        self._end_frame = SameTypes(end_frame)
        self._bounds = bounds_of_body(model.body)
        self._at_first = model.measures(global_stepper.method.number)
        self.make_room()
        audit.begin(self.context, NOWHERE)

    @property
    def owners(self) -> tuple[Owner, ...]:
        """All that follows changes of the mesh, and grows with it, in that order: the model first.

        The others see its new body. Cores add to the masses that elasticity wrote.
        """
        model = self.model
        return (
            model,
            model.elasticity,
            model.cores,
            model.interaction,
            model.contact,
            model.geoms,
            self.integrator,
            self.handles,
            self.chunks,
            self.audit,
            self.incision,
        )

    def advance(self, sweep: BladeSweep | None, dt: float) -> StepResult:
        """Do the stages of a step; see `tissue.Tissue.step`.

        Raises:
            ValueError: no blade can move so, it does not fit the mesh, or the step is too long.
            UnstableError: a number of the state was not finite before, or the motion is unstable.
        """
        has_blade = sweep is not None
        edge = NOWHERE if sweep is None else edge_of(sweep)
        model, incision, handles = self.model, self.incision, self.handles
        n, travel = self._begin(sweep, edge, dt)
        model.cut_faces.pass_time(dt)
        n_substeps = 0
        collision = topology = relaxation = 0.0  # wall times
        now = perf_counter()
        for i in range(n):
            increment, started = Increment(edge, dt, i / n, (i + 1) / n), now
            # RX, relaxation: forces, contact, motion, slip of the blade
            n_substeps += self._relax(increment, has_blade)
            relaxed = perf_counter()
            # CD, collision detection: path, active tetrahedra, crossed edges
            is_crossed = has_blade and self._detect(increment)
            detected = perf_counter()
            # GC, geometric changes: subdivision, separation
            if is_crossed:
                incision.cut(self.hooks)
            elif has_blade and incision.has_begun and not model.interaction.is_engaged:
                self.end_incision()
            now = perf_counter()
            relaxation += relaxed - started
            collision += detected - relaxed
            topology += now - detected
        if has_blade and incision.has_begun and incision.has_rested(travel, dt):
            incision.open_to_edge(self.hooks)
            topology += perf_counter() - now
        if model.geoms.are_led:
            model.geoms.stop()
        if handles.act:
            handles.end_step(dt)
        handles.end_support_step(dt)
        stage_times = StageTimes(collision, topology, relaxation)
        return self._result(edge, has_blade, dt, n_substeps, stage_times)

    def _begin(self, sweep: BladeSweep | None, edge: Edge, dt: float) -> tuple[int, float]:
        """Take the edge, and begin a step; return its increments and how far the edge moves [m]."""
        model, has_blade, outcome = self.model, sweep is not None, BEGUN
        while True:
            frame = self.frame_now()
            numbers = dt, model.interaction.edge_length, model.added_by_attachments
            outcome = self._begin_frame.call(frame, edge, has_blade, *numbers, outcome)
            if outcome == BEGUN:
                break
            self._follow_up(outcome, sweep, edge, dt)
        n, travel = frame.n_increments, frame.travel
        if model.geoms.geoms:
            n = max(n, model.geoms.begin_step(model.body, dt))
        model.interaction.edge_now = (edge, 0.0)
        if self.handles.act:
            self.handles.begin_step(dt)
        return n * self.global_stepper.refinement, travel

    def _follow_up(self, outcome: int, sweep: BladeSweep | None, edge: Edge, dt: float) -> None:
        """Run what the begin of a step needs, or refuse the step; see `begin_frame`."""
        model = self.model
        if outcome == NOT_FINITE_BEFORE:
            raise UnstableError(FAULT_BEFORE)
        if outcome == MANY_STEPS:
            expect_few_steps(model, self.global_stepper.method.number, dt)
        elif outcome == TOO_FAR:
            self.incision.n_increments(edge.travel)
        elif sweep is None:
            self.take_edge(None)
        else:
            edge_or_error(sweep)  # before the tissue is released
            if outcome == OTHER_EDGE:
                self.take_edge(edge)

    def _relax(self, increment: Increment, has_blade: bool) -> int:
        """Relax by an increment; return the substeps that it took."""
        model, handles, audit, account = self.model, self.handles, self.audit, self.audit.account
        before, is_driven = 0.0, handles.act
        if is_driven:
            if handles.loads.act or handles.attachments.act:
                self.global_stepper.wake()
            before = handles.begin_increment(increment, has_blade)
        n = self.integrator.relax(model, self.frame_now().relaxation, increment, has_blade)
        geoms = model.geoms.arrays
        of_loads = handles.end_increment(before, increment) if is_driven else 0.0
        account.work_of_loads += of_loads + geoms.work
        account.lost_at_geoms += geoms.dissipated
        if n > 0:
            audit.is_known = False
        model.interaction.edge_now = (increment.edge, increment.end)
        return n

    def _detect(self, increment: Increment) -> bool:
        """Trace the path of the edge through the material; return whether it crossed anything."""
        incision, blade = self.incision, self.frame_now().relaxation.blade
        travel = self._trace.call(blade, increment.edge, increment.end)
        if travel == NOT_ENGAGED:
            return False
        incision.has_begun = True
        return incision.detect(blade.body, blade.visits, travel)

    def end_incision(self) -> None:
        """Resolve what the blade left uncut; the next contact begins another incision."""
        if self.incision.has_begun:
            self.incision.end(self.hooks)
            self.model.incision_ended()
            forget_path(self.incision.path)

    def _result(
        self, edge: Edge, has_blade: bool, dt: float, n_substeps: int, stage_times: StageTimes
    ) -> StepResult:
        """Return what the step did."""
        model, scheme, audit = self.model, self.incision.scheme, self.audit
        frame = self.frame_now()
        self._end_frame.call(frame, edge, dt, audit.take(edge, 1.0))
        model.report_fibres(edge)
        change, geoms = scheme.change, model.geoms
        return LazyResult.of(
            frame.relaxation.blade.report,
            model.interaction.contacts,
            geoms if geoms.arrays.n_contacts > 0 else None,
            audit.account.energies.copy() if audit.is_kept else None,
            has_blade,
            (scheme.n_active, change.area, change.finished_area),
            (n_substeps, model.contact.report(dt), stage_times),
        )

    @property
    def context(self) -> StepContext:
        """The body and all that acts on it, as the kernels of an integrator take it."""
        return self.frame_now().relaxation.step

    def frame_now(self) -> FrameContext:
        """Return what the kernels of a step work on; another struct where arrays were replaced."""
        if self._frame is not None and self._n_made == Arrays.n_made:
            return self._frame
        model, stepper, path = self.model, self.global_stepper, self.incision.path
        interaction, contact, geoms = model.interaction, model.contact, model.geoms
        parts = (
            *(model.body, model.visits, model.stages, model.elasticity.arrays),
            *(model.supports, model.attachments, model.loose, model.damping, model.cores.arrays),
            *(interaction.state, interaction.grid, interaction.latest_report, path),
            *(contact.search, contact.forces, geoms.arrays, geoms.search, geoms.faces),
            stepper.choice,
        )
        if self._frame is None or not all(map(is_, parts, self._parts)):
            blade = interaction.context(*parts[:2], path, self._bounds, self._slit_reach)
            self._frame = FrameContext(
                n_increments=1,
                travel=0.0,
                relaxation=stepper.arrays(model, blade),
                account=self.audit.account,
                node_size=float(model.node_size),
            )
            self._parts = (*parts[:-1], stepper.choice)
        self._n_made = Arrays.n_made
        return self._frame

    # between steps

    def chunks_now(self) -> Chunks:
        """Return boxes that together hold the body and its ligaments.

        After a cut the body is divided again, which takes some 0.3 us a tetrahedron; else it costs
        one pass over the nodes.
        """
        model, found = self.model, self.chunks.boxes(self.model.body)
        if not model.has_fibres:
            return found
        boxes = fibre_boxes(model.attachments, model.body.positions)
        return found._replace(boxes=np.concatenate((found.boxes, boxes))) if len(boxes) else found

    def cut_report(self, solver: SolverSettings) -> CutReport:
        """Return what cuts did so far; see `tissue.Tissue.cut_report`."""
        model = self.model
        error = path_error(model.body)
        return CutReport(
            n_cut_nodes=error.n_nodes,
            path_error_mean=error.mean,
            path_error_largest=error.largest,
            node_size=model.node_size,
            guard=0.0 if solver.scheme == "paper" else solver.cut.guard * model.node_size,
            initial=self._at_first,
            now=model.measures(self.global_stepper.method.number),
        )

    def cut_along(self, rows: FloatArray, directions: FloatArray) -> float:
        """Cut along a surface; return the area cut [m2].

        Args:
            rows: Places of the edge in the body at rest [m], shape (n_places, n_points, 3).
            directions: Unit vectors in which it faces, shape (n_places, 3).
        """
        self.end_incision()
        incision, blade_path = self.incision, self.incision.path
        before, faces = incision.cut_area, self.model.cut_faces
        faces.is_given = True
        cut_along(incision, self.hooks, rows, directions, self.model.node_size)
        self.end_incision()
        faces.is_given = False
        incision.path = blade_path
        self._frame = None  # it may have the other path, and no struct was made for this one
        return incision.cut_area - before

    def settle(self, floor: float | None) -> int:
        """Relax to equilibrium; return the steps it took. See `tissue.Tissue.settle`.

        `floor`: height of the floor below the body [m]; None for no floor.
        """
        model = self.model
        self.handles.stop()
        support = support_of(model, self.materials[0], floor)
        found = settle(self.global_stepper, model, NOWHERE, support)
        self.integrator.body_moved(model.body)
        if found.is_at_rest:
            self.global_stepper.let_rest(model)
        else:
            warn_of_motion(model, found.n_steps, found.accelerations, support, SETTLED)
        write_bounds(model.body, self._bounds)
        self.audit.begin(self.context, NOWHERE)
        return found.n_steps

    def take_edge(self, edge: Edge | None) -> None:
        """Take the edge of this blade; another blade, or none, releases the tissue."""
        length, interaction = 0.0 if edge is None else edge.length, self.model.interaction
        if interaction.is_other_edge(length):
            if edge is not None:
                interaction.expect_usable_edge(length)
                for material in self.materials:
                    expect_toughness_in_range(material, self.model.node_size)
            self.end_incision()
            self.model.replace_edge(length)
            self.incision.take_edge(interaction.n_samples)

    # changes of the mesh

    @property
    def hooks(self) -> CutHooks:
        """Calls of the incision while it cuts."""
        return CutHooks(self._before_cut, self._after_pass, self._after_cut, self.mesh)

    def mesh(self) -> tuple[Body, Visits]:
        """Return the body as it is now, and scratch for searches."""
        return self.model.body, self.model.visits

    def _before_cut(self) -> None:
        self.model.elasticity.before_cut(self.model.body)
        self.audit.before_cut(self.context, *self.model.interaction.edge_now)

    def _after_pass(self) -> None:
        """Update what depends on the tetrahedra that changed, and make room for another pass."""
        model, change = self.model, self.incision.scheme.change
        if change.n_dirty == 0 and not change.is_full:
            return
        n = _TOUCHED.call(model.body, change, model.visits, model.touched)
        if n:
            changed = ChangedMesh(model.body, model.visits, change, model.touched[:n])
            for owner in self.owners:
                owner.mesh_changed(changed)
        self.make_room()

    def _after_cut(self) -> None:
        self.model.elasticity.after_cut(self.model.body)
        self.audit.after_cut(self.context, *self.model.interaction.edge_now)

    def make_room(self) -> None:
        """Make room for the next pass of a cut: arrays double when they are nearly full."""
        room = room_for_a_pass(self.model.body, self.incision.scheme.doubled_nodes)
        if room is not None:
            for owner in self.owners:
                owner.grow(*room)

    def make_more_room(self, lacking: int) -> None:
        """Make twice the room for what lacked it in a cut; see `NoRoomError`."""
        self.incision.scheme.make_room(lacking)
        self.make_room()
