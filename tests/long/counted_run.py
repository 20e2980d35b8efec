"""`scalpel-sim` that counts its frames in a file that outlives a kill.

    python -m tests.long.counted_run COUNT WORDS...

The memory of a mapped file belongs to the system: what the process has counted is there whatever
ended it.
"""

import mmap
import struct
import sys
from pathlib import Path

from scalpel_sim.stop_signals import interrupt_on_signals

COUNT = struct.Struct("<q")


def main() -> None:
    """Run the command line, counting."""
    interrupt_on_signals()
    from scalpel_sim.__main__ import main as run_program
    from scalpel_sim.simulation import Simulation

    path = Path(sys.argv.pop(1))
    path.write_bytes(bytes(COUNT.size))
    with path.open("r+b") as file:
        memory = mmap.mmap(file.fileno(), COUNT.size)
    step = Simulation.step

    def counted(simulation: Simulation) -> object:
        done = step(simulation)
        COUNT.pack_into(memory, 0, len(simulation.recording))
        return done

    Simulation.step = counted  # type: ignore[method-assign, assignment]
    run_program()


def count_in(path: Path) -> int:
    """Return how many frames were done."""
    counted = path.read_bytes() if path.exists() else b""
    return int(COUNT.unpack(counted)[0]) if len(counted) == COUNT.size else 0


if __name__ == "__main__":
    main()
