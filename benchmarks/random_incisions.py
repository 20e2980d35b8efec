"""Random incisions in several meshes, and checks of the mesh after each of them.

Usage: PYTHONPATH=. python benchmarks/random_incisions.py [--runs N] [--motion], in the repository

Each incision is made in a moving, deformed body along a random surface. Then the mesh is checked:
links, volumes, stars, boundary, total volume, mass, momentum. With `--motion` a blade moves through
a body at rest and interacts with it, which takes some seconds each. Published meshes are cut too
where SCALPEL_SIM_TEST_MESHES names their folder.
"""

import argparse
import traceback
from collections.abc import Callable
from functools import partial
from time import perf_counter

import numpy as np
from rich.console import Console
from rich.table import Table

from tests.support import bodies, incisions, judged
from tests.support.incisions import Incision
from tests.support.judged import Verdict
from tissue import TetrahedralMesh

KINDS = (*incisions.KINDS, "two that cross", "three planes")


def meshes() -> dict[str, Callable[[int], TetrahedralMesh]]:
    """Return functions that make a mesh from a seed."""
    made: dict[str, Callable[[int], TetrahedralMesh]] = {
        "jittered grid": partial(bodies.jittered_grid, 5),
        "Delaunay, 10 degrees": partial(bodies.body_centred, 4),
        "Delaunay, slivers": partial(bodies.with_slivers, 5),
    }
    for file in bodies.FILES if bodies.FOLDER else ():
        made[file] = partial(lambda mesh, seed: mesh, bodies.third_party_mesh(file))
    return made


def cuts_of(kind: str, mesh: TetrahedralMesh, seed: int) -> list[Incision]:
    """Return the incisions of one run."""
    if kind == "three planes":
        return incisions.crossing_planes(mesh, seed)
    if kind == "two that cross":
        names = list(incisions.KINDS)
        return [
            incisions.incision(mesh, names[seed % len(names)], seed),
            incisions.incision(mesh, names[seed // len(names) % len(names)], seed + 10_000),
        ]
    return [incisions.incision(mesh, kind, seed)]


def expected_pieces(mesh: str, kind: str) -> int | None:
    """Return the number of pieces after the cut, or None where it is not known in advance."""
    if mesh in bodies.FILES or kind == "two that cross":
        return None
    if kind == "three planes":
        return 8
    return 2 if kind in incisions.CLEAN_THROUGH else 1


def main() -> None:
    """Run, and print a row for each mesh and each kind of surface, and the failures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=18, help="incisions of each kind in each mesh")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument(
        "--motion", action="store_true", help="cut with a blade that interacts with the tissue"
    )
    parser.add_argument("--meshes", default="", help="only those whose name contains this")
    parser.add_argument("--kinds", default="", help="only those whose name contains this")
    options = parser.parse_args()

    table = Table("mesh", "kind", "runs", "exceptions", "violations", "pieces as expected",
                  "growth, median", "most", "volume", "mass", "momentum", "s")  # fmt: skip
    failures: list[str] = []
    total = 0
    console = Console(width=170)
    for name, make in meshes().items():
        for kind in KINDS:
            if options.meshes not in name or options.kinds not in kind:
                continue
            started = perf_counter()
            verdicts: list[Verdict] = []
            n_exceptions = n_violations = n_as_expected = 0
            for seed in range(options.first, options.first + options.runs):
                mesh = make(seed)
                cuts = cuts_of(kind, mesh, seed)
                total += 1
                try:
                    cut = judged.cut_by_blade if options.motion else judged.incised
                    verdict = cut(mesh, cuts)
                except Exception:
                    n_exceptions += 1
                    failures.append(f"{name}, {kind}, seed {seed}: {traceback.format_exc()}")
                    continue
                verdicts.append(verdict)
                n_violations += bool(verdict.faults)
                expected = expected_pieces(name, kind)
                as_expected = expected in (None, verdict.n_pieces)
                n_as_expected += as_expected
                if verdict.faults or not as_expected:
                    failures.append(
                        f"{name}, {kind}, seed {seed}: {verdict.n_pieces} pieces {verdict.faults}"
                    )
            growths = [v.growth for v in verdicts] or [np.nan]
            table.add_row(
                name,
                kind,
                str(options.runs),
                str(n_exceptions),
                str(n_violations),
                str(n_as_expected) if expected_pieces(name, kind) else "-",
                f"{np.median(growths):.2f}",
                f"{max(growths):.2f}",
                *(
                    f"{max((v[i] for v in verdicts), default=np.nan):.0e}"
                    for i in (Verdict._fields.index(f) for f in ("volume", "mass", "momentum"))
                ),
                f"{perf_counter() - started:.1f}",
            )
    console.print(table)
    console.print(f"{total} runs")
    for line in failures:
        print(line)


if __name__ == "__main__":
    main()
