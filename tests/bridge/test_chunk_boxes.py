import fcl
import numpy as np

from bridge.chunk_boxes import SLACK, ChunkBoxes

CHUNKS = np.array([[[0.0, 0, 0], [1, 1, 1]], [[2.0, 0, 0], [3, 1, 1]]])


def probe(x):
    """Return a ball of a millimetre on the x axis."""
    return fcl.CollisionObject(fcl.Sphere(1e-3), fcl.Transform(np.array([x, 0.5, 0.5])))


def test_only_boxes_that_their_chunks_have_left_are_moved():
    boxes = ChunkBoxes()
    assert boxes.fit(CHUNKS) == 2
    assert boxes.fit(CHUNKS + 0.9 * SLACK) == 0
    assert boxes.fit(CHUNKS + np.array([[[1.1 * SLACK]], [[0.0]]])) == 1


def test_boxes_are_met_where_their_chunks_are():
    boxes = ChunkBoxes()
    assert not boxes.are_met_by(probe(0.5))
    boxes.fit(CHUNKS)
    met = [boxes.are_met_by(probe(x)) for x in (0.5, 1.5, 2.5)]
    boxes.fit(CHUNKS + np.array([1.0, 0.0, 0.0]))
    moved = [boxes.are_met_by(probe(x)) for x in (0.5, 1.5, 2.5, 3.5)]
    assert (met, moved) == ([True, False, True], [False, True, False, True])


def test_chunks_may_come_and_go():
    boxes = ChunkBoxes()
    boxes.fit(CHUNKS)
    boxes.fit(CHUNKS[:1])
    assert [boxes.are_met_by(probe(x)) for x in (0.5, 2.5)] == [True, False]
    boxes.fit(CHUNKS)
    assert boxes.are_met_by(probe(2.5))
