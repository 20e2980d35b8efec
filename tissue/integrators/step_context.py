"""What a step works on: one struct for kernels, and the part of a time step to advance by."""

from typing import NamedTuple

from tissue.blade.blade_state import BladeState
from tissue.blade.edge import Edge
from tissue.contact.geoms.geom_arrays import GeomContacts
from tissue.contact.response.contacts import PenaltyForces
from tissue.core.structs import Arrays
from tissue.core.thread_team import Team
from tissue.elasticity.internal_forces import Elastic, Surroundings
from tissue.integrators.attachments import Attachments
from tissue.integrators.damping import Damping
from tissue.integrators.stages import Stages
from tissue.integrators.support_state import Supports
from tissue.mesh.body import Body
from tissue.mesh.pieces import LoosePieces
from tissue.mesh.star import Visits


class StepContext(Arrays, two_precisions=True):
    """Everything that the kernels of an integrator read and write."""

    body: Body
    """Positions and velocities are written."""
    elastic: Elastic
    """What the forces inside the body follow from."""
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
    stages: Stages
    """Scratch of a step, the forces of the blade, and loads."""
    visits: Visits
    """Scratch for searches."""
    team: Team
    """The loop that threads share."""


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
