"""Names of labels in `.vtu` files."""

import base64

import meshio
import numpy as np
import pytest

from tests.support import bodies
from tissue import Tissue, read_mesh, write_mesh, write_vtu
from tissue.mesh.mesh_arrays import MeshError

NAMES = {1: "fat", 3: 'V. cava \u00df "x" </a>'}
MESH = bodies.jittered(3, 0)._replace(labels=np.arange(174) % 4, label_names=NAMES)


def test_names_are_read_as_they_were_written(tmp_path):
    write_mesh(tmp_path / "mesh.vtu", MESH)
    again = read_mesh(tmp_path / "mesh.vtu")
    assert again.label_names == NAMES
    np.testing.assert_array_equal(again.labels, MESH.labels)


def test_a_body_is_written_with_names_that_others_can_read(tmp_path):
    tissue = Tissue(MESH)
    write_vtu(tmp_path / "body.vtu", tissue.snapshot(), label_names=tissue.label_names)
    assert read_mesh(tmp_path / "body.vtu").label_names == NAMES
    read = meshio.read(tmp_path / "body.vtu")
    (labels,) = read.cell_data["label"]
    np.testing.assert_array_equal(labels, MESH.labels)
    assert b'"1": "fat"' in read.field_data["label_names"].tobytes()


def test_a_mesh_without_names_has_no_field_data(tmp_path):
    write_mesh(tmp_path / "mesh.vtu", MESH._replace(label_names={}))
    assert b"FieldData" not in (tmp_path / "mesh.vtu").read_bytes()


@pytest.mark.parametrize("text", [b"[1, 2]", b'{"a": "fat"}', b"\xff", b'{"1": "f'])
def test_names_that_are_none_are_refused(text, tmp_path):
    path = tmp_path / "mesh.vtu"
    write_mesh(path, MESH._replace(label_names={1: "fat"}))
    good = b'{"1": "fat"}'

    def packed(content):
        return base64.b64encode(len(content).to_bytes(8, "little") + content)

    data = path.read_bytes()
    assert packed(good) in data
    data = data.replace(packed(good), packed(text))
    path.write_bytes(data.replace(b'NumberOfTuples="12"', b'NumberOfTuples="%d"' % len(text)))
    with pytest.raises(MeshError, match="names of labels in the field data label_names"):
        read_mesh(path)
