"""The options of the command line about a scene, in the groups that `--help` shows.

Each group is a dataclass that several commands share. An option that is not given is None, and
leaves what the scene has.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Group, Parameter

from scalpel_sim.runs.options import Flag

SceneName = Annotated[
    str | None,
    Parameter(
        help="organ (default), incision, retract, excise, taut_incision, a specimen of a material "
        "(liver, kidney, skin, fat, muscle, gelatin, silicone), slab, grid2 or grid7; or a "
        "FILE.toml, which the command `new` writes."
    ),
]

_SCENE = Group("Scene", sort_key=0)
_BODY = Group("Body", sort_key=1)
_MATERIAL = Group("Material", sort_key=2)
_BLADE = Group("Blade", sort_key=3)
_SOLVER = Group("Solver", sort_key=4)
_ARM = Group("Arm", sort_key=5)


@Parameter(name="*", group=_BODY)
@dataclass(frozen=True)
class BodyOptions:
    """The body, and the sides at which it is held."""

    mesh: Path | None = None
    "Cut this tetrahedral mesh instead of a scene: Gmsh .msh, legacy .vtk, or .vtu."
    scale: float | None = None
    "Metres in one unit of the mesh file: 0.001 for millimetres."
    fix: str | None = None
    """What is held: sides (left, right, front, back, bottom, top), the underside (all that faces
    down), a box x0,y0,z0:x1,y1,z1 in m, a sphere sphere:x,y,z,radius in m, or none."""
    stretch: float | None = None
    "How far opposite held sides are pulled apart before the run, as a fraction: a slit opens."
    gravity: float | None = None
    "Gravity, downwards [m/s2]."
    floor: float | None = None
    "Height of a floor [m], below the body: pieces that are cut loose land on it."


@Parameter(name="*", group=_MATERIAL)
@dataclass(frozen=True)
class MaterialOptions:
    """The material of the body. Single numbers override those of `--material`."""

    material: str | None = None
    """Name of a material (liver, kidney, skin, fat, muscle, gelatin, silicone), or a FILE.toml. The
    command `materials` lists the names and writes a file to start from."""
    law: str | None = None
    """How forces follow from deformation: springs, as in the paper, or tetrahedra: neo_hookean, or
    exponential or yeoh, which stiffen as they are stretched."""
    young: float | None = None
    "Young's modulus [Pa]."
    poisson_ratio: float | None = None
    "Poisson's ratio: below 0.5; 0.25 or more for springs, 0 or more for the other laws."
    stiffening: float | None = None
    "b of law exponential: stretched to length 1 + e, tissue is exp(3 b e^2) times as stiff."
    yeoh_second: float | None = None
    "C20 / C10 of law yeoh."
    yeoh_third: float | None = None
    "C30 / C10 of law yeoh."
    prony: str | None = None
    """Relaxation of stress, as G:TAU of one to three terms, such as 0.3:0.1,0.2:5: held tissue
    keeps 1 - sum of G (1 - exp(-t / TAU)) of its stress. Not under law springs."""
    density: float | None = None
    "Density [kg/m3]."
    toughness: float | None = None
    "Fracture toughness: the energy that a square metre of cut costs [J/m2]."
    skin_toughness: float | None = None
    "Fracture toughness until the edge has broken in, the peak of a puncture [J/m2]."
    toughness_exponent: float | None = None
    "Exponent n of a toughness that rises with the speed of the cut: toughness (1 + (speed / S)^n)."
    toughness_speed: float | None = None
    "Speed S at which toughness is twice that of a slow cut [m/s]."
    work_to_rupture: float | None = None
    "Energy that it takes to stretch a volume until it breaks [J/m3]: what a blunt edge adds."
    friction: float | None = None
    "Coefficient of friction of cut faces, pieces and the floor."
    blade_friction: float | None = None
    "Coefficient of friction on the faces of the blade."
    blade_viscosity: float | None = None
    "Shear stress per sliding speed on the faces of the blade, in addition to friction [Pa s/m]."
    calibrate: Flag = False
    "Measure the springs on this mesh first, and make them as stiff as asked for. Law springs only."
    spring_error: Flag = False
    "Report how far springs on this mesh are from the material that they stand for."


@Parameter(name="*", group=_BLADE)
@dataclass(frozen=True)
class BladeOptions:
    """The blade. Single numbers override those of `--blade`."""

    blade: Path | None = None
    "Take the measures of the blade from this FILE.toml, which `materials --write` makes."
    blade_thickness: float | None = None
    """Thickness of the blade [m]; 0: a line, as in the paper. The scenes of the paper have a line,
    all others a scalpel of 0.0004."""
    blade_bevel: float | None = None
    "Angle between each bevel and the plane of the blade [degree; a scalpel's: 10]."
    blade_height: float | None = None
    "Distance from the edge to the back of the blade [m; a scalpel's: 0.006]."
    blade_edge_radius: float | None = None
    "Radius of the edge: how blunt it is [m; a scalpel's: 0.000001]."


@Parameter(name="*", group=_SOLVER)
@dataclass(frozen=True)
class SolverOptions:
    """How the mesh is cut, and how the motion is computed."""

    scheme: str | None = None
    "How the mesh is cut: stellar [default], or paper: the paper's own scheme, with its limits."
    relaxation: str | None = None
    """How the motion is advanced: global, all nodes together by the Runge-Kutta method [default of
    run]; verlet, the same by a method of second order, up to 1.5 times as fast [default of
    view]; or hierarchical, the paper's, for springs."""
    mass_scaling: float | None = None
    """Light nodes, of slivers or beside the blade, get mass until none is faster than this angular
    frequency [1/s; 0: off; default: 5800]. The added mass has no weight, and the table tells how
    much it is."""
    precision: str | None = None
    """Precision of the forces of tetrahedra: single [default], or double, which takes a third
    longer. Positions and velocities are double."""
    threads: int | None = None
    """Threads that share the loops over the body, to the same bits, with the relaxation global or
    verlet; give it no more than there are idle cores [default: 1]."""
    snap: float | None = None
    """Where the blade passes nearer to a node than this share of the node's size, the cut goes
    through the node: 0 follows the blade exactly, 1 keeps elements large [default: 0.3]."""
    guard: float | None = None
    """No new element is thinner than this share of the mean node size, at most 0.5; best is half of
    --snap [default: 0.15]."""
    audit: bool | None = None
    """Keep an account of the energy: where the work of the blade goes. Needs the relaxation global
    or verlet, where `run` has it switched on."""


