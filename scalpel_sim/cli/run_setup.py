"""From the command line's options to a run that only has to be started."""

import gc
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, NamedTuple

from bridge import InProcessLink, TcpLink, TissueLink, chosen_key
from scalpel_sim.arm.scalpel import chosen_blade, expect_faces
from scalpel_sim.cli.console import compiling
from scalpel_sim.cli.material_file import read_blade, read_material, warn_of_unused_tables
from scalpel_sim.cli.options import (
    ArmOptions,
    BladeOptions,
    ClientOptions,
    MaterialOptions,
    OutputOptions,
    PrintOptions,
    TissueOptions,
)
from scalpel_sim.cli.prony_series import series_of
from scalpel_sim.errors import UsageError
from scalpel_sim.output.export import check_exports
from scalpel_sim.output.run_folder import check_folder
from scalpel_sim.preparation import prepare
from scalpel_sim.scene_body import check_scene, make_tissue
from scalpel_sim.scene_parts.choices import can_audit
from scalpel_sim.scenes import (
    DEFAULT_SCENE,
    Scene,
    changed,
    check_motion,
    mesh_scene,
    scene_called,
    scene_of,
)
from scalpel_sim.simulation import Simulation
from scalpel_sim.tables.material import material_called
from scalpel_sim.tables.toml import is_toml_file
from scalpel_sim.warm_up import USUAL_SETS, KernelSet, prepare_kernels
from tissue import BladeShape, Material

_log = logging.getLogger("scalpel_sim")

LONGEST_RUN = 3600.0
"""Longest simulated time that can be asked for [s]: more is taken for a typing error."""

_UNKNOWN_TO_CLIENT = frozenset(
    {
        "fixed",
        "stretch",
        "gravity",
        "floor",
        "cut",
        "scheme",
        "relaxation",
        "mass_scaling",
        "precision",
        "contact",
        "threads",
        "blade",
        "audit",
    }
)
"""Settings of a scene that a server knows and does not send."""


class RunOptions(NamedTuple):
    """What the command line asks for, group by group."""

    tissue: TissueOptions
    arm: ArmOptions
    client: ClientOptions
    output: OutputOptions
    printing: PrintOptions


class PreparedRun(NamedTuple):
    """A run that only has to be started."""

    simulation: Simulation
    folder: Path
    settings: dict[str, Any]
    """What the command line and the scene resolved to."""


@contextmanager
def prepared_run(
    name: str | None, options: RunOptions, *, audits: bool = False, relaxation: str | None = None
) -> Iterator[PreparedRun]:
    """Yield the run that the command line asks for, and close the link to the tissue afterwards.

    Args:
        name: The scene; None for the default one.
        options: What the command line asks for.
        audits: Whether an account of the energy is kept where nothing is said of it.
        relaxation: How the motion is advanced where nothing is said of it, and the tissue does not
            stiffen; None: as the scene has it.

    Raises:
        UsageError: options that make no sense, or not together.
        LinkError: the tissue is elsewhere, and cannot be reached.
    """
    seconds, client = options.arm.seconds, options.client
    if seconds is not None and not 0.0 < seconds <= LONGEST_RUN:
        raise UsageError(f"--seconds is {seconds}; it must be above 0 and at most {LONGEST_RUN:g}")
    if client.key is not None and client.connect is None:
        raise UsageError("--key is for a tissue elsewhere; add --connect HOST:PORT, or omit it")
    check_exports(options.output.export)
    if client.connect is None:
        link, scene, settings = _tissue_here(name, options, audits, relaxation)
    else:
        link, scene, settings = _tissue_elsewhere(name, options, client.connect)
    try:
        simulation = prepare(scene, link)
        settings |= {"arm": simulation.arm.preset, "seconds": seconds}
        yield PreparedRun(simulation, _folder(options.output, scene), settings)
    finally:
        link.close()


