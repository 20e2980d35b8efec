"""The tables of a scene file: each key with what it may hold, its meaning, unit and default.

The text below a key is its help on the command line, its comment in the files that `materials
--write` makes, and its line in docs/scenes.md.
"""

import math

from scalpel_sim.tables.values import (
    Angle,
    Finite,
    FourNumbers,
    Gravity,
    HexColour,
    Label,
    LabelNumber,
    LawName,
    NotNegative,
    Positive,
    Ratio,
    Region,
    RowsOfThree,
    Series,
    Share,
    Text,
    ThreeNumbers,
    Times,
    TomlTable,
    TrueOrFalse,
    Whole,
)
from tissue import CutSettings, SolverSettings

DEFAULT_FOV = 38.0
"""Angle that a picture spans from its lower to its upper side, where a view gives none [deg]."""

OVERVIEW, ENDOSCOPE = "overview", "endoscope"
"""Names of the cameras that are always there."""

SHIPPED_CAMERAS = (OVERVIEW, ENDOSCOPE)

DEFAULT_MASS_SCALING = SolverSettings().mass_scaling or 0.0
"""Angular frequency above which nodes get mass, where a scene gives none [1/s]."""

STANDARD_GRAVITY = 9.81
"""Gravity along -z [m/s2]."""

_CUT = CutSettings()


class MaterialTable(TomlTable, kw_only=True, frozen=True):
    """`[material]`: the figures of `tissue.Material`."""

    law: LawName | None = None
    """Law by which forces follow from deformation: springs along the edges of the mesh, as in the
    paper, or tetrahedra: neo_hookean, or exponential or yeoh, which stiffen as they are
    stretched."""
    young_modulus: Positive | None = None
    """Young's modulus, the stiffness at small strain [Pa]."""
    poisson_ratio: Ratio | None = None
    """Poisson's ratio: below 0.5, and 0.25 or more for springs. Soft tissue has 0.45 to 0.49;
    above 0.49 the time step becomes short."""
    stiffening: NotNegative | None = None
    """b of law exponential, 0 under the others: stretched to length 1 + e, tissue is exp(3 b e^2)
    times as stiff. Soft organs have 5 to 30."""
    yeoh_second: NotNegative | None = None
    """C20 / C10 of law yeoh, 0 under the others."""
    yeoh_third: NotNegative | None = None
    """C30 / C10 of law yeoh, 0 under the others."""
    prony: Series | None = None
    """Relaxation of stress: g and tau [s] of one to three terms, [[g, tau], ...]; held tissue keeps
    1 - sum of g (1 - exp(-t / tau)) of its stress. []: none relaxes, as under springs."""
    density: Positive | None = None
    """Density [kg/m3]."""
    toughness: NotNegative | None = None
    """Fracture toughness: the energy that a square metre of cut costs [J/m2]."""
    skin_toughness: NotNegative | None = None
    """Fracture toughness until the edge has broken in [J/m2]: the peak of a puncture. Less than
    toughness means no peak."""
    toughness_exponent: NotNegative | None = None
    """Exponent n of a toughness that rises with the speed of the cut: toughness (1 + (speed /
    toughness_speed)^n). 0: it does not rise."""
    toughness_speed: Positive | None = None
    """Speed at which toughness is twice that of a slow cut [m/s]."""
    work_to_rupture: NotNegative | None = None
    """Energy that it takes to stretch a volume until it breaks [J/m3]: what a blunt edge adds to
    the toughness."""
    friction: NotNegative | None = None
    """Coefficient of friction where cut faces, pieces and the floor touch."""
    blade_friction: NotNegative | None = None
    """Coefficient of friction on the faces of the blade."""
    blade_viscosity: NotNegative | None = None
    """Shear stress per sliding speed on the faces of the blade [Pa s/m], in addition to
    friction."""
    viscous_damping: NotNegative | None = None
    """Drag: the rate at which slow motion within the tissue dies away [1/s]."""
    retardation_time: NotNegative | None = None
    """Viscosity in shear over the shear modulus [s]."""
    spring_calibration: Positive | None = None
    """Stiffness of the springs over that of van Gelder's formula. Keep it at 1, unless the law is
    springs and they were measured on this mesh."""


class PresetMaterialTable(MaterialTable, kw_only=True, frozen=True):
    """`[material]` of a scene: a preset and figures that replace its own, or figures alone."""

    preset: Text | None = None
    """Name of a material (`scalpel-sim materials`). Without a preset, `law` and `young_modulus` are
    needed."""


