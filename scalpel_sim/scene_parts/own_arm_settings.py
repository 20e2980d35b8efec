"""What a scene says of an arm of the user's own."""

from dataclasses import dataclass


@dataclass(frozen=True)
class OwnArm:
    """An MJCF file with a blade, and where the tissue lies in its world."""

    model: str
    """The file."""
    heel: str = "heel"
    """Site at the handle's end of the edge."""
    tip: str = "tip"
    """Site at the sharp end."""
    forward: tuple[float, float, float] = (0.0, 0.0, -1.0)
    """Direction in which the edge cuts, in the frame of its body."""
    force: float | None = None
    """Largest force that it can render [N]; None: any."""
    torque: float | None = None
    """Largest torque [N m]; None: any."""
    pos: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Origin of the tissue in its world [m]."""
    quat: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    """Rotation of the tissue there: w, x, y, z."""
