"""The names that settings of a scene may have, and the checks of those that are given."""

import os

from scalpel_sim.errors import UsageError, unknown

SCHEMES = ("stellar", "paper")
"""Names of the schemes that `Tissue` takes."""

RELAXATIONS = ("global", "verlet", "hierarchical")
"""Names of the relaxations that `Tissue` takes."""

_PRECISIONS = ("single", "double")
"""Precisions that `Tissue` takes."""


COUPLINGS = ("rigid", "virtual")
"""Names of the couplings between the arm's blade and the one that cuts."""

ARM_CHOICES = ("auto", "touch", "premium")
"""Names of the arms, and `auto`: the first of them that reaches."""


def check_scheme(name: str) -> None:
    """Check that a scheme of cutting exists.

    Raises:
        UsageError: it does not; the message lists the schemes.
    """
    if name not in SCHEMES:
        raise unknown("scheme", name, SCHEMES)


def check_relaxation(name: str, threads: int) -> None:
    """Check that a relaxation exists, and that it uses threads where there are several.

    Raises:
        UsageError: it does not; the message says why.
    """
    if name not in RELAXATIONS:
        raise unknown("relaxation", name, RELAXATIONS)
    if threads != 1 and name == "hierarchical":
        raise UsageError(
            f"--threads {threads} is for --relaxation global or verlet; {name} runs on one"
        )
    cores = os.cpu_count() or 1
    if not 1 <= threads <= cores:
        raise UsageError(
            f"--threads is {threads}; it must be from 1 to {cores}, the number of cores"
        )


def check_precision(name: str) -> None:
    """Check that a precision exists.

    Raises:
        UsageError: it does not; the message lists the precisions.
    """
    if name not in _PRECISIONS:
        raise unknown("precision", name, _PRECISIONS)


def can_audit(relaxation: str) -> bool:
    """Whether an energy account can be kept: where all nodes move together."""
    return relaxation in ("global", "verlet")
