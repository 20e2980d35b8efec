"""The same strokes give the same bits."""

import hashlib

import numpy as np
import pytest

from tests import bodies, strokes
from tissue import Tissue, block

MESHES = {
    "grid": block(),
    "jittered": bodies.jittered(4, 0),
    "fine": block((8, 9, 10), (0.04,) * 3),
}
"""In the fine one the arrays grow during the cut."""


def fingerprint(tissue, results):
    """Return a hash of every bit of the state and of what was felt."""
    digest = hashlib.sha256()
    for array in tissue.snapshot():
        digest.update(np.ascontiguousarray(array).tobytes())
    for array in tissue.surface():
        digest.update(np.ascontiguousarray(array).tobytes())
    for r in results:
        digest.update(np.concatenate([*r.wrench, r.force_on_tissue]).tobytes())
        digest.update(repr((r.cut_area, r.work_of_blade, r.work_of_cutting)).encode())
    return digest.hexdigest()


def run(mesh, stroke):
    tissue = Tissue(mesh, fixed=bodies.sides(mesh))
    results = strokes.make(tissue, stroke)
    assert results[-1].cut_area > 0.0
    return tissue, fingerprint(tissue, results)


@pytest.mark.parametrize("stroke", ["slanted", "curved"])
@pytest.mark.parametrize("mesh", MESHES)
def test_the_same_stroke_twice_gives_the_same_bits(mesh, stroke):
    body = MESHES[mesh]
    first, second = (run(body, strokes.THROUGH[stroke](body)) for _ in range(2))
    assert first[1] == second[1]


def test_arrays_that_grow_change_nothing():
    """Room that is there from the start, and room made in the middle of the cut."""
    mesh = MESHES["jittered"]
    stroke = strokes.slanted(mesh)
    _, expected = run(mesh, stroke)
    roomy = Tissue(mesh, fixed=bodies.sides(mesh))
    for _ in range(3):  # each call doubles arrays that look nearly full
        n_nodes, n_tetrahedra = roomy._body.n_nodes, roomy._body.n_tetrahedra
        roomy._body.n_nodes = len(roomy._body.rest)
        roomy._body.n_tetrahedra = len(roomy._body.tetrahedra)
        roomy._make_room()
        roomy._body.n_nodes, roomy._body.n_tetrahedra = n_nodes, n_tetrahedra
    assert len(roomy._body.rest) > 4 * len(Tissue(mesh)._body.rest)
    assert fingerprint(roomy, strokes.make(roomy, stroke)) == expected


def test_another_stroke_gives_other_bits():
    mesh = MESHES["grid"]
    assert run(mesh, strokes.slanted(mesh))[1] != run(mesh, strokes.slanted(mesh, 0.36))[1]


def test_two_bodies_do_not_disturb_each_other():
    """Steps of two bodies in turn give each the bits that it has alone."""
    mesh = MESHES["jittered"]
    stroke = strokes.straight(mesh)
    _, alone = run(mesh, stroke)
    pair = [Tissue(mesh, fixed=bodies.sides(mesh)) for _ in range(2)]
    results = [], []
    for sweep in strokes.sweeps(stroke):
        for tissue, felt in zip(pair, results, strict=True):
            felt.append(tissue.step(sweep, strokes.DT))
    assert [fingerprint(t, r) for t, r in zip(pair, results, strict=True)] == [alone] * 2
