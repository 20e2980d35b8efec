"""Label volumes become tetrahedra: no gap between labels, and each has its volume."""

import json

import meshio
import numpy as np
import pytest

from scalpel_sim.cli.app import command_line
from scalpel_sim.errors import EXIT_OK, EXIT_WRONG_USE, UsageError
from scalpel_sim.meshing.label_volume import read_label_volume
from scalpel_sim.meshing.stuffing import stuff_volume
from tissue.mesh.faces import sorted_faces
from tissue.mesh.validation import quality, signed_volumes

nibabel = pytest.importorskip("nibabel", reason="the extra `mesh` is not installed")
nrrd = pytest.importorskip("nrrd", reason="the extra `mesh` is not installed")

WIDTH = 0.2
"""Of the volume [m]."""


def organs(n):
    """Two organs that touch, n voxels wide: 4 lies in 7."""
    at = (np.indices((n, n, n)).reshape(3, -1).T + 0.5) / n - 0.5
    first = np.linalg.norm((at - [-0.1, 0.0, 0.0]) * [1.0, 1.2, 1.4], axis=1) < 0.28
    second = np.linalg.norm((at - [0.15, 0.05, 0.0]) * [1.2, 1.0, 1.1], axis=1) < 0.25
    return np.where(first, 4, np.where(second, 7, 0)).astype(np.uint8).reshape(n, n, n)


def nifti(labels, folder, unit="mm", side=None, name="organs.nii.gz"):
    side = 1e3 * WIDTH / len(labels) if side is None else side
    image = nibabel.Nifti1Image(labels, np.diag([-side, side, side, 1.0]))
    image.header.set_xyzt_units(unit)
    nibabel.save(image, folder / name)
    return folder / name


def volumes_by_label(mesh):
    volumes = signed_volumes(mesh.positions, mesh.tetrahedra)
    return {k: volumes[mesh.labels == k].sum() for k in np.unique(mesh.labels).tolist()}


@pytest.mark.parametrize("n", [24, 64, 128])
def test_two_organs_that_touch_have_their_volumes_and_no_gap(n, tmp_path):
    labels = organs(n)
    mesh = stuff_volume(nifti(labels, tmp_path)).mesh
    own = volumes_by_label(mesh)
    for label in (4, 7):
        assert own[label] == pytest.approx((labels == label).sum() * (WIDTH / n) ** 3, rel=0.01)
    faces = sorted_faces(mesh.tetrahedra)
    a, b = faces.halves[faces.starts[faces.counts == 2][:, None] + [0, 1]].T // 4
    assert (mesh.labels[a] != mesh.labels[b]).sum() > 50
    # What encloses both encloses the sum: nothing is left free in between.
    tets, local = np.divmod(faces.halves[faces.starts[faces.counts == 1]], 4)
    opposite = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])[local]
    skin = mesh.positions[np.take_along_axis(mesh.tetrahedra[tets], opposite, axis=1)]
    assert np.linalg.det(skin).sum() / 6.0 == pytest.approx(sum(own.values()), rel=1e-9)
    assert quality(mesh.positions, mesh.tetrahedra).min() >= 0.1


def test_the_mesh_is_where_the_voxels_are(tmp_path):
    labels = organs(48)
    mesh = stuff_volume(nifti(labels, tmp_path), edge_length=0.008).mesh
    volume = read_label_volume(tmp_path / "organs.nii.gz", None)
    inside = np.argwhere(labels > 0)
    places = inside @ volume.to_metres[:, :3].T + volume.to_metres[:, 3]
    sizes = signed_volumes(mesh.positions, mesh.tetrahedra)
    centre = (sizes[:, None] * mesh.positions[mesh.tetrahedra].mean(axis=1)).sum(axis=0)
    np.testing.assert_allclose(centre / sizes.sum(), places.mean(axis=0), atol=2e-4)
    np.testing.assert_allclose(mesh.positions.min(axis=0), places.min(axis=0), atol=4e-3)


def test_labels_are_chosen_joined_and_named(tmp_path):
    labels = organs(24)
    labels[:4, :4, :4] = 9
    file = nifti(labels, tmp_path)
    only = stuff_volume(file, keep_labels="4").mesh
    assert set(only.labels) == {4}
    both = stuff_volume(file, keep_labels="4,7", label=["7,4=liver"]).mesh
    assert set(both.labels) == {7} and both.label_names == {7: "liver"}
    for options in ({"keep_labels": "5"}, {"label": ["4"]}, {"keep_labels": "a"}):
        with pytest.raises(UsageError, match=r"there are 4, 7, 9|3,5"):
            stuff_volume(file, **options)


def test_specks_are_left_out_with_a_word(tmp_path):
    labels = organs(48)
    labels[1:4, 1:4, 1:4] = 7
    made = stuff_volume(nifti(labels, tmp_path), edge_length=0.006)
    assert any("left out 1 pieces" in note for note in made.notes)


