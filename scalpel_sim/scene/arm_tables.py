"""The tables of arms in a scene file: `[arm]` and `[[grasper]]`, as those in `schema`."""

from typing import Annotated, Literal

from msgspec import Meta, field

from scalpel_sim.tables.values import (
    Every,
    FileName,
    FourNumbers,
    Name,
    NotNegative,
    Opening,
    Positive,
    Text,
    ThreeNumbers,
    TomlTable,
    TrueOrFalse,
    one_of,
)

BLADE_NAME = "blade"
"""Name of the blade among the instruments, besides those of graspers."""

DEFAULT_APPROACH, DEFAULT_ACROSS = (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)
"""Direction of the shaft and of the jaws of a grasper at first, where a motion gives none."""


class ArmTable(TomlTable, kw_only=True, frozen=True):
    """`[arm]`: the arm, and how it is coupled to the tissue."""

    preset: Text = "auto"
    """Arm that holds the blade: touch, premium, or auto, the first of them that reaches; or psm,
    through a trocar."""
    trocar: ThreeNumbers | None = None
    """Where the remote centre of a psm is [m], [its trocar](#through-a-trocar); where it reaches
    best without."""
    model: FileName | None = None
    """MJCF or URDF file of [an arm of your own](#an-arm-of-your-own), in place of a preset."""
    mount: Text | None = None
    """Site, body, frame or link of that model that holds a scalpel, along its +z, in place of a
    blade of its own."""
    heel: Text = "heel"
    """Site of that model at the handle's end of the edge."""
    tip: Text = "tip"
    """Site at the sharp end."""
    forward: ThreeNumbers = (0.0, 0.0, -1.0)
    """Direction in which the edge cuts, in the frame of its body; with a mount in that of the
    mount, and [0, 1, 0] without."""
    force: Positive | None = None
    """Largest force that it can render [N]; any without."""
    torque: Positive | None = None
    """Largest torque [N m]; any without."""
    tissue_every: Every = 1
    """Query the tissue once in so many milliseconds; in between the arm feels its last answer and
    its local stiffness."""
    coupling: Text = "rigid"
    """Coupling of the arm's blade to the one that cuts: rigid, they are one; or virtual, by a
    spring and a damper, and the arm feels nothing stiffer."""
    coupling_stiffness: Positive | None = None
    """Stiffness of a virtual coupling [N/m; default: 700]."""
    coupling_damping: NotNegative | None = None
    """Damping of a virtual coupling [N s/m; default: twice what is needed for stability]."""
    passivity: TrueOrFalse = True
    """Damp motion by which the coupling would create energy. It is counted anyway."""


class WaypointTable(TomlTable, kw_only=True, frozen=True):
    """A row of `motion`: where a grasper rests at an instant; what is left out is as before."""

    time: NotNegative
    """When the grasper is there [s]."""
    at: ThreeNumbers | None = None
    """Middle between the pads [m]."""
    approach: ThreeNumbers | None = None
    """Direction in which shaft and pads point ([0, 0, -1] at first)."""
    across: ThreeNumbers | None = None
    """Direction in which the jaws open ([1, 0, 0] at first)."""
    opening: Opening | None = None
    """Distance between the pads, at most 0.02 [m]."""


class GrasperTable(TomlTable, kw_only=True, frozen=True):
    """`[[grasper]]`: an arm that holds a grasper, led along a motion, or as a hand has led it."""

    name: Name = "left"
    """Name: its columns in `forces.csv` begin with it, and its parts in the model."""
    preset: Text | None = None
    """Its arm: auto, touch, premium or psm. Without it, and without a model, psm where that holds
    the blade, else auto."""
    trocar: ThreeNumbers | None = None
    """Where the remote centre of a psm is [m]; where it reaches best without."""
    model: FileName | None = None
    """MJCF or URDF file of an arm of your own."""
    at: Text | None = None
    """Site, body, frame or link of that model which holds the grasper, along its +z, as
    flanges of robots point."""
    pos: ThreeNumbers | None = None
    """Origin of that model in the frame of the tissue [m]; [0, 0, 0] without."""
    quat: FourNumbers | None = None
    """Rotation of that model: w, x, y, z; [1, 0, 0, 0] without."""
    holds: Annotated[Literal["attachment", "friction"], one_of("attachment", "friction")] = (
        "attachment"
    )
    """Kind of hold on tissue: by attachment, what is between the pads when they have closed is tied
    to the grasper by springs; or by friction, shaft, jaws and pads touch the tissue, and friction
    (0.6) holds it."""
    stiffness: Positive | None = None
    """Stiffness of the attachment [N/m]; 2000 without."""
    damping: NotNegative | None = None
    """Damping of the attachment [N s/m]; 2 without."""
    breaks_at: Positive | None = None
    """Force at which what is held slips out [N]; none without."""
    closed: Positive | None = None
    """Distance between the pads below which they hold [m]; 0.006 without."""
    force: Positive | None = None
    """Largest force of the jaws [N]; 5 without."""
    motion: Annotated[list[WaypointTable], Meta(min_length=1)] = field(default_factory=list)
    """Rows of where it rests, and when. Between two it moves, turns and opens along the polynomial
    of least jerk."""
    recorded: FileName | None = None
    """CSV file of what [a hand](live.md#what-is-recorded) did with it, in place of a motion."""
