"""A tetrahedral body that a blade can cut: `Tissue._advance` lists the stages of a step."""

from collections.abc import Sequence
from time import perf_counter

import numpy as np
import numpy.typing as npt

from tissue.blade.blade_context import NOT_ENGAGED, BladeContext
from tissue.blade.edge import Edge
from tissue.blade.lazy_result import LazyResult
from tissue.blade.path_tracing import forget_path
from tissue.blade.prescribed_cut import cut_along
from tissue.blade_shape import BladeShape
from tissue.core.array_types import BoolArray, FloatArray
from tissue.core.three_vectors import BladeSweep
from tissue.core.vec3 import Vec3
from tissue.cut_settings import CutReport
from tissue.cutting.incision import CutHooks, Incision
from tissue.cutting.scheme_choice import scheme_of
from tissue.cutting.snapping import EXPLAINED
from tissue.elasticity.internal_forces import Surroundings
from tissue.input_checks import (
    checked_edges,
    checked_fixed,
    checked_floor,
    checked_gravity,
    checked_positions,
    checked_solver,
    checked_time_step,
    edge_of,
    edge_or_error,
    expect_toughness_in_range,
    warn_of_ratio,
    warn_of_toughness,
)
from tissue.integrators.equilibrium import SETTLED, settle
from tissue.integrators.equilibrium_checks import support_of, warn_of_motion
from tissue.integrators.global_stepper import GlobalStepper, method_of
from tissue.integrators.integrator import integrator_of
from tissue.integrators.model import Numerics, assembled
from tissue.integrators.options import Hierarchical
from tissue.integrators.step_context import Increment
from tissue.integrators.step_length import expect_few_steps
from tissue.loads.attachment_list import AttachmentList
from tissue.loads.load import Loads
from tissue.material import Material
from tissue.mesh.body import Body, build_body
from tissue.mesh.bounding_boxes import write_bounds
from tissue.mesh.changes import touched_nodes
from tissue.mesh.cut_error import path_error
from tissue.mesh.star import Visits
from tissue.mesh.validation import expect_sound
from tissue.mesh.workspace import room_for_a_pass
from tissue.solver_settings import SolverSettings
from tissue.stepping.checked_steps import RepeatedSteps
from tissue.stepping.energy_audit import Audit
from tissue.types import SchemeStatistics, StageTimes, StepResult, TetrahedralMesh

NOWHERE = Edge(*(Vec3(*row) for row in ([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]) * 2))
"""The edge of no blade."""


