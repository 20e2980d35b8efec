"""Reads a Prony series from the command line: `0.3:0.1,0.2:5`."""

from scalpel_sim.errors import UsageError


def series_of(text: str) -> tuple[tuple[float, float], ...]:
    """Return g and tau [s] of each term; `tissue.Material` checks their range.

    Raises:
        UsageError: the text is not a list of such pairs.
    """
    pairs = []
    for term in text.split(","):
        share, _, time = term.partition(":")
        try:
            pairs.append((float(share), float(time)))
        except ValueError:
            raise UsageError(
                f"--prony has the term '{term}'; write g:tau for each, separated by commas, such "
                "as 0.3:0.1,0.2:5"
            ) from None
    return tuple(pairs)
