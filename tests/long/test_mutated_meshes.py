"""Damaged mesh files of every format: refused by name, or read as a sound mesh with all cells."""

import pytest

from tests.long.child import Child
from tests.long.mesh_mutations import READ, REFUSED
from tests.support.battery import battery


@pytest.fixture(scope="module")
def reader(tmp_path_factory):
    child = Child("tests.long.mesh_mutations", "read_one", str(tmp_path_factory.mktemp("meshes")))
    yield child
    child.close()


@battery(n_per_change=1_500, n_long=100_000)
def test_a_damaged_mesh_is_refused_or_read_whole(case, reader, tally):
    outcome = reader.run(case)
    assert outcome in (REFUSED, READ)
    tally[outcome] += 1
