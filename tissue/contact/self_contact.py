"""`SelfContact`: owns the arrays of contact, and knows when there is anything to search.

Lips of a cut, pieces, and the floor: no node goes through a triangle, no edge through an edge.
Before the first face is cut, in a body of one piece without a floor, contact costs nothing.

Sides are in contact where one went through the other, from outside to inside, in a Runge-Kutta
step. So nodes of one body that lie close under a triangle of it are never mistaken for contact,
nothing passes unseen at any speed as long as it moves less than its own element in a step, and what
overlaps from the start is left alone rather than torn apart.
"""

from typing import Any

import numpy as np

from tissue.contact.candidates import Candidates, grown_candidates, new_candidates
from tissue.contact.constraints import Contacts, grown_contacts, new_contacts
from tissue.contact.faces import (
    grown_faces,
    new_faces,
    update_changed_faces,
    with_found_pieces,
    with_room,
)
from tissue.contact.hits import new_hits
from tissue.contact.motion_bounds import grown_motion_bounds, new_motion_bounds
from tissue.contact.penalty.contact_forces import new_penalty_forces
from tissue.contact.resolve import note_all_positions, resolve
from tissue.contact.state import FACES_CHANGED, REBUILD, UP_TO_DATE, ContactState
from tissue.core.array_types import FloatArray
from tissue.core.simd import aligned, room_for_points
from tissue.mesh.body import Body, grown
from tissue.mesh.changes import Change
from tissue.types import BodyContacts

PAIR_MARGIN = 0.25
"""Distance up to which faces are paired, per mean node size. Larger: more pairs, each to be tested
now and then; smaller: nodes must be paired again more often."""

FAST_MOVE = 1.0 / 64.0
"""Displacement in a Runge-Kutta step above which a node is fast, in margins. Larger: all pairs are
tested more often; smaller: more nodes are tested one by one."""

_TOLERANCE = 1e-4
"""Distance that counts as none, and correction at which Gauss-Seidel ends, per mean node size: a
third of a micrometre in an organ. Smaller: where lips of one cut lie node on node, each node
presses on all triangles around the other, one contact many times, and iterations never end early;
at 1e-6 a body with 3,000 contacts had 5,000, for less than shows. Larger: nodes that are pressed
tremble."""

_LARGEST_RESIDUAL = 0.01
"""Depth, per mean node size, up to which a node that could not be pushed out is found again by the
triangle beside as it slides there. Larger: what was always so is taken for contact, where lips are
thin; smaller: a node that is pinched between two faces is lost."""

