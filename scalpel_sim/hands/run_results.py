"""Results of a run, for its page."""

from collections.abc import Sequence
from typing import NamedTuple


class RunResults(NamedTuple):
    """Results of a run, for its page."""

    figures: Sequence[tuple[str, str]]
    """Labels and figures."""
    folder: str
    """Folder of its files."""
    replay: str
    """Path of the replay; empty: there is none."""
    report: str = ""
    """Path of the report; empty: there is none."""
