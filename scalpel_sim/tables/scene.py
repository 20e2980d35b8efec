"""The tables of a scene file."""

from typing import Annotated

from msgspec import Meta, field

from bridge import MAX_FRAMES_PER_ANSWER
from scalpel_sim.tables.attachment import AttachmentTable
from scalpel_sim.tables.body import BodyTable
from scalpel_sim.tables.grasper import GrasperTable
from scalpel_sim.tables.material import BladeTable, PresetMaterialTable
from scalpel_sim.tables.stroke import StrokeTable
from scalpel_sim.tables.values import (
    Finite,
    NotNegative,
    Positive,
    Region,
    Share,
    Text,
    ThreeNumbers,
    TomlTable,
    TrueOrFalse,
    Whole,
)
from scalpel_sim.tables.view import ViewTable

_NameOfScene = Annotated[
    str,
    Meta(
        pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$",
        description="a name: letters, digits, dots, dashes and underscores, 64 at most",
    ),
]


_Every = Annotated[
    int,
    Meta(
        ge=1,
        le=MAX_FRAMES_PER_ANSWER,
        description=f"a whole number from 1 to {MAX_FRAMES_PER_ANSWER}",
    ),
]


_Quaternion = Annotated[
    tuple[Finite, Finite, Finite, Finite], Meta(description="four numbers: [w, x, y, z]")
]


class SceneBodyTable(BodyTable, kw_only=True, frozen=True):
    """`[body]`: the geometry, and how it is held."""

    fixed: Region = "left,right"
    """Which nodes do not move: sides, a box, or none."""
    stretch: Finite | None = None
    """How far opposite held sides are pulled apart before the run, as a fraction; None: 0.05 with
    left and right held, as a scene has them, else 0."""


class WorldTable(TomlTable, kw_only=True, frozen=True):
    """`[world]`: what is around the body."""

    gravity: NotNegative | None = None
    floor: Finite | None = None
    table: Finite | None = None
    """Height of the upper side of a table on which the body lies, tissue frame [m]."""
    table_friction: NotNegative | None = None
    """Coefficient of friction between the two; None: that of the material."""
    pos: ThreeNumbers | None = None
    """Where the origin of the tissue is in the world of an arm of the user's own [m]."""
    quat: _Quaternion | None = None
    """How the tissue is turned there: w, x, y, z."""


class SolverTable(TomlTable, kw_only=True, frozen=True):
    """`[solver]`: how the mesh is cut, and how the motion is computed; None: the usual."""

    scheme: Text | None = None
    relaxation: Text | None = None
    mass_scaling: NotNegative | None = None
    precision: Text | None = None
    threads: Whole | None = None
    snap: Share | None = None
    snap_floor: Share | None = None
    guard: Share | None = None
    crumb: NotNegative | None = None
    audit: TrueOrFalse | None = None


class ArmTable(TomlTable, kw_only=True, frozen=True):
    """`[arm]`: the arm, and how it is coupled to the tissue; None: the usual."""

    preset: Text | None = None
    model: Text | None = None
    """MJCF file of an arm of the user's own, which then stands where the file has it."""
    heel: Text | None = None
    tip: Text | None = None
    forward: ThreeNumbers | None = None
    force: Positive | None = None
    torque: Positive | None = None
    tissue_every: _Every | None = None
    coupling: Text | None = None
    coupling_stiffness: Positive | None = None
    coupling_damping: NotNegative | None = None
    passivity: TrueOrFalse | None = None


class SceneContent(TomlTable, kw_only=True, frozen=True):
    """The whole file."""

    name: _NameOfScene | None = None
    about: Text | None = None
    seconds: Positive | None = None
    body: SceneBodyTable
    material: PresetMaterialTable | None = None
    blade: BladeTable = field(default_factory=BladeTable)
    world: WorldTable = field(default_factory=WorldTable)
    solver: SolverTable = field(default_factory=SolverTable)
    arm: ArmTable = field(default_factory=ArmTable)
    attachment: list[AttachmentTable] = field(default_factory=list)
    grasper: list[GrasperTable] = field(default_factory=list)
    stroke: list[StrokeTable] = field(default_factory=lambda: [StrokeTable()])
    view: list[ViewTable] = field(default_factory=list)
