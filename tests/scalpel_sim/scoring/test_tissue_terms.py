"""Volumes that are stretched too far, and that are cut out: against bodies of known geometry."""

import numpy as np
import pytest

from bridge import InProcessLink
from scalpel_sim.scene.task_table import LimitTable
from scalpel_sim.scoring.tissue_terms import PiecesTerm, StrainTerm
from tests.scalpel_sim.scoring.known_cuts import COARSE, FINE, SIZE, body, upright_cut, yardstick
from tissue import TetrahedralMesh, Tissue, block

MESHES = pytest.mark.parametrize("cells", [COARSE, FINE])


def limits(**strains):
    """Return limits of strain, by the name of the part; `rest` is what has none of its own."""
    named = {None if name == "rest" else name: strain for name, strain in strains.items()}
    return {"limits": tuple(LimitTable(label=name, strain=x) for name, x in named.items())}


@MESHES
@pytest.mark.parametrize(
    ("strains", "shares"),
    [
        ({"rest": 0.2}, [0.5]),
        ({"rest": 0.25}, [0.0]),
        ({"vessel": 0.2, "rest": 0.2}, [0.25, 0.25]),
        ({"vessel": 0.25, "rest": 0.2}, [0.0, 0.25]),
    ],
)
def test_the_volume_that_is_stretched_too_far_is_known(cells, strains, shares):
    """The half behind y = 30 mm is 1.2 times as long, a strain of 0.22; the left half is vessel."""
    tissue = body(cells, labels=lambda middles: middles[:, 0] < 0.02)
    terms = [StrainTerm(each) for each in yardstick(tissue, **limits(**strains)).strains]
    nodes = tissue._body
    n, y = nodes.n_nodes, nodes.rest[: nodes.n_nodes, 1]
    nodes.positions[:n, 1] = y + 0.2 * np.maximum(y - 0.03, 0.0)
    for term in terms:
        term.look(tissue)
    volume = float(np.prod(SIZE))
    for term, share in zip(terms, shares, strict=True):
        assert term.volume == pytest.approx(share * volume, rel=1e-9, abs=1e-15)
    nodes.positions[:n, 1] = y  # what was stretched is hurt, though it comes back
    for term, share in zip(terms, shares, strict=True):
        term.look(tissue)
        assert term.volume == pytest.approx(share * volume, rel=1e-9, abs=1e-15)


def test_a_cut_through_strained_tissue_changes_no_volume():
    tissue = body()
    (term,) = [StrainTerm(each) for each in yardstick(tissue, **limits(rest=0.2)).strains]
    upright_cut(tissue, [(0.021, -0.01), (0.017, 0.07)], low=0.005)
    assert tissue.n_tetrahedra > len(block(COARSE, SIZE).tetrahedra)
    nodes = tissue._body
    nodes.positions[: nodes.n_nodes, 1] *= 1.2
    term.look(tissue)
    assert term.volume == pytest.approx(float(np.prod(SIZE)), rel=1e-9)


@MESHES
def test_what_is_cut_out_is_known(cells):
    """Of 40 mm the last 10 are cut off: part of the target, and of the rest."""
    mesh = block(cells, SIZE)
    x, y, _ = mesh.positions[mesh.tetrahedra].mean(axis=1).T
    labels = ((x > 0.02) & (y < 0.02)).astype(np.int64)
    tissue = Tissue(mesh._replace(labels=labels, label_names={1: "lump"}), gravity=(0.0, 0.0, 0.0))
    scale = yardstick(tissue, kind="excise", target="lump")
    term = PiecesTerm(scale, tissue.snapshot(), 1)
    upright_cut(tissue, [(0.03, -0.01), (0.03, 0.04)], low=-0.01)
    term.look(InProcessLink(tissue))
    assert (term.n, term.removed, term.healthy) == (1, 0.0, 0.0)
    upright_cut(tissue, [(0.03, -0.01), (0.03, 0.07)], low=-0.01)
    term.look(InProcessLink(tissue))
    per = float(np.prod(SIZE)) / len(labels)
    off = x > 0.03
    assert term.n == 2
    assert term.removed == pytest.approx((labels[off] == 1).sum() / (labels == 1).sum(), rel=1e-9)
    assert term.removed == pytest.approx(0.5, rel=0.2)
    assert term.healthy == pytest.approx(per * (labels[off] == 0).sum(), rel=1e-9)


def two_bodies():
    """Return a large body with a lump, and a small one beside it, whose cells are 5 mm wide."""
    large, small = block((8, 4, 4), (0.04, 0.02, 0.02)), block((2, 2, 2), (0.01, 0.01, 0.01))
    positions = np.concatenate([large.positions, small.positions + np.array([0.1, 0.0, 0.0])])
    tetrahedra = np.concatenate([large.tetrahedra, small.tetrahedra + len(large.positions)])
    x = positions[tetrahedra].mean(axis=1)[:, 0]
    labels = np.select([x > 0.05, x > 0.03], [3, 2], 1)
    names = {1: "a", 2: "a/lump", 3: "b"}
    return Tissue(TetrahedralMesh(positions, tetrahedra, labels, names), gravity=(0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("target", "removed", "healthy"),
    [("a/lump", 1.0, 0.005 * 0.02**2), ("a", 0.015 / 0.04, 0.0), ("b", 0.0, 0.015 * 0.02**2)],
)
def test_of_several_bodies_what_is_smaller_than_a_part_cut_off_is_not_cut_out(
    target, removed, healthy
):
    """Of 40 mm of the large body 15 are cut off, in which its lump is; the small one is whole."""
    tissue = two_bodies()
    term = PiecesTerm(yardstick(tissue, target=target), tissue.snapshot(), tissue.n_pieces())
    upright_cut(tissue, [(0.025, -0.01), (0.025, 0.03)], low=-0.01)
    term.look(InProcessLink(tissue))
    assert term.n == 3
    assert term.removed == pytest.approx(removed, rel=1e-9)
    assert term.healthy == pytest.approx(healthy, rel=1e-9)
    before = term.removed, term.healthy
    upright_cut(tissue, [(0.01, -0.01), (0.01, 0.01)], low=-0.01)  # not through
    term.look(InProcessLink(tissue))
    assert (term.removed, term.healthy) == before
