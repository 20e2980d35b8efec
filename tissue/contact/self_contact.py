"""`SelfContact`: owns the arrays of contact, and says when there is anything to look for.

Lips of a cut, pieces, and the floor: no node goes through a triangle, no edge through an edge.
Before the first face is cut, in a body of one piece without a floor, it costs nothing.

What is found is what went through between two Runge-Kutta steps, from outside to inside. So nodes
of one body that lie close under a triangle of it are never mistaken for contact, at any speed
nothing passes unseen as long as it moves less than its own element in a step, and what overlaps
from the start is left alone rather than torn apart.
"""

from typing import Any

import numpy as np

from tissue.contact.candidates import Candidates, grown_candidates, new_candidates
from tissue.contact.constraints import Contacts, grown_contacts, new_contacts
from tissue.contact.faces import (
    WITH_SKIN,
    collect_faces,
    count_faces,
    grown_faces,
    in_pieces,
    new_faces,
    renew_faces,
    with_room,
)
from tissue.contact.motion_bounds import grown_motion, new_motion
from tissue.contact.pairs import new_hits
from tissue.contact.state import (
    ANEW,
    CHANGED,
    FLOOR_IMPULSE,
    IS_AWAKE,
    IS_STALE,
    N_STATES,
    N_TOTALS,
    N_TOUCHING,
    PENETRATION,
    PRESSURE_IMPULSE,
    ContactState,
)
from tissue.core.simd import aligned, room_for_points
from tissue.mesh.body import Body, grown
from tissue.mesh.changes import Change
from tissue.mesh.pieces import label_pieces
from tissue.types import BodyContacts

MARGIN = 0.25
"""How far apart candidates may be, per mean node size. Larger: more pairs, each to be looked at now
and then; smaller: nodes are sought anew more often."""

LITTLE = 1.0 / 64.0
"""How far a node moves in a Runge-Kutta step at most that is not restless, in margins. Larger: all
pairs are looked at more often; smaller: more nodes are asked one by one."""

TOUCH = 1e-4
"""Distance that is none, and correction at which sweeps end, per mean node size: a third of a
micrometre in an organ. Smaller: where lips of one cut lie node on node, each node presses on all
triangles around the other, which say the same, and all sweeps are always done; at 1e-6 a body with
3,000 contacts had 5,000, for less than shows. Larger: nodes that are pressed tremble."""

_SLACK = 0.01
"""How deep a node may be left in what it touches, and be found again by the triangle beside as it
slides there, per mean node size. Larger: what was always so is taken for contact, where lips are
thin; smaller: a node that is pinched between two faces is lost."""

RECOVERY = 1.0
"""Speed at which an overlap is undone that was there before a Runge-Kutta step, in mean node sizes
a second. It is work on the springs behind that nobody paid for, and a node that is pinched between
two faces goes to and fro at about this speed without end. Where nothing is undone, what overlaps
does so for good."""

CAPACITY = 256
"""Faces that there is room for at first."""


def _scratch(candidates: Candidates) -> dict[str, Any]:
    """Return scratch of `ContactState` for these candidates."""
    points, edges = candidates.point_triangle, candidates.edge_edge
    return {
        "signs": aligned(len(edges.node)),
        "point_hits": new_hits(len(points.wake)),
        "edge_hits": new_hits(len(edges.wake)),
    }


