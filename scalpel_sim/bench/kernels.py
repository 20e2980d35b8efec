"""The engine's loops one by one: forces, steps, a cut step, and the search for contact."""

from collections.abc import Callable
from functools import partial

from scalpel_sim.bench import cut
from scalpel_sim.bench.blocks import up_to
from scalpel_sim.bench.engine import LAWS, Loops, Touching
from scalpel_sim.bench.results import Figure, Findings, of_times
from scalpel_sim.bench.tables import print_figures
from scalpel_sim.bench.timing import CPU, Case, interleaved
from scalpel_sim.bench.watch import SILENT, Watch

_SIZES = (576, 5_400, 20_250, 60_000)
"""Of the blocks [tetrahedra]."""
TOUCHING = 5_400
"""Of each of the two blocks that touch."""
_NS_PER_S, _US_PER_S = 1e9, 1e6

NAMES = {"springs": "springs", "neo_hookean": "neo-Hookean"}


def measure(n_rounds: int, largest: int | None = None, watch: Watch = SILENT) -> Findings:
    """Time every loop, at each size up to the largest."""
    sizes = up_to(_SIZES, largest)
    cases: list[Case] = []
    figures: list[Callable[[list], Figure]] = []
    for size in sizes:
        for law in LAWS:
            loops = Loops(size, law)
            for what, run in (
                ("forces", loops.forces),
                ("Runge-Kutta step", loops.runge_kutta_steps),
                ("time step of 1 ms", loops.frames),
            ):
                name = f"{NAMES[law]}: {what}"
                cases.append(Case(f"{name}, {size:,}", run))
                figures.append(partial(_per_tetrahedron, name, size))
    touching = Touching(min(TOUCHING, sizes[-1]))
    for name, run in (
        ("contact: search", touching.searches),
        ("contact: check of a step", touching.checks),
    ):
        cases.append(Case(name, run))
        figures.append(partial(_whole, name, 2 * min(TOUCHING, sizes[-1])))
    taken = interleaved(cases, n_rounds, clock=CPU, watch=watch)
    found = [make(rounds) for make, rounds in zip(figures, taken, strict=True)]
    found += cut.measure(n_rounds, cut.CELLS[:1], watch).figures
    return Findings(
        found,
        [],
        partial(
            print_figures,
            "kernels",
            found,
            [],
            about="ns/tet: for each tetrahedron. Blocks of jittered cells of 10 mm, held on four "
            "sides; one thread. CPU: what the processor spent on it. Forces: one evaluation, "
            "dampers included. A Runge-Kutta step evaluates forces three times and dampers four "
            "times. The time step holds all that is done in 1 ms without a blade.",
        ),
    )


def _per_tetrahedron(case: str, size: int, rounds: list) -> Figure:
    return of_times(
        "kernels", case, size, "time", "ns/tet", rounds,
        clock=CPU.name, convert=lambda s: _NS_PER_S * s / size,
    )  # fmt: skip


def _whole(case: str, size: int, rounds: list) -> Figure:
    return of_times(
        "kernels", case, size, "time", "µs", rounds, clock=CPU.name, convert=lambda s: _US_PER_S * s
    )
