"""Scenes: a body, its material, how it is held, and the stroke through it."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from bridge import MAX_FRAMES_PER_ANSWER, TissueLink, VirtualCoupling
from scalpel_sim.arm.scalpel import SCALPEL
from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.scene_parts.choices import (
    ARM_CHOICES,
    COUPLINGS,
    can_audit,
    check_contact,
    check_precision,
    check_relaxation,
    check_scheme,
)
from scalpel_sim.scene_parts.specimens import SPECIMENS
from scalpel_sim.strokes.planning import STROKES
from scalpel_sim.strokes.stroke import Stroke, from_csv
from tissue import (
    MATERIALS,
    BladeShape,
    CutSettings,
    Material,
    SolverSettings,
    TetrahedralMesh,
    block,
)

PHANTOM = Material(
    law="springs",
    poisson_ratio=0.25,
    young_modulus=10e3,
    density=1000.0,
    toughness=20.0,
    blade_friction=MATERIALS["gelatin"].blade_friction.value,
)
"""A soft gel phantom of springs, as in the paper. toughness / young_modulus = 2 mm: the length by
which the blade drags the tissue along before the tissue parts. It must be small against the body,
or the blade drags the body along instead of cutting it."""

GEL = replace(PHANTOM, law="neo_hookean", poisson_ratio=0.45)
"""The same gel as tetrahedra that hardly change their volume: what a mesh from a file is made of,
unless another material is asked for. Springs turn flat elements of such meshes inside out."""

PARENCHYMA = replace(MATERIALS["liver"].material, law="neo_hookean", stiffening=0.0, toughness=10.0)
"""Liver that does not stiffen, of a toughness well below the 164 J/m2 of liver with its vessels, so
that toughness / young_modulus is 2 mm here too, and one stroke cuts through. `--material liver` is
liver as published."""

DEFAULT_CUT_SETTINGS = CutSettings()
"""How closely cuts follow the blade, unless a scene says otherwise."""

DEFAULT_MASS_SCALING = SolverSettings().mass_scaling or 0.0
"""Angular frequency above which nodes get mass, unless a scene says otherwise [1/s]."""

STANDARD_GRAVITY = 9.81
"""Gravity along -z [m/s2]."""


@dataclass(frozen=True)
class Scene:
    """A body, and the stroke that cuts it. Lengths in metres, tissue frame."""

    name: str
    about: str
    """A description in one line."""
    mesh: Callable[[], TetrahedralMesh]
    material: Material = PHANTOM
    fixed: str = "left,right"
    """Which nodes do not move: names of sides, a box, or `none`, as `tissue.fixed_nodes` takes
    them."""
    cut: CutSettings = DEFAULT_CUT_SETTINGS
    """How closely cuts follow the blade, against how small the elements get."""
    scheme: str = "stellar"
    """How the mesh is cut: `stellar`, or `paper` as in Bielser, Maiwald and Gross (1998)."""
    relaxation: str = "global"
    """How the motion is advanced: `global`, `verlet` or `hierarchical`."""
    mass_scaling: float = DEFAULT_MASS_SCALING
    """Angular frequency above which nodes get mass where a cut has left slivers [1/s]; 0: none
    do."""
    precision: str = "single"
    """Precision of the forces of tetrahedra: `single` or `double`. Positions and velocities are
    double."""
    contact: str | None = None
    """How the body is kept from passing through itself: `impulses`, or `penalty`; None: `penalty`
    with the relaxation global or verlet."""
    threads: int = 1
    """Threads that share the loops over the body, with the relaxation global or verlet."""
    stretch: float = 0.05
    """How far opposite held sides are pulled apart before the run, as a fraction of their distance.
    Living tissue is under tension: a slit opens."""
    gravity: float = STANDARD_GRAVITY
    """Gravity along -z [m/s2]."""
    floor: float | None = None
    """Height of a floor on which loose pieces land [m], tissue frame; None: no floor."""
    blade: BladeShape | None = SCALPEL
    """The blade as a body; None: a line, as in the paper."""
    audit: bool = False
    """Whether an account of the energy is kept."""
    stroke: str = "straight"
    """One of `scalpel_sim.strokes.planning.STROKES`, or a CSV file."""
    speed: float = 0.06
    """Speed of the blade's tip [m/s]."""
    arm: str = "auto"
    """`touch`, `premium`, or `auto`: the first of them that reaches."""
    tissue_every: int = 1
    """Number of frames after which the tissue is asked again."""
    coupling: str = "rigid"
    """Between the arm's blade and the one that cuts: `rigid` (they are one), or `virtual`."""
    coupling_stiffness: float | None = None
    """Stiffness of a virtual coupling [N/m]; None: the default."""
    coupling_damping: float | None = None
    """Damping of a virtual coupling [N s/m]; None: twice what its stiffness needs."""
    passivity: bool = True
    """Whether what would give the arm energy out of nothing is damped."""

    def __post_init__(self) -> None:
        """Refuse names and numbers that make no sense.

        Raises:
            UsageError: stretch, gravity, speed, mass scaling or a number of the coupling is out of
                range; there is no such scheme, relaxation, precision, contact or coupling; an audit
                of a relaxation that has none.
        """
        check_scheme(self.scheme)
        check_relaxation(self.relaxation, self.threads)
        check_contact(self.contact, self.relaxation)
        if self.audit and not can_audit(self.relaxation):
            raise UsageError(
                f"--audit needs --relaxation global or verlet, not {self.relaxation}; omit "
                "--audit, or choose one of those"
            )
        if self.relaxation == "verlet" and self.material.stiffens:
            raise UsageError(
                f"--relaxation verlet gains energy under law {self.material.law}; use global"
            )
        check_precision(self.precision)
        if not (self.mass_scaling >= 0.0 and np.isfinite(self.mass_scaling)):
            raise UsageError(
                f"--mass-scaling is {self.mass_scaling}; it is an angular frequency [1/s], or 0 "
                "for no added mass"
            )
        self.virtual_coupling()
        if not 1 <= self.tissue_every <= MAX_FRAMES_PER_ANSWER:
            raise UsageError(
                f"the tissue is to be asked every {self.tissue_every} frames; it must be 1 to "
                f"{MAX_FRAMES_PER_ANSWER}"
            )
        if not -0.5 <= self.stretch <= 1.0:
            raise UsageError(f"stretch is {self.stretch}; it is a fraction from -0.5 to 1")
        if not 0.0 <= self.gravity <= 100.0:
            raise UsageError(f"gravity is {self.gravity} m/s2; it must lie between 0 and 100")
        if not 0.0 < self.speed <= 1.0:
            raise UsageError(f"speed is {self.speed} m/s; it must be above 0 and at most 1")

    def virtual_coupling(self) -> VirtualCoupling | None:
        """Return the coupling of the arm's blade to the one that cuts; None where they are one.

        Raises:
            UsageError: there is no such coupling, or it cannot have such a stiffness or damping.
        """
        if self.coupling not in COUPLINGS:
            raise unknown("coupling", self.coupling, COUPLINGS)
        asked = {"stiffness": self.coupling_stiffness, "damping": self.coupling_damping}
        given: dict[str, Any] = {name: value for name, value in asked.items() if value is not None}
        if self.coupling == "virtual":
            try:
                return VirtualCoupling(**given)
            except ValueError as error:
                raise UsageError(str(error)) from None
        for name in given:
            raise UsageError(f"--coupling-{name} is for --coupling virtual; a rigid one has none")
        return None

    def settings(self) -> dict[str, Any]:
        """Return the numbers and names of the scene, for a report."""
        found = {field.name: getattr(self, field.name) for field in fields(self)}
        del found["name"], found["mesh"]
        return found | {
            "material": asdict(self.material),
            "cut": asdict(self.cut),
            "blade": None if self.blade is None else asdict(self.blade),
        }