class SelfContact:
    """Contact of one body with itself and with the floor.

    Args:
        body: At its start.
        node_size: Its mean node size [m].
        friction: Coefficient of friction.
        floor: Height of the floor [m], or None.
    """

    def __init__(
        self, body: Body, node_size: float, friction: float, floor: float | None = None
    ) -> None:
        n_nodes, n_tetrahedra = len(body.rest), len(body.tetrahedra)
        self._capacity = CAPACITY
        self._cell = float(node_size)
        recovery = float(RECOVERY * node_size)
        candidates = new_candidates(n_nodes, CAPACITY, self._cell)
        self.arrays = ContactState(
            faces=new_faces(n_tetrahedra),
            candidates=candidates,
            motion=new_motion(n_nodes, float(LITTLE * MARGIN * node_size)),
            contacts=new_contacts(n_nodes, self._n_contacts(n_nodes), recovery),
            normal=room_for_points(n_nodes),
            **_scratch(candidates),
            looked=np.zeros(1, np.int64),
            start=np.zeros((n_nodes, 3)),
            depth=np.zeros(n_nodes),
            depth_epoch=np.zeros(n_nodes, np.int64),
            tangled=np.zeros(n_nodes, np.int64),
            state=np.zeros(N_STATES, np.int64),
            totals=np.zeros(N_TOTALS),
            friction=float(friction),
            floor=-np.inf if floor is None else float(floor),
            margin=float(MARGIN * node_size),
            slack=float(_SLACK * node_size),
            touch=float(TOUCH * node_size),
        )
        self.arrays.state[IS_AWAKE] = floor is not None
        self.look_for_pieces(body)

    @property
    def is_awake(self) -> bool:
        """Whether there is anything that could touch."""
        return bool(self.arrays.state[IS_AWAKE])

    def begin(self) -> None:
        """Begin to count anew."""
        self.arrays.totals[:] = 0.0

    def touch(self, dt: float) -> BodyContacts:
        """Return what was counted, over the time `dt` [s]."""
        totals = self.arrays.totals
        per_second = 1.0 / dt if dt > 0.0 else 0.0
        return BodyContacts(
            n_contacts=int(totals[N_TOUCHING]),
            penetration=float(totals[PENETRATION]),
            force=float(totals[PRESSURE_IMPULSE] * per_second),
            force_of_floor=totals[FLOOR_IMPULSE : FLOOR_IMPULSE + 3] * per_second,
        )

    def mesh_changed(self, body: Body, change: Change) -> None:
        """Take in the faces that a pass of a cut made.

        The lips of the first incision do not touch before it ends: the blade is between them.
        """
        state, faces = self.arrays.state, self.arrays.faces
        faces = with_room(faces, 4 * int(change.n_dirty))
        renew_faces(faces, body, change)
        if faces is not self.arrays.faces:
            self.arrays = self.arrays.replaced(faces=faces)
        state[IS_STALE] = max(int(state[IS_STALE]), CHANGED)

    def incision_ended(self, body: Body) -> None:
        """Let its lips touch; and where the body is in pieces now, their skin too."""
        self.arrays.state[IS_AWAKE] |= self.arrays.faces.counts[0] > 0
        self.look_for_pieces(body)

    def look_for_pieces(self, body: Body) -> None:
        """Find out whether the body is in pieces; its skin may touch then, too."""
        faces = self.arrays.faces
        n_tetrahedra = body.n_tetrahedra
        piece, queue = np.empty((2, n_tetrahedra), np.int64)
        n_pieces = label_pieces(body, piece, queue)
        if n_pieces == 1:
            return
        faces = in_pieces(faces, piece, n_pieces)
        if not faces.counts[WITH_SKIN]:
            faces = with_room(faces, count_faces(body, True))
            faces.counts[WITH_SKIN] = 1
            collect_faces(faces, body)
        self.arrays = self.arrays.replaced(faces=faces)
        self.arrays.state[[IS_AWAKE, IS_STALE]] = 1, ANEW

    def make_room(self) -> None:
        """Double the room for what may touch."""
        self._capacity *= 2
        n_nodes = len(self.arrays.depth)
        candidates = new_candidates(n_nodes, self._capacity, self._cell)
        self.arrays = self.arrays.replaced(
            candidates=candidates,
            **_scratch(candidates),
            contacts=self._larger_contacts(n_nodes),
        )

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra."""
        arrays = self.arrays
        of_nodes = ("start", "depth", "depth_epoch", "tangled", "normal")
        self.arrays = arrays.replaced(
            faces=grown_faces(arrays.faces, n_tetrahedra),
            candidates=grown_candidates(arrays.candidates, n_nodes),
            motion=grown_motion(arrays.motion, n_nodes),
            contacts=self._larger_contacts(n_nodes),
            **{name: grown(getattr(arrays, name), n_nodes) for name in of_nodes},
        )

    def _larger_contacts(self, n_nodes: int) -> Contacts:
        return grown_contacts(self.arrays.contacts, n_nodes, self._n_contacts(n_nodes))

    def _n_contacts(self, n_nodes: int) -> int:
        """Return how many there is room for, every node on the floor among them."""
        return 16 * self._capacity + n_nodes
