"""`RunJournal`: the file in which a run notes what it was asked for, and how far it has got."""

from collections.abc import Mapping
from pathlib import Path

from scalpel_sim.recording.file_sum import FileSum
from scalpel_sim.recording.growing_file import GrowingFile
from scalpel_sim.runs.run_notes import RunMark, RunPlan, line_of


class RunJournal:
    """Notes of a run, with the checksums of its other files. It is written after them.

    Args:
        path: The file.
        plan: What the run was asked for.
        seconds: How long it is to last [s]; None: as long as what a hand does, which leads it.
        read: Files of recorded motions that it repeats, by path seen from its folder.
        n_kept: How much is kept of a file that is there [bytes].

    Raises:
        OSError: the system refuses.
    """

    def __init__(
        self,
        path: Path,
        plan: RunPlan,
        seconds: float | None,
        read: Mapping[str, FileSum],
        n_kept: int = 0,
    ) -> None:
        self.plan = plan
        self._seconds, self._read = seconds, dict(read)
        self.file = GrowingFile(path, b"", FileSum(n_kept))
        self.file.append(line_of(plan))

    def mark(self, n_frames: int, written: Mapping[str, FileSum]) -> RunMark:
        """Return how far the run has got.

        Args:
            n_frames: Frames that were done.
            written: Files that grow with the run, by name.
        """
        return RunMark(n_frames, self._seconds, dict(written), self._read)
