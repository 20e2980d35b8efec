"""The integrator of local time stepping: its arrays, and which nodes are awake."""

from tissue.contact.resolve import note_all_positions, note_positions
from tissue.core.array_types import FloatArray, IntArray
from tissue.elasticity.elasticity import Elasticity
from tissue.elasticity.strained_frequency import strain_frequencies
from tissue.integrators.local.chebyshev import chebyshev
from tissue.integrators.local.element_subsets import new_patch
from tissue.integrators.local.kernels import (
    LocalState,
    MacroStep,
    grown_zone,
    macro_steps,
    new_zone,
)
from tissue.integrators.local.sleeping import (
    all_asleep,
    doze,
    grown_activity,
    wake_all,
    wake_each,
    wake_pulled,
    wake_touching,
)
from tissue.integrators.local.step_selection import (
    find_bounds,
    find_listed_patch,
    find_near,
    find_zone,
    new_step_tables,
    plan_steps,
)
from tissue.integrators.node_rings import new_rings
from tissue.integrators.options import LocalTimeStepping
from tissue.integrators.step_context import Increment
from tissue.integrators.step_end import end_step
from tissue.integrators.system import System
from tissue.mesh.body import Body
from tissue.mesh.moved_nodes import Moved, grown_moved, none_moved, note_moved


