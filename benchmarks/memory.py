"""Which bodies fit into the memory of this machine."""

from collections.abc import Sequence

from scalpel_sim.validate.speed.measurements import Skipped

BYTES_PER_TETRAHEDRON = 2_000
"""Memory that a body takes while it is made; measured, and rounded up."""
SHARE_OF_MEMORY = 0.6
"""Share of the free memory that all bodies together may take: other programs need some too."""


def sizes_that_fit(
    sizes: Sequence[int], available: int | None, benchmark: str, n_of_each: int = 1
) -> tuple[tuple[int, ...], list[Skipped]]:
    """Return the sizes whose bodies fit together into the free memory, and why others do not.

    Args:
        sizes: Numbers of tetrahedra, from small to large.
        available: Free memory [bytes]; None where it is unknown: then all sizes fit.
        benchmark: Name of the benchmark that makes the bodies.
        n_of_each: Bodies of each size.
    """
    fit: list[int] = []
    skipped: list[Skipped] = []
    for size in sizes:
        needed = BYTES_PER_TETRAHEDRON * n_of_each * (sum(fit) + size)
        if available is None or needed <= SHARE_OF_MEMORY * available:
            fit.append(size)
        else:
            reason = (
                f"together with the smaller bodies it needs {needed / 1e9:.1f} GB, and "
                f"{SHARE_OF_MEMORY:.0%} of the {available / 1e9:.1f} GB of free memory may be used"
            )
            skipped.append(Skipped(benchmark, benchmark, size, reason))
    return tuple(fit), skipped
