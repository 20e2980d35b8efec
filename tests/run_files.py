"""The files of a run, as a user sees them."""

from pathlib import Path

from scalpel_sim.runs.file_names import PASSING_FILES


def names_in(folder: str | Path) -> list[str]:
    """Return the names of the files in a folder, sorted, without hidden ones such as its lock.

    Files with which an interrupted run could go on are left out, too.
    """
    names = [path.name for path in Path(folder).iterdir()]
    return sorted(each for each in names if not each.startswith(".") and each not in PASSING_FILES)
