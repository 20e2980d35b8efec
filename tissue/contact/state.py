"""`ContactState`: all that contact reads and writes, beside the body."""

from tissue.contact.candidates import Candidates
from tissue.contact.constraints import Contacts
from tissue.contact.faces import Faces
from tissue.contact.hits import Hits
from tissue.contact.motion_bounds import MotionBounds
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.structs import Arrays, FloatCell, IntCell

UP_TO_DATE, FACES_CHANGED, REBUILD = 0, 1, 2
"""Values of `ContactState.stale`: faces have changed; all candidates are to be found again."""


class ContactState(Arrays):
    """All that contact reads and writes, beside the body."""

    is_awake: IntCell
    """1 if anything can touch, else 0."""
    stale: IntCell
    """What of the candidates is out of date: UP_TO_DATE, FACES_CHANGED or REBUILD."""
    is_pending: IntCell
    """1 if a Runge-Kutta step is done but for contact, which had no room, else 0."""
    has_begun: IntCell
    """1 if contact has begun with this step, and had no room to finish it, else 0."""
    step: IntCell
    """Number of the Runge-Kutta step."""
    tested_at: IntCell
    """When pairs were tested last in this step, by `Contacts.clock`, or -1."""
    n_pressing: IntCell
    """Number of contacts that pressed in the last Runge-Kutta step."""
    pressure_impulse: FloatCell
    """Sum of the impulses that pressed faces together since totals were cleared [N s]."""
    penetration: FloatCell
    """Greatest penetration left since totals were cleared [m]."""
    floor_impulse: FloatArray
    """Impulse of the floor on the body since totals were cleared [N s], shape (3,)."""
    faces: Faces
    candidates: Candidates
    motion: MotionBounds
    contacts: Contacts
    start: FloatArray
    """Positions before the Runge-Kutta step [m], shape (node capacity, 3)."""
    depth: FloatArray
    """How deep each node was left in what it touches [m], shape (node capacity,)."""
    depth_step: IntArray
    """Runge-Kutta step in which `depth` was written, shape (node capacity,)."""
    inverted_step: IntArray
    """Runge-Kutta step in which a tetrahedron with this node was last seen inverted; shape (node
    capacity,). A blade can drag small ones so. Their faces point into the body, and would hold
    them as they are: they must pass through others to come right again."""
    normal: FloatArray
    """Outward normal, weighted by area, at the nodes of faces after the step [m2]; shape (node
    capacity, 3)."""
    signs: FloatArray
    """Scratch of `simd_prefilter`, shape (4 * capacity of pairs,)."""
    point_hits: Hits
    """Scratch: nodes that went through triangles."""
    edge_hits: Hits
    """Scratch: edges that went through edges."""
    friction: float
    """Coefficient of friction."""
    floor: float
    """Height of the floor [m], or -inf."""
    margin: float
    """Distance up to which faces are paired [m]."""
    largest_residual: float
    """Depth in what they touch [m] up to which nodes that could not be pushed out are found again
    there by other faces."""
    tolerance: float
    """Distance that counts as none, and correction that Gauss-Seidel leaves [m]."""
