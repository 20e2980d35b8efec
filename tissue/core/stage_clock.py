"""How long the stages of a step take, by the names of the paper's Table 1."""

from time import perf_counter


class Stopwatch:
    """Sums up the time spent in `with` blocks."""

    __slots__ = ("_started", "seconds")

    def __init__(self) -> None:
        self.seconds = 0.0
        """Time spent so far [s]."""
        self._started = 0.0

    def __enter__(self) -> None:
        self._started = perf_counter()

    def __exit__(self, *_: object) -> None:
        self.seconds += perf_counter() - self._started


class StageClock:
    """A stopwatch for each stage of a step."""

    __slots__ = ("CD", "GC", "RX")

    def __init__(self) -> None:
        self.CD = Stopwatch()
        """Collision detection: the path of the blade, active tetrahedra, crossed edges."""
        self.GC = Stopwatch()
        """Geometric changes: subdivision and separation of the mesh."""
        self.RX = Stopwatch()
        """Relaxation: forces, contact and motion."""
