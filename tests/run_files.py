"""The files of a run, as a user sees them."""

from pathlib import Path


def names_in(folder: str | Path) -> list[str]:
    """Return the names of the files in a folder, sorted, without hidden ones such as its lock."""
    return sorted(path.name for path in Path(folder).iterdir() if not path.name.startswith("."))