_RECOVERY = 1.0
"""Speed at which an overlap is undone that was there before a Runge-Kutta step, in mean node sizes
a second. It is work on the springs behind that nothing accounts for, and a node that is pinched
between two faces moves to and fro at about this speed without end. Where nothing is undone, what
overlaps does so for good."""

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
        body: Body at its start.
        node_size: Mean node size of the body [m].
        friction: Coefficient of friction.
        floor: Height of the floor [m], or None.
    """

    def __init__(
        self, body: Body, node_size: float, friction: float, floor: float | None = None
    ) -> None:
        n_nodes, n_tetrahedra = len(body.rest), len(body.tetrahedra)
        self._capacity = CAPACITY
        self._cell = float(node_size)
        recovery = float(_RECOVERY * node_size)
        candidates = new_candidates(n_nodes, CAPACITY, self._cell)
        self.arrays = ContactState(
            is_awake=floor is not None,
            stale=UP_TO_DATE,
            is_pending=0,
            has_begun=0,
            step=0,
            tested_at=0,
            n_pressing=0,
            pressure_impulse=0.0,
            penetration=0.0,
            floor_impulse=np.zeros(3),
            faces=new_faces(n_tetrahedra),
            candidates=candidates,
            motion=new_motion_bounds(n_nodes, float(FAST_MOVE * PAIR_MARGIN * node_size)),
            contacts=new_contacts(n_nodes, self._n_contacts(n_nodes), recovery),
            normal=room_for_points(n_nodes),
            **_scratch(candidates),
            start=np.zeros((n_nodes, 3)),
            depth=np.zeros(n_nodes),
            depth_step=np.zeros(n_nodes, np.int64),
            inverted_step=np.zeros(n_nodes, np.int64),
            friction=float(friction),
            floor=-np.inf if floor is None else float(floor),
            margin=float(PAIR_MARGIN * node_size),
            largest_residual=float(_LARGEST_RESIDUAL * node_size),
            tolerance=float(_TOLERANCE * node_size),
        )
        self.forces = new_penalty_forces(0, friction, 0.0)
        self._find_pieces(body)

    @property
    def is_awake(self) -> bool:
        """Whether there is anything that could touch."""
        return bool(self.arrays.is_awake)

    @property
    def is_touching(self) -> bool:
        """Whether there were contacts in the last step."""
        return bool(self.arrays.contacts.n_contacts > 0)

    def wakes(self, body: Body) -> bool:
        """Return `is_awake`: folds are not looked for."""
        return self.is_awake

    def begin(self) -> None:
        """Clear the totals."""
        arrays = self.arrays
        arrays.floor_impulse[:] = 0.0
        arrays.pressure_impulse = 0.0
        arrays.penetration = 0.0
        arrays.n_pressing = 0

    def report(self, dt: float) -> BodyContacts:
        """Return the contacts since `begin`; `dt` is the time that has passed [s]."""
        arrays = self.arrays
        per_second = 1.0 / dt if dt > 0.0 else 0.0
        return BodyContacts(
            n_contacts=arrays.n_pressing,
            penetration=arrays.penetration,
            force=arrays.pressure_impulse * per_second,
            force_of_floor=arrays.floor_impulse * per_second,
        )

    def mesh_changed(self, body: Body, change: Change) -> None:
        """Add the faces that a pass of a cut made: lips touch as soon as they have parted."""
        arrays = self.arrays
        faces = with_room(arrays.faces, 4 * change.n_dirty)
        update_changed_faces(faces, body, change)
        arrays.stale = max(arrays.stale, FACES_CHANGED)
        if faces is not arrays.faces:
            self.arrays = arrays.replaced(faces=faces)
        self.arrays.is_awake |= faces.n_places > 0

    def incision_ended(self, body: Body) -> None:
        """Let the skin of pieces touch, where the body is in pieces now."""
        self._find_pieces(body)

    def _find_pieces(self, body: Body) -> None:
        """Find out whether the body is in pieces; their skin may touch then, too."""
        faces = with_found_pieces(self.arrays.faces, body)
        if faces is not None:
            self.arrays = self.arrays.replaced(faces=faces, is_awake=1, stale=REBUILD)

    @property
    def added_frequency_squared(self) -> float:
        """What contact adds to w^2 of the body [1/s2]: it corrects motion, and is no spring."""
        return 0.0

    def prepare(
        self,
        body: Body,
        frequency_squared: FloatArray,
        highest: float,
        room: float,
        seconds: float,
    ) -> None:
        """Do nothing: contacts are found after each substep.

        Args:
            body: Where the nodes are.
            frequency_squared: Bound on w^2 of each node without contact [1/s2].
            highest: Bound on w^2 of the body without contact [1/s2].
            room: What may be added to that without another step [1/s2].
            seconds: Length of the time step [s].
        """

    def start_substep(self, body: Body) -> None:
        """Note where all nodes are, before a substep."""
        if self.is_awake:
            note_all_positions(self.arrays, body)

    def end_substep(self, body: Body, external: FloatArray, seconds: float) -> None:
        """Correct positions and velocities after a substep of that length [s]."""
        if self.is_awake:
            while not resolve(self.arrays, body, seconds):
                self.make_room()

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
        """Make room for a body of `n_nodes` and `n_tetrahedra`."""
        arrays = self.arrays
        of_nodes = ("start", "depth", "depth_step", "inverted_step", "normal")
        self.arrays = arrays.replaced(
            faces=grown_faces(arrays.faces, n_tetrahedra),
            candidates=grown_candidates(arrays.candidates, n_nodes),
            motion=grown_motion_bounds(arrays.motion, n_nodes),
            contacts=self._larger_contacts(n_nodes),
            **{name: grown(getattr(arrays, name), n_nodes) for name in of_nodes},
        )

    def _larger_contacts(self, n_nodes: int) -> Contacts:
        return grown_contacts(self.arrays.contacts, n_nodes, self._n_contacts(n_nodes))

    def _n_contacts(self, n_nodes: int) -> int:
        """Return how many contacts there is room for, every node on the floor among them."""
        return 16 * self._capacity + n_nodes
