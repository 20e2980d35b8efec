"""The cache of compiled kernels: its folder, and that an edit never reuses an old binary."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import tissue
from tissue.core.jit import cache_directory, kernel

pytestmark = pytest.mark.kernel

PACKAGE = Path(tissue.__file__).parent


def directory_of(package: Path, cache: str = "elsewhere") -> Path:
    """Return the cache directory that a copy of the package uses."""
    program = "from tissue.core.jit import cache_directory; print(cache_directory())"
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=package.parent,
        env=os.environ | {"PYTHONPATH": str(package.parent), "NUMBA_CACHE_DIR": cache},
        capture_output=True,
        text=True,
        check=True,
    )
    return Path(done.stdout.strip())


@pytest.fixture
def copy(tmp_path):
    """A copy of the package's sources."""
    target = tmp_path / "tissue"
    shutil.copytree(PACKAGE, target, ignore=shutil.ignore_patterns("__pycache__", "data"))
    return target


def test_the_same_sources_share_a_cache(copy):
    assert directory_of(copy).name == directory_of(PACKAGE).name == cache_directory().name


@pytest.mark.parametrize(
    "source",
    [
        "core/vec3.py",
        "elasticity/springs.py",
        "core/jit.py",
        "contact/spatial_hash.py",
        "cutting/bielser_1998/case_table.py",
    ],
)
def test_editing_any_source_changes_the_cache(copy, source):
    before = directory_of(copy)
    (copy / source).write_text((copy / source).read_text() + "# edited\n")
    assert directory_of(copy) != before


def test_a_new_source_changes_the_cache(copy):
    before = directory_of(copy)
    (copy / "another.py").write_text('"""Another."""\n')
    assert directory_of(copy) != before


def test_numba_s_own_variable_moves_the_cache(copy, tmp_path):
    assert directory_of(copy, str(tmp_path / "here")).is_relative_to(tmp_path / "here")


def test_without_the_variable_the_cache_is_the_user_s(monkeypatch):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    assert "scalpel-sim" in str(cache_directory())


def test_a_kernel_computes_what_its_source_says():
    @kernel
    def halves(a, b):
        return 0.5 * (a + b)

    assert halves(1.0, 2.0) == 1.5
    assert halves(3, 4) == 3.5
