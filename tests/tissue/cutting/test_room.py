"""Where lists of a cut are full the step is done again: the bits do not depend on their room."""

import numpy as np
import pytest

from tests.support import bodies, strokes
from tissue import Material, MeshError, SolverSettings, TetrahedralMesh, Tissue
from tissue.cutting import workspace
from tissue.mesh import changes
from tissue.mesh.star import LARGEST_STAR

MESH = bodies.jittered(3, 0)
FRAME = 1e-3


def cut_through(scheme):
    """Return the body after a stroke through it, and the report of the cut."""
    tissue = Tissue(
        MESH,
        Material(),
        fixed=bodies.sides(MESH),
        solver=SolverSettings(scheme=scheme, audit=True),
    )
    for sweep in strokes.sweeps(strokes.THROUGH["slanted"](MESH)):
        tissue.step(sweep, FRAME)
    for _ in range(20):
        tissue.step(None, FRAME)
    assert tissue.n_repeated_steps == 0  # for want of room is not for instability
    assert len(tissue._stages.incision.scheme.change.dirty) > 1
    return tissue.snapshot(), tissue.cut_report()


@pytest.fixture
def no_room(monkeypatch):
    monkeypatch.setattr(changes, "CHANGES", 1)
    monkeypatch.setattr(workspace, "CHANGES", 1)
    monkeypatch.setattr(workspace, "CROSSINGS", 1)
    monkeypatch.setattr(workspace, "HASH_SLOTS", 1)


@pytest.mark.parametrize("scheme", ["stellar", "paper"])
def test_a_cut_that_begins_with_room_for_one_gives_the_same_bits(scheme, request):
    much, report = cut_through(scheme)
    request.getfixturevalue("no_room")
    little, other_report = cut_through(scheme)
    for one, other in zip(much, little, strict=True):
        assert np.array_equal(one, other)
    assert report == other_report
    assert len(much.tetrahedra) > len(MESH.tetrahedra)


def incised():
    """Return a body that was cut in its middle, and the area of the cut."""
    tissue = Tissue(MESH, fixed=bodies.sides(MESH))
    low, high = MESH.positions.min(axis=0), MESH.positions.max(axis=0)
    x = np.linspace(low[0] - 0.01, high[0] + 0.01, 12)
    y, z = 0.52 * (low[1] + high[1]), [low[2] - 0.01, high[2] + 0.01]
    edges = np.array([[(at, y, z[0]), (at, y, z[1])] for at in x])
    area = tissue.incise(edges, (1.0, 0.0, 0.0))
    return tissue.snapshot(), area, tissue.n_pieces()


def test_an_incision_that_begins_with_room_for_one_gives_the_same_bits(request):
    much, area, n_pieces = incised()
    request.getfixturevalue("no_room")
    little, other_area, other_n_pieces = incised()
    assert n_pieces == other_n_pieces == 2
    assert area == other_area
    for one, other in zip(much, little, strict=True):
        assert np.array_equal(one, other)


def test_a_node_with_more_tetrahedra_than_searches_have_room_for_is_refused():
    n = LARGEST_STAR + 4
    angles = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros(n)], axis=1)
    positions = np.concatenate([[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]], ring])
    i = np.arange(n)
    tetrahedra = np.stack([0 * i, 2 + i, 2 + (i + 1) % n, 0 * i + 1], axis=1)
    with pytest.raises(MeshError, match=rf"node 0 has {n} tetrahedra around it; there may be"):
        Tissue(TetrahedralMesh(positions, tetrahedra))
