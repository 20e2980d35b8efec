"""Rows of numbers over time, of which those at rest are left out."""


class PoseRecord:
    """What a hand did, frame by frame. Of rows in turn that are the same, two are enough."""

    def __init__(self) -> None:
        self._rows: list[list[float]] = []
        self._last: tuple[float, list[float]] | None = None
        self._is_kept = False

    @property
    def has_begun(self) -> bool:
        """Whether there is a row yet."""
        return self._last is not None

    def add(self, t: float, row: list[float]) -> None:
        """Record a row at time `t` [s], and the one before where that had been left out.

        Of rows in turn that are the same, the first and the last are enough.
        """
        is_new = self._last is None or self._last[1] != row
        if is_new:
            if self._last is not None and not self._is_kept:
                self._rows.append([self._last[0], *self._last[1]])
            self._rows.append([t, *row])
        self._last, self._is_kept = (t, row), is_new

    def finish(self, t: float) -> None:
        """End the record at time `t` [s] with the last row."""
        if self._last is not None and (t > self._last[0] or not self._is_kept):
            self._rows.append([t, *self._last[1]])

    def take_rows(self) -> list[list[float]]:
        """Return the rows since the last call, each after its time."""
        rows, self._rows = self._rows, []
        return rows
