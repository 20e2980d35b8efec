"""The boxes of the tissue's chunks in a collision manager, moved only where they must be."""

import fcl
import numpy as np

from bridge.collision_objects import MovableBox
from bridge.swept_box import SweptBox
from tissue.types import FloatArray

SLACK = 1e-3
"""[m], by which a box is larger than its chunk on every side, so that one which trembles, or sags
slowly, need not be moved in each step. A quarter of what the broad phase allows for sound."""

_UNTURNED = np.eye(3)


class ChunkBoxes:
    """Boxes that hold the tissue, and whether another object meets one of them."""

    def __init__(self) -> None:
        self._boxes: list[MovableBox] = []
        self._held = np.zeros((0, 2, 3))
        self._manager = fcl.DynamicAABBTreeCollisionManager()

    def fit(self, chunks: FloatArray) -> int:
        """Make the boxes hold these chunks, shape (n, 2, 3); return how many had to be moved."""
        if len(chunks) != len(self._boxes):
            self._boxes = [MovableBox() for _ in chunks]
            self._held = np.full((len(chunks), 2, 3), np.nan)
            self._manager = fcl.DynamicAABBTreeCollisionManager()
            self._manager.registerObjects([box.object for box in self._boxes])
            self._manager.setup()
        inside = (self._held[:, 0] <= chunks[:, 0]) & (chunks[:, 1] <= self._held[:, 1])
        left = np.flatnonzero(~inside.all(axis=1))
        if len(left) == 0:
            return 0
        self._held[left, 0] = chunks[left, 0] - SLACK
        self._held[left, 1] = chunks[left, 1] + SLACK
        for i in left.tolist():
            low, high = self._held[i]
            self._boxes[i].place(SweptBox(0.5 * (low + high), high - low, _UNTURNED))
        self._manager.update([self._boxes[i].object for i in left.tolist()])
        return len(left)

    def are_met_by(self, other: fcl.CollisionObject) -> bool:
        """Whether an object meets one of them."""
        found = fcl.CollisionData(request=_ONE_CONTACT)
        self._manager.collide(other, found, fcl.defaultCollisionCallback)
        return bool(found.result.is_collision)


_ONE_CONTACT = fcl.CollisionRequest(num_max_contacts=1, enable_contact=False)
