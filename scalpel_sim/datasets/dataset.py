"""`write_dataset`: a folder with a dataset, which appears when it is whole."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from scalpel_sim.datasets.card import Card, write_card
from scalpel_sim.datasets.demonstration import DatasetWriter, Demonstration
from scalpel_sim.datasets.whole_folder import whole_folder
from scalpel_sim.errors import EXPECTED, Interrupted, RunError, one_line, writing


class Written(NamedTuple):
    """Contents of a dataset."""

    n_episodes: int
    """Number of its episodes."""
    n_steps: int
    """Number of their control steps."""
    episodes: Sequence[dict[str, Any]]
    """Where each comes from, and how it ended."""


def write_dataset(
    folder: Path,
    episodes: Sequence[Demonstration],
    writer_in: Callable[[Path], DatasetWriter],
    card: Card,
    on_episode: Callable[[dict[str, Any]], None] = lambda told: None,
) -> Written:
    """Write a dataset to a folder.

    Where an episode cannot be done to its end, those before it are the dataset, and it is said.

    Args:
        folder: The folder, which is not there yet.
        episodes: What is written, in order.
        writer_in: Returns what writes to an empty folder.
        card: What its card says.
        on_episode: Called with what is known of each episode that is whole.

    Raises:
        Interrupted: the user or the system ended it.
        RunError: an episode failed, or the system refuses to write.
    """
    told: list[dict[str, Any]] = []
    failure: Exception | None = None
    with writing(folder, "another --output"), whole_folder(folder) as unfinished:
        writer = writer_in(unfinished)
        try:
            for episode in episodes:
                try:
                    writer.add(episode)
                except EXPECTED as error:
                    if isinstance(error, OSError) or not writer.n_episodes:
                        raise
                    failure = error
                    break
                told.append(episode.provenance())
                on_episode(told[-1])
            writer.finish()
        finally:
            writer.close()
        write_card(unfinished, card, told)
    if failure is not None:
        kind = Interrupted if isinstance(failure, Interrupted) else RunError
        raise kind(
            f"{one_line(failure)}; {folder} has the {len(told)} of {len(episodes)} demonstrations "
            "before it"
        ) from failure
    return Written(writer.n_episodes, writer.n_steps, told)
