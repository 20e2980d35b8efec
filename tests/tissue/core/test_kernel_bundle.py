"""A bundle of kernels is used where it fits, and refused with a reason where it does not."""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import llvmlite.binding as llvm
import pytest

import tissue
from tissue.core import kernel_bundle
from tissue.core.jit import is_compiling
from tissue.core.kernel_bundle import LEVELS, bundle_name, write_bundle

HERE = [name for name, level in LEVELS.items() if not level.missing()]
"""Levels that this machine reaches."""

pytestmark = pytest.mark.skipif(
    not (HERE and is_compiling()), reason="no level of this machine, or nothing is compiled"
)

CALL = """
from tissue.core.vec3 import Vec3, norm
print(norm(Vec3(1.0, 2.0, 2.0)))
"""


def call(cache: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """Return what a process prints that calls one kernel, with a cache of its own."""
    paths = {"PYTHONPATH": str(Path(tissue.__file__).parents[1]), "NUMBA_CACHE_DIR": str(cache)}
    done = subprocess.run(
        [sys.executable, "-c", CALL],
        env=os.environ | paths | variables,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "3.0\n"
    return done


@pytest.fixture(scope="module", params=HERE)
def bundle(request, tmp_path_factory):
    """A bundle of one program for a level, compiled as `warm-up --target` does."""
    folder = tmp_path_factory.mktemp("compiled")
    call(folder, **LEVELS[request.param].environment)
    (compiled,) = (folder / "kernels").iterdir()
    assert compiled.name == LEVELS[request.param].folder.name
    file = folder / bundle_name(request.param)
    assert write_bundle(request.param, compiled, file) == 1
    return file


def changed(bundle: Path, file: Path, **changes: str) -> Path:
    """Write a copy of a bundle whose key says something else, and return it."""
    with zipfile.ZipFile(bundle) as old, zipfile.ZipFile(file, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "key.json":
                content = json.dumps(json.loads(content) | changes).encode()
            new.writestr(name, content)
    return file


def test_with_a_bundle_nothing_is_compiled_or_written(bundle, tmp_path):
    assert not call(tmp_path, SCALPEL_SIM_BUNDLE=str(bundle)).stderr
    assert not list(tmp_path.rglob("*.nbc"))


def test_without_one_kernels_are_compiled(tmp_path):
    assert not call(tmp_path, SCALPEL_SIM_BUNDLE="").stderr
    assert list(tmp_path.rglob("*.nbc"))


def test_one_that_does_not_fit_is_refused_in_a_sentence_and_kernels_are_compiled(bundle, tmp_path):
    older = changed(bundle, tmp_path / "older.zip", numba="0.1.0")
    said = call(tmp_path, SCALPEL_SIM_BUNDLE=str(older)).stderr
    (sentence,) = said.splitlines()
    assert f"bundle of kernels {older} is not used: its numba is 0.1.0, and here" in sentence
    assert "kernels are compiled instead" in sentence and "warm-up --target" in sentence
    assert list(tmp_path.rglob("*.nbc"))


@pytest.mark.parametrize(
    "changes",
    [{"Python": "cpython-30"}, {"llvmlite": "0.1.0"}, {"engine": "0" * 16}, {"system": "plan9"}],
)
def test_a_bundle_serves_the_versions_alone_from_which_it_was_made(bundle, tmp_path, changes):
    ((name, value),) = changes.items()
    with pytest.raises(ValueError, match=f"its {name} is {value}, and here it is"):
        kernel_bundle._opened(changed(bundle, tmp_path / "other.zip", **changes))


def test_a_processor_that_lacks_an_instruction_refuses_it(bundle, monkeypatch):
    """It would else end the program as soon as the instruction comes."""
    with zipfile.ZipFile(bundle) as packed:
        level = LEVELS[json.loads(packed.read("key.json"))["level"]]
    has = dict(llvm.get_host_cpu_features())
    for lacking in level.features:
        others = has | {lacking: False}
        monkeypatch.setattr(llvm, "get_host_cpu_features", lambda others=others: others)
        with pytest.raises(ValueError, match=f"this machine lacks {lacking}$"):
            kernel_bundle._opened(bundle)


def test_another_architecture_refuses_it(bundle, monkeypatch):
    monkeypatch.setattr(kernel_bundle.platform, "machine", lambda: "riscv64")
    with pytest.raises(ValueError, match="this machine lacks processor"):
        kernel_bundle._opened(bundle)


def test_a_level_that_this_version_does_not_know_is_refused(bundle, tmp_path):
    with pytest.raises(ValueError, match="its level is x86-64-v9"):
        kernel_bundle._opened(changed(bundle, tmp_path / "newer.zip", level="x86-64-v9"))


@pytest.mark.parametrize("content", [b"", b"no zip file", None])
def test_a_file_that_is_no_bundle_is_refused(tmp_path, content):
    file = tmp_path / "kernels.zip"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(ValueError, match="it cannot be read"):
        kernel_bundle._opened(file)


def test_of_the_bundles_in_the_package_the_best_that_fits_is_used(bundle, tmp_path, monkeypatch):
    """A wheel that carries several serves each machine with one, without a word."""
    monkeypatch.delenv("SCALPEL_SIM_BUNDLE", raising=False)
    monkeypatch.setattr(kernel_bundle, "_PACKAGED", tmp_path)
    (tmp_path / bundle_name("neoverse")).write_bytes(b"of another machine")
    (tmp_path / bundle.name).write_bytes(bundle.read_bytes())
    used = kernel_bundle._bundle.__wrapped__()
    assert used.filename == str(tmp_path / bundle.name)