class Tissue(RepeatedSteps):
    """A soft body of tetrahedra: masses at nodes, a material between them, a blade that cuts it.

    Args:
        mesh: The body at rest.
        material: What it is made of.
        fixed: The supports: nodes that do not move, or move as `move_supports` says, shape
            (n_nodes,).
        positions: Where the nodes are at first [m], shape (n_nodes, 3); default at rest. Fixed
            nodes stay there: the paper's displacement boundary conditions.
        gravity: Acceleration of free fall [m/s2].
        floor: Height of a floor, for example a table, below the body [m]; None for no floor.
        blade: The body of the blade, whose faces part the tissue and rub on it; None for the
            paper's blade, a line that cuts.
        solver: How the body is cut and moved.

    Raises:
        MeshError: the mesh is broken, or would have to be repaired
            (`tissue.mesh.validation.checked`).
        ValueError: another argument does not fit the mesh, or is not finite.
    """

    def __init__(
        self,
        mesh: TetrahedralMesh,
        material: Material | None = None,
        *,
        fixed: BoolArray | None = None,
        positions: FloatArray | None = None,
        gravity: Sequence[float] = (0.0, 0.0, -9.81),
        floor: float | None = None,
        blade: BladeShape | None = None,
        solver: SolverSettings = SolverSettings(),
    ) -> None:
        mesh = expect_sound(mesh)
        self.material = material or Material()
        self.blade = blade
        self.floor = floor
        self.solver = solver
        options = checked_solver(solver, self.material)
        surroundings = Surroundings(
            gravity=checked_gravity(gravity),
            drag=float(self.material.viscous_damping),
            retardation_time=float(self.material.retardation_time),
        )
        body = build_body(
            mesh,
            checked_positions(positions, mesh.positions),
            checked_fixed(fixed, len(mesh.positions)),
        )
        if solver.scheme == "paper":
            from tissue.cutting.bielser_1998.mesh_records import with_room_to_hang

            body = with_room_to_hang(body)
        method = method_of(options, self.material.law)
        single = solver.precision == "single"
        together = not isinstance(options, Hierarchical)
        how = Numerics(solver.mass_scaling, method.damps_between_steps, single, together)
        self._system = assembled(body, self.material, surroundings, blade, floor, how)
        self.node_size = self._system.node_size
        warn_of_toughness(self.material, self.node_size)
        warn_of_ratio(self.material)
        checked_floor(floor, float(self.bounds[0, 2]), options)
        scheme = scheme_of(solver.scheme, solver.cut, body, self.material.density, self.node_size)
        self._incision = Incision(scheme, self.node_size)
        self._system.find_loose_pieces()
        self._loads = Loads()
        self._attachments = AttachmentList()
        self._audit = Audit(is_kept=solver.audit)
        self._global_stepper = GlobalStepper(method, solver.threads)
        self._at_first = self._system.measures(method.limit)
        self._integrator = integrator_of(options, self._global_stepper, len(body.rest))
        self._bounds = self.bounds
        self._slit_reach = EXPLAINED * solver.cut.floor * self.node_size
        self._edge_now = (NOWHERE, 1.0)
        self._touched = np.zeros(len(body.rest), dtype=np.int64)
        self._make_room()
        self._audit.begin(self._system, NOWHERE)
        self._begin_state()

    def _advance(self, sweep: BladeSweep | None, dt: float) -> StepResult:
        """Do the stages of `step`."""
        has_blade = sweep is not None
        edge = NOWHERE if sweep is None else edge_of(sweep)
        dt = checked_time_step(dt)
        expect_few_steps(self._system, self._global_stepper.method.limit, dt)
        interaction, incision = self._system.interaction, self._incision
        travel = edge.travel if has_blade else 0.0
        n = incision.n_increments(travel)
        self._begin_step(sweep, edge, dt)
        self._begin_hold(dt)
        n = max(n, self._system.geoms.n_increments) * self._global_stepper.refinement
        n_substeps = 0
        collision = topology = relaxation = 0.0  # wall times
        now = perf_counter()
        for i in range(n):
            increment, begun = Increment(edge, dt, i / n, (i + 1) / n), now
            # RX, relaxation: forces, contact, motion, slip of the blade
            n_substeps += self._relax(increment, has_blade)
            relaxed = perf_counter()
            # CD, collision detection: path, active tetrahedra, crossed edges
            is_crossed = has_blade and self._detect(increment)
            detected = perf_counter()
            # GC, geometric changes: subdivision, separation
            if is_crossed:
                incision.cut(self._hooks)
            elif has_blade and not interaction.is_engaged:
                self._end_incision()
            now = perf_counter()
            relaxation += relaxed - begun
            collision += detected - relaxed
            topology += now - detected
        if has_blade and incision.has_rested(travel, dt):
            incision.open_to_edge(self._hooks)
            topology += perf_counter() - now
        stage_times = StageTimes(collision, topology, relaxation)
        self._end_hold(dt)
        return self._result(edge, has_blade, dt, n_substeps, stage_times)

    def incise(self, edges: npt.ArrayLike, forward: npt.ArrayLike) -> float:
        """Cut along a given surface in the body at rest: no blade, no force, no time passes.

        For tissue that was cut before the scene begins, and for cuts that must be where they are
        told. The surface is ruled: the edge goes in straight lines from each of its places to the
        next. As with a blade only its front cuts; where a point of it goes back, it cuts nothing
        until it is ahead of where it has been.

        Args:
            edges: Places of the cutting edge in the body at rest [m], from tip to heel, shape
                (n_places, n_points, 3), at least two of each.
            forward: Direction in which the edge faces in each place, shape (n_places, 3); or in
                all of them, (3,).

        Returns:
            Area of the faces cut [m2], one side of each.

        Raises:
            ValueError: an array has another shape, is not finite, or an edge faces along itself.
        """
        rows, directions = checked_edges(edges, forward)
        self._begin_change()
        return self._with_room(lambda: self._cut_along(rows, directions))

    def _cut_along(self, rows: FloatArray, directions: FloatArray) -> float:
        """Cut along a surface that was checked; return the area cut [m2]."""
        self._end_incision()
        incision, blade_path = self._incision, self._incision.path
        before = incision.cut_area
        cut_along(incision, self._hooks, rows, directions, self.node_size)
        self._end_incision()
        incision.path = blade_path
        return incision.cut_area - before

    def settle(self) -> int:
        """Relax to equilibrium under gravity, loads and supports; return the steps it took.

        Dynamic relaxation (`tissue.integrators.equilibrium`): all nodes are moved together,
        whatever the integrator. Stress that relaxes (`Material.prony`) has relaxed wholly: this is
        where the body comes to rest at last. A body that still moves a little gets a warning.

        Raises:
            TissueError: nothing holds the body, or a piece of it, against its weight and its loads,
                its motion became unstable, or it does not come to rest. It is then where it was.
        """
        self._begin_change()
        self._with_room(lambda: self._take_edge(None))
        system = self._system
        self._loads.spread(system.body, system.stages.loads)
        self._attachments.stop(system.body)
        system.geoms.stop()
        support = support_of(system, self.material, self.floor)
        found = settle(self._global_stepper, system, NOWHERE, support)
        self._integrator.body_moved(system.body)
        if found.is_at_rest:
            self._global_stepper.let_rest(system)
        else:
            warn_of_motion(system, found.n_steps, found.accelerations, support, SETTLED)
        write_bounds(system.body, self._bounds)
        self._audit.begin(self._system, NOWHERE)
        return found.n_steps

    def cut_report(self) -> CutReport:
        """Return the path error of the cuts so far, and what they did to elements and time step."""
        error, solver = path_error(self._body), self.solver
        return CutReport(
            n_cut_nodes=error.n_nodes,
            path_error_mean=error.mean,
            path_error_largest=error.largest,
            node_size=self.node_size,
            guard=0.0 if solver.scheme == "paper" else solver.cut.guard * self.node_size,
            initial=self._at_first,
            now=self._system.measures(self._global_stepper.method.limit),
        )

    def scheme_statistics(self) -> SchemeStatistics | None:
        """Return what the paper's scheme did so far; None where another scheme cuts."""
        return self._incision.scheme.statistics(self._system.body)

    # stages of a step

    def _begin_step(self, sweep: BladeSweep | None, edge: Edge, dt: float) -> None:
        """Take the edge, and start the totals of a step.

        Raises:
            ValueError: no blade can move so, or it does not fit the mesh.
        """
        system = self._system
        if sweep is None:
            self._take_edge(None)
        elif system.interaction.is_other_edge(edge.length):
            edge_or_error(sweep)  # before the tissue is released
            self._take_edge(edge)
        if not system.interaction.begin_step(system.body, edge, dt, sweep is None):
            assert sweep is not None
            edge_or_error(sweep)  # it takes numbers whose squares are not finite
            system.interaction.begin_step(system.body, edge, dt, True)
        self._edge_now = (edge, 0.0)
        system.contact.begin()

    def _relax(self, increment: Increment, has_blade: bool) -> int:
        """Relax by an increment; return the substeps that it took."""
        system = self._system
        before = self._begin_driving(increment, has_blade)
        n = self._integrator.relax(system, self._blade_context, increment, has_blade)
        self._audit.work_of_loads += self._driven_work(before, increment)
        self._audit.lost_at_geoms += system.geoms.arrays.dissipated
        if n > 0:
            self._audit.forget()
        self._edge_now = (increment.edge, increment.end)
        return n

    def _detect(self, increment: Increment) -> bool:
        """Trace the path of the edge through the material; return whether it crossed anything."""
        interaction, incision = self._system.interaction, self._incision
        travel = interaction.trace(self._blade_context, increment.edge, increment.end)
        if travel == NOT_ENGAGED:
            return False
        incision.has_begun = True
        return incision.detect(*self._mesh(), travel)

    def _end_incision(self) -> None:
        """Resolve what the blade left uncut; the next contact begins another incision."""
        if self._incision.has_begun:
            self._incision.end(self._hooks)
            self._system.incision_ended()
            forget_path(self._incision.path)

    def _result(
        self, edge: Edge, has_blade: bool, dt: float, n_substeps: int, stage_times: StageTimes
    ) -> StepResult:
        """Return what the step did."""
        system, incision = self._system, self._incision
        report = system.report(self._blade_context, edge, dt)
        amounts, change = report.amounts, incision.scheme.change
        return LazyResult.of(
            report,
            system.geoms if system.geoms.act else None,
            int(amounts.n_tetrahedra),
            int(amounts.n_nodes),
            incision.scheme.n_active,
            int(amounts.tip_tetrahedron) if has_blade else -1,
            amounts.anchored_length,
            change.area,
            change.finished_area,
            amounts.work_of_blade,
            amounts.work_of_cutting,
            n_substeps,
            system.contact.report(dt),
            stage_times,
            self._audit.energies(system, edge),
        )

    @property
    def _blade_context(self) -> BladeContext:
        system, path = self._system, self._incision.path
        where = (path, self._bounds, self._slit_reach)
        return system.interaction.context(system.body, system.visits, *where)

    # changes of the mesh

    @property
    def _hooks(self) -> CutHooks:
        return CutHooks(self._before_cut, self._after_pass, self._after_cut, self._mesh)

    def _mesh(self) -> tuple[Body, Visits]:
        return self._system.body, self._system.visits

    def _before_cut(self) -> None:
        self._audit.before_cut(self._system, *self._edge_now)

    def _after_pass(self) -> None:
        """Update what depends on the tetrahedra that changed, and make room for another pass."""
        system, change = self._system, self._incision.scheme.change
        if change.n_dirty == 0 and not change.is_full:
            return
        n = touched_nodes(system.body, change, system.visits, self._touched)
        if n:
            self._chunks = None
            self._audit.forget()
            nodes = self._touched[:n]
            system.mesh_changed(change, nodes, *self._edge_now)
            self._integrator.mesh_changed(nodes)
            self._hold_again()
        self._make_room()

    def _after_cut(self) -> None:
        self._audit.after_cut(self._system, *self._edge_now)

    def _make_more_room(self, lacking: int) -> None:
        self._incision.scheme.make_room(lacking)
        self._make_room()

    def _make_room(self) -> None:
        """Make room for the next pass of a cut: arrays double when they are nearly full."""
        room = room_for_a_pass(self._system.body, self._incision.scheme.doubled_nodes)
        if room is not None:
            self._system.grow(*room)
            self._incision.scheme.grow(*room)
            self._integrator.grow(room[0])
            self._touched = np.zeros(room[0], dtype=np.int64)

    def _take_edge(self, edge: Edge | None) -> None:
        """Take the edge of this blade; another blade, or none, releases the tissue."""
        length = 0.0 if edge is None else edge.length
        interaction = self._system.interaction
        if interaction.is_other_edge(length):
            if edge is not None:
                interaction.expect_usable_edge(length)
                expect_toughness_in_range(self.material, self.node_size)
            self._end_incision()
            interaction.replace_edge(length, self._system.body, *self._edge_now)
            self._incision.take_edge(interaction.n_samples)
