"""`ContactState`: all that contact reads and writes, beside the body."""

from tissue.contact.candidates import Candidates
from tissue.contact.constraints import Contacts
from tissue.contact.faces import Faces
from tissue.contact.motion_bounds import Motion
from tissue.contact.pairs import Hits
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.structs import Arrays

IS_AWAKE, IS_STALE, IS_PENDING, EPOCH, HAS_BEGUN = 0, 1, 2, 3, 4
N_STATES = 5
"""Places in `ContactState.state`."""

CHANGED, ANEW = 1, 2
"""What `state[IS_STALE]` says: faces have changed; all is to be sought anew."""

FLOOR_IMPULSE, PRESSURE_IMPULSE, PENETRATION, N_TOUCHING = 0, 3, 4, 5
"""Places in `ContactState.totals`."""
N_TOTALS = 6


class ContactState(Arrays):
    """All that contact reads and writes, beside the body."""

    faces: Faces
    candidates: Candidates
    motion: Motion
    contacts: Contacts
    start: FloatArray
    """Positions before the Runge-Kutta step [m], shape (node capacity, 3)."""
    depth: FloatArray
    """How deep each node was left in what it touches [m], shape (node capacity,)."""
    depth_epoch: IntArray
    """Runge-Kutta step in which that was, shape (node capacity,)."""
    tangled: IntArray
    """Runge-Kutta step in which a tetrahedron with this node was last seen inside out; shape (node
    capacity,). A blade can drag small ones so. Their faces point into the body, and would hold
    them as they are: they must pass through others to come right again."""
    normal: FloatArray
    """Outward, weighted by area, of the nodes of faces after the step [m2]; shape (node capacity,
    3)."""
    signs: FloatArray
    """Scratch: see `first_look`; shape (4 * capacity of pairs,)."""
    point_hits: Hits
    edge_hits: Hits
    looked: IntArray
    """When pairs were looked at last in this step, by `Contacts.clock`, or -1; shape (1,)."""
    state: IntArray
    """Whether anything can touch; whether the candidates are out of date; whether a step is done
    but for contact; number of the Runge-Kutta step; whether contact has begun with it, and there
    was no room to go on. Shape (N_STATES,)."""
    totals: FloatArray
    """Since they were cleared: impulse of the floor on the body [N s], three; sum of the impulses
    that press faces together [N s]; greatest penetration left [m]; and the number of contacts that
    pressed in the last step. Shape (N_TOTALS,)."""
    friction: float
    """Coefficient of friction."""
    floor: float
    """Height of the floor [m], or -inf."""
    margin: float
    """Of the candidates [m]."""
    slack: float
    """How deep nodes may be left in what they touch, to be found again there by others [m]."""
    touch: float
    """Distance that is none, and correction that Gauss-Seidel leaves [m]."""
