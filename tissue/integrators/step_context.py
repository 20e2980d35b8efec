"""What advancing the motion needs, whichever way it is done, and what is done around each step."""

from typing import NamedTuple, Protocol

from tissue.blade.anchors import Edge
from tissue.blade.forces import Tool, give_way
from tissue.contact.resolve import resolve
from tissue.contact.self_contact import SelfContact
from tissue.core.array_types import IntArray
from tissue.elasticity.elasticity import Elasticity
from tissue.elasticity.internal_forces import Surroundings
from tissue.integrators.runge_kutta import Stages
from tissue.mesh.body import Body
from tissue.mesh.moved_nodes import Moved
from tissue.mesh.star import Visits


class Motion(NamedTuple):
    """A part of a time step, and all that takes part."""

    body: Body
    elasticity: Elasticity
    contact: SelfContact
    tool: Tool
    edge: Edge
    visits: Visits
    stages: Stages
    queue: IntArray
    """Scratch for searches, shape (LARGEST_STAR,)."""
    surroundings: Surroundings
    reach: float
    """See `slip` [m]."""
    dt: float
    """Length of the whole time step [s], which the edge's motion is over."""
    begin: float
    """Fraction of the time step at which to begin."""
    end: float
    """Fraction at which to end."""

    @property
    def span(self) -> float:
        """What is to be advanced [s]."""
        return self.dt * (self.end - self.begin)


class Relaxation(Protocol):
    """A way to advance the motion. It owns what it remembers from step to step."""

    @property
    def moved(self) -> Moved | None:
        """Nodes that moved since it was emptied; None where all do."""
        ...

    @property
    def moving(self) -> tuple[IntArray, int] | None:
        """Nodes that may have moved in the last call of `relax`, and how many; None where all."""
        ...

    def relax(self, motion: Motion) -> int:
        """Advance the motion; return how many steps the finest nodes took."""
        ...

    def mesh_changed(self, body: Body, elasticity: Elasticity, nodes: IntArray, n: int) -> None:
        """Take note that the mesh around the first `n` of `nodes` changed."""
        ...

    def body_moved(self, body: Body, elasticity: Elasticity) -> None:
        """Take note that every node moved by other means, and is at rest."""
        ...

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra."""
        ...


def end_step(motion: Motion, seconds: float, when: float) -> None:
    """After a step: set right what went through what, and let give way what does not hold.

    Args:
        motion: What takes part.
        seconds: Length of the step [s].
        when: Its end, as a fraction of the time step.
    """
    if motion.contact.is_awake:
        set_right(motion, seconds)
    give_way_after(motion, seconds, when)


def set_right(motion: Motion, seconds: float) -> None:
    """Set right what went through what in a step of that length [s]."""
    while not resolve(motion.contact.arrays, motion.body, seconds):
        motion.contact.make_room()


def give_way_after(motion: Motion, seconds: float, when: float) -> None:
    """Let give way what the blade does not hold: see `end_step`."""
    body, edge, external, reach = motion.body, motion.edge, motion.stages.external, motion.reach
    give_way(motion.tool, body, motion.visits, edge, external, when, seconds, reach, motion.queue)
