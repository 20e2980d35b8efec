"""Degenerate cuts: exact answers where the blade passes through nodes, edges or faces."""

import numpy as np
import pytest

from tests.support import bodies, incisions, soundness, strokes
from tests.support.incisions import Incision
from tissue import TetrahedralMesh, Tissue, block

EDGE = 0.04
CUBE = block((4, 4, 4), (EDGE, EDGE, EDGE))
"""Cells of 10 mm of six tetrahedra around the diagonal from the lowest to the highest corner."""

SIDE = EDGE**2
"""Area of a side of the cube [m2]."""


def at_rest(mesh: TetrahedralMesh) -> Tissue:
    return Tissue(mesh, gravity=(0.0, 0.0, 0.0))


def straight(tip, heel, displacement, stop=None) -> Incision:
    """Return the flat cut of an edge from `tip` to `heel` [m] that moves by `displacement` [m]."""
    tip, heel, displacement = (np.asarray(x, dtype=np.float64) for x in (tip, heel, displacement))
    shares = np.linspace(0.0, 1.0, incisions.N_POSITIONS)[:, None, None]
    edges = np.stack([tip, heel]) + shares * displacement
    return Incision(edges, np.tile(displacement / np.linalg.norm(displacement), (len(edges), 1)))


def upright_at(x: float, low: float = -0.01, start: float = -0.01, stop: float = 0.05) -> Incision:
    """Return a cut along y of an upright edge at `x`, down to `low` [m]."""
    return straight((x, start, low), (x, start, 0.05), (0.0, stop - start, 0.0))


def expect_sound(before: Tissue, tissue: Tissue) -> None:
    assert soundness.faults(before, tissue.snapshot(), volume=1e-12) == []
    assert soundness.link_faults(tissue._body) == []


ALONG_FACES = {  # a cut along faces of the mesh, and its area
    "along a plane of nodes": (upright_at(0.02), SIDE),
    "a rounding error to the left of it": (upright_at(0.02 - 1e-13), SIDE),
    "a rounding error to the right of it": (upright_at(0.02 + 1e-13), SIDE),
    "flat, along a plane of nodes": (
        straight((-0.01, -0.01, 0.01), (0.05, -0.01, 0.01), (0.0, 0.06, 0.0)),
        SIDE,
    ),
    "along the diagonals of the cells": (
        straight((-0.01, -0.01, -0.01), (-0.01, -0.01, 0.05), (0.06, 0.06, 0.0)),
        np.sqrt(2.0) * SIDE,
    ),
    "a rounding error beside the diagonals": (
        straight((-0.01, -0.01 + 1e-13, -0.01), (-0.01, -0.01 + 1e-13, 0.05), (0.06, 0.06, 0.0)),
        np.sqrt(2.0) * SIDE,
    ),
    "along the diagonals, the edge along them too": (
        straight((-0.01, -0.01, -0.01), (0.05, -0.01, 0.05), (0.0, 0.06, 0.0)),
        np.sqrt(2.0) * SIDE,
    ),
    "starts at nodes inside": (upright_at(0.02, start=0.01, stop=0.05), 3 * SIDE / 4),
    "tip and end on lines of the grid": (upright_at(0.02, 0.02, stop=0.02), SIDE / 4),
    "the tip always on a line": (upright_at(0.02, 0.02), SIDE / 2),
    "stops at nodes": (upright_at(0.02, stop=0.03), 3 * SIDE / 4),
}
THROUGH_NODES = {
    "across the diagonals": straight((-0.01, 0.05, -0.01), (-0.01, 0.05, 0.05), (0.06, -0.06, 0.0)),
    "through two edges of the cube": straight(
        (-0.01, -0.01, 0.05), (0.05, -0.01, -0.01), (0.0, 0.06, 0.0)
    ),
}
SLITS = (
    "starts at nodes inside",
    "tip and end on lines of the grid",
    "the tip always on a line",
    "stops at nodes",
)


@pytest.mark.parametrize("name", [*ALONG_FACES, *THROUGH_NODES])
def test_14_a_cut_through_nodes_has_its_area_and_along_faces_it_adds_no_tetrahedra(name):
    cut, area = ALONG_FACES.get(name) or (THROUGH_NODES[name], np.sqrt(2.0) * SIDE)
    tissue = at_rest(CUBE)
    before = tissue.snapshot()
    assert tissue.incise(*cut) == pytest.approx(area, rel=1e-9)
    assert name in THROUGH_NODES or tissue.n_tetrahedra == len(CUBE.tetrahedra)
    assert tissue.n_pieces() == (1 if name in SLITS else 2)
    expect_sound(before, tissue)


