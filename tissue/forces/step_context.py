"""Everything that a step works on: one struct for kernels, and a part of a time step."""

from typing import NamedTuple

from tissue.blade.blade_state import BladeState
from tissue.blade.edge import Edge
from tissue.contact.geoms.geom_arrays import GeomContacts
from tissue.contact.response.contacts import PenaltyForces
from tissue.core.array_types import FloatArray
from tissue.core.simd import room_for_points
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.thread_team import Team
from tissue.elasticity.internal_forces import Elastic, Surroundings
from tissue.forces.attachments import Attachments
from tissue.mesh.body import Body
from tissue.mesh.pieces import LoosePieces
from tissue.mesh.rigid_cores import Cores
from tissue.mesh.star import Visits


class Supports(Arrays):
    """Whether supports move, and the work that they did."""

    is_moving: IntCell
    """1 if a fixed node has a velocity, else 0."""
    work: FloatCell
    """Work that moving supports did on the tissue so far [J]."""
    force: FloatArray
    """Scratch: the force on one node [N], shape (1, 3)."""


def supports_at_rest() -> Supports:
    """Return supports that do not move."""
    return Supports(is_moving=0, work=0.0, force=room_for_points(1))


class Stages(Arrays):
    """Positions, velocities and accelerations within a step, each of shape (capacity, 3)."""

    positions: FloatArray
    """Positions of the second stage, and of the third where that is at the same instant [m]."""
    last_positions: FloatArray
    """Positions of the last stage [m]."""
    velocities: FloatArray
    """Velocities of the second stage, then of the last [m/s]."""
    change: FloatArray
    """Velocities of the third stage less those of the second [m/s]."""
    external: FloatArray
    """Forces of the blade on nodes [N]: zero everywhere but at those that it acts on."""
    loads: FloatArray
    """Loads on nodes [N], constant in a step."""
    a1: FloatArray
    """Accelerations of the first stage [m/s2]."""
    a2: FloatArray
    """Accelerations of the second stage [m/s2]."""
    start_positions: FloatArray
    """Positions before the step [m], where the loss in damped stages is counted."""
    start_velocities: FloatArray
    """Velocities before the step [m/s], where the loss in damped stages is counted."""


def new_stages(n_nodes: int) -> Stages:
    """Return scratch for that many nodes."""
    return Stages(**{name: room_for_points(n_nodes) for name in Stages.__annotations__})


class Damping(Arrays):
    """Damping that acts between steps, and the loss in damping either way."""

    interval: IntCell
    """Steps from one time that it acts to the next, one or two."""

    owed: FloatCell
    """Time for which it has yet to act [s]: half of the steps since it acted last."""
    dissipated: FloatCell
    """Energy lost in viscosity and drag so far [J]; where damping acts in every stage it is counted
    for an account of energy alone."""
    is_counted: IntCell
    """1 where an account of energy is kept, else 0."""
    rate_uncut: float
    """Highest rate at which damping stops a motion of the body before it is cut [1/s]."""
    retardation_time: float
    """Viscosity per stiffness at rest [s]; 0 where it acts in every stage."""
    drag: float
    """Rate at which free motion dies away [1/s]; 0 where it acts in every stage."""


class StepContext(Arrays, two_precisions=True):
    """Everything that the kernels of an integrator read and write."""

    body: Body
    """Positions and velocities are written."""
    elastic: Elastic
    """Data from which the forces inside the body follow."""
    blade: BladeState
    """The blade: it acts in every stage, and slips after every step."""
    contacts: PenaltyForces
    """Contacts of the body with itself and the floor, as forces."""
    geoms: GeomContacts
    """Contacts with rigid geoms: forces in every stage, which are corrected after every step."""
    surroundings: Surroundings
    """Gravity, and the damping that acts in every stage."""
    damping: Damping
    """The damping that acts between steps."""
    supports: Supports
    """Whether fixed nodes move, and their work."""
    attachments: Attachments
    """Points that are tied to what moves from outside."""
    loose: LoosePieces
    """The pieces that are not held: drag does not act on their rigid motion."""
    cores: Cores
    """Nodes that move as rigid bodies."""
    stages: Stages
    """Scratch of a step, the forces of the blade, and loads."""
    visits: Visits
    """Scratch for searches."""
    team: Team
    """The loop that threads share."""


class Instant(NamedTuple):
    """An instant at which forces are evaluated, and its weight in integrals over a time step."""

    when: float
    """The instant, as a fraction of the time step."""
    share: float
    """Weight of this evaluation, as a fraction of the time step."""
    seconds: float
    """Weight of this evaluation [s]."""
    dt: float
    """Length of the time step [s]."""


class Increment(NamedTuple):
    """A part of a time step, over which the edge moves little."""

    edge: Edge
    """The cutting edge over the whole time step."""
    dt: float
    """Length of the whole time step [s]."""
    begin: float
    """Fraction of the time step at which the increment begins."""
    end: float
    """Fraction of the time step at which it ends."""

    @property
    def span(self) -> float:
        """Length of the increment [s]."""
        return self.dt * (self.end - self.begin)
