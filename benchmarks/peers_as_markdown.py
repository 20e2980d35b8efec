"""Prints the results of `scalpel-sim bench peers --save FILE` as a table of Markdown.

Usage: PYTHONPATH=. python benchmarks/peers_as_markdown.py FILE
"""

import sys
from pathlib import Path

from benchmarks.peers.benchmark import ratio_to
from benchmarks.peers.cases import OURS, OURS_SOLID, OURS_SPRINGS, PEERS
from scalpel_sim.validate.speed.measurements import load_results
from scalpel_sim.validate.speed.tables import three_digits


def main() -> None:
    """Print a row for each case: ours in ms, those of other engines in multiples of ours."""
    results = load_results(Path(sys.argv[1]))
    measured = results.measurements
    medians = {(each.case, each.tetrahedra, each.quantity): each.median for each in measured}
    sizes = sorted({each.tetrahedra for each in measured if each.tetrahedra is not None})
    print("| | method | forces |", " | ".join(f"{size:,}" for size in sizes), "|")
    print("|---|---|---|" + "---|" * len(sizes))
    for name, case in (OURS | PEERS).items():
        cells = []
        for size in sizes:
            if name in OURS:
                time = medians.get((name, size, "time"))
                cells.append("-" if time is None else f"{time:.3g} ms")
            else:
                ratios = [
                    medians.get((name, size, ratio_to(o))) for o in (OURS_SPRINGS, OURS_SOLID)
                ]
                cells.append(
                    ", ".join("-" if x is None else f"{three_digits(x)} x" for x in ratios)
                )
        engine = f"ours: {name}" if name in OURS else name
        print(f"| {engine} | {case.law}; {case.differs} | {case.evaluations} |", end=" ")
        print(" | ".join(cells), "|")
    for each in results.skipped:
        print(f"{each.case}, {each.tetrahedra}: not measured: {each.reason}", file=sys.stderr)


if __name__ == "__main__":
    main()
