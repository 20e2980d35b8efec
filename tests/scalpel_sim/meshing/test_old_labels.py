"""Labels of a mesh that is filled anew."""

import numpy as np
import pytest

from scalpel_sim.meshing.old_labels import with_old_labels
from tissue import block
from tissue.mesh.validation import signed_volumes

SIZE = (0.06, 0.04, 0.04)


def labelled(cells, at):
    """A block with another label beyond a plane across x."""
    mesh = block(cells, SIZE)
    middles = mesh.positions[mesh.tetrahedra].mean(axis=1)[:, 0]
    return mesh._replace(labels=np.where(middles < at, 3, 7), label_names={3: "fat", 7: "skin"})


def test_labels_are_those_of_the_places():
    new, notes = with_old_labels(block((11, 7, 7), SIZE), labelled((6, 4, 4), 0.03))
    middles = new.positions[new.tetrahedra].mean(axis=1)[:, 0]
    clear = np.abs(middles - 0.03) > 0.06 / 11
    np.testing.assert_array_equal(new.labels[clear], np.where(middles < 0.03, 3, 7)[clear])
    assert new.label_names == {3: "fat", 7: "skin"}
    volumes = signed_volumes(new.positions, new.tetrahedra)
    assert volumes[new.labels == 3].sum() == pytest.approx(0.5 * np.prod(SIZE), rel=0.1)
    assert len(notes) == 1 and "fat " in notes[0] and "skin " in notes[0]


def test_a_large_tetrahedron_counts_where_the_middles_of_small_ones_are_nearer():
    old = labelled((6, 4, 4), 0.01)
    stretched = np.interp(old.positions[:, 0], [0.0, 0.01, 0.06], [0.0, 0.03, 0.06])
    old = old._replace(positions=np.c_[stretched, old.positions[:, 1:]])
    new, _ = with_old_labels(block((24, 4, 4), SIZE), old)
    middles = new.positions[new.tetrahedra].mean(axis=1)[:, 0]
    assert (new.labels[middles < 0.0285] == 3).all()
    assert (new.labels[middles > 0.0315] == 7).all()


def test_the_same_mesh_has_the_same_labels_and_flat_tetrahedra_do_not_count():
    old = labelled((6, 4, 4), 0.03)
    flat = old._replace(
        tetrahedra=np.vstack([old.tetrahedra, old.tetrahedra[:, [0, 1, 2, 2]]]),
        labels=np.concatenate([old.labels, 10 - old.labels]),
    )
    for mesh in (old, flat):
        new, _ = with_old_labels(old._replace(labels=None), mesh)
        np.testing.assert_array_equal(new.labels, old.labels)


def test_a_mesh_without_labels_gets_none():
    mesh = block((2, 2, 2), SIZE)
    assert with_old_labels(mesh, mesh) == (mesh, ())