def _tissue_here(
    name: str | None, options: RunOptions, audits: bool, relaxation: str | None
) -> tuple[TissueLink, Scene, dict[str, Any]]:
    """Make the tissue in this process, after all checks that need none."""
    tissue = options.tissue
    scene = changed(chosen_scene(name, tissue), **_changes_of_scene(options.arm))
    is_free = tissue.solver.relaxation is None and not scene.material.stiffens
    if relaxation is not None and is_free:
        scene = replace(scene, relaxation=relaxation)
    if audits and tissue.solver.audit is None and can_audit(scene.relaxation):
        scene = replace(scene, audit=True)
    check_scene(scene)
    check_folder(_folder(options.output, scene))
    scene, springs = springs_as_asked(scene, tissue.material)
    load_kernels(options.printing, scene)
    _log.info("settling %s", scene.about)
    return InProcessLink(make_tissue(scene), scene.name), scene, scene.settings() | springs


def _tissue_elsewhere(
    name: str | None, options: RunOptions, address: str
) -> tuple[TissueLink, Scene, dict[str, Any]]:
    """Connect to the tissue in another process, and make a scene from what its server describes."""
    tissue = options.tissue
    for group in (tissue.body, tissue.material, tissue.blade, tissue.solver):
        for field in fields(group):
            if getattr(group, field.name) not in (None, False):
                raise UsageError(
                    f"--{field.name.replace('_', '-')} belongs to the tissue, and that is at "
                    f"{address}; give it to `scalpel-sim serve`"
                )
    link = TcpLink(address, key=chosen_key(options.client.key))
    try:
        scene = changed(scene_of(link), **_changes_of_scene(options.arm))
        if name not in (None, scene.name):
            raise UsageError(f"{address} holds '{scene.name}', not '{name}'")
        check_motion(scene)
        check_folder(_folder(options.output, scene))
    except BaseException:
        link.close()
        raise
    settings = {
        key: value for key, value in scene.settings().items() if key not in _UNKNOWN_TO_CLIENT
    }
    return link, scene, settings | {"connect": address}


def springs_as_asked(scene: Scene, options: MaterialOptions) -> tuple[Scene, dict[str, Any]]:
    """Return the scene, calibrated on request, and a report on its springs for the summary.

    Raises:
        UsageError: the scene's law has no springs.
        ValueError: no stiffness of the springs gives the Young's modulus that is asked for.
    """
    if not (options.calibrate or options.spring_error):
        return scene, {}
    if scene.material.law != "springs":
        option = "--calibrate" if options.calibrate else "--spring-error"
        raise UsageError(
            f"{option} is about law springs; law {scene.material.law} is as stiff as asked for on "
            "any mesh. Add --law springs, or omit it"
        )
    from tissue import calibrated, spring_error

    mesh = scene.mesh()
    if options.calibrate:
        scene = replace(scene, material=calibrated(mesh, scene.material))
    error = spring_error(mesh, scene.material)
    return scene, {
        "springs": {
            "young_modulus_pa": error.relaxed.young_modulus,
            "young_modulus_error": error.young_modulus_error,
            "young_modulus_softest_pa": error.softest,
            "young_modulus_stiffest_pa": error.stiffest,
            "poisson_ratio": error.relaxed.poisson_ratio,
            "calibration": scene.material.spring_calibration,
        }
    }


def load_kernels(options: PrintOptions, scene: Scene | None = None) -> None:
    """Load the kernels, which ends the loading; show the progress where they are compiled first.

    Args:
        options: Whether to show it.
        scene: Whose kernels; None: those of the default scene, with and without an account.
    """
    with compiling(options) as on_progress:
        prepare_kernels(USUAL_SETS if scene is None else [KernelSet.of(scene)], on_progress)
    gc.enable()


def _changes_of_scene(arm: ArmOptions) -> dict[str, Any]:
    """Return the options of the arm that are fields of the scene."""
    return {
        name: getattr(arm, name)
        for name in (
            "stroke",
            "speed",
            "arm",
            "tissue_every",
            "coupling",
            "coupling_stiffness",
            "coupling_damping",
            "passivity",
        )
    }


def _folder(output: OutputOptions, scene: Scene) -> Path:
    """Return the folder of the files."""
    return output.out or Path("out") / scene.name