NOTHING = {
    "an edge that does not move": Incision(
        np.array([[[0.02, 0.02, -0.01], [0.02, 0.02, 0.05]]] * 3), np.tile([0.0, 1.0, 0.0], (3, 1))
    ),
    "an edge that moves along itself": Incision(
        np.array([[[0.02, 0.02, z], [0.02, 0.02, z + 0.06]] for z in (-0.01, 0.0, 0.01)]),
        np.tile([0.0, 1.0, 0.0], (3, 1)),
    ),
    "an edge that moves backward only": straight(
        (0.02, 0.05, -0.01), (0.02, 0.05, 0.05), (0.0, -0.06, 0.0)
    )._replace(forward=np.tile([0.0, 1.0, 0.0], (incisions.N_POSITIONS, 1))),
    "an edge beside the body": upright_at(0.05),
    "an edge in the skin": upright_at(0.0),
    "an edge that grazes the skin": upright_at(EDGE - 1e-13),
    "an edge that passes above the body": upright_at(0.02, 0.0400001),
    "an edge along an edge of the body": straight(
        (0.04, -0.01, 0.04), (0.05, -0.01, 0.05), (0, 0.06, 0)
    ),
}


@pytest.mark.parametrize("name", NOTHING)
def test_an_incision_that_cuts_nothing_changes_no_bit_of_the_body(name):
    tissue = at_rest(CUBE)
    before = tissue.snapshot()
    assert tissue.incise(*NOTHING[name]) == 0.0
    for old, after in zip(before, tissue.snapshot(), strict=True):
        np.testing.assert_array_equal(after, old)


def test_a_cut_in_one_step_is_the_same_as_in_many():
    """One step from side to side of the body, or many of a millimetre."""
    mesh = bodies.jittered_grid(4, 3)
    many = upright_at(0.0217)
    at_once = Incision(many.edges[[0, -1]], many.forward[[0, -1]])
    once, stepwise = at_rest(mesh), at_rest(mesh)
    assert once.incise(*at_once) == pytest.approx(stepwise.incise(*many), rel=0.02)
    assert once.n_pieces() == stepwise.n_pieces() == 2


SHAPES = {
    "a sheet 100 times as wide as thick": block((10, 10, 1), (0.1, 0.1, 0.001)),
    "a sheet of cells 50 times as wide as high": block((4, 4, 2), (0.1, 0.1, 0.001)),
    "a rod": block((1, 20, 1), (0.002, 0.04, 0.002)),
    "a single cell": block((1, 1, 1), (0.01, 0.01, 0.01)),
    "a single tetrahedron": TetrahedralMesh(
        0.01 * bodies.unit_tetrahedron().positions, bodies.unit_tetrahedron().tetrahedra
    ),
    "two tetrahedra": TetrahedralMesh(
        0.01 * bodies.two_tetrahedra().positions, bodies.two_tetrahedra().tetrahedra
    ),
    "the size of a cell": block((3, 3, 3), (2e-5, 2e-5, 2e-5)),
    "slivers": bodies.with_slivers(4, 0),
}


@pytest.mark.parametrize("kind", incisions.KINDS)
@pytest.mark.parametrize("shape", SHAPES)
def test_thin_small_and_badly_shaped_bodies_stay_sound(shape, kind):
    mesh = SHAPES[shape]
    for seed in range(2):
        tissue = at_rest(mesh)
        before = tissue.snapshot()
        tissue.incise(*incisions.incision(mesh, kind, seed))
        expect_sound(before, tissue)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("shape", ["a sheet 100 times as wide as thick", "a rod", "a single cell"])
def test_a_thin_body_can_be_cut_in_two_across_any_axis(shape, axis):
    mesh = SHAPES[shape]
    tissue = at_rest(mesh)
    normal = np.eye(3)[axis] + 1e-3
    tissue.incise(*incisions.plane(mesh, normal, 0.03 * np.ptp(mesh.positions[:, axis])))
    assert tissue.n_pieces() == 2


# Cuts by a moving blade.


def cut_by_stroke(mesh: TetrahedralMesh, stroke: strokes.Stroke) -> tuple[Tissue, float]:
    """Return the body after a stroke, held at two sides, and the area cut [m2]."""
    tissue = Tissue(mesh, fixed=bodies.sides(mesh), gravity=(0.0, 0.0, 0.0))
    before = tissue.snapshot()
    results = strokes.make(tissue, stroke)
    tissue.step(None, strokes.DT)
    expect_sound(before, tissue)
    return tissue, results[-1].cut_area


def test_a_blade_at_10_metres_a_second_cuts_all_the_elements_that_it_passes_in_a_step():
    tissue, area = cut_by_stroke(
        CUBE, strokes.upright(0.0217, -0.01, 0.08, -0.01, 0.05, speed=10.0)
    )
    assert tissue.n_pieces() == 2
    assert area == pytest.approx(SIDE, rel=0.1)


def test_a_blade_that_only_grazes_the_skin_leaves_one_piece():
    tissue, area = cut_by_stroke(CUBE, strokes.upright(0.0217, -0.01, 0.08, 0.0399, 0.08))
    assert tissue.n_pieces() == 1
    assert area < 0.1 * SIDE
