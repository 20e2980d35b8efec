"""Every notebook in docs/notebooks runs, and prints what it shows."""

import re
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
LARGEST = 100_000
"""Bytes of a notebook with its pictures: a clone stays small."""


def printed(notebook: nbformat.NotebookNode) -> list[str]:
    """Return what the cells of a notebook have printed."""
    outputs = [each for cell in notebook.cells for each in cell.get("outputs", ())]
    return [each.text for each in outputs if each.output_type == "stream"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_a_notebook_prints_what_it_shows(path, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))
    shown = nbformat.read(path, as_version=4)
    nbformat.validate(shown)
    run = nbformat.from_dict(shown)
    NotebookClient(run, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert len(printed(run)) > 0 and printed(run) == printed(shown)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_a_notebook_is_small_and_linked(path):
    assert path.stat().st_size < LARGEST
    pages = "".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs").glob("*.md"))
    assert re.search(rf"\]\(notebooks/{path.name}\)", pages)
