"""What contact does for a system, whichever of the two ways a user chose."""

from typing import Protocol

from tissue.contact.penalty.contact_forces import PenaltyForces
from tissue.core.array_types import FloatArray
from tissue.mesh.body import Body
from tissue.mesh.changes import Change
from tissue.types import BodyContacts


class Contact(Protocol):
    """Contact of one body with itself and with the floor."""

    @property
    def forces(self) -> PenaltyForces:
        """The contacts that act as forces; none where contact corrects the motion."""
        ...

    @property
    def is_awake(self) -> bool:
        """Whether there is anything that could touch."""
        ...

    @property
    def is_touching(self) -> bool:
        """Whether there were contacts in the last step, or some are kept ready."""
        ...

    def wakes(self, body: Body) -> bool:
        """Look whether there is anything that could touch now."""
        ...

    @property
    def added_frequency_squared(self) -> float:
        """What contact adds at most to w^2 of the body [1/s2]."""
        ...

    def begin(self) -> None:
        """Begin a time step: clear the totals."""
        ...

    def prepare(
        self,
        body: Body,
        frequency_squared: FloatArray,
        highest: float,
        room: float,
        seconds: float,
    ) -> None:
        """Find the contacts that act as forces, unless this was done since `begin`.

        Args:
            body: Where the nodes are.
            frequency_squared: Bound on w^2 of each node without contact [1/s2].
            highest: Bound on w^2 of the body without contact [1/s2].
            room: What may be added to that without another step [1/s2].
            seconds: Length of the time step [s].
        """
        ...

    def start_substep(self, body: Body) -> None:
        """Take note of the positions before a substep."""
        ...

    def end_substep(self, body: Body, external: FloatArray, seconds: float) -> None:
        """Do what is done after a substep of that length [s].

        `external`: forces on the nodes [N], shape (capacity, 3); those of contact are cleared.
        """
        ...

    def report(self, dt: float) -> BodyContacts:
        """Return the contacts since `begin`; `dt` is the time that has passed [s]."""
        ...

    def mesh_changed(self, body: Body, change: Change) -> None:
        """Add the faces that a pass of a cut made."""
        ...

    def incision_ended(self, body: Body) -> None:
        """Let the skin of pieces touch, where the body is in pieces now."""
        ...

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for a body of `n_nodes` and `n_tetrahedra`."""
        ...