def chosen_scene(name: str | None, options: TissueOptions) -> Scene:
    """Return the scene, or one around the user's mesh, with the changes that the user asks for.

    Raises:
        MeshError: the mesh cannot be cut.
        UsageError: there is no such scene, or options that make no sense together.
        ValueError: a number is out of its range.
    """
    body, solver = options.body, options.solver
    scene = _scene_or_mesh(name, body.mesh, body.scale)
    _warn_of_unused_tables(options)
    blade = _blade_as_asked(scene.blade, options.blade)
    expect_faces(blade, vars(options.material))
    return replace(
        changed(
            scene,
            fixed=body.fix,
            material=_material_as_asked(scene.material, options.material),
            scheme=solver.scheme,
            relaxation=solver.relaxation,
            mass_scaling=solver.mass_scaling,
            precision=solver.precision,
            contact=solver.contact,
            threads=solver.threads,
            snap=solver.snap,
            guard=solver.guard,
            stretch=body.stretch,
            gravity=body.gravity,
            floor=body.floor,
            audit=solver.audit,
        ),
        blade=blade,
    )


def _scene_or_mesh(name: str | None, mesh: Path | None, scale: float | None) -> Scene:
    """Return the scene of that name, or one around a mesh."""
    if mesh is None:
        if scale is not None:
            raise UsageError("--scale is for a --mesh; the scenes come in metres")
        return scene_called(name or DEFAULT_SCENE)
    if name is not None:
        raise UsageError(f"both the scene '{name}' and --mesh {mesh} are given; choose one")
    return mesh_scene(mesh, 1.0 if scale is None else scale)


def _warn_of_unused_tables(options: TissueOptions) -> None:
    """Log a warning where a file has a table that no option asks for."""
    name = options.material.material
    is_file = name is not None and is_toml_file(name)
    # A material by name is a choice, which a `[material]` beside the blade does not question.
    if name is None or is_file:
        warn_of_unused_tables(Path(name) if name is not None else None, options.blade.blade)


def _material_as_asked(usual: Material, options: MaterialOptions) -> Material:
    """Return the material of that name or file, else the usual one, with single numbers replaced.

    Raises:
        UsageError: no such material or file, or numbers that make no sense together.
    """
    numbers = {
        "law": options.law,
        "young_modulus": options.young,
        "poisson_ratio": options.poisson_ratio,
        "stiffening": options.stiffening,
        "yeoh_second": options.yeoh_second,
        "yeoh_third": options.yeoh_third,
        "prony": None if options.prony is None else series_of(options.prony),
        "density": options.density,
        "toughness": options.toughness,
        "skin_toughness": options.skin_toughness,
        "toughness_exponent": options.toughness_exponent,
        "toughness_speed": options.toughness_speed,
        "work_to_rupture": options.work_to_rupture,
        "friction": options.friction,
        "blade_friction": options.blade_friction,
        "blade_viscosity": options.blade_viscosity,
    }
    given: dict[str, Any] = {key: value for key, value in numbers.items() if value is not None}
    name = options.material
    if name is None:
        return replace(usual, **given)
    if not is_toml_file(name):
        return replace(material_called(name), **given)
    in_file = read_material(Path(name))
    try:
        return replace(usual, **(in_file | given))
    except ValueError as error:
        raise UsageError(f"{name}: {error}") from error


def _blade_as_asked(usual: BladeShape | None, options: BladeOptions) -> BladeShape | None:
    """Return the blade of a file, else the usual one, with single measures replaced.

    Raises:
        UsageError: no such file, or measures that make no sense together.
    """
    measures = {
        "thickness": options.blade_thickness,
        "bevel": options.blade_bevel,
        "height": options.blade_height,
        "edge_radius": options.blade_edge_radius,
    }
    given = {key: value for key, value in measures.items() if value is not None}
    if options.blade is None:
        return chosen_blade(usual, **given)
    in_file = read_blade(options.blade)
    if "bevel_degrees" in in_file:
        in_file["bevel"] = in_file.pop("bevel_degrees")
    if given.get("thickness", in_file.get("thickness")) == 0.0:
        in_file = {"thickness": 0.0}  # a line, on which the other numbers of the file do not act
    try:
        return chosen_blade(usual, **(in_file | given))
    except ValueError as error:
        raise UsageError(f"{options.blade}: {error}") from error
