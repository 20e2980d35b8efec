"""A scene: a body, its material, how it is held, and the strokes through it."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import structs

from bridge import MAX_FRAMES_PER_ANSWER, VirtualCoupling
from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.scene.blade import SCALPEL
from scalpel_sim.scene_parts.choices import (
    ARM_CHOICES,
    COUPLINGS,
    can_audit,
    check_precision,
    check_relaxation,
    check_scheme,
)
from scalpel_sim.scene_parts.own_arm_settings import OwnArm
from scalpel_sim.tables.attachment import AttachmentTable, check_attachment
from scalpel_sim.tables.grasper import GrasperTable, check_graspers
from scalpel_sim.tables.material import given_in
from scalpel_sim.tables.stroke import DEFAULT_SPEED, StrokeTable, check_stroke, stroke_called
from scalpel_sim.tables.view import ViewTable, check_views
from tissue import (
    MATERIALS,
    BladeShape,
    CutSettings,
    Material,
    SolverSettings,
    TetrahedralMesh,
)

GEL = Material(blade_friction=MATERIALS["gelatin"].blade_friction.value)
"""A soft gel that hardly changes its volume, as tetrahedra: what a body is made of, unless another
material is asked for. Its toughness / Young's modulus is 2 mm, the length by which the blade drags
the tissue along before it parts. That must be small against the body, or the blade drags the body
along instead of cutting it."""

DEFAULT_CUT_SETTINGS = CutSettings()
"""How closely cuts follow the blade, unless a scene says otherwise."""

DEFAULT_MASS_SCALING = SolverSettings().mass_scaling or 0.0
"""Angular frequency above which nodes get mass, unless a scene says otherwise [1/s]."""

LONGEST_RUN = 3600.0
"""Longest simulated time that can be asked for [s]: more is taken for a typing error."""

STANDARD_GRAVITY = 9.81
"""Gravity along -z [m/s2]."""


@dataclass(frozen=True)
class Scene:
    """A body, and the stroke that cuts it. Lengths in metres, tissue frame."""

    name: str
    about: str
    """A description in one line."""
    mesh: Callable[[], TetrahedralMesh]
    material: Material = GEL
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
    threads: int = 1
    """Threads that share the loops over the body, with the relaxation global or verlet."""
    stretch: float = 0.05
    """How far opposite held sides are pulled apart before the run, as a fraction of their distance.
    Living tissue is under tension: a slit opens."""
    gravity: float = STANDARD_GRAVITY
    """Gravity along -z [m/s2]."""
    floor: float | None = None
    """Height of a floor on which loose pieces land [m], tissue frame; None: no floor."""
    table: float | None = None
    """Height of the upper side of a table on which the body lies [m], tissue frame; None: none."""
    table_friction: float | None = None
    """Coefficient of friction between the two; None: that of the material."""
    blade: BladeShape | None = SCALPEL
    """The blade as a body; None: a line, as in the paper."""
    audit: bool = False
    """Whether an account of the energy is kept."""
    attachments: Sequence[AttachmentTable] = ()
    """What holds the tissue beside the fixed nodes."""
    strokes: Sequence[StrokeTable] = (StrokeTable(),)
    """What is done with the blade, in turn."""
    arm: str = "auto"
    """`touch`, `premium`, or `auto`: the first of them that reaches."""
    own_arm: OwnArm | None = None
    """An arm of the user's own, in place of those."""
    graspers: Sequence[GrasperTable] = ()
    """Other arms, each with a grasper, and what they do."""
    views: Sequence[ViewTable] = ()
    """Where pages and pictures look at it from, the first of them at the start; none: from beside
    the arms."""
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
    seconds: float | None = None
    """How long to simulate [s]; None: the strokes and a rest."""

    def __post_init__(self) -> None:
        """Refuse names and numbers that make no sense.

        Raises:
            UsageError: stretch, gravity, mass scaling or a number of the coupling is out of range;
                there is no such scheme, relaxation, precision, contact, arm, coupling or stroke; an
                audit of a relaxation that has none.
        """
        check_scheme(self.scheme)
        check_relaxation(self.relaxation, self.threads)
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
        if self.seconds is not None and not 0.0 < self.seconds <= LONGEST_RUN:
            raise UsageError(
                f"seconds is {self.seconds}; it must be above 0 and at most {LONGEST_RUN:g}"
            )
        if self.arm not in ARM_CHOICES:
            raise unknown("arm", self.arm, ARM_CHOICES)
        if not self.strokes:
            raise UsageError("the scene has no stroke; give at least one [[stroke]]")
        for i, stroke in enumerate(self.strokes):
            check_stroke(stroke, f"[[stroke]] number {i + 1}")
        for i, attachment in enumerate(self.attachments):
            check_attachment(attachment, f"[[attachment]] number {i + 1}")
        check_graspers(self.graspers)
        check_views(self.views)

    @property
    def stroke(self) -> str:
        """Kinds of the strokes, for a heading."""
        return ", ".join(stroke.kind for stroke in self.strokes)

    @property
    def speed(self) -> float:
        """Highest speed of the blade's tip in a stroke whose speed is given [m/s]."""
        return max(stroke.speed or DEFAULT_SPEED for stroke in self.strokes)

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

    @property
    def recorded_files(self) -> list[Path]:
        """Files of motions that a hand did, which the scene repeats."""
        strokes = [each.file for each in self.strokes if each.kind == "recorded"]
        motions = [each.recorded for each in self.graspers]
        return [Path(file) for file in (*strokes, *motions) if file is not None]

    def settings(self) -> dict[str, Any]:
        """Return the numbers and names of the scene, for a report."""
        found = {field.name: getattr(self, field.name) for field in fields(self)}
        del found["name"], found["mesh"]
        return found | {
            "stroke": self.stroke,
            "attachments": [given_in(attachment) for attachment in self.attachments],
            "strokes": [given_in(stroke) for stroke in self.strokes],
            "graspers": [given_in(grasper) for grasper in self.graspers],
            "views": [given_in(view) for view in self.views],
            "material": asdict(self.material),
            "cut": asdict(self.cut),
            "blade": None if self.blade is None else asdict(self.blade),
            "own_arm": None if self.own_arm is None else asdict(self.own_arm),
        }


def changed(scene: Scene, **changes: Any) -> Scene:
    """Return the scene with some fields replaced; a change that is None is ignored.

    Names are those of fields of the scene, of its material or of its cut settings. Properties of a
    material change the `material` that is given beside them, else the scene's; another `law` drops
    the parameters of the law before. `snap` sets the
    floor of snapping too: nodes of slivers snap like those of the mean element.

    The stretch of the scene is dropped where other sides are held; one that is given stays, and is
    refused later where nothing can be pulled.

    `stroke` is the kind of a stroke, or a CSV file, which replaces those of the scene; `speed` and
    `depth` are those of each.
    """
    given = {name: value for name, value in changes.items() if value is not None}
    if "stroke" in given:
        given["strokes"] = (stroke_called(given.pop("stroke")),)
    of_strokes = {name: given.pop(name) for name in ("speed", "depth") if name in given}
    if of_strokes:
        strokes = given.get("strokes", scene.strokes)
        given["strokes"] = tuple(structs.replace(stroke, **of_strokes) for stroke in strokes)
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
