"""A scene: a body, its material, how it is held, and the strokes through it."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import Any

from msgspec import field, structs, to_builtins

from bridge import VirtualCoupling
from scalpel_sim.errors import UsageError
from scalpel_sim.scene.act_table import ActTable, check_act, hands_led
from scalpel_sim.scene.arm_tables import ArmTable, GrasperTable
from scalpel_sim.scene.blade import blade_of, table_of_blade
from scalpel_sim.scene.body import (
    Bodies,
    GivenBody,
    HeldBodyTable,
    OneOfBodiesTable,
    check_bodies,
    mesh_of_bodies,
    nodes_held,
)
from scalpel_sim.scene.checks import (
    check_arm,
    check_attachment,
    check_grasper,
    check_label,
    check_parts,
    check_range,
    check_rows,
    check_solver,
    check_support,
    check_view,
    virtual_coupling,
)
from scalpel_sim.scene.interfaces import InterfaceTable, check_interfaces, expect_parts
from scalpel_sim.scene.labels import full_name, labelled
from scalpel_sim.scene.materials import given_in, material_in, material_of, naming_table
from scalpel_sim.scene.observe_table import ObserveTable, check_observe
from scalpel_sim.scene.schema import (
    SHIPPED_CAMERAS,
    AttachmentTable,
    BladeTable,
    CoreTable,
    LabelTable,
    LedSupportTable,
    PresetMaterialTable,
    SolverTable,
    ViewTable,
    WorldTable,
)
from scalpel_sim.scene.task_table import TaskTable, check_task
from scalpel_sim.scene.vary_table import VaryTable, check_vary
from scalpel_sim.strokes.kind import StrokeTable, stroke_called
from scalpel_sim.strokes.scene_stroke import check_strokes
from scalpel_sim.tables.values import NameOfScene, Positive, Text, TomlTable
from tissue import MATERIALS, BladeShape, BoolArray, CutSettings, Material, TetrahedralMesh

GEL = Material(blade_friction=MATERIALS["gelatin"].blade_friction.value)
"""A soft gel that barely changes its volume, as tetrahedra: what a body is made of, unless another
material is given. Its toughness / Young's modulus is 2 mm, the length by which the blade drags
the tissue along before it parts. That must be small against the body, or the blade drags the body
along instead of cutting it."""

_Part = int | str | tuple[int | str, int | str] | None
"""A label, None for all others, or two labels with a layer between them."""


class Scene(TomlTable, kw_only=True, frozen=True, dict=True):
    """A scene, as its file has it. Lengths in metres, tissue frame.

    `material` and `blade` are what the engine takes; their tables may name a preset, or be partial.

    Raises:
        UsageError: a name or a number makes no sense, alone or with another.
    """

    name: NameOfScene = ""
    """Name of the scene; that of its file without."""
    about: Text = ""
    """A description in one line."""
    seconds: Positive | None = None
    """Time to simulate [s; default: the strokes and 0.3 s more]."""
    body: Bodies
    """The geometry, and how it is held: one body, or the rows of several."""
    material_table: PresetMaterialTable | None = field(default=None, name="material")
    """The material; a soft gel without."""
    labels: tuple[LabelTable, ...] = field(default=(), name="label")
    """Parts of the body, each with a name, and with a material of its own."""
    interfaces: tuple[InterfaceTable, ...] = field(default=(), name="interface")
    """Layers between parts of the body, along which it dissects."""
    blade_table: BladeTable = field(default_factory=BladeTable, name="blade")
    """The blade; a scalpel without."""
    world: WorldTable = field(default_factory=WorldTable)
    """Surroundings of the body."""
    solver: SolverTable = field(default_factory=SolverTable)
    """Methods that cut the mesh and compute the motion."""
    arm: ArmTable = field(default_factory=ArmTable)
    """The arm, and how it is coupled to the tissue."""
    attachments: tuple[AttachmentTable, ...] = field(default=(), name="attachment")
    """Attachments that hold the tissue besides the fixed nodes."""
    cores: tuple[CoreTable, ...] = field(default=(), name="core")
    """Rigid cores inside the tissue."""
    supports: tuple[LedSupportTable, ...] = field(default=(), name="support")
    """Held sides that move."""
    graspers: tuple[GrasperTable, ...] = field(default=(), name="grasper")
    """Other arms, each with a grasper, and what they do."""
    strokes: tuple[StrokeTable, ...] = field(default=(StrokeTable(),), name="stroke")
    """Strokes of the blade, in turn."""
    views: tuple[ViewTable, ...] = field(default=(), name="view")
    """Where pages and pictures show it from, the first of them at the start."""
    task: TaskTable | None = None
    """The task that a run is scored by; without, it has no score."""
    act: ActTable | None = None
    """The actions of a policy. A script or a hand ignores it, and the two that follow."""
    observe: ObserveTable | None = None
    """Quantities and pictures that a policy is shown."""
    vary: tuple[VaryTable, ...] = ()
    """Numbers that are drawn for each episode of a policy."""

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        check_bodies(self.body)
        check_parts([body.name for body in self.bodies], self._rows_of_parts)
        check_strokes(self.strokes)
        check_solver(self.solver, self.material)
        _ = self.cut, self.blade  # they check themselves
        check_range(self.stretched_by, self.world.free_fall, self.seconds)
        check_arm(self.arm, self.world)
        _ = self.materials
        check_rows("label", self.labels, check_label)
        check_interfaces(self.interfaces)
        check_rows("attachment", self.attachments, check_attachment)
        check_rows("support", self.supports, check_support)
        check_rows("grasper", self.graspers, check_grasper)
        check_rows("view", self.views, check_view)
        names = [each.name for each in self.graspers]
        check_task(self.task, names)
        check_act(self.act, names)
        check_observe(self.observe, names, self._cameras, has_task=self.task is not None)
        hands = hands_led(self.act or ActTable(), names)
        layers = [row.between for row in self.interfaces]
        seen_by = [row.name for row in (self.observe or ObserveTable()).cameras]
        check_vary(self.vary, hands, layers, seen_by, self.task)

    @property
    def bodies(self) -> tuple[OneOfBodiesTable, ...]:
        """The bodies, where there are several; none where there is one."""
        return () if isinstance(self.body, HeldBodyTable) else self.body

    @property
    def stretched_by(self) -> float:
        """Fraction by which opposite held sides are pulled apart: none of several bodies."""
        return self.body.stretched_by if isinstance(self.body, HeldBodyTable) else 0.0

    @property
    def _cameras(self) -> tuple[str, ...] | None:
        """Names of all cameras; None where a model of the user's own may have more."""
        models = (self.arm.model, *(each.model for each in self.graspers))
        if any(model is not None for model in models):
            return None
        return (*(view.name for view in self.views), *SHIPPED_CAMERAS)

    @property
    def _rows_of_parts(self) -> dict[str, Sequence[TomlTable]]:
        """Rows that may name one of several bodies, by the name of their array."""
        return {
            "label": self.labels,
            "attachment": self.attachments,
            "core": self.cores,
            "support": self.supports,
        }

    @cached_property
    def material(self) -> Material:
        """Material of the body; of several bodies without `[material]` that of the first."""
        if self.material_table is None and self.bodies:
            return self.material_of_body(self.bodies[0])
        return self._usual_material

    @cached_property
    def _usual_material(self) -> Material:
        """Material of `[material]`; a soft gel without."""
        table = self.material_table
        if table is None:
            return GEL
        return naming_table("[material]", lambda: material_of(table))

    @cached_property
    def materials(self) -> Material | dict[int | str | None, Material]:
        """Material of the body; or, where parts have their own, of each and of the rest (None)."""
        own: dict[int | str | None, Material] = {
            body.name: self.material_of_body(body) for body in self.bodies
        }
        usual: dict[int | str | None, Material] = {} if own else {None: self.material}
        own |= {full_name(row): self._material_of_label(row) for row in self.labels if row.material}
        return usual | own if own else self.material

    @property
    def all_materials(self) -> tuple[Material, ...]:
        """Each material of the body once."""
        materials = self.materials
        found = (materials,) if isinstance(materials, Material) else materials.values()
        return tuple(dict.fromkeys(found))

    @property
    def materials_and_layers(self) -> Material | dict[_Part, Material | float]:
        """The materials, and the toughness of layers between two labels [J/m2], for the tissue."""
        materials = self.materials
        if isinstance(materials, Material) and not self.interfaces:
            return materials
        found: dict[_Part, Material | float] = {None: self.material}
        if not isinstance(materials, Material):
            found.update(materials.items())
        found.update((row.between, row.toughness) for row in self.interfaces)
        return found

    def material_of_body(self, body: OneOfBodiesTable) -> Material:
        """Return the material of one of several bodies."""
        return material_in(f"[[body]] '{body.name}'", body.material, self._usual_material)

    def _material_of_label(self, row: LabelTable) -> Material:
        owner = next((body for body in self.bodies if body.name == row.body), None)
        usual = self.material if owner is None else self.material_of_body(owner)
        return material_in(f"[[label]] '{row.name}'", row.material, usual)

    @cached_property
    def blade(self) -> BladeShape | None:
        """The blade as a body; None: a line, as in the paper."""
        return naming_table("[blade]", lambda: blade_of(self.blade_table))

    @cached_property
    def cut(self) -> CutSettings:
        """Settings that weigh how closely cuts follow the blade against small elements."""
        given = self.solver
        floor = given.snap if given.snap_floor is None else given.snap_floor
        settings = {"snap": given.snap, "floor": floor, "guard": given.guard, "crumb": given.crumb}
        return naming_table("[solver]", lambda: CutSettings(**settings))

    def mesh(self) -> TetrahedralMesh:
        """Return the mesh of the body, or of all bodies.

        Raises:
            MeshError: it cannot be cut.
            ValueError: there can be no such body.
        """
        return self._labelled_mesh

    @cached_property
    def _labelled_mesh(self) -> TetrahedralMesh:
        mesh = labelled(mesh_of_bodies(self.body), self.labels, self.bodies)
        expect_parts(mesh, "interface", [row.between for row in self.interfaces])
        expect_parts(mesh, "vary", [(row.label,) if row.label else () for row in self.vary])
        return mesh

    def held_nodes(self) -> BoolArray:
        """Return which nodes of the mesh are held, shape (n_nodes,).

        Raises:
            ValueError: no node is where it is to be held.
        """
        return nodes_held(self.body, self.mesh())

    @property
    def stroke(self) -> str:
        """Kinds of the strokes, for a heading."""
        return ", ".join(stroke.kind for stroke in self.strokes)

    @property
    def speed(self) -> float:
        """Highest speed of the blade's tip in a stroke whose speed is given [m/s]."""
        return max(stroke.tip_speed for stroke in self.strokes)

    def virtual_coupling(self) -> VirtualCoupling | None:
        """Return the coupling of the arm's blade to the one that cuts; None where they are one."""
        return virtual_coupling(self.arm)

    @property
    def recorded_files(self) -> list[Path]:
        """Files of motions that a hand did, which the scene repeats."""
        strokes = [each.file for each in self.strokes]
        motions = [each.recorded for each in self.graspers]
        return [Path(file) for file in (*strokes, *motions) if file is not None]

    def settings(self) -> dict[str, Any]:
        """Return the numbers and names of the scene, for a report."""
        world, solver, arm = self.world, self.solver, self.arm
        own = _values(arm, "model", "mount", "heel", "tip", "forward", "force", "torque")
        return {
            "about": self.about,
            "material": self.material.as_keys(),
            "labels": [self._settings_of_label(row) for row in self.labels],
            "interfaces": [given_in(row) for row in self.interfaces],
            "bodies": [self._settings_of_body(body) for body in self.bodies],
            "fixed": None if isinstance(self.body, tuple) else self.body.fixed,
            "cut": asdict(self.cut),
            **_values(
                solver, "scheme", "relaxation", "mass_scaling", "element", "precision", "threads"
            ),
            "stretch": self.stretched_by,
            **_values(world, "gravity", "floor", "table", "table_friction"),
            "blade": None if self.blade is None else asdict(self.blade),
            "audit": solver.audit,
            "attachments": [given_in(attachment) for attachment in self.attachments],
            "cores": [given_in(core) for core in self.cores],
            "supports": [given_in(support) for support in self.supports],
            "strokes": [given_in(stroke) for stroke in self.strokes],
            "arm": arm.preset,
            "own_arm": None if arm.model is None else own | _values(world, "pos", "quat"),
            "graspers": [given_in(grasper) for grasper in self.graspers],
            "views": [given_in(view) for view in self.views],
            "task": None if self.task is None else to_builtins(self.task),
            "act": None if self.act is None else to_builtins(self.act),
            "observe": None if self.observe is None else to_builtins(self.observe),
            "vary": [given_in(row) for row in self.vary],
            **_values(arm, "tissue_every", "coupling", "coupling_stiffness", "coupling_damping"),
            "passivity": arm.passivity,
            "seconds": self.seconds,
            "stroke": self.stroke,
        }

    def _settings_of_label(self, row: LabelTable) -> dict[str, Any]:
        """Return what a report has of a label: its material as numbers, where it has its own."""
        material = None if row.material is None else self._material_of_label(row).as_keys()
        return {"name": full_name(row), "spare": row.spare, "material": material}

    def _settings_of_body(self, body: OneOfBodiesTable) -> dict[str, Any]:
        """Return what a report has of one of several bodies: its material as numbers."""
        material = self.material_of_body(body).as_keys()
        return _values(body, "name", "shape", "pos", "quat", "fixed", "weld") | {
            "material": material
        }