def _liver_lobe() -> TetrahedralMesh:
    from tissue import liver_lobe  # loads numba

    return liver_lobe()


def _specimen(name: str) -> Scene:
    """Return the scene in which the specimen of a material by name is cut in two."""
    specimen = SPECIMENS[name]
    return Scene(
        name,
        specimen.about,
        specimen.mesh,
        material=MATERIALS[name].material,
        fixed=specimen.fixed,
        stretch=specimen.stretch,
        speed=specimen.speed,
        arm=specimen.arm,
        blade=SCALPEL if specimen.has_scalpel else None,
    )


SCENES = {
    scene.name: scene
    for scene in (
        Scene(
            "organ",
            "an organ of some 5,000 tetrahedra, 90 x 60 x 30 mm",
            _liver_lobe,
            material=PARENCHYMA,
        ),
        Scene(
            "incision",
            "liver as published, on its underside; a scalpel is drawn along it, 8 mm deep",
            _liver_lobe,
            material=MATERIALS["liver"].material,
            fixed="underside",
            stretch=0.0,
            stroke="incision",
        ),
        *map(_specimen, SPECIMENS),
        Scene(
            "slab",
            "the paper's Figure 10: 4 x 6 x 4 cells, 576 tetrahedra",
            lambda: block((4, 6, 4), (0.04, 0.06, 0.04)),
            blade=None,
        ),
        Scene(
            "grid2",
            "the paper's Figure 12 a: 2 x 2 x 2 cells, 48 tetrahedra",
            lambda: block((2, 2, 2), (0.04, 0.04, 0.04)),
            blade=None,
        ),
        Scene(
            "grid7",
            "the paper's Figure 12 b: 7 x 7 x 7 cells, 2,058 tetrahedra",
            lambda: block((7, 7, 7), (0.04, 0.04, 0.04)),
            blade=None,
        ),
    )
}
"""The scenes that come with the project, by name."""

