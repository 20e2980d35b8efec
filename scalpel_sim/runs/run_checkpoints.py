"""`RunCheckpoints`: makes the checkpoints of a run from what it is after a frame."""

from typing import Self

from bridge import InProcessLink
from scalpel_sim.runs.checkpoints import Checkpoint, CheckpointHead, Checkpoints
from scalpel_sim.runs.file_names import FORCES, REPLAY_FRAMES, STROKE, grasp_file
from scalpel_sim.runs.run_folder import Outputs
from scalpel_sim.simulation import Simulation
from scalpel_sim.viewer.replay import ReplayWriter


class RunCheckpoints:
    """Writes the checkpoints of a run. Where the tissue is in another process there are none.

    Args:
        outputs: Where they are written, and how often.
        simulation: The run.
        replay: Its replay.
    """

    def __init__(self, outputs: Outputs, simulation: Simulation, replay: ReplayWriter) -> None:
        self._outputs, self._simulation, self._replay = outputs, simulation, replay
        every = 0
        if outputs.checkpoint_seconds > 0.0 and isinstance(simulation.link, InProcessLink):
            every = max(1, round(outputs.checkpoint_seconds / simulation.dt))
        grown = (FORCES, REPLAY_FRAMES, STROKE, *(grasp_file(g.name) for g in simulation.graspers))
        self._checkpoints = Checkpoints(outputs.folder, every, grown)
        if outputs.resumption is not None:
            self._checkpoints.read(is_said=True)
            self._checkpoints.go_on_from(outputs.resumption.n_frames)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._checkpoints.close()

    @property
    def are_there(self) -> bool:
        """Whether there is one from which the run could go on."""
        return self._checkpoints.are_there

    @property
    def are_due(self) -> bool:
        """Whether one is to be written now. All rows must be written before."""
        return self._checkpoints.is_due(len(self._simulation.recording))

    def write(self) -> None:
        """Write a checkpoint after a frame."""
        self._checkpoints.write(self._now)

    def write_last(self) -> None:
        """Write a checkpoint of the present, if any are wanted, and wait until all are written."""
        if self._checkpoints.are_wanted:
            self._checkpoints.write(self._now)
        self._checkpoints.finish()

    def mark(self) -> int:
        """Return how many frames were done."""
        return len(self._simulation.recording)

    def cut_back(self, mark: int) -> None:
        """Remove the checkpoints of what was undone."""
        self._checkpoints.go_on_from(mark)

    def _now(self) -> Checkpoint:
        """Return the run as it is."""
        simulation = self._simulation
        n_frames, replay = len(simulation.recording), self._replay.mark()
        head = CheckpointHead(*self._outputs.checkpoint_notes(n_frames, replay))
        return Checkpoint(head, simulation.save_state().to_bytes())
