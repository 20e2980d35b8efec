"""`Incision`: brings the path of the blade into the mesh, from the first contact to the last."""

import math
from collections.abc import Callable
from typing import Final, NamedTuple, NoReturn

from tissue.core.jit import kernel
from tissue.cut_settings import SCHEMES, CutSettings
from tissue.cutting.blade_path import Path, new_path, path_travel
from tissue.cutting.stellar_scheme import StellarScheme
from tissue.cutting.workspace import Scheme, SnapLimits
from tissue.mesh.body import Body
from tissue.mesh.changes import ChangedMesh
from tissue.mesh.star import LARGEST_STAR, Visits
from tissue.mesh.validation import signed_volumes
from tissue.types import TissueError

INCREMENT = 0.25
"""Share of the mean node size by which the edge moves between two cuts at most. Coarser steps on
steep curves leave tetrahedra that bridge the cut."""

MOST_EDGE_INCREMENTS = 10_000
"""Increments of a step at most: half a minute of wall time in an organ, for a path of some metres.
More is taken for a mistake, which would keep a process for hours."""

TOO_MANY: Final = 0
"""Returned where there would be more increments than `MOST_EDGE_INCREMENTS`."""

RESTING_SPEED = 0.2
"""Mean node sizes per second below which the edge counts as at rest."""

RESTING_TIME = 0.02
"""Time at rest before the cut opens up to the edge [s]. A trembling hand stands still for an
instant at each turn; to lay a crack front there each time would shred the mesh."""


@kernel
def count_increments(travel: float, node_size: float) -> int:
    """Return in how many increments the edge moves, little in each; or TOO_MANY.

    It is 1 for a path that is not finite: a blade on it is refused anyway.

    Args:
        travel: Distance that the edge moves [m].
        node_size: Mean node size of the body [m].
    """
    n = travel / (INCREMENT * node_size)
    if not math.isfinite(n):
        return 1
    return TOO_MANY if n > MOST_EDGE_INCREMENTS else max(1, math.ceil(n))


class NoRoomError(Exception):
    """A list of a cut was full, so that what was done is of no use.

    Go back to where the step began, call `Scheme.make_room`, and do it again.

    Args:
        lacking: What lacks room: `LISTS` or `NODES` of `tissue.mesh.changes`.
    """

    def __init__(self, lacking: int) -> None:
        super().__init__("no room in a cut")
        self.lacking = lacking


class CutHooks(NamedTuple):
    """Calls of the owner of the mesh while it is cut.

    They are passed to each call and not kept: the owner holds the incision, and a cycle of the two
    would keep the arrays of a body in memory until Python searches for cycles.
    """

    before_cut: Callable[[], None]
    """Called before the passes of a cut step."""
    after_pass: Callable[[], None]
    """Called after each pass: updates what depends on the mesh, and makes room for another pass."""
    after_cut: Callable[[], None]
    """Called after the last pass."""
    mesh: Callable[[], tuple[Body, Visits]]
    """Returns the body as it is now, and scratch for searches."""