@Parameter(name="*", group=_ARM)
@dataclass(frozen=True)
class ArmOptions:
    """The arm, the path of its blade, and how it is coupled to the tissue."""

    stroke: str | None = None
    """Path of the blade: straight, slanted, curved, stop, incision, press, or a CSV file of poses
    over time. A scene file has others, and several in turn."""
    speed: float | None = None
    "Speed of the blade along the stroke [m/s]."
    arm: str | None = None
    "Arm that holds the blade: touch, premium, or auto, the first of them that reaches."
    tissue_every: int | None = None
    """Ask the tissue once in so many milliseconds; in between the arm feels its last answer and its
    local stiffness [default: 1]."""
    coupling: str | None = None
    """How the arm's blade is coupled to the one that cuts: rigid [default], they are one; or
    virtual, by a spring and a damper, and the arm feels nothing stiffer."""
    coupling_stiffness: float | None = None
    "Stiffness of a virtual coupling [N/m; default: 700]."
    coupling_damping: float | None = None
    "Damping of a virtual coupling [N s/m; default: twice what is needed for stability]."
    passivity: bool | None = None
    "Damp motion by which the coupling would create energy [default: yes]. It is counted anyway."
    seconds: float | None = None
    "How long to simulate [s; default: the strokes and 0.3 s more]."


@Parameter(name="*")
@dataclass(frozen=True)
class TissueOptions:
    """What the process that holds the tissue must know: body, material, blade and solver."""

    body: BodyOptions = BodyOptions()
    material: MaterialOptions = MaterialOptions()
    blade: BladeOptions = BladeOptions()
    solver: SolverOptions = SolverOptions()
    settings: Annotated[
        tuple[str, ...],
        Parameter(name="--set", negative="", show_default=False, group=_SCENE),
    ] = ()
    """A key of the scene file, such as material.toughness=50 or stroke.0.depth=0.01. May be given
    several times. The options below override it."""


def given_options(group: Any) -> Iterator[str]:
    """Yield the names of the options of a group that are given, as the command line has them."""
    for field in fields(group):
        value = getattr(group, field.name)
        if is_dataclass(value):
            yield from given_options(value)
        elif value != field.default:
            yield "set" if field.name == "settings" else field.name.replace("_", "-")
