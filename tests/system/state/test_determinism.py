"""The same strokes give bit-identical results."""

import hashlib

import numpy as np
import pytest

from tests.support import bodies, strokes
from tests.support.materials import SPRINGS
from tissue import Hierarchical, Material, SolverSettings, Tissue, block

MESHES = {
    "grid": block(),
    "jittered": bodies.jittered(4, 0),
    "fine": block((8, 9, 10), (0.04,) * 3),
}
"""Meshes of the tests; in the fine one the arrays grow during the cut."""

RELAXATIONS = {
    "global": "global",
    "hierarchical": Hierarchical(updates=16, rings=3),
    "verlet": "verlet",
}


def fingerprint(tissue, results):
    """Return a hash of every bit of the final state and of the wrenches of all frames."""
    digest = hashlib.sha256()
    for array in tissue.snapshot():
        digest.update(np.ascontiguousarray(array).tobytes())
    for array in tissue.surface():
        digest.update(np.ascontiguousarray(array).tobytes())
    for r in results:
        digest.update(np.concatenate([*r.wrench, r.force_on_tissue]).tobytes())
        digest.update(repr((r.cut_area, r.work_of_blade, r.work_of_cutting)).encode())
    return digest.hexdigest()


def body_of(mesh, relaxation="global"):
    """Return `mesh` held at its sides, made of springs where it is not relaxed by Runge-Kutta."""
    return Tissue(
        mesh,
        Material() if relaxation == "global" else SPRINGS,
        fixed=bodies.sides(mesh),
        solver=SolverSettings(relaxation=relaxation),
    )


def run(mesh, stroke, relaxation="global"):
    """Return the fingerprint of a stroke that cuts."""
    tissue = body_of(mesh, relaxation)
    results = strokes.make(tissue, stroke)
    assert results[-1].cut_area > 0.0
    return fingerprint(tissue, results)


@pytest.mark.parametrize(
    ("mesh", "stroke", "relaxation"),
    [
        ("grid", "curved", "global"),
        ("jittered", "slanted", "global"),
        ("fine", "slanted", "global"),
        *(("jittered", "slanted", relaxation) for relaxation in ("hierarchical", "verlet")),
    ],
)
def test_the_same_stroke_twice_gives_the_same_bits(mesh, stroke, relaxation):
    body = MESHES[mesh]
    planned = strokes.THROUGH[stroke](body)
    first, second = (run(body, planned, RELAXATIONS[relaxation]) for _ in range(2))
    assert first == second


@pytest.mark.parametrize("relaxation", RELAXATIONS)
def test_arrays_that_grow_change_nothing(relaxation):
    """Arrays with enough capacity from the start, and arrays that grow during the cut."""
    mesh = MESHES["jittered"]
    stroke = strokes.slanted(mesh)
    ample = body_of(mesh, RELAXATIONS[relaxation])
    at_first = len(ample._body.rest)
    for _ in range(3):  # each call doubles arrays that appear nearly full
        n_nodes, n_tetrahedra = ample._body.n_nodes, ample._body.n_tetrahedra
        ample._body.n_nodes = len(ample._body.rest)
        ample._body.n_tetrahedra = len(ample._body.tetrahedra)
        ample._stages.make_room()
        ample._body.n_nodes, ample._body.n_tetrahedra = n_nodes, n_tetrahedra
    assert len(ample._body.rest) > 4 * at_first
    expected = run(mesh, stroke, RELAXATIONS[relaxation])
    assert fingerprint(ample, strokes.make(ample, stroke)) == expected


def test_another_stroke_gives_other_bits():
    mesh = MESHES["grid"]
    assert run(mesh, strokes.slanted(mesh)) != run(mesh, strokes.slanted(mesh, 0.36))


@pytest.mark.parametrize(
    "choice", [{"precision": "single"}, {"precision": "double"}, {"relaxation": "verlet"}], ids=str
)
def test_an_account_of_the_energy_changes_no_bit(choice):
    """What is computed to count energies is scratch of the motion too."""
    mesh = MESHES["jittered"]
    soft = Material(law="neo_hookean", poisson_ratio=0.45)
    found = []
    for audit in (False, True):
        solver = SolverSettings(audit=audit, **choice)
        tissue = Tissue(mesh, soft, fixed=bodies.sides(mesh), solver=solver)
        found.append(fingerprint(tissue, strokes.make(tissue, strokes.slanted(mesh))))
    assert found[0] == found[1]
