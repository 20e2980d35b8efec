"""A tetrahedral body that a blade can cut: `Tissue` owns every array, `step` lists the stages."""

import math
from collections.abc import Callable, Sequence
from time import perf_counter

import numpy as np
import numpy.typing as npt

from tissue.blade.anchors import (
    Edge,
    anchored_length,
)
from tissue.blade.forces import begin_step, clear_tool
from tissue.blade.impulse_totals import (
    WORK_OF_BLADE,
    WORK_OF_CUTTING,
)
from tissue.blade.interaction import MOST_SAMPLES, SAMPLES_PER_NODE_SIZE, Grip
from tissue.blade.path_tracing import forget_path, trace_path
from tissue.blade.prescribed_path import begin_path, prescribe_path
from tissue.blade_shape import BladeShape
from tissue.contact.self_contact import SelfContact
from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.core.vec3 import Vec3
from tissue.cut_settings import CutReport, CutSettings, MeshMeasures
from tissue.cutting.blade_path import Path, new_path, path_travel, put_on_lattice, resampled
from tissue.cutting.scheme import Scheme, checked_scheme
from tissue.cutting.snapping import EXPLAINED
from tissue.cutting.stellar_scheme import StellarScheme
from tissue.cutting.workspace import SPARE_NODES, Quality
from tissue.elasticity.elasticity import Elasticity
from tissue.elasticity.internal_forces import Surroundings
from tissue.energy_audit import Audit
from tissue.input_checks import (
    checked_audit,
    checked_edge,
    checked_edges,
    checked_fixed,
    checked_floor,
    checked_gravity,
    checked_positions,
    checked_threads,
)
from tissue.integrators.choice import relaxation_of
from tissue.integrators.dynamic_relaxation import settle
from tissue.integrators.global_stepper import GlobalStepper
from tissue.integrators.options import LocalTimeStepping, Relaxing, checked_relaxation
from tissue.integrators.runge_kutta import new_stages
from tissue.integrators.stability import stable_step
from tissue.integrators.step_context import Motion
from tissue.material import Material
from tissue.material_warnings import warn_of_ratio, warn_of_toughness
from tissue.mesh.body import Body, build_body, grown_body
from tissue.mesh.bounding_boxes import Survey, survey, survey_of
from tissue.mesh.changes import touched_nodes
from tissue.mesh.chunks import ChunkNodes, chunk_nodes, chunks_of
from tissue.mesh.cut_error import lowest_altitude, path_error
from tissue.mesh.pieces import label_pieces, piece_of_tetrahedra, pieces_of
from tissue.mesh.point_location import build_grid
from tissue.mesh.star import LARGEST_STAR, Visits, mean_node_size, no_visits
from tissue.mesh.surface import boundary_surface
from tissue.mesh.validation import expect_sound
from tissue.types import (
    BladeSweep,
    Chunks,
    Energies,
    Piece,
    SchemeStatistics,
    Snapshot,
    StageTimes,
    StepResult,
    Surface,
    TetrahedralMesh,
)

INCREMENT = 0.25
"""Share of the mean node size by which the edge moves between two cuts at most. Coarser steps on
steep curves leave tetrahedra that bridge the cut."""

RESTING_SPEED = 0.2
"""Mean node sizes per second below which the edge counts as at rest."""
RESTING_TIME = 0.02
"""How long it is so before the cut opens up to the edge [s]. A trembling hand stands still for an
instant at each turn; to lay a crack front there each time would shred the mesh."""

SHEET_MARGIN = 0.5
"""How far outside the skin the sheet begins and ends, per mean node size."""

ROOM_FOR_TETRAHEDRA = 1 << 12
"""Free tetrahedra that a pass of a cut step begins with; more are made between passes."""

NOWHERE = Edge(*(Vec3(*row) for row in ([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]) * 2))
"""The edge of no blade."""


class TissueError(RuntimeError):
    """The tissue cannot go on."""