DEFAULT_SCENE = "organ"


def scene_called(name: str) -> Scene:
    """Return the scene of that name.

    Raises:
        UsageError: there is none; the message lists them.
    """
    if name not in SCENES:
        raise unknown("scene", name, SCENES)
    return SCENES[name]


def mesh_scene(path: Path, scale: float = 1.0) -> Scene:
    """Return a scene around a mesh from a file, named after it. The file is read once, here.

    Raises:
        MeshError: the file holds no mesh that could be cut.
        UsageError: the scale is not a positive number.
    """
    if not (np.isfinite(scale) and scale > 0.0):
        raise UsageError(
            f"--scale is {scale}; it must be positive: the metres in one unit of {path}"
        )
    from tissue import read_mesh  # loads numba

    mesh = read_mesh(path, scale)
    return Scene(path.stem, f"the mesh {path.name}", lambda: mesh, material=GEL)


def scene_of(link: TissueLink) -> Scene:
    """Return a scene around a body that already exists.

    Raises:
        LinkError: the body is in another process, and cannot be reached.
    """
    body = link.describe()
    known = SCENES.get(body.scene)
    if known is not None:
        return replace(known, material=body.material)
    rest = link.snapshot()
    mesh = TetrahedralMesh(rest.rest_positions, rest.tetrahedra)
    return Scene(body.scene, f"the body '{body.scene}'", lambda: mesh, material=body.material)


def check_motion(scene: Scene) -> None:
    """Check that stroke and arm of a scene exist.

    Raises:
        UsageError: the stroke is neither a known name nor a CSV file, or the arm is unknown.
    """
    read_stroke(scene)
    if scene.arm not in ARM_CHOICES:
        raise unknown("arm", scene.arm, ARM_CHOICES)


def read_stroke(scene: Scene) -> Stroke | None:
    """Return the stroke of a CSV file, or None for a stroke that is to be planned.

    Raises:
        UsageError: the stroke is neither a known name nor a CSV file.
    """
    if scene.stroke.lower().endswith(".csv"):
        return from_csv(scene.stroke)
    if scene.stroke not in STROKES:
        raise unknown("stroke", scene.stroke, [*STROKES, "a file ending in .csv"])
    return None


def changed(scene: Scene, **changes: Any) -> Scene:
    """Return the scene with some fields replaced; a change that is None is ignored.

    Names are those of fields of the scene, of its material or of its cut settings. Properties of a
    material change the `material` that is given beside them, else the scene's; another `law` drops
    the parameters of the law before. `snap` sets the
    floor of snapping too: nodes of slivers snap like those of the mean element.

    The stretch of the scene is dropped where other sides are held; one that is given stays, and is
    refused later where nothing can be pulled.
    """
    given = {name: value for name, value in changes.items() if value is not None}
    if given.get("fixed", scene.fixed) != scene.fixed:
        given.setdefault("stretch", 0.0)
    of_scene = {field.name for field in fields(scene)}
    parts = {name: given.pop(name, getattr(scene, name)) for name in ("material", "cut")}
    if "snap" in given:
        snap = given.pop("snap")
        parts["cut"] = replace(parts["cut"], snap=snap, floor=snap)
    for name, part in parts.items():
        properties = {field.name for field in fields(part)} - of_scene
        own = {key: given.pop(key) for key in properties & given.keys()}
        parts[name] = part.changed(**own) if isinstance(part, Material) else replace(part, **own)
    return replace(scene, **given, **parts)
