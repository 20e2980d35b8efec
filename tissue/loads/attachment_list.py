"""`AttachmentList`: the attachments of a body, as the arrays that kernels work on."""

import numpy as np

from tissue.core.array_types import FloatArray
from tissue.forces.attachments import (
    CAUGHT,
    Attachments,
    attached_energy,
    frequency_squared,
    no_attachments,
)
from tissue.forces.fibre_crossing import catch_fibres, note_fibres
from tissue.forces.fibres import free_fibres, write_stiffening
from tissue.forces.step_context import Increment
from tissue.forces.tearing import tear_fibres
from tissue.loads.attachment import Attachment
from tissue.mesh.body import Body

_SAME = 1e-3
"""Relative change of its length by which an edge is another one, as for the tissue
(`tissue.blade.interaction`)."""

_LASTING = ("state", "place", "bend", "spent", "side", "before")
"""Arrays of `Attachments` that last while others come and go."""

_SUMS = ("work", "dissipated", "severing", "released")
"""Sums that do."""


class AttachmentList:
    """All attachments of a body, and their arrays."""

    def __init__(self) -> None:
        self._attachments: list[Attachment] = []
        self._released: list[Attachment] = []
        self._n_added = 0
        self.arrays: Attachments = no_attachments()
        """Arrays that kernels work on; others where attachments come or go."""
        self.added_frequency_squared = 0.0
        """Amount that they add to w^2 of the body at most [1/s2]."""
        self._edge_length = 0.0
        self.has_fibres = False
        """Whether any is a fibre that the blade can cut."""
        self._had_caught = False

    @property
    def all(self) -> tuple[Attachment, ...]:
        """Those that hold."""
        return tuple(self._attachments)

    @property
    def n_fibres(self) -> int:
        """Number of fibres that the blade may hold."""
        return int((self.arrays.section > 0.0).sum())

    @property
    def act(self) -> bool:
        """Whether there are any."""
        return bool(self._attachments)

    @property
    def is_idle(self) -> bool:
        """Whether a step has none to move, and none to forget that was released."""
        return not (self._attachments or self._released)

    def add(self, attachment: Attachment, body: Body) -> None:
        """Add an attachment, which holds from now on."""
        row = len(self.arrays.nodes)
        attachment.number = self._n_added
        self._n_added += 1
        self._attachments.append(attachment)
        self._renew(body, list(range(row)))
        arrays = self.arrays
        arrays.released -= attached_energy(arrays, body.positions, row, len(arrays.nodes))

    def remove(self, attachment: Attachment, body: Body) -> None:
        """Release an attachment.

        Raises:
            ValueError: it does not hold this body.
        """
        if attachment not in self._attachments:
            raise ValueError("it does not hold this tissue, or was released before")
        attachment.is_released = True
        attachment.forget()
        self._drop_released(body)

    def begin_step(self, body: Body, dt: float) -> None:
        """Move the frames that follow a path by `dt` [s], and write where all go in this step."""
        for each in self._attachments:
            each.advance(dt)
        self._drop_released(body)
        for each in self._released:
            each.forget()
        self._released.clear()
        self._write_targets()

    def _write_targets(self) -> None:
        """Write where the frames go in the next step."""
        if self._attachments:
            first, last = zip(*(each.targets() for each in self._attachments), strict=True)
            self.arrays.begin[:], self.arrays.end[:] = np.concatenate(first), np.concatenate(last)
            self.arrays.impulse[:] = self.arrays.turn[:] = 0.0

    def stop(self, body: Body) -> None:
        """Put every frame where it was to be at the end of the next step; free the blade."""
        self._free(body)
        for each in self._attachments:
            each.stop()
        self._write_targets()

    def begin_increment(self, body: Body, increment: Increment, has_blade: bool) -> None:
        """Hold what the blade, which may be gone or another, has caught."""
        self.arrays.work = 0.0
        if not self.has_fibres:
            return
        edge = increment.edge
        if not (has_blade and abs(edge.length - self._edge_length) <= _SAME * edge.length):
            self._free(body)
        self._edge_length = edge.length if has_blade else 0.0
        note_fibres(self.arrays, body.positions, increment.begin)
        has_caught = self.arrays.n_caught > 0
        if has_caught or self._had_caught:
            self._bound(body, edge.travel * (increment.end - increment.begin))
        self._had_caught = has_caught

    def end_increment(self, body: Body, increment: Increment) -> None:
        """Catch the fibres that the blade has met, and tear those between bodies that must."""
        if self.has_fibres and self._edge_length > 0.0:
            _, _, begin, end = increment
            catch_fibres(self.arrays, body.positions, increment.edge, begin, end)
        if self.has_fibres:
            tear_fibres(self.arrays, body.positions)

    def locate(self, body: Body) -> None:
        """Find the points in the mesh, which a cut has changed."""
        row = 0
        for each in self._attachments:
            nodes, weights = each.points.nodes_and_weights(body)
            rows = slice(row, row + len(nodes))
            self.arrays.nodes[rows], self.arrays.weights[rows] = nodes, _within(weights)
            if each.to is not None:
                others, of_others = each.to.nodes_and_weights(body)
                self.arrays.other_nodes[rows] = others
                self.arrays.other_weights[rows] = _within(of_others)
            row += len(nodes)
        self._bound(body, 0.0)

    def _bound(self, body: Body, travel: float) -> None:
        """Bound what attachments add to w^2 while the edge moves by `travel` [m] at most."""
        stiffening = np.empty(len(self.arrays.nodes))
        write_stiffening(self.arrays, body.positions, travel, stiffening)
        own_masses = body.masses - body.added_masses
        self.added_frequency_squared = frequency_squared(self.arrays, own_masses, stiffening)

    def end_step(self, body: Body, dt: float) -> None:
        """Write the force on its points to each attachment; drop those that were released."""
        arrays, row = self.arrays, 0
        for each in self._attachments:
            rows = slice(row, row + len(each.points))
            impulse, turn = (part[rows].sum(axis=0) for part in (arrays.impulse, arrays.turn))
            each.end_step(impulse / dt, turn / dt, arrays.state[rows])
            row += len(each.points)
        self._drop_released(body)

    def _drop_released(self, body: Body) -> None:
        """Drop those that were released, and count the energy of their springs."""
        if not any(each.is_released for each in self._attachments):
            return
        arrays, begin = self.arrays, 0
        kept: list[int] = []
        for each in self._attachments:
            rows = range(begin, begin + len(each.points))
            if each.is_released:
                self._released.append(each)
                arrays.released += attached_energy(arrays, body.positions, rows.start, rows.stop)
            else:
                kept += rows
            begin = rows.stop
        self._attachments = [each for each in self._attachments if not each.is_released]
        self._renew(body, kept)

    def _free(self, body: Body) -> None:
        """Take the blade away from all fibres."""
        free_fibres(self.arrays, body.positions)

    def _renew(self, body: Body, kept: list[int]) -> None:
        """Make arrays for the attachments that there are; the first are at rows of the old ones."""
        counts = [len(each.points) for each in self._attachments]
        old, self.arrays = self.arrays, no_attachments(sum(counts))
        for name in _LASTING:
            getattr(self.arrays, name)[: len(kept)] = getattr(old, name)[kept]
        for name in _SUMS:
            setattr(self.arrays, name, getattr(old, name))
        self.arrays.n_caught = int((self.arrays.state == CAUGHT).sum())
        row = 0
        for each, n in zip(self._attachments, counts, strict=True):
            rows = slice(row, row + n)
            self.arrays.stiffness[rows] = each.stiffness * each.points.shares
            self.arrays.damping[rows] = each.damping * each.points.shares
            self.arrays.length[rows] = each.lengths
            self.arrays.section[rows] = each.sections
            self.arrays.toughness[rows] = each.toughness
            self.arrays.is_tie[rows] = each.to is not None
            row += n
        self.has_fibres = bool(self.arrays.section.any())
        self._write_targets()
        self.locate(body)


def _within(weights: FloatArray) -> FloatArray:
    """Return weights of points in their tetrahedra: in a cut one rounding may have put it outside.

    `weights`: shape (n, 4).
    """
    inside = np.maximum(weights, 0.0)
    return np.asarray(inside / inside.sum(axis=1, keepdims=True))
