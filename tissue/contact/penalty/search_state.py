"""`SearchState`: all that the search for contacts reads and writes, beside the body."""

from tissue.contact.faces import Faces
from tissue.contact.penalty.folds import Folds
from tissue.contact.penalty.near_pairs import NearPairs
from tissue.contact.penalty.node_ways import NodeWays
from tissue.contact.penalty.ridge_pairs import RidgePairs
from tissue.contact.penalty.ridges import Ridges
from tissue.contact.penalty.stiffness import Limits
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, FloatCell, IntCell

_MANY_MOVING = 4
"""One over the share of moving nodes from which on it is cheaper to ask all."""


class SearchState(Arrays):
    """All that the search for contacts reads and writes, beside the body and the contacts."""

    step: IntCell
    """Number of times that normals were computed."""
    turn: IntCell
    """Tetrahedron that `lost_nodes` looks into next."""
    n_rounds: IntCell
    """Number of the round in which `lost_nodes` looks into all tetrahedra, from 1."""
    n_listings: IntCell
    """Number of times that contacts were listed."""
    stage: IntCell
    """Stage at which a search begins or, where it stopped for want of room, goes on: a value of
    `search`."""
    is_anew: IntCell
    """1 if pairs are updated in this search, else 0."""
    is_pairing_due: IntCell
    """1 if pairs are to be updated whatever has moved, else 0."""
    has_new_faces: IntCell
    """1 if a cut has changed faces since pairs were updated, else 0."""
    is_listing_due: IntCell
    """1 if contacts are to be listed whatever has moved, else 0."""
    since_pairing: IntCell
    """Number of searches since pairs were updated."""
    since_normals: IntCell
    """Number of searches since normals were computed."""
    n_due: IntCell
    """Number of nodes whose contacts are sought in this search."""
    all_calm_until: FloatCell
    """Value of `NodeWays.quiet_way` up to which no node need be asked while no node moves much
    [m]."""
    faces: Faces
    pairs: NearPairs
    ridges: Ridges
    ridge_pairs: RidgePairs
    ways: NodeWays
    folds: Folds
    limits: Limits
    normal: FloatArray
    """Outward normal of each node of a face, weighted by area [m2]; shape (node capacity, 3)."""
    inverted_step: IntArray
    """Value of `step` when a tetrahedron with this node was last seen inverted; shape (node
    capacity,)."""
    is_due: IntArray
    """1 if the contacts of a node are sought in this search, else 0; shape (node capacity,)."""
    calm_until: FloatArray
    """Value of `NodeWays.quiet_way` up to which a node need not be asked while neither it nor a
    corner of a face that it is paired with moves much [m], shape (node capacity,)."""
    contact: IntArray
    """First contact of each node with faces, in the list in use; shape (node capacity,)."""
    n_contacts: IntArray
    """Number of contacts of each node with faces, shape (node capacity,)."""
    listed_at: IntArray
    """Listing in which the contacts of each node with faces were last listed; shape (node
    capacity,)."""
    floor_contact: IntArray
    """Contact of each node with the floor in the list in use, shape (node capacity,)."""
    floor_listed_at: IntArray
    """Listing in which each node was last in contact with the floor, shape (node capacity,)."""
    ridge_contact: IntArray
    """Scratch: last contact of ridges that begins with each node, counted from their first; shape
    (node capacity,)."""
    ridge_contact_at: IntArray
    """Search in which that was written, shape (node capacity,)."""
    recovered: FloatArray
    """How far the contacts of each node have come out since the last incision [m], shape (node
    capacity,)."""
    distance: FloatArray
    """Scratch: squared distance of the contacts that a node was found to have [m2], shape (3,)."""
    share: FloatArray
    """Scratch of `split_masses`, shape (node capacity,)."""
    floor: float
    """Height of the floor [m], or -inf."""


@kernel
def are_many_moving(search: SearchState) -> bool:
    """Whether so many nodes moved much that all are asked."""
    return bool(_MANY_MOVING * search.ways.n_moving > search.pairs.n_nodes)
