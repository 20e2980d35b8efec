"""`GeomContact`: owns the arrays of contact with rigid geoms, and searches once in a time step."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from tissue.contact.geometry.faces import (
    Faces,
    grown_faces,
    new_faces,
    update_changed_faces,
    with_room,
    with_skin,
)
from tissue.contact.geoms.contact_search import LIST_IS_FULL, find_geom_contacts
from tissue.contact.geoms.geom import Geom, GeomForces
from tissue.contact.geoms.geom_arrays import (
    MOVES_TOO_FAR,
    NO_ROTATION,
    ORIGIN_NOT_FINITE,
    TAKEN,
    TURNS_TOO_FAR,
    GeomContacts,
    Geoms,
    GeomSearch,
    grown_geom_contacts,
    largest_motion,
    lead_geoms,
    new_geom_contacts,
    new_geoms,
    place_geoms,
)
from tissue.contact.geoms.kinematic_contact import sum_wrenches
from tissue.contact.geoms.signed_distance import distance_to
from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.core.jit import SameTypes, kernel
from tissue.core.three_vectors import Wrench
from tissue.core.vec3 import vec3
from tissue.mesh.body import Body, grown
from tissue.mesh.changes import ChangedMesh
from tissue.types import RigidContacts

CONTACTS_AT_FIRST = 64
"""Contacts that there is room for at first."""

DEEPEST_AT_FIRST = 0.1
"""Largest depth of a node in a geom as contact begins, per mean node size: 0.3 mm in an organ. It
is put out of it in the first substep. Deeper: the tissue around is thrown."""

FARTHEST_IN_A_SUBSTEP = 0.5
"""Largest motion of a geom in an increment, per half its thickness: what is on one side of it
then is never beyond its middle in the next. Larger: a thin one passes through tissue."""

LARGEST_TURN = 0.5 * math.pi
"""Angle by which a geom may turn in a time step [rad]: beyond, the direction of its turn is a
guess."""


MOST_INCREMENTS = 500
"""Into how many increments a time step may be divided for geoms that move: a rod of 1 mm at 125 m/s
for 1 ms. It is a tenth of a second of wall time for a small body, and 15 times as long where the
step goes wrong and is repeated. More is taken for a mistake, which would keep a process for long.
With 10,000 a geom that was put 7 m elsewhere kept a server for 15 s."""

_UPDATE_FACES = SameTypes(update_changed_faces)


class GeomContact:
    """Contact of a body with rigid geoms, which are moved from outside between steps.

    Args:
        geoms: What the body can touch.
        body: The body.
        node_size: Its mean node size [m].
        origins: Origin of each geom [m], shape (n, 3); None: that of the tissue's frame.
        rotations: Axes of each as columns, shape (n, 3, 3); None: those of the tissue's frame.

    Raises:
        ValueError: a geom makes no sense (`planes_of`), two have one name, a pose is not finite or
            no pose, or a geom is inside the body by more than `DEEPEST_AT_FIRST`.
    """

    def __init__(
        self,
        geoms: Sequence[Geom],
        body: Body,
        node_size: float,
        origins: npt.ArrayLike | None = None,
        rotations: npt.ArrayLike | None = None,
    ) -> None:
        self.geoms = tuple(geoms)
        """The geoms, in the order of their numbers."""
        names = [geom.name for geom in self.geoms]
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise ValueError(f"two geoms have the name {twice!r}")
        n_nodes, all_geoms = len(body.rest), new_geoms(list(self.geoms))
        self.arrays: GeomContacts = new_geom_contacts(all_geoms, CONTACTS_AT_FIRST, n_nodes)
        """Arrays of the contacts; others where they grow."""
        self.faces: Faces = with_skin(new_faces(len(body.tetrahedra)), body)
        """Skin and lips; other arrays where they grow."""
        of_nodes = ("near", "near_at", "listed")
        self.search = GeomSearch(
            stamp=0,
            search=0,
            is_first=1,
            is_due=1,
            n_listed=0,
            n_of_faces=0,
            next_old=0,
            n_near=0,
            n_touched=0,
            seconds=0.0,
            moved=0.0,
            covered=0.0,
            fastest=0.0,
            touched=np.zeros(len(self.faces.face), np.int64),
            normal=np.zeros((n_nodes, 3)),
            node_size=float(node_size),
            **{name: np.zeros(n_nodes, np.int64) for name in of_nodes},
        )
        """Scratch of the search; another struct where its arrays grow."""
        self._find, self._lead = SameTypes(find_geom_contacts), SameTypes(lead_geoms)
        self._sum = SameTypes(sum_wrenches)
        self.seconds = 0.0
        """Length of the last time step [s]."""
        self.are_led = False
        """Whether geoms were led to poses for the next step, or in the last one."""
        n = len(self.geoms)
        self._origins = np.zeros((n, 3))
        self._rotations = np.tile(np.eye(3), (n, 1, 1))
        at_first = self._origins if origins is None else origins
        self._lead_to(at_first, rotations, largest_turn=math.inf, farthest=math.inf)
        self.stop()
        self._expect_outside(body)

    def move(self, origins: npt.ArrayLike, rotations: npt.ArrayLike | None = None) -> None:
        """Move all geoms in the next step, at even speeds, to where they then stay.

        Args:
            origins: Origin of each at the end of the step [m], shape (n, 3).
            rotations: Axes of each as columns, shape (n, 3, 3); None: as they are.

        Raises:
            ValueError: a number is not finite, a rotation is none, or turns by more than
                `LARGEST_TURN`; or a geom moves so far that `MOST_INCREMENTS` do not suffice.
        """
        self._lead_to(origins, rotations, LARGEST_TURN, MOST_INCREMENTS * FARTHEST_IN_A_SUBSTEP)

    def _lead_to(
        self,
        origins: npt.ArrayLike,
        rotations: npt.ArrayLike | None,
        largest_turn: float,
        farthest: float,
    ) -> None:
        """Do `move`, with turns up to that angle [rad], and that far per half a thickness."""
        n = len(self.geoms)
        places = np.array(origins, np.float64)
        axes = self._rotations if rotations is None else np.array(rotations, np.float64)
        if places.shape != (n, 3) or axes.shape != (n, 3, 3):
            raise ValueError(
                f"origins {places.shape} and rotations {axes.shape} of {n} geoms; they have the "
                f"shapes ({n}, 3) and ({n}, 3, 3)"
            )
        rows = axes.reshape(n, 9)
        fault, g = self._lead.call(self.arrays.geoms, places, rows, largest_turn, farthest)
        if fault != TAKEN:
            before = self._origins, self._rotations.reshape(n, 9)  # those before it were led
            self._lead.call(self.arrays.geoms, *before, math.inf, math.inf)
            what = f"geom '{self.geoms[g].name}'"
            raise ValueError(
                {
                    ORIGIN_NOT_FINITE: f"the origin of {what} is {places[g].tolist()}; it is three "
                    "finite numbers in m",
                    NO_ROTATION: f"the rotation of {what} is {axes[g].tolist()}; it is three axes "
                    "as columns, right-handed",
                    TURNS_TOO_FAR: f"{what} turns by more than {LARGEST_TURN:.2g} rad in one step, "
                    "so that its direction is a guess. Take shorter steps",
                    MOVES_TOO_FAR: f"{what} moves so far in one step, to {places[g].tolist()} m, "
                    f"that it takes more than {MOST_INCREMENTS} increments so that nothing slips "
                    "through it. Take shorter steps, or a thicker geom",
                }[fault]
            )
        self._origins, self._rotations = places, axes
        self.are_led = True

    def stop(self) -> None:
        """Place every geom where the next step would end."""
        if not self.are_led:
            return
        self.are_led = False
        arrays = self.arrays.geoms
        arrays.origin_t0[:] = self._origins
        arrays.axes_t0[:] = self._rotations.reshape(-1, 9)
        arrays.shift[:] = arrays.turn[:] = 0.0
        place_geoms(arrays, 1.0)

    @property
    def target(self) -> tuple[FloatArray, FloatArray, IntArray]:
        """Where the geoms go in the next step, and which may be touched; none of it is written."""
        return self._origins, self._rotations, self.arrays.geoms.is_near.copy()

    @target.setter
    def target(self, target: tuple[FloatArray, FloatArray, IntArray]) -> None:
        origins, rotations, are_near = target
        if origins is not self._origins or rotations is not self._rotations:
            self.move(origins, rotations)
        self.consider(are_near)

    def consider(self, are_near: BoolArray | IntArray) -> None:
        """Select the geoms that may touch in the next steps, by a broad phase; shape (n,)."""
        flags = self.arrays.geoms.is_near
        if (flags != are_near).any():
            flags[:] = are_near
            self.search.is_due = 1

    @property
    def act(self) -> bool:
        """Whether any node is near a geom."""
        return bool(self.geoms) and self.arrays.n_contacts > 0

    def begin_step(self, body: Body, dt: float) -> int:
        """Find the contacts of a step of that length [s].

        Returns:
            Number of increments of the step, so that no geom passes unseen.
        """
        self.seconds = dt
        if not self.geoms:
            return 1
        while self._find.call(self.search, self.arrays, self.faces, body, dt) == LIST_IS_FULL:
            # Twice the room: the arrays have two lists.
            self.arrays = grown_geom_contacts(self.arrays, len(self.arrays.geom), len(body.rest))
        if not self.are_led:
            return 1
        return max(1, math.ceil(largest_motion(self.arrays.geoms) / FARTHEST_IN_A_SUBSTEP))

    def wrenches(self) -> tuple[FloatArray, FloatArray]:
        """Return forces and torques of the tissue on the geoms, averaged over the last step.

        Returns:
            Forces [N], shape (n, 3), and torques about the geoms' origins at its end [N m],
            shape (n, 3), in the tissue's frame.
        """
        forces, torques = np.zeros((2, len(self.geoms), 3))
        per_second = 1.0 / self.seconds if self.seconds > 0.0 else 0.0
        self._sum.call(self.arrays, self._origins, per_second, forces, torques)
        return forces, torques

    def wrench(self, geom: int) -> Wrench:
        """Return the wrench of the tissue on one geom; see `wrenches`."""
        forces, torques = self.wrenches()
        return Wrench(forces[geom], torques[geom], self._origins[geom].copy())

    def forces(self) -> GeomForces:
        """Return where tissue touched geoms in the last step, and with which forces."""
        rows = self._rows()
        rows = rows[self.arrays.impulse[rows].any(axis=1)]
        arrays, seconds = self.arrays, self.seconds or math.inf
        return GeomForces(
            arrays.geom[rows],
            arrays.point[rows],
            arrays.normal[rows],
            arrays.impulse[rows] / seconds,
        )

    def contacts(self) -> RigidContacts:
        """Return the same contacts as rows of `StepResult.contacts`."""
        geom, point, normal, force = self.forces()
        press = np.einsum("ni,ni->n", force, normal)
        friction = force - press[:, None] * normal
        return RigidContacts(point, normal, press, friction, np.zeros(len(geom)), geom)

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Take the faces that a pass of a cut made."""
        if self.geoms:
            self.faces = with_room(self.faces, 4 * changed.change.n_dirty)
            _UPDATE_FACES.call(self.faces, changed.body, changed.change)
            self.search.is_due = 1
            n_faces = len(self.faces.face)
            if len(self.search.touched) < n_faces:
                self.search = self.search.replaced(touched=np.zeros(n_faces, np.int64))

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for a body of `n_nodes` and `n_tetrahedra`."""
        search = self.search
        of_nodes = {
            name: grown(getattr(search, name), n_nodes)
            for name in ("near", "near_at", "listed", "normal")
        }
        self.search = search.replaced(**of_nodes)
        self.faces = grown_faces(self.faces, n_tetrahedra)
        self.arrays = grown_geom_contacts(self.arrays, len(self.arrays.geom) // 2, n_nodes)

    def _rows(self) -> IntArray:
        first = self.arrays.first
        return np.arange(first, first + self.arrays.n_contacts)

    def _expect_outside(self, body: Body) -> None:
        """Refuse geoms that are inside the body.

        Raises:
            ValueError: a node is deeper in one than `DEEPEST_AT_FIRST`.
        """
        most = DEEPEST_AT_FIRST * self.search.node_size
        for g, geom in enumerate(self.geoms):
            node, depth = _deepest_node(self.arrays.geoms, g, body)
            if depth > most:
                x, y, z = body.positions[node]
                raise ValueError(
                    f"geom '{geom.name}' is {1e3 * depth:.2g} mm inside the tissue at ({x:.4g}, "
                    f"{y:.4g}, {z:.4g}) m as contact begins; at most {1e3 * most:.2g} mm are taken "
                    "out of it gently. Begin with it outside"
                )


def no_geoms(body: Body, node_size: float) -> GeomContact:
    """Return contact with nothing."""
    return GeomContact((), body, node_size)


@kernel
def _deepest_node(geoms: Geoms, g: int, body: Body) -> tuple[int, float]:
    """Return the free node that is deepest in geom `g`, and how deep [m]."""
    deepest, found = 0.0, 0
    for node in range(body.n_nodes):
        depth = -distance_to(geoms, g, vec3(body.positions, node)).distance
        if depth > deepest and not body.fixed[node]:
            deepest, found = depth, node
    return found, deepest
