"""Surfaces of all kinds: a sentence, or tetrahedra that come to rest and are cut."""

import importlib.util
import logging

import numpy as np
import pytest

from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.meshing.filling import fill
from scalpel_sim.meshing.limited_process import ProcessLimits
from tests.support import surfaces
from tests.support.battery import battery
from tissue import Tissue
from tissue.mesh.validation import quality

needs_mesher = pytest.mark.skipif(
    importlib.util.find_spec("pytetwild") is None, reason="the extra `mesh` is not installed"
)

EDGE_LENGTH = 0.012
"""[m]"""
HELD = 0.3
"""Share of the height below which nodes are held: an egg that stands on its tip does not rest."""


@needs_mesher
@battery(n_per_change=8, n_long=100)
def test_a_random_surface_is_refused_or_filled_and_cut(case, tmp_path_factory, tally, caplog):
    mesh, kind, unit = surfaces.of_a_kind(case)
    file = tmp_path_factory.mktemp("surface") / "body.stl"
    mesh.export(file)
    try:
        made = fill(
            file, scale=unit, edge_length=EDGE_LENGTH, limits=ProcessLimits(120.0, 4.0)
        ).mesh
    except (UsageError, RunError) as error:
        assert str(error).strip() and "\n" not in str(error)
        tally[f"{kind}: refused"] += 1
        return
    assert quality(made.positions, made.tetrahedra).min() > 0.05
    lowest, highest = made.positions.min(axis=0), made.positions.max(axis=0)
    height = highest[2] - lowest[2]
    with caplog.at_level(logging.ERROR, logger="tissue"):
        tissue = Tissue(made, fixed=made.positions[:, 2] < lowest[2] + HELD * height)
    tissue.settle()
    middle, margin = 0.5 * (lowest + highest), 0.1 * (highest - lowest)
    edges = [
        [[middle[0], y, z] for z in (lowest[2] - margin[2], highest[2] + margin[2])]
        for y in (lowest[1] - margin[1], highest[1] + margin[1])
    ]
    assert tissue.incise(edges, forward=(0.0, 1.0, 0.0)) > 0.0
    tissue.settle()
    assert np.isfinite(tissue.snapshot().positions).all()
    tally[f"{kind}: cut"] += 1
