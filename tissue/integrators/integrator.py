"""What an integrator does for a tissue, which one a choice stands for, and the end of a step."""

from typing import Protocol

from tissue.blade.blade_context import BladeContext
from tissue.core.array_types import IntArray
from tissue.integrators.global_stepper import GlobalStepper
from tissue.integrators.model import TissueModel
from tissue.integrators.options import Hierarchical, IntegratorOptions
from tissue.integrators.step_context import Increment
from tissue.mesh.body import Body
from tissue.mesh.changes import ChangedMesh
from tissue.mesh.node_motion import Moved


class Integrator(Protocol):
    """A method that advances the motion. It owns what it remembers from step to step."""

    @property
    def moved(self) -> Moved | None:
        """Nodes that moved since the list was emptied; None where all do."""
        ...

    @property
    def moving(self) -> tuple[IntArray, int] | None:
        """Nodes that may have moved in the last `advance`, and how many; None where all may."""
        ...

    def relax(
        self, system: TissueModel, blade: BladeContext, increment: Increment, has_blade: bool
    ) -> int:
        """Relax (RX) by an increment; return how many steps the finest nodes took.

        Faces of the blade, forces, contact and motion, slip and anchors of its edge.

        Args:
            system: Body, forces and contact.
            blade: What searches of the blade work on.
            increment: The part of a time step to advance by.
            has_blade: Whether there is a blade.

        Raises:
            TissueError: the motion became unstable.
        """
        ...

    def advance(self, system: TissueModel, increment: Increment) -> int:
        """Advance the motion by an increment; return how many steps the finest nodes took."""
        ...

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Note that a pass of a cut changed the mesh."""
        ...

    def body_moved(self, body: Body) -> None:
        """Take note that every node moved by other means, and is at rest."""
        ...

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra."""
        ...


def integrator_of(
    options: IntegratorOptions, global_stepper: GlobalStepper, n_nodes: int
) -> Integrator:
    """Return the integrator that a user chose, with room for that many nodes."""
    # Imported late: kernels that are not used cost no start.
    if isinstance(options, Hierarchical):
        from tissue.integrators.hierarchical.stepper import HierarchicalStepper

        return HierarchicalStepper(options, n_nodes)
    return global_stepper