class LabelTable(TomlTable, kw_only=True, frozen=True):
    """`[[label]]`: a part of the body, with a name, and a material of its own."""

    name: Label
    """Name of the part. Without `label` and `region` it is that of a group of the mesh file."""
    body: Text | None = None
    """Body that it is a part of, where there are [several](#several-bodies)."""
    label: LabelNumber | None = None
    """Number of the part in the mesh file."""
    region: Region | None = None
    """Box or sphere, as for `fixed`: the elements whose middles are in it."""
    material: PresetMaterialTable | None = None
    """Material: a preset, with figures that replace its own; or figures that replace those of
    `[material]`, or of its body."""
    colour: HexColour | None = None
    """Colour on pages, in figures and in exported files, "#rrggbb"; without, that of the tissue
    which the name or the material says."""
    spare: TrueOrFalse = False
    """Whether the blade is to leave it whole: a run that cuts it says so."""


class BladeTable(TomlTable, kw_only=True, frozen=True):
    """`[blade]`: the measures of `tissue.BladeShape`, those of a scalpel where none is given."""

    thickness: NotNegative | None = None
    """Thickness of the blade [m; a scalpel's: 0.0004]. 0: the blade is a line, as in the paper, and
    has no other measures."""
    bevel_degrees: Positive | None = None
    """Angle between each bevel and the plane of the blade, at most 60 [degree; a scalpel's: 10]."""
    height: Positive | None = None
    """Distance from the edge to the back of the blade [m; a scalpel's: 0.006]."""
    edge_radius: NotNegative | None = None
    """Radius of the edge: how blunt it is [m; a scalpel's: 0.000001]."""


class WorldTable(TomlTable, kw_only=True, frozen=True):
    """`[world]`: what is around the body."""

    gravity: Gravity = STANDARD_GRAVITY
    """Gravity [m/s2]: a number, downwards; or a vector, [x, y, z], which is that of the arm's world
    as well."""
    floor: Finite | None = None
    """Height of a floor [m], below the body: pieces that are cut loose land on it."""
    table: Finite | None = None
    """Height of the upper side of a table on which the body lies from the first [m]: a board of
    1 cm that reaches 8 cm beyond it, and that arms stand clear of."""
    table_friction: NotNegative | None = None
    """Coefficient of friction between body and table; that of the material without."""
    pos: ThreeNumbers = (0.0, 0.0, 0.0)
    """Origin of the tissue in the world of an arm of your own [m]."""
    quat: FourNumbers = (1.0, 0.0, 0.0, 0.0)
    """Rotation of the tissue there: w, x, y, z."""

    @property
    def free_fall(self) -> tuple[float, float, float]:
        """Gravity as a vector, tissue frame [m/s2]."""
        if isinstance(self.gravity, (int, float)):
            return 0.0, 0.0, -self.gravity
        x, y, z = self.gravity
        return x, y, z

    @property
    def stop(self) -> float:
        """Height of the table or the floor that stops a blade [m]; minus infinity without."""
        return max((z for z in (self.table, self.floor) if z is not None), default=-math.inf)


class SolverTable(TomlTable, kw_only=True, frozen=True):
    """`[solver]`: how the mesh is cut, and how the motion is computed."""

    scheme: Text = "stellar"
    """Scheme that cuts the mesh: stellar, or paper: the paper's own scheme, with its limits."""
    relaxation: Text = "global"
    """Method that advances the motion: global, all nodes together by the Runge-Kutta method
    [default of run]; verlet, the same by a method of second order, up to 1.5 times as fast [default
    of view]; or, for springs, hierarchical, near the blade more often, or paper, the same as
    printed: far from the blade nothing moves."""
    mass_scaling: NotNegative = DEFAULT_MASS_SCALING
    """Light nodes, of slivers or near the blade, get mass until none is faster than this angular
    frequency [1/s; 0: off]. The added mass has no weight, and the table says how much it is."""
    element: Text = "averaged"
    """Strain of tetrahedra: averaged, a share of their shear around nodes, so that coarse
    meshes bend and twist as a solid; or plain, each by itself: faster, and stiffer by a third where
    two or three are across."""
    precision: Text = "single"
    """Precision of the forces of tetrahedra: single, or double, which takes a third longer.
    Positions and velocities are double."""
    threads: Whole = 1
    """Threads that share the loops over the body, to the same bits, with the relaxation global or
    verlet; give it no more than there are idle cores."""
    snap: Share = _CUT.snap
    """Where the blade passes nearer to a node than this share of the node's size, the cut goes
    through the node: 0 follows the blade exactly, 1 keeps elements large."""
    snap_floor: Share | None = None
    """The same as a share of the mean node size, in any case; that of `snap` without."""
    guard: Share = _CUT.guard
    """No new element is thinner than this share of the mean node size, at most 0.5; best is half of
    snap."""
    crumb: NotNegative = _CUT.crumb
    """Volume below which a piece is not cut loose, in mean tetrahedra."""
    audit: TrueOrFalse = False
    """Keep an account of the energy: where the work of the blade goes [default of run]. Needs the
    relaxation global or verlet."""


