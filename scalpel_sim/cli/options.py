"""What can be asked for on the command line."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

SceneName = Annotated[
    str | None,
    Parameter(help="organ (default), slab, grid2 or grid7."),
]

FigureNumber = Annotated[Literal[10, 11, 12], Parameter(help="10, 11 or 12.")]


@Parameter(name="*")
@dataclass(frozen=True)
class Body:
    """What is to be cut. What is not given is the scene's."""

    mesh: Path | None = None
    "Cut this tetrahedral mesh instead of a scene: Gmsh .msh, legacy .vtk, or .vtu."
    scale: float | None = None
    "Metres in one unit of the mesh file: 0.001 for millimetres."
    fix: str | None = None
    "What is held: sides (left, right, front, back, bottom, top), a box x0,y0,z0:x1,y1,z1, or none."
    material: str | None = None
    "A material by name: liver, kidney, skin, fat, muscle, gelatin, silicone; see `materials`."
    law: str | None = None
    "How forces follow from deformation: springs, the paper's, or neo_hookean tetrahedra."
    young: float | None = None
    "Young's modulus [Pa]."
    poisson_ratio: float | None = None
    "Poisson's ratio: below 0.5; 0 or more for neo_hookean, 0.25 or more for springs."
    calibrate: Annotated[bool, Parameter(negative="")] = False
    "Measure the springs on this mesh first, and make them as stiff as asked for; report the rest."
    spring_error: Annotated[bool, Parameter(negative="")] = False
    "Say how far springs on this mesh are from the material that they stand for."
    density: float | None = None
    "Density [kg/m3]."
    toughness: float | None = None
    "Fracture toughness: what a square metre of cut costs [J/m2]."
    skin_toughness: float | None = None
    "What it costs until the edge has broken in, the peak of a puncture [J/m2]."
    toughness_exponent: float | None = None
    "n of a toughness that rises with the speed of the cut: toughness (1 + (speed / S)^n)."
    toughness_speed: float | None = None
    "S: the speed at which toughness is twice that of a slow cut [m/s]."
    work_to_rupture: float | None = None
    "Energy that it takes to stretch a volume until it breaks [J/m3]: what a blunt edge adds."
    blade_friction: float | None = None
    "Coefficient of friction on the faces of the blade."
    blade_viscosity: float | None = None
    "Shear stress per sliding speed on the faces of the blade, besides friction [Pa s/m]."
    blade_thickness: float | None = None
    """Thickness of the blade [m]; 0: a line, as in the paper. The paper's scenes meet a line, all
    others a scalpel of 0.0004."""
    blade_bevel: float | None = None
    "Angle between each bevel and the plane of the blade [degree; a scalpel's: 10]."
    blade_height: float | None = None
    "From the edge to the back of the blade [m; a scalpel's: 0.006]."
    blade_edge_radius: float | None = None
    "Radius of the edge: how blunt it is [m; a scalpel's: 0.000001]."
    scheme: str | None = None
    "How the mesh is cut: stellar [default], or paper: the paper's own scheme, with its limits."
    relaxation: str | None = None
    """How the motion is advanced: global, all nodes together; local, small elements in substeps and
    what rests asleep; or hierarchical, the paper's, for springs."""
    threads: int | None = None
    "Threads that share a global relaxation; pays from about 30,000 tetrahedra on [default: 1]."
    snap: float | None = None
    """Where the blade passes nearer to a node than this share of the node's size, the cut goes
    through the node: 0 follows the blade exactly, 1 keeps elements large [default: 0.3]."""
    guard: float | None = None
    """No new element is thinner than this share of the mean node size, at most 0.5; best is half of
    --snap [default: 0.15]."""
    stretch: float | None = None
    "How far opposite held sides are pulled apart before the run, as a fraction: a slit opens."
    gravity: float | None = None
    "Gravity, downwards [m/s2]."
    friction: float | None = None
    "Coefficient of friction of cut faces, pieces and the floor."
    floor: float | None = None
    "Height of a floor [m], below the body: pieces that are cut loose land on it."
    audit: bool | None = None
    """Account for the energy: where the work of the blade goes. Needs a global relaxation on one
    thread, and is done there by `run` unless you say no."""


@Parameter(name="*")
@dataclass(frozen=True)
class Motion:
    """What is done to it, and by what. What is not given is the scene's."""

    stroke: str | None = None
    "straight, slanted, curved, stop, press, or a CSV file of times and blade poses."
    speed: float | None = None
    "How fast the blade is led [m/s]."
    arm: str | None = None
    "touch, premium, or auto: the first that reaches."
    tissue_every: int | None = None
    """Ask the tissue once in so many milliseconds; in between its last answer and its local
    stiffness are felt [default: 1]."""
    coupling: str | None = None
    """rigid [default]: the arm's blade is the one that cuts; virtual: a spring and a damper are
    between them, and the arm feels nothing stiffer."""
    coupling_stiffness: float | None = None
    "Stiffness of a virtual coupling [N/m; default: 700]."
    coupling_damping: float | None = None
    "Damping of a virtual coupling [N s/m; default: twice what is stable by rule]."
    passivity: bool | None = None
    "Damp what would give the arm energy out of nothing [default: yes]. It is counted either way."
    seconds: float | None = None
    "How long to simulate [s]; else the stroke and 0.3 s more."
    seed: int = 0
    "Seed of whatever is random. Kept in summary.json."
    connect: str | None = None
    "The tissue is elsewhere: HOST:PORT of `scalpel-sim serve`."
    key: Path | None = None
    "File with the key of that server; else SCALPEL_SIM_KEY, if that is set. See `scalpel-sim key`."
    out: Path | None = None
    "Folder for the files; out/SCENE if not given."
    export: Annotated[tuple[Path, ...], Parameter(negative="")] = ()
    """Write the body's surface after the run to this file too: .glb, .obj (pieces and cut faces by
    name), .ply (marked on each face) or .stl (triangles alone). May be given several times."""


@Parameter(name="*")
@dataclass(frozen=True)
class Talk:
    """How much is said."""

    json: Annotated[bool, Parameter(negative="")] = False
    "Print the summary as JSON on standard output, and nothing else there."
    quiet: Annotated[bool, Parameter(name=["--quiet", "-q"], negative="")] = False
    "Say nothing but errors."
    verbose: Annotated[bool, Parameter(name=["--verbose", "-v"], negative="")] = False
    "Say what is being done; after an error, show where it came from."
