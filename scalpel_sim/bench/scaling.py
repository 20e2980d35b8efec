"""What the same work costs as the body grows around it: 576 to 1,000,000 tetrahedra.

A step of the whole body must grow with the body; per tetrahedron it shows where the mesh leaves
each cache. What is local must not grow at all.
"""

from collections.abc import Sequence
from functools import partial

from scalpel_sim.bench.blocks import up_to
from scalpel_sim.bench.engine import LAWS, Loops
from scalpel_sim.bench.kernels import NAMES
from scalpel_sim.bench.machine import memory
from scalpel_sim.bench.memory import that_fit
from scalpel_sim.bench.results import Figure, Findings, of_times
from scalpel_sim.bench.tables import print_figures
from scalpel_sim.bench.timing import CPU, Case, interleaved
from scalpel_sim.bench.watch import SILENT, Watch
from tissue import FloatArray

_SIZES = (576, 6_000, 60_000, 199_800, 600_000, 1_000_188)
"""Of the blocks [tetrahedra]."""
_NS_PER_S, _MS_PER_S = 1e9, 1e3

_ABOUT = (
    "Blocks of jittered cells of 10 mm, held on four sides; one thread; sizes take turns. CPU: "
    "what the processor spent on it. A step of the whole body costs the same per tetrahedron until "
    "the body outgrows a cache."
)


def measure(
    n_rounds: int,
    largest: int | None = None,
    watch: Watch = SILENT,
    sizes: Sequence[int] = _SIZES,
) -> Findings:
    """Time a Runge-Kutta step of each size up to the largest, under each law."""
    sizes, skipped = that_fit(up_to(tuple(sizes), largest), memory(), "scaling", len(LAWS))
    cases: list[tuple[str, int, Case]] = []
    for size in sizes:
        for law in LAWS:
            name = f"{NAMES[law]}: Runge-Kutta step"
            loops = Loops(size, law)
            cases.append((name, size, Case(f"{name}, {size:,}", loops.runge_kutta_steps)))
    taken = interleaved([case for _, _, case in cases], n_rounds, clock=CPU, watch=watch)
    figures: list[Figure] = []
    for (name, size, _), rounds in zip(cases, taken, strict=True):
        figures += _figures(name, size, rounds)
    figures.sort(key=lambda figure: (figure.case, figure.unit, figure.tetrahedra))
    return Findings(
        figures, skipped, partial(print_figures, "scaling", figures, skipped, about=_ABOUT)
    )


def _figures(name: str, size: int, rounds: Sequence[FloatArray]) -> list[Figure]:
    """Return the time of a step, whole and shared among the tetrahedra."""
    return [
        of_times(
            "scaling", name, size, "time per tetrahedron", "ns/tet", rounds,
            clock=CPU.name, convert=lambda s: _NS_PER_S * s / size,
        ),
        of_times(
            "scaling", name, size, "time", "ms", rounds,
            clock=CPU.name, convert=lambda s: _MS_PER_S * s,
        ),
    ]  # fmt: skip