class Tissue:
    """A soft body of tetrahedra: masses at nodes, springs along edges, and a blade that cuts it.

    Args:
        mesh: The body at rest.
        material: What it is made of.
        fixed: Nodes that do not move, shape (n_nodes,).
        positions: Where the nodes are at first [m], shape (n_nodes, 3); default at rest. Fixed
            nodes stay there: the paper's displacement boundary conditions.
        gravity: [m/s2].
        floor: Height of a floor, for example a table, below the body [m]; None for no floor.
        quality: How closely cuts follow the blade, where the scheme lets one choose.
        scheme: How the mesh is cut: "stellar", or "paper" for that of Bielser, Maiwald and Gross,
            with its limits (`tissue.cutting.bielser_1998`).
        threads: How many threads share the loops over the body. The result is the same to the
            last bit; more than one pays from about 30,000 tetrahedra on, and only where no other
            program needs the cores.
        relaxation: How the motion is advanced: "global", all nodes together; "local", small
            elements in substeps and what rests asleep; "hierarchical", the paper's; or
            `LocalTimeStepping` or `Hierarchical` with settings (`tissue.integrators.options`).
        blade: The body of the blade, whose faces part the tissue and rub on it; None for the
            paper's blade, a line that cuts.
        audit: Whether to keep an account of the energy (`StepResult.energies`), for a global
            relaxation. It takes about as long as the motion itself, and one thread.

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
        quality: CutSettings | None = None,
        scheme: str = "stellar",
        threads: int = 1,
        relaxation: str | Relaxing = "global",
        blade: BladeShape | None = None,
        audit: bool = False,
    ) -> None:
        expect_sound(mesh)
        checked_scheme(scheme)
        checked_threads(threads)
        self.material = material or Material()
        self.blade = blade
        self.floor = floor
        relaxing = checked_relaxation(relaxation, self.material)
        checked_audit(audit, relaxing)
        self._surroundings = Surroundings(
            checked_gravity(gravity),
            self.material.viscous_damping,
            self.material.retardation_time,
        )
        self._audit = Audit(self._surroundings.gravity) if audit else None
        self._all_together = GlobalStepper(threads, self._audit.audited if self._audit else None)
        self._body = build_body(
            mesh,
            checked_positions(positions, mesh.positions),
            checked_fixed(fixed, len(mesh.positions)),
        )
        if scheme == "paper":
            from tissue.cutting.bielser_1998.mesh_records import with_room_to_hang

            self._body = with_room_to_hang(self._body)
        n_nodes, n_tetrahedra = self.n_nodes, self.n_tetrahedra
        self._around = np.zeros(LARGEST_STAR, dtype=np.int64)
        self._visits = no_visits(n_nodes, n_tetrahedra)
        self._stages = new_stages(n_nodes)
        self._path = new_path(2)
        self._incising = False
        self._is_open = False
        self._calm = 0.0

        is_local = isinstance(relaxing, LocalTimeStepping)
        self._elasticity = Elasticity(self.material, self._body, self._visits, is_tight=is_local)
        self.node_size = mean_node_size(self._body, self._visits, self._around)
        self._grip = Grip(blade, self.material, self.node_size, n_tetrahedra)
        warn_of_toughness(self.material, self.node_size)
        warn_of_ratio(self.material)
        quality = quality or CutSettings()
        volume = self._body.masses.sum() / self.material.density
        self._snap_floor = float(quality.floor * self.node_size)
        self._scheme: Scheme
        if scheme == "paper":  # imported late: its kernels would cost every start 0.8 s
            from tissue.cutting.bielser_1998.scheme import PaperScheme

            self._scheme = PaperScheme(self._body, self.material.density, self.node_size)
        else:
            lengths = Quality(
                snap=float(quality.snap),
                floor=self._snap_floor,
                guard=float(quality.guard * self.node_size),
                crumb=float(quality.crumb * volume / n_tetrahedra),
            )
            self._scheme = StellarScheme(lengths, n_nodes, n_tetrahedra)
        checked_floor(floor, float(self.bounds[0, 2]))
        self._contact = SelfContact(self._body, self.node_size, self.material.friction, floor)
        self._guard = 0.0 if scheme == "paper" else quality.guard * self.node_size
        self._at_first = self._measures()
        self._relaxation = relaxation_of(relaxing, self._all_together, self._body, self._elasticity)
        self._box = survey(self._body)
        self._now = (NOWHERE, 1.0)
        self._chunks: ChunkNodes | None = None
        self._grow()
        self._begin_audit()

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return self._body.n_nodes

    @property
    def n_tetrahedra(self) -> int:
        """Number of tetrahedra."""
        return self._body.n_tetrahedra

    @property
    def bounds(self) -> FloatArray:
        """Lowest and highest corner of the body [m], shape (2, 3)."""
        low, high, _ = survey(self._body)
        return np.array([low, high])

    def step(self, sweep: BladeSweep | None, dt: float) -> StepResult:
        """Let the body live through `dt` [s] while the blade does `sweep`.

        Args:
            sweep: Motion of the cutting edge, or None where no blade is near.
            dt: [s]. It is divided as stability and the speed of the blade need.

        Raises:
            ValueError: the blade has no length, or a number is not finite.
            TissueError: the motion of the tissue became unstable.
        """
        edge = NOWHERE if sweep is None else checked_edge(sweep)
        if not (math.isfinite(dt) and dt >= 0.0):
            raise ValueError(f"dt is {dt} s; it must be finite and not negative")
        self._take(None if sweep is None else edge)
        self._now = (edge, 0.0)
        begin_step(self._grip.tool, self._body, edge, dt)
        self._contact.begin()
        collision = topology = relaxation = 0.0
        n_substeps = 0
        travel = 0.0 if sweep is None else _travel(edge)
        n_increments = self._n_parts(travel)  # so that the edge moves little in each
        for i in range(n_increments):
            begin, end = i / n_increments, (i + 1) / n_increments
            started = perf_counter()
            self._feel(edge if sweep else None, begin)
            n_substeps += self._relax(edge, dt, begin, end)
            self._now = (edge, end)
            if sweep is not None:
                self._hold(edge, end)
            relaxed = perf_counter()
            detected = sweep is not None and self._detect()
            collided = perf_counter()
            if detected:
                self._cut(self._scheme.cut)
            relaxation += relaxed - started
            collision += collided - relaxed
            topology += perf_counter() - collided
        is_closed = self._incising and not self._is_open
        if is_closed and sweep is not None and self._rests(travel, dt):
            started = perf_counter()
            self._open_up()
            topology += perf_counter() - started
        return self._result(
            edge, sweep, dt, n_substeps, StageTimes(collision, topology, relaxation)
        )

    def incise(self, edges: npt.ArrayLike, forward: npt.ArrayLike) -> float:
        """Cut along a given surface in the body at rest: no blade, no force, no time passes.

        For tissue that was cut before the scene begins, and for cuts that must be where they are
        told. The surface is ruled: the edge goes in straight lines from each of its places to the
        next. As with a blade only its front cuts; where a point of it goes back, it cuts nothing
        until it is ahead of where it has been.

        Args:
            edges: Places of the cutting edge in the body at rest [m], from tip to heel, shape
                (n_places, n_points, 3), at least two of each.
            forward: Where the edge faces in each place, shape (n_places, 3); or always, (3,).

        Returns:
            Area of the faces cut [m2], one side of each.

        Raises:
            ValueError: an array has another shape, is not finite, or an edge faces along itself.
        """
        rows, ways = checked_edges(edges, forward)
        self._end_incision()
        before = self._scheme.change.area
        spacing = self.node_size / SAMPLES_PER_NODE_SIZE
        rows = resampled(rows, spacing, MOST_SAMPLES)
        blade, self._path = self._path, new_path(rows.shape[1])
        grid = build_grid(self._body, self._body.rest, 0.0)
        begin_path(self._path, rows[0])
        prescribe_path(self._path, self._body, grid, rows[0], Vec3(*ways[0].tolist()))
        self._incising = True
        self._open_up()  # where the edge begins within the body, so does the cut
        for i in range(1, len(rows)):
            n = self._n_parts(float(np.linalg.norm(rows[i] - rows[i - 1], axis=1).max()))
            for j in range(1, n + 1):
                at = j / n
                points = (1.0 - at) * rows[i - 1] + at * rows[i]
                way = Vec3(*((1.0 - at) * ways[i - 1] + at * ways[i]).tolist())
                prescribe_path(self._path, self._body, grid, points, way)
                if self._detect():
                    self._cut(self._scheme.cut)
        self._end_incision()
        self._path = blade
        return self._scheme.change.area - before

    def settle(self) -> int:
        """Relax to equilibrium under gravity and fixed displacements; return the steps it took.

        Dynamic relaxation with kinetic damping: the nodes are stopped whenever their kinetic energy
        has passed a peak. All nodes are moved together, whatever the relaxation.
        """
        self._take(None)
        n_steps = settle(self._all_together, self._motion(NOWHERE, 0.0, 0.0, 1.0))
        self._relaxation.body_moved(self._body, self._elasticity)
        self._box = survey(self._body)
        self._begin_audit()
        return n_steps

    def snapshot(self) -> Snapshot:
        """Return a copy of the whole state."""
        n, body = self.n_nodes, self._body
        return Snapshot(
            body.positions[:n].copy(),
            body.rest[:n].copy(),
            body.velocities[:n].copy(),
            body.masses[:n].copy(),
            body.tetrahedra[: self.n_tetrahedra].copy(),
            body.fixed[:n].copy(),
        )

    def surface(self) -> Surface:
        """Return the boundary triangles, skin and cut faces apart."""
        return boundary_surface(self._body)

    def chunks(self) -> Chunks:
        """Return boxes that together hold the body: where a blade outside of them touches nothing.

        After a cut the body is divided anew, which takes some 0.3 us a tetrahedron; else it costs a
        look at each node.
        """
        if self._chunks is None:
            self._chunks = chunk_nodes(self._body)
        return chunks_of(self._body, self._chunks)

    def n_pieces(self) -> int:
        """Return the number of connected pieces."""
        piece, queue = np.empty((2, self.n_tetrahedra), dtype=np.int64)
        return label_pieces(self._body, piece, queue)

    def pieces(self) -> tuple[Piece, ...]:
        """Return the connected pieces and their mass properties, the largest at rest first."""
        return pieces_of(self.snapshot())

    def piece_of_tetrahedra(self) -> IntArray:
        """Return the piece that each tetrahedron is in, shape (n_tets,): its place in `pieces`."""
        return piece_of_tetrahedra(self.snapshot())

    def quality(self) -> CutReport:
        """Return the path error of the cuts so far, and what they did to elements and time step."""
        error = path_error(self._body)
        return CutReport(
            n_cut_nodes=error.n_nodes,
            path_error_mean=error.mean,
            path_error_largest=error.largest,
            node_size=self.node_size,
            guard=self._guard,
            initial=self._at_first,
            now=self._measures(),
        )

    def scheme_statistics(self) -> SchemeStatistics | None:
        """Return what the paper's scheme did so far; None where another scheme cuts."""
        return self._scheme.statistics(self._body)

    # stages of a step

    def _relax(self, edge: Edge, dt: float, begin: float, end: float) -> int:
        """Advance the motion over a part of the step; return the steps that it took."""
        motion = self._motion(edge, dt, begin, end)
        if motion.span == 0.0:
            return 0
        n = self._relaxation.relax(motion)
        self._box = self._survey()
        if not self._box.is_finite:
            raise TissueError(
                "the motion of the tissue became unstable: the position of a node is no finite "
                "number. Use a shorter time step, or a material that is softer or heavier"
            )
        return n

    def _motion(self, edge: Edge, dt: float, begin: float, end: float) -> Motion:
        return Motion(
            body=self._body,
            elasticity=self._elasticity,
            contact=self._contact,
            tool=self._grip.tool,
            edge=edge,
            visits=self._visits,
            stages=self._stages,
            queue=self._around,
            surroundings=self._surroundings,
            reach=self.node_size,
            dt=dt,
            begin=begin,
            end=end,
        )

    def _survey(self) -> Survey:
        """Return where the body is, from what may have moved since the last survey."""
        moving = self._relaxation.moving
        if moving is None or 2 * moving[1] > self.n_nodes:
            return survey(self._body)
        return survey_of(self._body, *moving, self._box)

    def _feel(self, edge: Edge | None, when: float) -> None:
        """Find the faces of the tissue that the faces of the blade may touch."""
        moved = self._relaxation.moved
        self._grip.feel(self._body, self._visits, moved, edge, when, self._box)

    def _hold(self, edge: Edge, when: float) -> None:
        """Anchor what came into the tissue, and trace the path of the edge through the material."""
        body, moved = self._body, self._relaxation.moved
        clear_tool(self._grip.tool, body, self._stages.external)
        reach = EXPLAINED * self._snap_floor
        self._grip.hold(body, self._visits, self._path, moved, edge, when, self._box, reach)
        if not self._grip.is_engaged:
            self._end_incision()
            return
        self._incising = True
        margin = SHEET_MARGIN * self.node_size
        trace_path(self._grip.tool.anchors, body, edge, when, margin, self._path)

    def _detect(self) -> bool:
        """Find the active tetrahedra and the edges that were crossed; return whether to cut."""
        if not self._incising or path_travel(self._path) == 0.0:
            return False
        self._is_open = False
        put_on_lattice(self._path, self._body.lattice)
        self._scheme.detect(self._body, self._visits, self._path)
        return True

    def _open_up(self) -> None:
        """Cut up to the edge itself: it rests, or leaves the way that it came."""
        put_on_lattice(self._path, self._body.lattice)
        self._scheme.detect(self._body, self._visits, self._path)
        self._cut(self._scheme.rest)
        self._is_open = True

    def _rests(self, travel: float, dt: float) -> bool:
        """Whether the edge, which went that far [m], has rested for a while by now."""
        travel = max(travel, path_travel(self._path))
        if travel > RESTING_SPEED * self.node_size * dt:
            self._calm = 0.0
        else:
            self._calm += dt
        return self._calm >= RESTING_TIME

    def _cut(self, one_pass: Callable[[Body, Visits, Path], None]) -> None:
        """Cut what was detected, and renew what depends on the mesh."""
        if self._audit:
            self._audit.before_cut(self._body, self._elasticity.arrays, self._grip.tool, *self._now)
        self._cut_in_passes(one_pass)
        if self._audit:
            self._audit.after_cut(self._body, self._elasticity.arrays, self._grip.tool, *self._now)

    def _cut_in_passes(self, one_pass: Callable[[Body, Visits, Path], None]) -> None:
        """Cut; where room runs out make some, and cut on."""
        change = self._scheme.change
        while True:
            one_pass(self._body, self._visits, self._path)
            n = touched_nodes(self._body, change, self._visits, self._nodes)
            if n:
                self._chunks = None
                self._elasticity.mesh_changed(self._body, self._visits, change, self._nodes, n)
                self._grip.mesh_changed(self._body, self._visits, change)
                self._contact.mesh_changed(self._body, change)
                self._relaxation.mesh_changed(self._body, self._elasticity, self._nodes, n)
            full = bool(change.is_full)
            self._grow()
            if not full:
                return
            self._scheme.detect(self._body, self._visits, self._path)

    def _begin_audit(self) -> None:
        """Begin the account of energy with the body as it is."""
        if self._audit:
            self._audit.begin(self._body, self._elasticity.arrays)
            self._grip.tool.anchors.totals[WORK_OF_BLADE:] = 0.0

    def _energies(self, edge: Edge) -> Energies | None:
        if self._audit is None:
            return None
        return self._audit.energies(self._body, self._elasticity.arrays, self._grip.tool, edge)

    def _end_incision(self) -> None:
        """Resolve what the blade left behind, and let the next contact begin another sheet."""
        if not self._incising:
            return
        if not self._is_open:
            self._open_up()
        self._is_open = False
        self._cut(self._scheme.end)
        self._scheme.forget()
        self._contact.incision_ended(self._body)
        forget_path(self._path)
        self._incising = False

    def _n_parts(self, travel: float) -> int:
        """Return in how many parts the edge goes that far [m]."""
        return max(1, math.ceil(travel / (INCREMENT * self.node_size)))

    def _measures(self) -> MeshMeasures:
        elasticity = self._elasticity
        return MeshMeasures(
            n_tetrahedra=self.n_tetrahedra,
            altitude=lowest_altitude(self._body),
            frequency=math.sqrt(elasticity.frequency_squared),
            time_step=stable_step(elasticity, elasticity.frequency_squared, self._surroundings),
        )

    def _result(
        self,
        edge: Edge,
        sweep: BladeSweep | None,
        dt: float,
        n_substeps: int,
        profile: StageTimes,
    ) -> StepResult:
        low, high, _ = self._box
        grip = self._grip
        totals = grip.tool.anchors.totals
        grip.report(self._body, edge)
        point = np.zeros(3) if sweep is None else np.array(edge.tip_t1)
        return StepResult(
            wrench=grip.mean_wrench(point, dt),
            wrench_t1=grip.wrench_t1(point),
            stiffness=grip.stiffness,
            contacts=grip.contacts,
            force_on_tissue=grip.mean_force_on_tissue(dt),
            bounds=np.array([low, high]),
            n_tetrahedra=self.n_tetrahedra,
            n_nodes=self.n_nodes,
            n_active=self._scheme.n_active,
            active_point_tetrahedron=int(self._path.seed[0]) if sweep is not None else -1,
            anchored_length=anchored_length(grip.tool.anchors),
            cut_area=self._scheme.change.area,
            work_of_blade=float(totals[WORK_OF_BLADE]),
            work_of_cutting=float(totals[WORK_OF_CUTTING]),
            n_substeps=n_substeps,
            touch=self._contact.touch(dt),
            profile=profile,
            energies=self._energies(edge),
        )

    # arrays

    def _take(self, edge: Edge | None) -> None:
        """Take the edge of this blade; another blade, or none, lets go of the tissue."""
        length = 0.0 if edge is None else math.dist(edge.tip_t1, edge.heel_t1)
        if self._grip.is_another(length):
            self._end_incision()
            self._grip.take(length, self._body, *self._now)
            self._path = new_path(self._grip.n_samples)

    def _grow(self) -> None:
        """Make room for the next pass of a cut step: arrays double when they are nearly full."""
        body = self._body
        n_nodes, n_tetrahedra = len(body.rest), len(body.tetrahedra)
        if self.n_nodes + 2 * SPARE_NODES > n_nodes:
            n_nodes = 2 * n_nodes + 2 * SPARE_NODES
        if self.n_tetrahedra + ROOM_FOR_TETRAHEDRA > n_tetrahedra:
            n_tetrahedra = 2 * n_tetrahedra + ROOM_FOR_TETRAHEDRA
        if (n_nodes, n_tetrahedra) == (len(body.rest), len(body.tetrahedra)):
            return
        self._body = grown_body(body, n_nodes, n_tetrahedra)
        self._elasticity.grow(n_nodes, n_tetrahedra)
        self._visits = no_visits(n_nodes, n_tetrahedra)
        self._scheme.grow(n_nodes, n_tetrahedra)
        self._grip.grow(n_tetrahedra)
        self._contact.grow(n_nodes, n_tetrahedra)
        self._relaxation.grow(n_nodes, n_tetrahedra)
        self._stages = new_stages(n_nodes)
        self._nodes = np.zeros(n_nodes, dtype=np.int64)


def _travel(edge: Edge) -> float:
    """Return how far the edge moves [m]: the further of its two ends."""
    return max(math.dist(edge.tip_t1, edge.tip_t0), math.dist(edge.heel_t1, edge.heel_t0))
