"""The cache of compiled kernels: its folder, and that an edit never reuses an old binary."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import llvmlite.binding as llvm
import numba as nb
import numpy as np
import pytest

import tissue
from tissue.core import kernel_parts, shortcuts
from tissue.core.jit import SameTypes, inlined, is_compiling, kernel
from tissue.core.kernel_cache import cache_directory

pytestmark = pytest.mark.kernel

PACKAGE = Path(tissue.__file__).parent


def directory_of(package: Path, cache: str = "elsewhere") -> Path:
    """Return the cache directory that a copy of the package uses."""
    program = "from tissue.core.kernel_cache import cache_directory; print(cache_directory())"
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


@pytest.mark.parametrize("source", ["core/vec3.py", "cutting/bielser_1998/case_table.py"])
def test_editing_any_source_changes_the_cache(copy, source):
    before = directory_of(copy)
    (copy / source).write_text((copy / source).read_text() + "# edited\n")
    assert directory_of(copy) != before


def test_numba_s_own_variable_moves_the_cache(copy, tmp_path):
    assert directory_of(copy, str(tmp_path / "here")).is_relative_to(tmp_path / "here")


def test_without_the_variable_the_cache_is_the_user_s(monkeypatch):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    assert "scalpel-sim" in str(cache_directory())


CALL = """
from tissue.core.vec3 import Vec3, norm
print(norm(Vec3(1.0, 2.0, 2.0)))
"""


def output_of_call(cache: Path) -> subprocess.CompletedProcess[str]:
    """Return what a process prints that calls one kernel, with a cache of its own."""
    return subprocess.run(
        [sys.executable, "-c", CALL],
        env=os.environ | {"PYTHONPATH": str(PACKAGE.parent), "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        check=True,
    )


@pytest.mark.skipif(not is_compiling(), reason="is about what is compiled")
def test_only_what_python_calls_becomes_a_program(tmp_path):
    output_of_call(tmp_path)
    assert sorted(path.name.split("-")[0] for path in tmp_path.rglob("*-part.*")) == [
        "vec3.dot",
        "vec3.norm",
    ]
    assert [path.name.split("-")[0] for path in tmp_path.rglob("*-program.*")] == ["vec3.norm"]


@pytest.mark.skipif(not is_compiling(), reason="is about what is compiled")
def test_a_second_process_finds_what_the_first_compiled(tmp_path):
    first = output_of_call(tmp_path).stdout
    files = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nbc")}
    assert output_of_call(tmp_path).stdout == first == "3.0\n"
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nbc")} == files


CALLED = """
from tissue.core.jit import kernel
FACTOR = {factor}
@kernel
def scaled(x):
    return x * {code}
"""

CALLER = """
from called import FACTOR, scaled
from tissue.core.jit import kernel
@kernel
def both(x):
    return later(x) + FACTOR
@kernel
def later(x):
    return scaled(x)
print(both(1.0))
"""


@pytest.mark.skipif(not is_compiling(), reason="is about what is compiled")
def test_a_kernel_of_another_package_is_compiled_again_when_what_it_uses_is_edited(tmp_path):
    (tmp_path / "caller.py").write_text(CALLER)
    paths = os.pathsep.join([str(PACKAGE.parent), str(tmp_path)])
    printed = []
    for factor, code in ((1.0, "2.0"), (1.0, "3.0"), (5.0, "3.0")):
        (tmp_path / "called.py").write_text(CALLED.format(factor=factor, code=code))
        found = subprocess.run(
            [sys.executable, "-B", "caller.py"],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": paths, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
            capture_output=True,
            text=True,
            check=True,
        )
        printed.append(float(found.stdout))
    assert printed == [3.0, 4.0, 8.0]


def test_a_cache_that_cannot_be_written_costs_time_and_nothing_else(tmp_path):
    no_folder = tmp_path / "file"
    no_folder.touch()
    assert output_of_call(no_folder).stdout == "3.0\n"


def test_two_kernels_of_one_name_and_line_stay_apart():
    def adding(amount):
        @kernel
        def added(a):
            return a + amount

        return added

    one, two = adding(1.0), adding(2.0)

    @kernel
    def both(a):
        return one(a) * two(a)

    assert both(1.0) == 6.0


@kernel
def sums(a, b, c):
    return a + b, a + c, c + c, a < c


def test_an_operator_is_typed_by_the_types_of_each_of_its_uses():
    """Types of operators are remembered from kernel to kernel."""
    for _ in range(2):
        values = sums(1, 2, 0.5), sums(1.5, 2, 3), sums(True, 2, 1)
        assert values == ((3, 1.5, 1.0, False), (3.5, 4.5, 6, True), (3, 2, 2, False))
        kinds = [[type(value) for value in row] for row in values]
        assert kinds == [
            [int, float, float, bool],
            [float, float, int, bool],
            [int, int, int, bool],
        ]


def code_of(function, *arguments):
    """Return the code of a kernel as a part, in LLVM's language."""
    compiled = kernel_parts._part_of(function.py_func, arguments)
    return str(compiled.library._get_module_for_linking())


@kernel
def _leaf(x):
    return x + 1.0


@inlined
def _branch(x):
    return _leaf(x)


@kernel
def _root(x):
    return _branch(x)


@pytest.mark.skipif(not is_compiling(), reason="nothing is compiled")
def test_a_kernel_has_the_same_flags_whoever_calls_it_first():
    """Its name in the code tells them: parts from two processes would not fit otherwise."""
    assert _root(1.0) == 2.0
    assert "alwaysinline" not in code_of(_leaf, nb.float64)
    assert "alwaysinline" in code_of(_branch, nb.float64)


@pytest.mark.skipif(not is_compiling(), reason="nothing is compiled")
def test_compiling_a_kernel_leaves_numba_as_it_was():
    def numba_s():
        functions = [getattr(owner, name) for owner, name, _ in shortcuts._REPLACEMENTS]
        return functions, list(llvm.ffi.lib._lock._cblist)

    before = numba_s()

    @kernel
    def added(a, b):
        return a + b

    assert added(1, 2) == 3
    assert before == numba_s()


@pytest.mark.skipif(not is_compiling(), reason="nothing is compiled")
def test_a_kernel_that_cannot_be_compiled_leaves_numba_as_it_was():
    before = [getattr(owner, name) for owner, name, _ in shortcuts._REPLACEMENTS]

    @kernel
    def of_no_type(a):
        return a.attribute_that_no_array_has

    with pytest.raises(nb.TypingError, match="attribute_that_no_array_has"):
        of_no_type(np.zeros(3))
    assert before == [getattr(owner, name) for owner, name, _ in shortcuts._REPLACEMENTS]


def test_a_kernel_for_a_caller_of_the_same_types_does_the_same_in_each_call():
    @kernel
    def scaled(x, factor):
        return x[0] * factor

    of_doubles, of_singles = SameTypes(scaled), SameTypes(scaled)
    for factor in (2.0, 3.0):
        assert of_doubles.call(np.array([1.5]), factor) == 1.5 * factor
        assert of_singles.call(np.array([1.5], np.float32), factor) == 1.5 * factor
    if is_compiling():
        assert of_doubles.call is not of_singles.call
        assert {type(each.call).__name__ for each in (of_doubles, of_singles)} == {
            "builtin_function_or_method"
        }
