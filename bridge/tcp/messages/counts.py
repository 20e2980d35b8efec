"""Check of the numbers of points and elements in a message."""

from bridge.tcp.wire import LARGEST_REPLY, MessageError


def check_counts(n_points: int, n_elements: int) -> None:
    """Check that a reply could hold these counts, before anything is computed from them.

    Raises:
        MessageError: a count is negative or too large.
    """
    if not (0 <= n_points <= LARGEST_REPLY and 0 <= n_elements <= LARGEST_REPLY):
        raise MessageError(
            f"{n_points} points and {n_elements} elements; wanted 0 to {LARGEST_REPLY} of each"
        )