def _values(table: TomlTable, *keys: str) -> dict[str, Any]:
    """Return some keys of a table, with their values."""
    return {key: getattr(table, key) for key in keys}


def changed(scene: Scene, **changes: Any) -> Scene:
    """Return a scene with some of it replaced.

    Names are those of fields of the scene, of its `[body]`, `[world]`, `[solver]` and `[arm]`, and
    of its material. Properties of a material change the `material` that is given besides, else the
    scene's; another `law` drops the parameters of the law before.

    The stretch of the scene is dropped where other sides are held; one that is given stays, and is
    refused later where nothing can be pulled.

    `mesh` makes the mesh of another body, which is held as before. `stroke` is the kind of a
    stroke, or a CSV file, which replaces those of the scene; `speed` and `depth` are those of each.
    """
    given = dict(changes)
    properties = scene.material.as_keys().keys() & given.keys()
    if properties or "material" in given:
        material = given.pop("material", scene.material)
        material = material.changed(**{name: given.pop(name) for name in properties})
        given["material_table"] = PresetMaterialTable(**material.as_keys())
    if isinstance(scene.body, tuple):
        _refuse_of_one_body(given)
    else:
        if "mesh" in given:
            fixed, stretch = scene.body.fixed, scene.body.stretch
            given["body"] = GivenBody(source=given.pop("mesh"), fixed=fixed, stretch=stretch)
        if given.get("fixed", scene.body.fixed) != scene.body.fixed:
            given.setdefault("stretch", 0.0)
    if "blade" in given:
        given["blade_table"] = table_of_blade(given.pop("blade"))
    if "stroke" in given:
        given["strokes"] = (stroke_called(given.pop("stroke")),)
    of_strokes = {name: given.pop(name) for name in ("speed", "depth") if name in given}
    if of_strokes:
        strokes = given.get("strokes", scene.strokes)
        given["strokes"] = tuple(structs.replace(stroke, **of_strokes) for stroke in strokes)
    for name in ("body", "world", "solver", "arm"):
        table = given.get(name, getattr(scene, name))
        if isinstance(table, tuple):  # several bodies
            continue
        own = {key: given.pop(key) for key in table.__struct_fields__ if key in given}
        if own:
            given[name] = structs.replace(table, **own)
    return Scene(**structs.asdict(scene) | given)  # which checks itself


def _refuse_of_one_body(changes: Mapping[str, Any]) -> None:
    """Refuse changes of the one body of a scene that has several.

    Raises:
        UsageError: there is one.
    """
    for name in ("mesh", *HeldBodyTable.__struct_fields__):
        if name in changes:
            raise UsageError(
                f"{name} is of one body, and the scene has several: change the rows of [[body]]"
            )