class AttachmentTable(TomlTable, kw_only=True, frozen=True):
    """`[[attachment]]`: springs from a region to a frame, or to a body; with `to`, a ligament."""

    where: Region
    """Region whose nodes it holds, as for `fixed`; of a box or a sphere also the nodes inside."""
    body: Text | None = None
    """Body whose region that is, where there are [several](#several-bodies); all without."""
    stiffness: Positive
    """Stiffness of all springs together [N/m]."""
    damping: NotNegative = 0.0
    """Damping of all dampers together [N s/m]."""
    rest_length: NotNegative | None = None
    """Length up to which each is slack [m]; 0 without, and of a fibre its length at first."""
    breaks_at: Positive | None = None
    """Force at which it releases the tissue [N]; none without."""
    to: ThreeNumbers | None = None
    """Where the fibres of a [ligament](own_arm.md#ligaments) end [m]. It has `area` and
    `toughness` too."""
    to_body: Text | None = None
    """Body where they end instead: [a layer](#ties-between-bodies) between the two."""
    within: Positive = 0.001
    """Farthest distance of the skin that such a layer ties [m]."""
    area: Positive | None = None
    """Cross-section of all fibres together [m2]; of a layer the area of the skin that it ties."""
    toughness: Positive | None = None
    """Energy of cutting the fibres [J/m2]."""
    displacements: RowsOfThree | None = None
    """Displacement of the frame, or the other ends of a ligament, from where they are at first,
    row by row [m]."""
    times: Times | None = None
    """When the frame is there, a time for each row [s]."""
    speed: Positive | None = None
    """Speed of the frame, in place of times [m/s]."""
    release_at: NotNegative | None = None
    """When it releases the tissue [s]."""


class CoreTable(TomlTable, kw_only=True, frozen=True):
    """`[[core]]`: a rigid core inside the tissue, such as a bone or a stone."""

    where: Region
    """Region, as for `fixed`: the core is made of the elements that are wholly in it."""
    body: Text | None = None
    """Body whose region that is, where there are several; all without."""
    density: Positive | None = None
    """Density, at least that of the tissue, and the same without [kg/m3]."""


class LedSupportTable(TomlTable, kw_only=True, frozen=True):
    """`[[support]]`: held nodes that are led: moved, turned and stretched over time."""

    where: Region
    """Region whose held nodes it leads, as for `fixed`."""
    body: Text | None = None
    """Body whose region that is, where there are several; all without."""
    times: Times
    """When they are at each row, after the start, above 0 [s]. From row to row all changes evenly;
    after the last they stay."""
    displacements: RowsOfThree | None = None
    """Displacement from where they are at first, row by row [m]."""
    rotations_degrees: RowsOfThree | None = None
    """By how much they are turned, row by row: vectors along the axis and as long as the angle
    [degree]."""
    stretches: RowsOfThree | None = None
    """Factors of their lengths along x, y and z, before they are turned, row by row."""
    about: ThreeNumbers | None = None
    """Point about which they are turned and stretched [m]; the middle of the region without."""


class ViewTable(TomlTable, kw_only=True, frozen=True):
    """`[[view]]`: a camera, which stands still in the frame of the tissue."""

    name: Label
    """Name on the page, up to 40 characters; each view has its own."""
    eye: ThreeNumbers
    """Position of the camera [m]."""
    target: ThreeNumbers
    """Point in the middle of the picture [m]."""
    up: ThreeNumbers = (0.0, 0.0, 1.0)
    """Direction that points to the upper side of the picture; not along the line of sight."""
    fov_degrees: Angle = DEFAULT_FOV
    """Angle from the lower to the upper side of the picture, above 0 and below 180 [degree]."""
