"""`UnstableError`: motion that became unstable, in a step of the integrator."""

from tissue.types import TissueError

REMEDY = "A shorter time step, or a material that is softer or heavier, may help"
"""Cases to try."""


class UnstableError(TissueError):
    """The motion of the tissue became unstable.

    Args:
        fault: How that shows.
    """

    def __init__(self, fault: str) -> None:
        self.fault = fault
        super().__init__(f"the motion of the tissue became unstable: {fault}. {REMEDY}")


def not_finite() -> UnstableError:
    """Return the error that tells that a position is not a finite number."""
    return UnstableError("the position of a node is not a finite number")
