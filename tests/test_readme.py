"""What the README promises: its code runs, its commands and its files are there."""

import re
import tomllib
from pathlib import Path

import pytest

from scalpel_sim.cli.app import command_line
from scalpel_sim.output.run_folder import RUN_FILES

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = dict(enumerate(re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)))


def block_about(word: str) -> str:
    """The only block of code that has a word in it."""
    (block,) = (code for code in BLOCKS.values() if word in code)
    return block


def printed(code: str, capsys) -> str:
    exec(compile(code, "README.md", "exec"), {})
    return capsys.readouterr().out


def test_five_lines_of_python_run_a_scene(capsys):
    assert len(BLOCKS[0].strip().splitlines()) <= 6
    assert re.search(r"\] \d+$", printed(BLOCKS[0], capsys).strip())


def test_a_tissue_attached_to_ones_own_arm_is_cut_and_felt(capsys):
    """The section is complete: pasted into a file, it cuts a block in two."""
    peak, area, pieces = re.search(
        r"peak ([\d.]+) N, cut (\d+) mm2, (\d+) pieces", printed(BLOCKS[1], capsys)
    ).groups()
    assert float(peak) == pytest.approx(20.0 * 0.02, rel=0.3)  # toughness times thickness
    assert float(area) == pytest.approx(40 * 20, rel=0.1)
    assert int(pieces) == 2


def test_a_body_is_cut_along_a_given_surface(capsys):
    area, pieces = re.search(r"(\d+) mm2, (\d+) pieces", printed(BLOCKS[2], capsys)).groups()
    assert float(area) == pytest.approx(60 * 40, rel=0.1) and int(pieces) == 2


def test_a_clamp_in_the_way_of_the_blade_is_met(capsys):
    assert re.search(r"'blade, clamp': \d+", printed(block_about("clamp"), capsys))


def test_the_forces_of_a_step_are_there_with_the_account_of_its_energy(capsys):
    found = printed(block_about("energies"), capsys)
    assert float(re.search(r"press with ([\d.]+) N", found).group(1)) > 0.1
    assert int(re.search(r"cutting took (\d+)%", found).group(1)) > 50
    assert abs(float(re.search(r"not accounted for: (-?[\d.]+)%", found).group(1))) < 0.5


def test_every_file_that_a_run_writes_is_explained():
    assert [name for name in RUN_FILES if f"`{name}`" not in README] == []


def test_the_options_of_the_readme_are_those_of_the_program(capsys):
    named = set(re.findall(r"`(--[a-z]+)", README))
    known = ""
    for command in ("run", "view", "serve", "figure", "bench", "bench kernels", "bench peers"):
        assert command_line([*command.split(), "--help"]) == 0
        known += capsys.readouterr().out
    assert named and {option for option in named if option not in known} == set()


def test_what_the_readme_shows_and_links_to_is_there():
    linked = re.findall(r"\]\((?!https?:)([^)#]+)\)", README)
    assert linked and [path for path in linked if not (ROOT / path).exists()] == []


def test_the_two_commands_of_the_readme_are_the_ones_that_the_package_offers():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert "\npip install uv && uv run scalpel-sim run\n" in README
    assert "\npip install uv && uv run --extra test pytest\n" in README
    assert "scalpel-sim" in project["scripts"]
    assert any(name.startswith("pytest") for name in project["optional-dependencies"]["test"])
