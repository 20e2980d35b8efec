"""Turns what `scalpel-sim bench peers --save FILE` found into the README's table.

PYTHONPATH=. python benchmarks/peers_as_markdown.py FILE
"""

import sys
from pathlib import Path

from scalpel_sim.bench.peers import OURS, OURS_SOLID, OURS_SPRINGS, PEERS, ratio_to
from scalpel_sim.bench.results import load
from scalpel_sim.bench.tables import number


def main() -> None:
    """Print a row for each case: ours in ms, theirs in multiples of ours."""
    results = load(Path(sys.argv[1]))
    of = {(f.case, f.tetrahedra, f.quantity): f.median for f in results.figures}
    sizes = sorted({f.tetrahedra for f in results.figures if f.tetrahedra is not None})
    print("| | what it is | forces |", " | ".join(f"{size:,}" for size in sizes), "|")
    print("|---|---|---|" + "---|" * len(sizes))
    for name, entry in (OURS | PEERS).items():
        cells = []
        for size in sizes:
            if name in OURS:
                time = of.get((name, size, "time"))
                cells.append("-" if time is None else f"{time:.3g} ms")
            else:
                ratios = [of.get((name, size, ratio_to(o))) for o in (OURS_SPRINGS, OURS_SOLID)]
                cells.append(", ".join("-" if x is None else f"{number(x)} x" for x in ratios))
        engine = f"ours: {name}" if name in OURS else name
        print(f"| {engine} | {entry.law}; {entry.differs} | {entry.evaluations} |", end=" ")
        print(" | ".join(cells), "|")
    for each in results.skipped:
        print(f"{each.case}, {each.tetrahedra}: not measured: {each.reason}", file=sys.stderr)


if __name__ == "__main__":
    main()
