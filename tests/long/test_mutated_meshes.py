"""Damaged mesh files of every format: refused by name, or read as a sound mesh with all cells."""

import pytest

from tests.long.child import Child
from tests.long.mesh_mutations import FORMATS, READ, REFUSED, format_of
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


@pytest.fixture(scope="module")
def reader_of_formats(tmp_path_factory):
    folder = str(tmp_path_factory.mktemp("formats"))
    child = Child("tests.long.mesh_mutations", "read_one_of_a_format", folder)
    yield child
    child.close()


@battery(n_per_change=50 * len(FORMATS), n_long=10_000 * len(FORMATS))
def test_a_damaged_file_of_each_format_is_refused_or_read_whole(case, reader_of_formats, tally):
    outcome = reader_of_formats.run(case)
    assert outcome in (REFUSED, READ)
    tally[f"{format_of(case)}: {outcome}"] += 1
