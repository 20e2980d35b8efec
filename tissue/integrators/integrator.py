"""Protocol of an integrator of a tissue, and the error where the motion becomes unstable."""

from typing import Protocol

from tissue.core.array_types import IntArray
from tissue.forces.step_context import Increment
from tissue.integrators.driver import Relaxation
from tissue.integrators.model import TissueModel
from tissue.mesh.body import Body
from tissue.mesh.changes import ChangedMesh
from tissue.mesh.node_motion import Moved
from tissue.types import TissueError

REMEDY = "A shorter time step, or a material that is softer or heavier, may help"
"""Cases to try."""


class Integrator(Protocol):
    """A method that advances the motion. It owns what it remembers from step to step."""

    @property
    def moved(self) -> Moved | None:
        """Nodes that moved since the list was emptied; None where all do."""
        ...

    @property
    def moving(self) -> tuple[IntArray, int] | None:
        """Nodes that may have moved in the last `relax`, and how many; None where all may."""
        ...

    def relax(
        self, system: TissueModel, arrays: Relaxation, increment: Increment, has_blade: bool
    ) -> int:
        """Relax (RX) by an increment; return how many steps the finest nodes took.

        Faces of the blade, forces, contact and motion, slip and anchors of its edge.

        Args:
            system: Body, forces and contact.
            arrays: All arrays as one struct.
            increment: The part of a time step to advance by.
            has_blade: Whether there is a blade.

        Raises:
            TissueError: the motion became unstable.
        """
        ...

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Note that a pass of a cut changed the mesh."""
        ...

    def body_moved(self, body: Body) -> None:
        """Note that every node moved by other means, and is at rest."""
        ...

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra."""
        ...


class UnstableError(TissueError):
    """The motion of the tissue became unstable.

    Args:
        fault: How that shows.
    """

    def __init__(self, fault: str) -> None:
        self.fault = fault
        super().__init__(f"the motion of the tissue became unstable: {fault}. {REMEDY}")


def not_finite() -> UnstableError:
    """Return the error that says that a position is not a finite number."""
    return UnstableError("the position of a node is not a finite number")
