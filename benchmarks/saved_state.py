"""Times saving and loading the state of a scene: at rest, in the middle of its cut, and after it.

Usage: PYTHONPATH=. python benchmarks/saved_state.py [SCENE], on an idle machine

"kept" is a state whose memory is new, as each of a hundred that are kept for undo; "again" one that
takes the memory of an earlier one, as a state that is saved in each frame to go back by a frame.
"bytes" is what a checkpoint takes of the frame loop: it is saved and made bytes.
"""

import sys

from benchmarks.timing import median_milliseconds
from bridge import InProcessLink
from scalpel_sim import SCENES, Simulation, prepare
from tissue import TissueState

N_TIMES = 50


def main() -> None:
    """Print the times."""
    name = sys.argv[1] if len(sys.argv) > 1 else "organ"
    simulation = prepare(SCENES[name])
    print(f"{name}, medians of {N_TIMES} [ms]; the last three columns: arm and coupling with it")
    columns = ("tetrahedra", "kept", "again", "load", "to bytes", "MB", "again", "load", "bytes")
    print(" " * 10 + "".join(f"{column:>11s}" for column in columns))
    for when, share in (("at rest", 0.0), ("in mid-cut", 0.5), ("after", 1.0)):
        simulation.run(share * simulation.duration + simulation.dt)
        print(f"{when:10s}" + "".join(f"{number:11.4g}" for number in figures(simulation)))


def figures(simulation: Simulation) -> tuple[float, ...]:
    """Return the numbers of a row."""
    link = simulation.link
    assert isinstance(link, InProcessLink)
    tissue = link.tissue
    state, whole = tissue.save_state(), simulation.save_state()
    states: list[TissueState] = []
    return (
        tissue.n_tetrahedra,
        median_milliseconds(lambda: states.append(tissue.save_state()), N_TIMES),
        median_milliseconds(tissue.save_state, N_TIMES),
        median_milliseconds(lambda: tissue.load_state(state), N_TIMES),
        median_milliseconds(state.to_bytes, N_TIMES),
        1e-6 * len(state.to_bytes()),
        median_milliseconds(simulation.save_state, N_TIMES),
        median_milliseconds(lambda: simulation.load_state(whole), N_TIMES),
        median_milliseconds(lambda: simulation.save_state().to_bytes(), N_TIMES),
    )


if __name__ == "__main__":
    main()
