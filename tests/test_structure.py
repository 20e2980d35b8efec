"""Limits on the size of files and functions, and one defining module for each public name."""

import ast
import re
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("tissue", "bridge", "scalpel_sim", "benchmarks")
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))

MOST_LINES = 400
MOST_BODY_LINES = 60
MOST_ARGUMENTS = 8
MOST_FILES_IN_A_ROOT = 12


def functions_of(path):
    """Return every function of a file, methods included."""
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef)
    return [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, kinds)]


def body_lines(function):
    """Return the number of lines of a function's body, without its docstring."""
    body = function.body[1:] if ast.get_docstring(function) is not None else function.body
    return body[-1].end_lineno - body[0].lineno + 1 if body else 0


def arguments(function):
    """Return the names of a function's arguments, without `self` and `cls`."""
    given = function.args
    names = [a.arg for a in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
    return [name for name in names if name not in ("self", "cls")]


def public_names(path):
    """Return the public functions, classes and constants that a file defines."""
    names = set()
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            names.add(node.name)
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            parts = [part for target in targets for part in ast.walk(target)]
            names |= {part.id for part in parts if isinstance(part, ast.Name)}
    return {name for name in names if not name.startswith("_")}


def named(path):
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("package", PACKAGES)
def test_no_package_root_has_many_files(package):
    assert len(list((ROOT / package).glob("*.py"))) <= MOST_FILES_IN_A_ROOT


def test_no_file_is_long():
    lines = {named(path): path.read_text().count("\n") for path in SOURCES}
    assert {name: n for name, n in lines.items() if n > MOST_LINES} == {}


def test_no_function_is_long():
    lengths = {f"{named(p)}:{f.name}": body_lines(f) for p in SOURCES for f in functions_of(p)}
    assert {name: n for name, n in lengths.items() if n > MOST_BODY_LINES} == {}


def test_no_function_takes_many_arguments():
    taken = {f"{named(p)}:{f.name}": len(arguments(f)) for p in SOURCES for f in functions_of(p)}
    assert {name: n for name, n in taken.items() if n > MOST_ARGUMENTS} == {}


def test_public_functions_of_many_arguments_document_each():
    undocumented = [
        f"{named(p)}:{f.name}"
        for p in SOURCES
        for f in functions_of(p)
        if len(arguments(f)) >= 5
        and not f.name.startswith("_")
        and "Args:" not in (ast.get_docstring(f) or "Args:")
    ]
    assert undocumented == []


def test_every_public_name_is_defined_in_one_module():
    modules = defaultdict(list)
    for path in SOURCES:
        for name in public_names(path):
            modules[name].append(named(path))
    assert {name: paths for name, paths in modules.items() if len(paths) > 1} == {}


def test_no_docstring_begins_as_a_question_or_a_request():
    """Each is a noun or an imperative."""
    begins = re.compile(r'^ *"""(What|How|Let|Have|Say|Tell) ', re.MULTILINE)
    found = {named(path): begins.findall(path.read_text()) for path in SOURCES}
    assert {name: words for name, words in found.items() if words} == {}


@pytest.mark.parametrize("package", PACKAGES)
def test_every_folder_says_what_it_holds(package):
    folders = {path.parent for path in SOURCES if path.is_relative_to(ROOT / package)}
    without_docstring = [
        f for f in folders if not ast.get_docstring(ast.parse((f / "__init__.py").read_text()))
    ]
    assert without_docstring == []


def test_no_test_module_calls_a_kernel_as_it_is_imported(kernels_at_import):
    """Each process of the tests imports all modules, and would compute the same again."""
    assert kernels_at_import == []
