"""From the command line's options to a run that only has to be started."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, NamedTuple

from bridge import InProcessLink, TcpLink, TissueLink
from bridge.tcp.keys import chosen_key
from scalpel_sim.arm.scalpel import chosen_blade, expect_faces
from scalpel_sim.cli.console import say
from scalpel_sim.cli.options import Body, Motion, Talk
from scalpel_sim.errors import UsageError
from scalpel_sim.output.export import check_exports
from scalpel_sim.output.run_folder import check_folder
from scalpel_sim.preparation import prepare
from scalpel_sim.scene_body import check, make_tissue
from scalpel_sim.scenes import (
    DEFAULT_SCENE,
    Scene,
    changed,
    check_motion,
    has_account,
    material_called,
    mesh_scene,
    scene_called,
    scene_of,
)
from scalpel_sim.simulation import Simulation
from scalpel_sim.warm_up import kernels_are_compiled, warm_up

_log = logging.getLogger("scalpel_sim")

LONGEST_RUN = 3600.0
"""[s] of simulated time: more is a slip of the keyboard."""


class Ready(NamedTuple):
    """A run that only has to be started."""

    simulation: Simulation
    folder: Path
    settings: dict[str, Any]
    """What the command line and the scene resolved to."""


@contextmanager
def ready_run(
    name: str | None, body: Body, motion: Motion, talk: Talk, *, audits: bool = False
) -> Iterator[Ready]:
    """Yield the run that the command line asks for, and let go of the tissue afterwards.

    `audits` says whether an account of the energy is kept where nothing is said of it.
    """
    if motion.seconds is not None and not 0.0 < motion.seconds <= LONGEST_RUN:
        raise UsageError(
            f"--seconds is {motion.seconds}; it must be above 0 and at most {LONGEST_RUN:g}"
        )
    if motion.key is not None and motion.connect is None:
        raise UsageError(
            "--key is for a tissue elsewhere; add --connect HOST:PORT, or leave it away"
        )
    check_exports(motion.export)
    if motion.connect is None:
        link, scene, settings = _tissue_here(name, body, motion, talk, audits)
    else:
        link, scene, settings = _tissue_elsewhere(name, body, motion, talk)
    try:
        simulation = prepare(scene, link)
        settings |= {"arm": simulation.arm.preset, "seconds": motion.seconds}
        yield Ready(simulation, _folder(motion, scene), settings)
    finally:
        link.close()


def _tissue_here(
    name: str | None, body: Body, motion: Motion, talk: Talk, audits: bool
) -> tuple[TissueLink, Scene, dict[str, Any]]:
    """Make the tissue in this process, after all checks that need none."""
    scene = changed(chosen_scene(name, body), **_given(motion))
    if audits and body.audit is None and has_account(scene.relaxation, scene.threads):
        scene = replace(scene, audit=True)
    check(scene)
    check_folder(_folder(motion, scene))
    scene, springs = springs_as_asked(scene, body)
    load_kernels(talk)
    _log.info("settling %s", scene.about)
    return InProcessLink(make_tissue(scene), scene.name), scene, scene.settings() | springs


def _tissue_elsewhere(
    name: str | None, body: Body, motion: Motion, talk: Talk
) -> tuple[TissueLink, Scene, dict[str, Any]]:
    """Reach the tissue in another process, and take the scene from what it says of itself."""
    assert motion.connect is not None
    for field in fields(body):
        if getattr(body, field.name) not in (None, False):
            raise UsageError(
                f"--{field.name.replace('_', '-')} belongs to the tissue, and that is at "
                f"{motion.connect}; give it to `scalpel-sim serve`"
            )
    link = TcpLink(motion.connect, key=chosen_key(motion.key))
    try:
        scene = changed(scene_of(link), **_given(motion))
        if name not in (None, scene.name):
            raise UsageError(f"{motion.connect} holds '{scene.name}', not '{name}'")
        check_motion(scene)
        check_folder(_folder(motion, scene))
    except BaseException:
        link.close()
        raise
    elsewhere = {
        "fixed",
        "stretch",
        "gravity",
        "floor",
        "quality",
        "scheme",
        "relaxation",
        "threads",
        "blade",
        "audit",
    }  # the server knows, and does not say
    settings = {key: value for key, value in scene.settings().items() if key not in elsewhere}
    return link, scene, settings | {"connect": motion.connect}


def springs_as_asked(scene: Scene, body: Body) -> tuple[Scene, dict[str, Any]]:
    """Return the scene, calibrated if that is asked for, and for its report what its springs are.

    Raises:
        UsageError: the scene's law has no springs.
        ValueError: no stiffness of the springs is what is asked for.
    """
    if not (body.calibrate or body.spring_error):
        return scene, {}
    if scene.material.law != "springs":
        option = "--calibrate" if body.calibrate else "--spring-error"
        raise UsageError(
            f"{option} is about law springs; law {scene.material.law} is as stiff as asked for on "
            "any mesh. Add --law springs, or leave it away"
        )
    from tissue.elasticity.spring_calibration import calibrated, spring_error

    mesh = scene.mesh()
    if body.calibrate:
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


def load_kernels(talk: Talk) -> None:
    """Load the kernels; where they must be compiled first, say why nothing seems to happen."""
    if not talk.quiet and not kernels_are_compiled():
        say("compiling kernels, first run only (about a minute)")
    warm_up()


def _given(motion: Motion) -> dict[str, Any]:
    """Return what of the motion is a field of the scene."""
    return {
        name: getattr(motion, name)
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


def _folder(motion: Motion, scene: Scene) -> Path:
    """Return where the files go."""
    return motion.out or Path("out") / scene.name


def chosen_scene(name: str | None, body: Body) -> Scene:
    """Return the scene or the user's mesh, with what the user changed about it."""
    if body.mesh is None:
        if body.scale is not None:
            raise UsageError("--scale is for a --mesh; the scenes come in metres")
        scene = scene_called(name or DEFAULT_SCENE)
    elif name is not None:
        raise UsageError(f"both the scene '{name}' and --mesh {body.mesh} are given; choose one")
    else:
        scene = mesh_scene(body.mesh, 1.0 if body.scale is None else body.scale)
    scene = changed(
        scene,
        fixed=body.fix,
        material=None if body.material is None else material_called(body.material),
        law=body.law,
        young_modulus=body.young,
        poisson_ratio=body.poisson_ratio,
        density=body.density,
        toughness=body.toughness,
        skin_toughness=body.skin_toughness,
        toughness_exponent=body.toughness_exponent,
        toughness_speed=body.toughness_speed,
        work_to_rupture=body.work_to_rupture,
        blade_friction=body.blade_friction,
        blade_viscosity=body.blade_viscosity,
        scheme=body.scheme,
        relaxation=body.relaxation,
        threads=body.threads,
        snap=body.snap,
        guard=body.guard,
        stretch=body.stretch,
        gravity=body.gravity,
        friction=body.friction,
        floor=body.floor,
        audit=body.audit,
    )
    blade = chosen_blade(
        scene.blade,
        thickness=body.blade_thickness,
        bevel=body.blade_bevel,
        height=body.blade_height,
        edge_radius=body.blade_edge_radius,
    )
    expect_faces(blade, vars(body))
    return replace(scene, blade=blade)
