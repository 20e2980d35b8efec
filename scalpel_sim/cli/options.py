"""The options of the command line about a scene, in the groups that `--help` shows.

Each group is a dataclass that several commands share. Options that are keys of a scene are made
from its schema. One that is not given is None, and leaves what the scene has.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass, make_dataclass, replace
from pathlib import Path
from typing import Annotated, Any, TypeVar, cast, get_args, get_origin

import msgspec
from cyclopts import Group, Parameter

from scalpel_sim.errors import UsageError
from scalpel_sim.runs.options import Flag
from scalpel_sim.scene.read import TASK_SCENES
from scalpel_sim.scene.scene import Scene
from scalpel_sim.scene.schema import BladeTable, MaterialTable, SolverTable
from scalpel_sim.strokes.kinds import STROKES
from scalpel_sim.tables.key_texts import has_usual, texts_of, usual_text, with_note
from scalpel_sim.tables.problems import alternatives, table_of

SceneName = Annotated[
    str | None,
    Parameter(
        help="organ (default), incision, retract, excise, taut_incision, layers, tumour, "
        "gallbladder, a specimen of a material (liver, kidney, skin, fat, muscle, gelatin, "
        f"silicone), slab, grid2 or grid7; a task ({', '.join(TASK_SCENES)}); or a FILE.toml, "
        "which the command `new` writes."
    ),
]

_SCENE = Group("Scene", sort_key=0)
_BODY = Group("Body", sort_key=1)
_MATERIAL = Group("Material", sort_key=2)
_BLADE = Group("Blade", sort_key=3)
_SOLVER = Group("Solver", sort_key=4)
_ARM = Group("Arm", sort_key=5)


KEYS_OF_GROUP = {
    _BODY: {
        "fix": "body.fixed",
        "stretch": "body.stretch",
        "gravity": "world.gravity",
        "floor": "world.floor",
    },
    _MATERIAL: {
        {"young_modulus": "young"}.get(key, key): f"material.{key}"
        for key in MaterialTable.__struct_fields__
        if key not in ("preset", "viscous_damping", "retardation_time", "spring_calibration")
    },
    _BLADE: {
        {"bevel_degrees": "blade_bevel"}.get(key, f"blade_{key}"): f"blade.{key}"
        for key in BladeTable.__struct_fields__
    },
    _SOLVER: {
        key: f"solver.{key}"
        for key in SolverTable.__struct_fields__
        if key not in ("snap_floor", "crumb")
    },
    _ARM: {
        "arm": "arm.preset",
        "tissue_every": "arm.tissue_every",
        "coupling": "arm.coupling",
        "coupling_stiffness": "arm.coupling_stiffness",
        "coupling_damping": "arm.coupling_damping",
        "passivity": "arm.passivity",
        "seconds": "seconds",
    },
}
"""Options that are keys of a scene, in each group, and the key of each."""

KEY_OF = {option: key for keys in KEYS_OF_GROUP.values() for option, key in keys.items()}
"""Key of each of these options."""

_AS_OPTION = {
    "gravity": " On the command line X,Y,Z.",
    "prony": " On the command line G:TAU of each term, such as 0.3:0.1,0.2:5.",
}
"""Text of the help of an option besides that of its key."""

_WITH_USUAL = ("solver", "arm")
"""Tables whose keys have a usual value that few scenes replace: help shows it."""

PLANNED_STROKES = [name for name, kind in STROKES.items() if kind.is_planned]
"""Kinds of strokes that need no key but their name."""

_Options = TypeVar("_Options")


def with_keys(group: Group) -> Callable[[type[_Options]], type[_Options]]:
    """Return a decorator that adds the options of a group that are keys of a scene.

    Each is made from its key in the schema; one that is not given is None.
    """

    def added(options: type[_Options]) -> type[_Options]:
        made = make_dataclass(
            options.__name__,
            [
                (option, _option_of(option, key), None)
                for option, key in KEYS_OF_GROUP[group].items()
            ],
            bases=(options,),
            frozen=True,
        )
        made.__doc__, made.__module__ = options.__doc__, options.__module__
        return cast(type[_Options], Parameter(name="*", group=group)(made))

    return added


def _option_of(option: str, key: str) -> Any:
    """Return the type of an option, with its help."""
    *tables, name = key.split(".")
    kinds: Any = {field.encode_name: field for field in msgspec.structs.fields(Scene)}
    table = table_of(kinds[tables[0]].type) if tables else Scene
    assert table is not None
    (field,) = (each for each in msgspec.structs.fields(table) if each.encode_name == name)
    text = texts_of(table)[field.name] + _AS_OPTION.get(option, "")
    if tables and tables[0] in _WITH_USUAL and "default" not in text and has_usual(field):
        text = with_note(text, f"default: {usual_text(field.default)}")
    return Annotated[_plain(field.type) | None, Parameter(help=text)]


def _plain(kind: Any) -> type:
    """Return the type of an option whose value a key holds."""
    only = alternatives(kind)[0]
    plain = get_args(only)[0] if get_origin(only) is Annotated else only
    return plain if plain in (float, int, bool) else str


@with_keys(_BODY)
@dataclass(frozen=True)
class BodyOptions:
    """The body, and the sides at which it is held."""

    mesh: Path | None = None
    "Cut this tetrahedral mesh instead of a scene: Gmsh, VTK, Medit, TetGen, Abaqus or Nastran."
    scale: float | None = None
    "Metres in one unit of the mesh file: 0.001 for millimetres."


@with_keys(_MATERIAL)
@dataclass(frozen=True)
class MaterialOptions:
    """The material of the body. Single numbers override those of `--material`."""

    material: str | None = None
    """Name of a material (liver, kidney, skin, fat, muscle, gelatin, silicone), or a FILE.toml. The
    command `materials` lists the names and writes a file to start from."""
    label: Annotated[tuple[str, ...], Parameter(name="--label", negative="")] = ()
    """Material of a part of the body, by the number or the name that its label has in the scene or
    the mesh file: 2=fat, or vessel=mine.toml. May be given several times."""
    calibrate: Flag = False
    "Measure the springs on this mesh first, and make them as stiff as requested. Law springs only."
    spring_error: Flag = False
    "Report how far springs on this mesh are from the material that they stand for."


@with_keys(_BLADE)
@dataclass(frozen=True)
class BladeOptions:
    """The blade. Single numbers override those of `--blade`."""

    blade: Path | None = None
    "Take the measures of the blade from this FILE.toml, which `materials --write` makes."


@with_keys(_SOLVER)
@dataclass(frozen=True)
class SolverOptions:
    """Methods that cut the mesh and compute the motion."""


@with_keys(_ARM)
@dataclass(frozen=True)
class ArmOptions:
    """The arm, the path of its blade, and how it is coupled to the tissue."""

    stroke: Annotated[
        str | None,
        Parameter(
            help=f"Path of the blade: {', '.join(PLANNED_STROKES)}, or a CSV file of poses over "
            "time. A scene file has others, and several in turn."
        ),
    ] = None
    speed: float | None = None
    "Speed of the blade along the stroke [m/s]."


@Parameter(name="*")
@dataclass(frozen=True)
class TissueOptions:
    """Options for the process that holds the tissue: body, material, blade and solver."""

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


def with_values(options: _Options, **values: Any) -> _Options:
    """Return options with the values of some that are made from the schema."""
    return replace(options, **values)  # type: ignore[type-var]


def given_options(group: Any) -> Iterator[str]:
    """Yield the names of the options of a group that are given, as the command line has them."""
    for field in fields(group):
        value = getattr(group, field.name)
        if is_dataclass(value):
            yield from given_options(value)
        elif value != field.default:
            yield "set" if field.name == "settings" else field.name.replace("_", "-")


def expect_no_options(groups: Sequence[Any], what: str) -> None:
    """Check that no option of some groups is given.

    Args:
        groups: The groups.
        what: What says it already, for the message.

    Raises:
        UsageError: one is given; the message names it.
    """
    for group in groups:
        for name in given_options(group):
            raise UsageError(f"--{name} is given with {what}; omit one of them")
