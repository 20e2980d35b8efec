"""`LocalStepper`: owns the arrays of local time stepping, and which nodes are awake."""

import numpy as np

from tissue.contact.resolve import note_positions, prepare
from tissue.core.array_types import FloatArray, IntArray
from tissue.elasticity.elasticity import Elasticity
from tissue.elasticity.internal_forces import TETRAHEDRA_TOO
from tissue.elasticity.strained_frequency import strain_frequencies
from tissue.integrators.local.chebyshev import chebyshev, substep_limits
from tissue.integrators.local.element_subsets import N_FORCES, new_patch
from tissue.integrators.local.kernels import grown_zone, macro_steps, new_zone
from tissue.integrators.local.sleeping import (
    N_LISTED,
    VERSION,
    all_asleep,
    doze,
    grown_activity,
    wake_all,
    wake_each,
    wake_pulled,
    wake_touching,
)
from tissue.integrators.local.step_selection import (
    MOST_STEPS,
    find_bounds,
    find_listed_patch,
    find_near,
    find_zone,
    plan,
)
from tissue.integrators.node_rings import new_rings
from tissue.integrators.options import LocalTimeStepping
from tissue.integrators.step_context import Motion, end_step
from tissue.mesh.body import Body
from tissue.mesh.moved_nodes import Moved, grown_moved, none_moved, note_moved


class LocalStepper:
    """Local time stepping; see `tissue.integrators.step_context.Relaxation`.

    Args:
        options: Its settings.
        body: All its nodes are awake at first.
        elasticity: What its forces follow from.
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
        self._substep_limits = substep_limits(options.stabilisation)
        self._limits, self._n_above = np.zeros((2, MOST_STEPS + 1))
        self._starts = True
        self._is_prepared = False
        self._has_new_nodes = False
        self.body_moved(body, elasticity)

    @property
    def moved(self) -> Moved:
        """Nodes that moved since it was emptied."""
        return self._moved

    @property
    def n_awake(self) -> int:
        """Nodes that are awake, or watched beside one that is."""
        return int(self._activity.counts[N_LISTED])

    @property
    def momentum_given_up(self) -> FloatArray:
        """Sum of the momenta that nodes had when they fell asleep [kg m/s], shape (3,)."""
        return self._activity.given_up.copy()

    @property
    def moving(self) -> tuple[IntArray, int]:
        """Nodes that may have moved in the last call of `relax`, and how many."""
        return self._activity.listed, self.n_awake

    def relax(self, motion: Motion) -> int:
        """Advance the motion; return how many steps the finest nodes took."""
        body, activity, zone = motion.body, self._activity, self._zone
        elastic, contact = motion.elasticity.arrays, motion.contact
        n, p = self._divide(motion)
        share = (motion.end - motion.begin) / n
        coefficients = chebyshev(p, self._options.stabilisation)
        done = 0
        while done < n:
            self._prepare(motion)
            self._renew_patch(motion)
            done = macro_steps(
                body,
                elastic,
                motion.tool,
                motion.edge,
                motion.visits,
                activity,
                self._listed,
                zone,
                coefficients,
                motion.stages.external,
                motion.surroundings,
                motion.reach,
                motion.queue,
                motion.dt,
                motion.begin,
                share,
                0.5 if self._starts else 1.0,
                done,
                # What touches is set right, and what has begun to move kicked, after each step.
                done + 1 if contact.is_awake or self._starts else n,
                not contact.is_awake,
            )
            self._starts = False
            if contact.is_awake:
                at = motion.begin + (done - 1) * share
                end_step(motion, share * motion.dt, at + share)
                wake_pulled(activity, body, elastic.springs, zone.accelerations)
                wake_touching(activity, body, elastic.springs, contact.arrays.contacts)
        note_moved(self._moved, activity.listed, self.n_awake)
        if self._options.sleep:
            if contact.is_awake:
                note_positions(contact.arrays, body, activity.listed, self.n_awake)
            doze(activity, body, elastic.springs, zone.accelerations, motion.span)
        return n * p

    def _divide(self, motion: Motion) -> tuple[int, int]:
        """Find the fine nodes; return the macro steps to take, and the substeps of each."""
        body, activity, zone = motion.body, self._activity, self._zone
        elastic, tool, rings = motion.elasticity.arrays, motion.tool, self._options.rings
        n_near = find_near(body, elastic.springs, tool, zone, max(rings - 1, 0))
        wake_each(activity, body, elastic.springs, zone.fine, n_near)
        n_near = n_near if rings > 0 else 0
        self._strain(motion)
        find_bounds(body, elastic, tool, activity, zone, motion.stages.external)
        n, p, limit = plan(
            activity,
            body.fixed,
            zone.bound,
            n_near,
            motion.span,
            motion.surroundings.retardation_time,
            self._substep_limits,
            self._limits,
            self._n_above,
        )
        find_zone(elastic, activity, zone, n_near, limit)
        return n, p

    def _strain(self, motion: Motion) -> None:
        """Raise the bounds of the listed nodes where tetrahedra are stretched."""
        elastic = motion.elasticity.arrays
        if elastic.has[TETRAHEDRA_TOO]:
            self._renew_patch(motion)
            patch, nodes = self._listed, self._activity.listed
            blocks = (patch.forces, patch.state[N_FORCES])
            strain_frequencies(elastic, motion.body.positions, *blocks, nodes, self.n_awake)

    def _renew_patch(self, motion: Motion) -> None:
        """Find what the listed nodes feel, where the list or the mesh has changed."""
        version = int(self._activity.counts[VERSION])
        if version != self._listed_version:
            self._listed_version = version
            elastic, activity = motion.elasticity.arrays, self._activity
            activity.listed[: self.n_awake].sort()  # as memory is
            find_listed_patch(self._listed, elastic, activity, self._around_listed)
            self._listed.sort()

    def _prepare(self, motion: Motion) -> None:
        """Let contact note where the nodes are before the step."""
        contact, body, activity = motion.contact, motion.body, self._activity
        if not contact.is_awake:
            self._is_prepared = False
        elif self._is_prepared:  # those that sleep are where they were
            note_positions(contact.arrays, body, activity.listed, self.n_awake)
            if self._has_new_nodes:  # fixed ones among them are never listed
                moved = self._moved
                note_positions(contact.arrays, body, moved.nodes, int(moved.n_nodes))
        else:
            prepare(contact.arrays, body)
            self._is_prepared = True
        self._has_new_nodes = False

    def mesh_changed(self, body: Body, elasticity: Elasticity, nodes: IntArray, n: int) -> None:
        """Wake the first `n` of `nodes`."""
        wake_each(self._activity, body, elasticity.arrays.springs, nodes, n)
        note_moved(self._moved, nodes, n)
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
