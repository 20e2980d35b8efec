"""Intervals of a cut whose account does not close: energy released, or area that is not paid for.

Both are looked at over 5 mm of cut and more. The length of a cut is the area that the mesh opened
over the mean length of edge in the tissue: each row of a recording has both, and unlike the way of
the blade it does not count tissue that is dragged along.
"""

from typing import NamedTuple

import numpy as np

from scalpel_sim.recording.recording import Recording
from tissue import FloatArray, IntArray

SHORTEST = 5e-3
"""Length of cut over which the account is looked at, at least [m]."""

MOST = 0.1
"""Share of the energy that may be released, and of the area that may be unpaid: the shipped scenes
are below 0.07, and a cut that costs nothing is at 1."""

AT_ONCE = 1.5
"""Length of cut that the mesh opens at once, in node sizes: the edge of a cell of a grid is 1.4 of
them. So far it may be ahead of the blade's work, or behind it."""


class Stretch(NamedTuple):
    """A part of a cut."""

    first: int
    """The frame at whose end it begins."""
    last: int
    """The frame at whose end it ends."""
    amount: float
    """Energy that was released [J], or area that was not paid for [m2]."""
    of: float
    """The energy [J], or the area [m2], of which that is a part."""

    @property
    def share(self) -> float:
        """The one over the other."""
        return self.amount / self.of


def energy_released(recording: Recording) -> Stretch | None:
    """Return the 5 mm of cut that released most of the energy; None if none passes `MOST`.

    The blade has gone as far there: the mesh opens in jerks, and energy flows as the blade goes.
    The energy is the work of the blade, or what was spent where it had been stored before.
    What the blade held at the start, and releases where it leaves the tissue, is not counted.

    Args:
        recording: With an account of the energy.
    """
    begins, ends = _windows(recording, _way_in_tissue(recording))
    if not len(begins):
        return None

    def change(name: str) -> FloatArray:
        column = recording.column(name)
        return np.asarray(column[ends] - column[begins])

    released = change("released_j")
    spent = released + change("cutting_j") + change("breaking_j") + change("friction_j")
    lost = released + np.minimum(change("held_j"), 0.0)
    energy = np.maximum(change("work_of_blade_j"), spent)
    shares = np.divide(lost, energy, out=np.zeros(len(lost)), where=energy > 0.0)
    most = int(shares.argmax())
    if shares[most] <= MOST:
        return None
    return Stretch(int(begins[most]), int(ends[most]), float(lost[most]), float(energy[most]))


def area_unpaid(recording: Recording, toughness: FloatArray, node_size: float) -> Stretch | None:
    """Return the part of a cut with most unpaid area, 5 mm or more; None if none passes `MOST`.

    What the mesh opens at once is not counted, and as much may be paid for before it opens.

    Args:
        recording: With an account of the energy.
        toughness: Energy per area at the speed of the blade in each frame [J/m2], (n_frames,).
        node_size: Mean size of a node [m].
    """
    begins, ends = _windows(recording)
    if not len(begins):
        return None
    opened = _area_opened(recording)
    paid = np.cumsum(np.diff(recording.column("cutting_j"), prepend=0.0) / toughness)
    beyond = (1.0 - MOST) * opened - paid
    at_once = AT_ONCE * node_size * float(recording.column("anchored_length_m").max())
    # A sum that does not fall below what may be paid for before (Page 1954, Biometrika 41:100).
    lowest = np.minimum.accumulate(beyond)[begins]
    sums = beyond[ends] - np.minimum(lowest + at_once, 0.0)
    most = int(sums.argmax())
    if sums[most] <= at_once:
        return None
    last = int(ends[most])
    first = int(begins[most]) - int(beyond[begins[most] :: -1].argmin())  # the last such place
    area = float(opened[last] - opened[first])
    return Stretch(first, last, area - float(paid[last] - paid[first]), area)


def length_of_cut(recording: Recording) -> FloatArray:
    """Return how long the cut is after each frame [m], shape (n_frames,)."""
    edge = recording.column("anchored_length_m")
    in_tissue = edge[edge > 0.0]
    if not len(in_tissue):
        return np.zeros(len(edge))
    return _area_opened(recording) / float(in_tissue.mean())


def _area_opened(recording: Recording) -> FloatArray:
    """Return the area that the mesh opened for the blade until each frame [m2], (n_frames,)."""
    return np.asarray(recording.column("cut_area_m2") - recording.column("finished_area_m2"))


def _way_in_tissue(recording: Recording) -> FloatArray:
    """Return how far the tip has gone with the edge in tissue after each frame [m], (n_frames,)."""
    tips = recording.vector("tip")
    steps = np.linalg.norm(np.diff(tips, axis=0, prepend=tips[:1]), axis=1)
    return np.cumsum(np.where(recording.column("anchored_length_m") > 0.0, steps, 0.0))


def _windows(recording: Recording, *others: FloatArray) -> tuple[IntArray, IntArray]:
    """Return the frames at which parts of a cut begin and end that are `SHORTEST` or little more.

    They begin where the edge is in the tissue after the frame.

    Args:
        recording: Of the cut.
        others: Other lengths after each frame that must have grown by as much [m].
    """
    lengths = (length_of_cut(recording), *others)
    ends: IntArray = np.max([np.searchsorted(each, each + SHORTEST) for each in lengths], axis=0)
    is_in = np.append(recording.column("anchored_length_m")[1:] > 0.0, False)
    begins: IntArray = np.flatnonzero((ends < len(ends)) & is_in)
    return begins, ends[begins]