class Incision:
    """The current incision: its path, its state, and the passes that cut it.

    Args:
        scheme: How the mesh is cut.
        node_size: Mean node size of the body [m].
    """

    def __init__(self, scheme: Scheme, node_size: float) -> None:
        self.scheme = scheme
        self.path = new_path(2)
        """Path of the edge through the body at rest, in this step."""
        self.has_begun = False
        """Whether the edge is in the tissue, or was in the last step."""
        self._node_size = node_size
        self._is_open = False
        self._resting_time = 0.0

    @property
    def cut_area(self) -> float:
        """Area of the faces cut so far, at rest, one side of each [m2]."""
        return self.scheme.change.area

    @property
    def finished_area(self) -> float:
        """The part of `cut_area` that no blade cut: bridges that were finished [m2]."""
        return self.scheme.change.finished_area

    def n_increments(self, travel: float) -> int:
        """Return in how many increments the edge moves that far [m], little in each.

        It is 1 for a path that is not finite: a blade on it is refused anyway.

        Raises:
            ValueError: there are more than `MOST_EDGE_INCREMENTS`.
        """
        n = count_increments(travel, self._node_size)
        if n == TOO_MANY:
            most = MOST_EDGE_INCREMENTS * INCREMENT * self._node_size
            raise ValueError(
                f"the edge of the blade moves {travel:.3g} m in one step; that may be {most:.3g} m "
                "in this mesh. Take shorter steps, or begin with `None` where the blade is put "
                "elsewhere"
            )
        return n

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Do nothing: the scheme made the change."""

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for that many nodes and tetrahedra."""
        self.scheme.grow(n_nodes, n_tetrahedra)

    def take_edge(self, n_samples: int) -> None:
        """Prepare for an edge of that many samples."""
        self.path = new_path(n_samples)

    def detect(self, body: Body, visits: Visits, travel: float) -> bool:
        """Find the active tetrahedra and the edges that were crossed; return whether to cut.

        `travel`: that of the path (`tissue.cutting.blade_path.path_travel`).
        """
        if not self.has_begun or travel == 0.0:
            return False
        self._is_open = False
        self._detect(body, visits)
        return True

    def cut(self, hooks: CutHooks) -> None:
        """Cut what was detected."""
        self._cut_in_passes(self.scheme.cut, hooks)

    def open_to_edge(self, hooks: CutHooks) -> None:
        """Cut up to the edge itself, which rests or leaves the path that it came by."""
        self._detect(*hooks.mesh())
        self._cut_in_passes(self.scheme.cut_to_edge, hooks)
        self._is_open = True

    def has_rested(self, travel: float, dt: float) -> bool:
        """Return whether the edge has rested for a while ahead of the open cut.

        Args:
            travel: How far the edge moved in this step [m].
            dt: Length of the step [s]; it counts.
        """
        if not self.has_begun or self._is_open:
            return False
        most = RESTING_SPEED * self._node_size * dt
        if travel > most or path_travel(self.path) > most:
            self._resting_time = 0.0
        else:
            self._resting_time += dt
        return self._resting_time >= RESTING_TIME

    def end(self, hooks: CutHooks) -> None:
        """Resolve what the blade left uncut; the next contact begins another incision."""
        if not self._is_open:
            self.open_to_edge(hooks)
        self._is_open = False
        self._cut_in_passes(self.scheme.end, hooks)
        if self.path.has_left:
            self._cut_in_passes(self.scheme.finish, hooks)
        self.scheme.forget()
        self.has_begun = False

    def _cut_in_passes(
        self, one_pass: Callable[[Body, Visits, Path], None], hooks: CutHooks
    ) -> None:
        """Cut; where room runs out, make some and cut on."""
        hooks.before_cut()
        while True:
            body, visits = hooks.mesh()
            one_pass(body, visits, self.path)
            change = self.scheme.change
            if change.lacks_room or visits.is_full:
                self._refuse(visits)
            is_full = bool(change.is_full)
            hooks.after_pass()
            if not is_full:
                break
            self._detect(*hooks.mesh())
        hooks.after_cut()

    def _detect(self, body: Body, visits: Visits) -> None:
        """Find the active tetrahedra and the edges that were crossed.

        Raises:
            NoRoomError: there are more than there is room for.
        """
        self.scheme.detect(body, visits, self.path)
        if self.scheme.change.lacks_room or visits.is_full:
            self._refuse(visits)

    def _refuse(self, visits: Visits) -> NoReturn:
        """Refuse what is not complete.

        Raises:
            NoRoomError: a list was full.
            TissueError: more tetrahedra are around a node than any list has room for.
        """
        if self.scheme.change.lacks_room:
            raise NoRoomError(int(self.scheme.change.lacks_room))
        visits.is_full = 0
        raise TissueError(
            f"a node has more than {LARGEST_STAR} tetrahedra around it, which is more than a cut "
            "can divide. Use a mesh without such nodes, or a larger guard (`CutSettings.guard`)"
        )


def checked_scheme(name: str) -> str:
    """Return the name of a scheme.

    Raises:
        ValueError: there is no such scheme.
    """
    if name not in SCHEMES:
        raise ValueError(f"there is no scheme {name!r} of cutting. Schemes: {', '.join(SCHEMES)}")
    return name


LARGEST_FRAGMENT = 0.125
"""Volume of a fragment at most, as a share of the body's: half of a body of six tetrahedra is
none."""


def scheme_of(name: str, cut: CutSettings, body: Body, node_size: float) -> Scheme:
    """Return the scheme of that name.

    Args:
        name: `stellar` or `paper`.
        cut: How closely cuts follow the blade, where the scheme lets one choose.
        body: The body to be cut; whole.
        node_size: Mean node size of the body [m].
    """
    if name == "paper":  # imported late: its kernels would cost every start 0.8 s
        from tissue.cutting.bielser_1998.scheme import PaperScheme

        return PaperScheme(body, node_size)
    materials, n = body.materials, body.n_tetrahedra
    if materials.n == 1:
        volume = body.masses.sum() / materials.density[0]
    else:
        volume = signed_volumes(body.rest, body.tetrahedra[:n]).sum()
    lengths = SnapLimits(
        snap=float(cut.snap),
        floor=float(cut.floor * node_size),
        guard=float(cut.guard * node_size),
        crumb=float(min(cut.crumb / body.n_tetrahedra, LARGEST_FRAGMENT) * volume),
    )
    return StellarScheme(lengths, len(body.rest), len(body.tetrahedra))