def test_many_labels_have_their_volumes_beside_one_that_is_smaller_than_a_cell(tmp_path):
    n = 64
    at = (np.indices((n, n, n)).reshape(3, -1).T + 0.5) / n - 0.5
    ways = np.linalg.norm(at[:, None] - np.random.default_rng(0).uniform(-0.2, 0.2, (6, 3)), axis=2)
    labels = np.where(ways.min(axis=1) < 0.2, ways.argmin(axis=1) + 1, 0).reshape(n, n, n)
    labels[tuple(np.argwhere(labels)[1000])] = 30
    made = stuff_volume(nifti(labels.astype(np.uint8), tmp_path))
    own = volumes_by_label(made.mesh)
    for label in range(1, 7):
        assert own[label] == pytest.approx((labels == label).sum() * (WIDTH / n) ** 3, rel=0.01)
    assert [note for note in made.notes if "by label: 30 lost." in note]
    assert quality(made.mesh.positions, made.mesh.tetrahedra).min() >= 0.1


@pytest.mark.parametrize(("unit", "metres"), [("mm", 1e-3), ("meter", 1.0), ("micron", 1e-6)])
def test_a_nifti_file_says_its_unit(unit, metres, tmp_path):
    volume = read_label_volume(nifti(organs(8), tmp_path, unit, side=2.0), None)
    np.testing.assert_allclose(volume.voxel_sides(), 2.0 * metres)


def test_voxels_without_a_size_are_asked_about(tmp_path):
    with pytest.raises(UsageError, match=r"does not say how large a voxel is\. Add --scale"):
        read_label_volume(nifti(organs(8), tmp_path, "unknown", side=1.0), None)
    volume = read_label_volume(tmp_path / "organs.nii.gz", 0.002)
    np.testing.assert_allclose(volume.voxel_sides(), 0.002)
    said = read_label_volume(nifti(organs(8), tmp_path, "unknown", side=1.5), None).notes
    assert said == (
        "voxels of 1.5 x 1.5 x 1.5, of a unit that is not named, are taken as millimetres",
    )


def test_segments_of_3d_slicer_keep_their_names(tmp_path):
    header = {
        "space": "left-posterior-superior",
        "space directions": np.diag([2.0, 3.0, 4.0]),
        "space origin": np.array([10.0, 20.0, 30.0]),
        "space units": ["mm"] * 3,
        "Segment0_LabelValue": "4",
        "Segment0_Name": "liver",
    }
    nrrd.write(str(tmp_path / "organs.seg.nrrd"), organs(8), header)
    volume = read_label_volume(tmp_path / "organs.seg.nrrd", None)
    np.testing.assert_allclose(
        volume.to_metres, 1e-3 * np.c_[np.diag([2.0, 3.0, 4.0]), [10, 20, 30]]
    )
    assert volume.names == {4: "liver"}
    np.testing.assert_array_equal(volume.labels, organs(8))


@pytest.mark.parametrize(
    ("labels", "said"),
    [
        (np.zeros((4, 4, 4), np.uint8), "with 0 outside"),
        (np.full((4, 4, 4), -1, np.int16), "as in an image: a label volume is needed"),
        (np.full((4, 4, 4), 0.5, np.float32), "not whole"),
        (np.ones((4, 4, 4, 2), np.uint8), "has 4 dimensions"),
    ],
)
def test_a_volume_that_holds_no_labels_is_refused(labels, said, tmp_path):
    with pytest.raises(UsageError, match=said):
        read_label_volume(nifti(labels, tmp_path), None)


@pytest.mark.parametrize("name", ["organs.nii", "organs.nii.gz", "organs.nrrd"])
def test_a_volume_that_is_cut_short_is_refused(name, tmp_path):
    if name.endswith(".nrrd"):
        nrrd.write(str(tmp_path / name), organs(16), {"spacings": [1.5] * 3})
    else:
        nifti(organs(16), tmp_path, name=name)
    whole = (tmp_path / name).read_bytes()
    for data in (whole[: len(whole) // 2], b"<html>", b""):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(UsageError, match="file, or it is cut short"):
            read_label_volume(tmp_path / name, None)


def test_the_command_writes_labels_and_tells_their_volumes(tmp_path, capsys):
    asked = ["mesh", str(nifti(organs(24), tmp_path)), "-o", str(tmp_path / "organs.vtu")]
    assert command_line([*asked, "--label", "4=liver", "--json"]) == EXIT_OK
    told = json.loads(capsys.readouterr().out)
    assert set(told["volumes"]) == {"4 (liver)", "7"}
    (labels,) = meshio.read(tmp_path / "organs.vtu").cell_data["label"]
    assert set(labels) == {4, 7}
    assert command_line([*asked, "--force", "--coarsen"]) == EXIT_WRONG_USE
    assert "--coarsen has no use here" in capsys.readouterr().err
