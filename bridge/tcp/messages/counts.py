"""How many points and elements a message may speak of."""

from bridge.tcp.wire import LARGEST_REPLY, MessageError


def check_counts(n_points: int, n_elements: int) -> None:
    """Refuse counts that no reply could hold, before anything is computed from them.

    Raises:
        MessageError: one is negative or too large.
    """
    if not (0 <= n_points <= LARGEST_REPLY and 0 <= n_elements <= LARGEST_REPLY):
        raise MessageError(f"{n_points} points and {n_elements} elements")
