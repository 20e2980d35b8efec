"""The public names of the packages: all exist, and importing a package loads little."""

import importlib
import subprocess
import sys

import pytest

PACKAGES = ("tissue", "tissue.support", "bridge", "scalpel_sim")
HEAVY = ("numba", "llvmlite", "mujoco", "matplotlib", "trimesh", "fcl")


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_exists(package):
    face = importlib.import_module(package)
    missing = [name for name in face.__all__ if getattr(face, name, None) is None]
    assert missing == []
    assert set(face.__all__) <= set(dir(face))


@pytest.mark.parametrize("package", PACKAGES)
def test_importing_a_package_loads_nothing_heavy(package):
    program = f"import sys, {package}; print(sorted(set({HEAVY}) & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("package", PACKAGES)
def test_a_name_that_is_not_public_is_refused(package):
    with pytest.raises(AttributeError, match="no_such_name"):
        importlib.import_module(package).no_such_name  # noqa: B018 - the access is the test


def test_the_process_that_serves_a_page_loads_no_simulation():
    """It begins a second sooner, before a person can see anything."""
    simulation = {"scalpel_sim.simulation", "tissue.tissue", "trimesh", "matplotlib"}
    program = f"import sys, scalpel_sim.viewer.server; print({simulation} & set(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "set()"
