"""The README and the pages in docs: their code runs, and their commands and links are valid."""

import re
import shlex
import tomllib
from pathlib import Path
from unittest.mock import patch

import pytest
from cyclopts import App

from benchmarks.__main__ import BENCHMARKS, benchmark_line
from bridge.tcp.wire import PROTOCOL_VERSION
from scalpel_sim import COLUMNS, OBSERVATIONS, STROKES
from scalpel_sim.cli.app import app, command_line
from scalpel_sim.runs.file_names import RUN_FILES
from tissue import LAWS, MATERIALS

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
PAGES = [README, *sorted((ROOT / "docs").glob("*.md"))]
LARGEST_README = 10 * 1024
HELPS = (
    "run",
    "view",
    "replay",
    "export",
    "snapshot",
    "trace",
    "film",
    "dataset",
    "explain",
    "serve",
    "spacemouse",
    "crtk",
    "key",
    "materials",
    "figure",
    "new",
    "mesh",
    "warm-up",
    "validate",
    "bench peers",
    "bench real-time",
)
"""Commands whose `--help` texts together list all options."""


def blocks(language: str) -> list[tuple[str, str]]:
    """Return every block of code in a language, with its page and line."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for match in re.finditer(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE):
            line = text.count("\n", 0, match.start()) + 1
            found.append((f"{page.relative_to(ROOT)}:{line}", match.group(1)))
    return found


def commands() -> list[tuple[str, list[str]]]:
    """Return the arguments of every `scalpel-sim` in a block of shell commands."""
    found = []
    for where, block in blocks("sh"):
        for line in block.splitlines():
            words = shlex.split(line, comments=True)
            if "scalpel-sim" in words:
                found.append((where, words[words.index("scalpel-sim") + 1 :]))
    return found


OF_README = [case for case in blocks("python") if case[0].startswith("README")]
"""Two blocks that tests of their own run: the first one, and an example."""

OF_DOCS = [case for case in blocks("python") if case not in OF_README]


def page_of(case: tuple[str, object]) -> str:
    return case[0]


@pytest.fixture
def in_folder(tmp_path, monkeypatch):
    """Run in a folder of its own; what is added to registries is taken out again."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))  # of processes that the code starts
    with patch.dict(COLUMNS), patch.dict(OBSERVATIONS), patch.dict(STROKES), patch.dict(LAWS):
        yield


@pytest.mark.parametrize("case", OF_DOCS, ids=page_of)
def test_every_python_block_runs_on_its_own(case, in_folder):
    where, code = case
    names: dict[str, object] = {"__name__": "__main__"}
    exec(compile(code, where, "exec"), names)
    assert len(names) > 2, f"{where} defines and imports nothing"


@pytest.mark.parametrize("case", commands(), ids=lambda case: " ".join(case[1]))
def test_the_program_accepts_every_command(case):
    program: App = app
    command, _, unused = program.parse_args(case[1], exit_on_error=False, print_error=False)
    assert callable(command) and not unused


def test_commands_and_code_are_found_at_all():
    assert len(commands()) > 20 and len(OF_DOCS) > 3


def test_the_readme_stays_short():
    assert len(README.read_bytes()) <= LARGEST_README


def test_five_lines_of_python_run_a_scene(capsys):
    (_, code), _ = OF_README
    assert len(code.strip().splitlines()) <= 6
    exec(compile(code, "README.md", "exec"), {})
    assert re.search(r"\] \d+$", capsys.readouterr().out.strip())


