"""The integrator of the paper's hierarchical relaxation: its arrays, and frames that are stable."""

import math
from collections.abc import Sequence

import numpy as np

from tissue.blade.blade_context import BladeContext
from tissue.blade.forces import apply_slip, frequency_with_blade
from tissue.core.array_types import IntArray
from tissue.forces.step_context import Increment
from tissue.integrators.bielser_1998.kernels import (
    FrameTimes,
    grown_local_clocks,
    hierarchical_frame,
    new_local_clocks,
    ring_frequencies,
)
from tissue.integrators.bielser_1998.rings import find_held, find_rings, grown_rings, new_rings
from tissue.integrators.driver import Relaxation
from tissue.integrators.integrator import not_finite
from tissue.integrators.methods import SAFETY, Hierarchical
from tissue.integrators.model import TissueModel
from tissue.integrators.stability import largest_stable_step
from tissue.mesh.body import Body
from tissue.mesh.bounding_boxes import widen_bounds, write_bounds
from tissue.mesh.changes import ChangedMesh
from tissue.mesh.node_motion import Moved, grown_moved, none_moved, note_moved


class HierarchicalStepper:
    """The paper's hierarchical relaxation as an `Integrator`.

    The focus is the anchored tetrahedron nearest to the tip of the blade; without an anchor, the
    focus before it.

    Args:
        options: Updates, rings, and the fate of nodes beyond.
        n_nodes: Room for nodes.
    """

    def __init__(self, options: Hierarchical, n_nodes: int) -> None:
        self._options = options
        self._rings = new_rings(n_nodes)
        self._held = new_rings(n_nodes)
        self._local_clocks = new_local_clocks(n_nodes)
        self._scratch = np.zeros(n_nodes, np.int64)
        self._moved = none_moved(n_nodes)
        self._highest = np.zeros(options.rings + 2)

    @property
    def moved(self) -> Moved | None:
        """Nodes that moved since the list was emptied; None where all do."""
        return self._moved if self._is_far_frozen else None

    @property
    def moving(self) -> tuple[IntArray, int] | None:
        """Nodes that may have moved in the last `advance`, and how many; None where all."""
        if not self._is_far_frozen:
            return None
        return self._rings.order, self._rings.n_found

    @property
    def _is_far_frozen(self) -> bool:
        return self._options.far == "frozen"

    def relax(
        self, system: TissueModel, arrays: Relaxation, increment: Increment, has_blade: bool
    ) -> int:
        """Relax by an increment, stage by stage; return how many steps the focus took."""
        return relax_in_stages(self, system, arrays.blade, increment, has_blade)

    def advance(self, system: TissueModel, increment: Increment) -> int:
        """Advance the motion by one frame; return how many steps the nodes of the focus took."""
        options, body, edge = self._options, system.body, increment.edge
        self._find_rings(system)
        n, every = self._divide(system, increment.span)
        times = (increment.dt, increment.begin, increment.end)
        frame = FrameTimes(*times, n, options.rings, self._is_far_frozen)
        rings, local_clocks = self._rings, self._local_clocks
        hierarchical_frame(system.context, edge, rings, local_clocks, every, frame)
        blade, external = system.interaction.state, system.stages.external
        apply_slip(blade, body, system.visits, edge, external, increment.end, increment.span)
        note_moved(self._moved, rings.order, rings.n_found)
        return n

    def _find_rings(self, system: TissueModel) -> None:
        """Find the rings around what the blade holds."""
        find_held(self._held, system.body, system.interaction.state)
        springs, last = system.elasticity.arrays.springs, self._options.rings + 1
        find_rings(self._rings, self._held, springs, last, self._scratch)

    def _divide(self, system: TissueModel, span: float) -> tuple[int, IntArray]:
        """Return how many micro steps to take in `span` [s], and after how many each ring moves."""
        body, by_node = system.body, system.elasticity.arrays.frequency_squared
        highest, options = self._highest, self._options
        ring_frequencies(body, by_node, self._rings, options.rings, self._is_far_frozen, highest)
        near = frequency_with_blade(system.interaction.state, body, by_node, system.stages.external)
        highest[0] = max(highest[0], near)
        around = system.surroundings
        needed = []
        for squared in highest:
            step = largest_stable_step(math.sqrt(squared), around.retardation_time, around.drag)
            needed.append(span / (SAFETY * step))
        return ring_steps(options, needed)

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Note nodes that may be new: they may have moved as others did."""
        note_moved(self._moved, changed.nodes, len(changed.nodes))

    def body_moved(self, body: Body) -> None:
        """Note every node."""
        note_moved(self._moved, np.arange(body.n_nodes), body.n_nodes)

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes."""
        del n_tetrahedra
        self._rings = grown_rings(self._rings, n_nodes)
        self._held = grown_rings(self._held, n_nodes)
        self._scratch = np.zeros(n_nodes, np.int64)
        self._local_clocks = grown_local_clocks(self._local_clocks, n_nodes)
        self._moved = grown_moved(self._moved, n_nodes)


def ring_steps(options: Hierarchical, needed: Sequence[float]) -> tuple[int, IntArray]:
    """Return how many micro steps a frame has, and after how many each ring is moved.

    Args:
        options: I and s_max.
        needed: Steps in a frame for which the nodes of each ring, and last those beyond, are
            stable.
    """
    last = options.rings
    steps = [options.updates >> ring for ring in range(last + 1)] + [1]
    for ring in range(last + 1, -1, -1):
        while steps[ring] < needed[ring]:
            steps[ring] *= 2
        if ring <= last:  # no fewer than further out, where blade and old cuts are equally stiff
            while steps[ring] < steps[ring + 1]:
                steps[ring] *= 2
    return steps[0], steps[0] // np.array(steps)


def relax_in_stages(
    integrator: HierarchicalStepper,
    system: TissueModel,
    blade: BladeContext,
    increment: Increment,
    has_blade: bool,
) -> int:
    """Relax by an increment; return the steps taken. See `Integrator.relax`.

    Args:
        integrator: Advances the motion.
        system: Body, forces and contact.
        blade: What searches of the blade work on.
        increment: The part of a time step to advance by.
        has_blade: Whether there is a blade.

    Raises:
        TissueError: the motion became unstable.
    """
    interaction, edge = system.interaction, increment.edge
    faces_of = edge if has_blade else None
    interaction.update_faces(blade, integrator.moved, faces_of, increment.begin)
    n = integrator.advance(system, increment) if increment.span > 0.0 else 0
    if n > 0:
        system.relax_stress(increment.span)
        if integrator.moving is None and system.increments_to_pieces > 0:
            system.find_new_loose_pieces()
        if not _update_bounds(integrator, system, blade):
            raise not_finite()
    if has_blade:
        external, blade = system.stages.external, interaction.renewed(blade)
        interaction.update_anchors(blade, external, integrator.moved, edge, increment.end)
    return n


def _update_bounds(
    integrator: HierarchicalStepper, system: TissueModel, blade: BladeContext
) -> bool:
    """Update the box around the body; return whether all positions are finite."""
    moving, body = integrator.moving, system.body
    if moving is None or 2 * moving[1] > body.n_nodes:
        return write_bounds(body, blade.bounds)
    return widen_bounds(body, moving[0], moving[1], blade.bounds)
