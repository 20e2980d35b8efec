"""`CutTimes`: since when each node of a body is on a face of a cut."""

import numpy as np

from bridge import InProcessLink, TissueLink
from tissue import BoolArray, FloatArray, Snapshot, Surface


class CutTimes:
    """Times at which nodes were first on a face of a cut, from step to step of a recording."""

    def __init__(self) -> None:
        self.times: FloatArray = np.empty(0)
        """Of each node [s]; NaN: it is on no face of a cut. Shape (n_nodes,)."""
        self._n_cut = 0
        self._forget_faces()

    def _forget_faces(self) -> None:
        self._n_faces = 0
        self._opened: dict[bytes, float] = {}  # since when there is a face, by place at rest

    def begin_again(self, times: FloatArray) -> None:
        """Continue after a step, with the times of its nodes [s]."""
        self.times, self._n_cut = times, -1
        self._forget_faces()

    def update(self, link: TissueLink, snapshot: Snapshot, surface: Surface, now: float) -> None:
        """Find the nodes that are on a face of a cut since the last call.

        Of a tissue in this process the time is that of the frame in which the first face was opened
        at the node's place, if its clock is the one of the simulation; else it is now.

        Args:
            link: The tissue.
            snapshot: The body.
            surface: The surface of it.
            now: Simulated time [s].
        """
        n_cut, n_nodes = int(surface.is_cut.sum()), len(snapshot.positions)
        if (n_cut, n_nodes) == (self._n_cut, len(self.times)):
            return
        times = np.full(n_nodes, np.nan)
        known = self.times[:n_nodes]
        times[: len(known)] = known
        self._note_faces(link)
        for node in np.flatnonzero(np.isnan(times) & _are_on_cut(snapshot, surface)):
            opened = self._opened.get(snapshot.rest_positions[node].tobytes(), now)
            times[node] = min(opened, now)
        self.times, self._n_cut = times, n_cut

    def _note_faces(self, link: TissueLink) -> None:
        """Note when faces were opened since the last call."""
        if not isinstance(link, InProcessLink):
            return
        faces = link.tissue.cut_faces(self._n_faces)
        self._n_faces += faces.n
        for corners, time in zip(faces.corners, faces.times.tolist(), strict=True):
            for corner in corners:
                self._opened.setdefault(corner.tobytes(), time)


def _are_on_cut(snapshot: Snapshot, surface: Surface) -> BoolArray:
    """Return which nodes are on a face of a cut, shape (n_nodes,).

    A surface does not say which nodes its vertices are: they are those at the same place.
    """
    vertices = np.unique(surface.triangles[surface.is_cut])
    on_cut = _keys(surface.positions[vertices], surface.rest_positions[vertices])
    return np.isin(_keys(snapshot.positions, snapshot.rest_positions), on_cut)


def _keys(positions: FloatArray, rest_positions: FloatArray) -> np.ndarray:
    """Return the bytes of each place now and at rest as one value, shape (n,)."""
    places = np.hstack([positions, rest_positions])
    return places.view(f"V{places.itemsize * places.shape[1]}").ravel()