def test_the_arm_of_the_readme_is_the_example():
    example = (ROOT / "docs" / "examples" / "attach_mjcf.py").read_text(encoding="utf-8")
    assert f"```python\n{example}```\n" in README.read_text(encoding="utf-8")
    ours = [line for line in example.splitlines() if re.match("from (tissue|bridge|scalpel)", line)]
    assert len(ours) == 3


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_all_files_that_a_page_links_to_exist(page):
    linked = re.findall(r"\]\((?!https?:)([^)#]+)[^)]*\)", page.read_text(encoding="utf-8"))
    assert [path for path in linked if not (page.parent / path).exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_all_sections_that_a_page_links_to_exist(page):
    text = page.read_text(encoding="utf-8")
    for path, section in re.findall(r"\]\((?!https?:)([^)#]*)#([^)]+)\)", text):
        target = (page.parent / path).read_text(encoding="utf-8") if path else text
        titles = re.findall(r"^#+ (.*)$", target, re.MULTILINE)
        known = {re.sub(r"[^\w\- ]", "", title).lower().replace(" ", "-") for title in titles}
        assert section in known, f"{page.name}: #{section} is not a section of {path or page.name}"


def test_every_source_file_that_a_page_names_exists():
    """Pages give the path from the root or the end of it: `tissue/tissue.py`, `anchors.py`."""
    folders = ("tissue", "bridge", "scalpel_sim", "tests", "benchmarks", "docs")
    there = {path.relative_to(ROOT).as_posix() for f in folders for path in (ROOT / f).rglob("*")}
    ends = {"/".join(path.split("/")[-n:]) for path in there for n in range(1, path.count("/") + 2)}
    missing = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        named = re.findall(r"`(?:python )?([\w/]+\.py|(?:tissue|bridge|scalpel_sim)/[\w/]*)", text)
        missing += [f"{page.name}: {path}" for path in named if path.rstrip("/") not in ends]
    assert missing == []


def test_every_page_is_in_the_index():
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    folder = ROOT / "docs"
    wanted = [*folder.glob("*.md"), *folder.glob("examples/**/*.py")]
    names = {path.relative_to(folder).as_posix() for path in wanted} - {"README.md"}
    assert {name for name in names if f"]({name})" not in index} == set()


def test_every_picture_is_shown_on_a_page():
    shown = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    pictures = [picture.name for picture in (ROOT / "docs").glob("*.png")]
    assert [name for name in pictures if name not in shown] == []


def test_every_file_that_a_run_writes_is_explained():
    text = README.read_text(encoding="utf-8")
    assert [name for name in RUN_FILES if f"`{name}`" not in text] == []


def test_the_options_that_a_page_names_are_those_of_the_program(capsys):
    named = {
        option
        for page in PAGES
        for option in re.findall(r"`(--[a-z-]+)", page.read_text(encoding="utf-8"))
    }
    known = ""
    for command in HELPS:
        assert command_line([*command.split(), "--help"]) == 0
        known += capsys.readouterr().out
    for name in BENCHMARKS:
        assert benchmark_line([name, "--help"]) == 0
        known += capsys.readouterr().out
    assert named and {option for option in named if option not in known} == set()


def test_the_package_offers_the_two_commands_of_the_readme():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    text = README.read_text(encoding="utf-8")
    assert "\npip install uv && uv run scalpel-sim run\n" in text
    assert "\npip install uv && uv run --extra test pytest\n" in text
    assert "scalpel-sim" in project["scripts"]
    assert any(name.startswith("pytest") for name in project["optional-dependencies"]["test"])


def test_the_readme_counts_laws_and_materials_as_the_code_does():
    words = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
    text = README.read_text(encoding="utf-8")
    stiffening = sum(law.stiffens for law in LAWS.values())
    assert f"**{words[len(LAWS)].title()} laws**" in text
    assert f"{words[stiffening]} that stiffen, with {words[len(MATERIALS)]} materials" in text


def test_the_page_of_the_protocol_has_its_version():
    text = (ROOT / "docs" / "wire.md").read_text(encoding="utf-8")
    assert f"version, {PROTOCOL_VERSION};" in text


def test_the_page_of_the_strokes_lists_all_that_an_option_names():
    text = (ROOT / "docs" / "cutting.md").read_text(encoding="utf-8")
    planned = [name for name, kind in STROKES.items() if kind.is_planned]
    assert planned and [name for name in planned if f"`{name}`" not in text] == []