class LocalStepper:
    """Local time stepping as an `Integrator`.

    Args:
        options: Rings, sleeping, and stabilisation.
        body: The body; all its nodes are awake at first.
        elasticity: Forces inside the body.
    """

    def __init__(self, options: LocalTimeStepping, body: Body, elasticity: Elasticity) -> None:
        self._options = options
        n_nodes = len(body.rest)
        self._activity = all_asleep(n_nodes)
        self._zone = new_zone(n_nodes, len(body.tetrahedra))
        self._listed = new_patch(n_nodes, len(body.tetrahedra))
        self._around_listed = new_rings(n_nodes)
        self._listed_version = -1
        self._moved = none_moved(n_nodes)
        self._tables = new_step_tables(options.stabilisation)
        self._local_state: LocalState | None = None
        self._starts = True
        self._is_prepared = False
        self._has_new_nodes = False
        self.body_moved(body, elasticity)

    @property
    def moved(self) -> Moved:
        """Nodes that moved since the list was emptied."""
        return self._moved

    @property
    def n_awake(self) -> int:
        """Nodes that are awake, or watched beside one that is."""
        return self._activity.n_listed

    @property
    def momentum_given_up(self) -> FloatArray:
        """Sum of the momenta that nodes had when they fell asleep [kg m/s], shape (3,)."""
        return self._activity.given_up.copy()

    @property
    def moving(self) -> tuple[IntArray, int]:
        """Nodes that may have moved in the last `advance`, and how many."""
        return self._activity.listed, self.n_awake

    def advance(self, system: System, increment: Increment) -> int:
        """Advance the motion by an increment; return how many steps the finest nodes took."""
        activity, zone, contact = self._activity, self._zone, system.hard_contact
        n, p = self._divide(system, increment.span)
        share = (increment.end - increment.begin) / n
        coefficients = chebyshev(p, self._options.stabilisation)
        done = 0
        while done < n:
            self._note_positions(system)
            self._update_listed(system)
            kick = 0.5 if self._starts else 1.0
            step = MacroStep(increment.dt, increment.begin, share, kick)
            # Contact is resolved, and what has begun to move kicked, after each step.
            end = done + 1 if contact.is_awake or self._starts else n
            edge, is_free = increment.edge, not contact.is_awake
            state = self._state()
            done = macro_steps(system.context, edge, state, coefficients, step, done, end, is_free)
            self._starts = False
            if contact.is_awake:
                at = increment.begin + (done - 1) * share
                end_step(system, increment, share * increment.dt, at + share)
                springs = system.elasticity.arrays.springs
                wake_pulled(activity, system.body, springs, zone.accelerations)
                wake_touching(activity, system.body, springs, contact.arrays.contacts)
        note_moved(self._moved, activity.listed, self.n_awake)
        if self._options.sleep:
            self._doze(system, increment.span)
        return n * p

    def _doze(self, system: System, span: float) -> None:
        """Put nodes to sleep that are at rest, `span` [s] after the last call."""
        body, activity, contact = system.body, self._activity, system.hard_contact
        if contact.is_awake:
            note_positions(contact.arrays, body, activity.listed, self.n_awake)
        springs = system.elasticity.arrays.springs
        doze(activity, body, springs, self._zone.accelerations, span)

    def _state(self) -> LocalState:
        """Return the arrays as one struct; another one where one of them was replaced."""
        state, mine = self._local_state, (self._activity, self._listed, self._zone)
        if state is None or (state.activity, state.listed, state.zone) != mine:
            activity, listed, zone = mine
            self._local_state = state = LocalState(activity=activity, listed=listed, zone=zone)
        return state

    def _divide(self, system: System, span: float) -> tuple[int, int]:
        """Find the fine nodes; return the macro steps to take in `span` [s], and their substeps."""
        body, activity, zone = system.body, self._activity, self._zone
        elastic, blade = system.elasticity.arrays, system.interaction.state
        rings = self._options.rings
        n_near = find_near(body, elastic.springs, blade, zone, max(rings - 1, 0))
        wake_each(activity, body, elastic.springs, zone.fine, n_near)
        n_near = n_near if rings > 0 else 0
        self._strain(system)
        find_bounds(body, elastic, blade, activity, zone, system.stages.external)
        time = system.surroundings.retardation_time
        n, p, limit = plan_steps(activity, body.fixed, zone.bound, n_near, span, time, self._tables)
        find_zone(elastic, activity, zone, n_near, limit)
        return n, p

    def _strain(self, system: System) -> None:
        """Raise the bounds of the listed nodes where tetrahedra are stretched."""
        elastic = system.elasticity.arrays
        if elastic.has_tetrahedra:
            self._update_listed(system)
            patch, nodes = self._listed, self._activity.listed
            blocks = (patch.forces, patch.n_forces)
            strain_frequencies(elastic, system.body, *blocks, nodes, self.n_awake)

    def _update_listed(self, system: System) -> None:
        """Find the tetrahedra around the listed nodes, if the list or the mesh has changed."""
        version = self._activity.version
        if version != self._listed_version:
            self._listed_version = version
            elastic, activity = system.elasticity.arrays, self._activity
            activity.listed[: self.n_awake].sort()  # by address
            find_listed_patch(self._listed, elastic, activity, self._around_listed)
            self._listed.sort()

    def _note_positions(self, system: System) -> None:
        """Let contact note where the nodes are before the step."""
        contact, body, activity = system.hard_contact, system.body, self._activity
        if not contact.is_awake:
            self._is_prepared = False
        elif self._is_prepared:  # those that sleep are where they were
            note_positions(contact.arrays, body, activity.listed, self.n_awake)
            if self._has_new_nodes:  # fixed ones among them are never listed
                moved = self._moved
                note_positions(contact.arrays, body, moved.nodes, moved.n_nodes)
        else:
            note_all_positions(contact.arrays, body)
            self._is_prepared = True
        self._has_new_nodes = False

    def mesh_changed(self, body: Body, elasticity: Elasticity, nodes: IntArray) -> None:
        """Wake these nodes: the mesh around them changed."""
        wake_each(self._activity, body, elasticity.arrays.springs, nodes, len(nodes))
        note_moved(self._moved, nodes, len(nodes))
        self._has_new_nodes = True
        self._listed_version = -1

    def body_moved(self, body: Body, elasticity: Elasticity) -> None:
        """Wake every node."""
        wake_all(self._activity, body, elasticity.arrays.springs)
        note_moved(self._moved, self._activity.listed, self.n_awake)
        self._starts = True
        self._is_prepared = False

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra."""
        self._activity = grown_activity(self._activity, n_nodes)
        self._zone = grown_zone(self._zone, n_nodes, n_tetrahedra)
        self._moved = grown_moved(self._moved, n_nodes)
        self._listed = new_patch(n_nodes, n_tetrahedra)
        self._around_listed = new_rings(n_nodes)
        self._listed_version = -1
