"""Values over time, by linear interpolation between the rows of a table."""

from collections.abc import Sequence

import numpy as np

from scalpel_sim.errors import UsageError
from tissue import FloatArray


class TimeTable:
    """Vectors at given times; before the first and after the last they stay as they are.

    Args:
        times: [s], ascending, shape (n,); None for one row that holds at all times.
        rows: A vector for each time, shape (n, 3).
        where: What the table belongs to, for messages.

    Raises:
        UsageError: the lengths differ, or times do not ascend.
    """

    def __init__(
        self, times: Sequence[float] | None, rows: Sequence[Sequence[float]], where: str
    ) -> None:
        self.rows: FloatArray = np.array(rows, dtype=np.float64)
        self.times: FloatArray = np.array([0.0] if times is None else times, dtype=np.float64)
        if len(self.times) != len(self.rows):
            raise UsageError(
                f"{where}: {len(self.rows)} rows and {len(self.times)} times; each row needs a time"
            )
        if not (np.diff(self.times) > 0.0).all():
            raise UsageError(f"{where}: times are {self.times.tolist()}; they must ascend")

    def at(self, time: float) -> FloatArray:
        """Return the vector at a time [s], shape (3,)."""
        return np.array([np.interp(time, self.times, column) for column in self.rows.T])
