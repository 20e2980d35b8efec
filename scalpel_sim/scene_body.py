"""A scene's body: held, pulled, and settled."""

import logging

import numpy as np

from scalpel_sim.errors import UsageError
from scalpel_sim.scenes import Scene, check_motion
from tissue import FloatArray, SolverSettings, Tissue, fixed_nodes
from tissue.blade.toughness import toughness_law_of

_log = logging.getLogger("scalpel_sim")

LONG_DRAG = 0.1
"""How far a blade may drag the tissue without a word, as a fraction of the body's middle extent."""

OPPOSITE_SIDES = (("left", "right"), ("front", "back"), ("bottom", "top"))
"""Pairs of sides that can be pulled apart, one pair an axis."""


def make_tissue(scene: Scene) -> Tissue:
    """Return the scene's body, at rest under gravity between the sides that hold it.

    Raises:
        MeshError: the mesh cannot be cut.
        ValueError: the material or what is to be fixed makes no sense for this mesh.
    """
    mesh = scene.mesh()
    fixed = fixed_nodes(mesh, scene.fixed)
    tissue = Tissue(
        mesh,
        scene.material,
        fixed=fixed,
        positions=pulled_apart(mesh.positions, scene.fixed, scene.stretch),
        gravity=(0.0, 0.0, -scene.gravity),
        floor=scene.floor,
        blade=scene.blade,
        solver=SolverSettings(
            cut=scene.quality,
            scheme=scene.scheme,
            relaxation=scene.relaxation,
            threads=scene.threads,
            audit=scene.audit,
        ),
    )
    if fixed.any():
        tissue.settle()
    return tissue


def check(scene: Scene) -> None:
    """Refuse what can be seen to be wrong before any tissue is made.

    Raises:
        MeshError: the mesh cannot be cut.
        ValueError: stroke or arm are unknown, or what is to be held is not there.
    """
    check_motion(scene)
    mesh = scene.mesh()
    fixed_nodes(mesh, scene.fixed)
    pulled_apart(mesh.positions, scene.fixed, scene.stretch)
    drag = toughest(scene) / scene.material.young_modulus
    extent = float(np.median(np.ptp(mesh.positions, axis=0)))
    if drag > LONG_DRAG * extent:
        _log.warning(
            "the blade will drag the tissue along by some %.2g mm (toughness / Young's modulus) "
            "before it parts, and the body measures %.3g mm: the cut may stay unfinished. A larger "
            "--young or a smaller --toughness cuts cleanly",
            1e3 * drag,
            1e3 * extent,
        )


def toughest(scene: Scene) -> float:
    """Return the most that a square metre of the scene's cut costs [J/m2]: skin, speed, edge."""
    material = scene.material
    resistance = toughness_law_of(material, scene.blade)
    at_speed = resistance.toughness
    if material.toughness_exponent > 0.0:
        ratio = scene.speed / material.toughness_speed
        at_speed *= 1.0 + ratio**material.toughness_exponent
    return max(resistance.skin_toughness, at_speed)


def pulled_apart(positions: FloatArray, fixed: str, stretch: float) -> FloatArray:
    """Return the positions with opposite held sides moved apart by the fraction `stretch`.

    The body between them is stretched evenly: a start from which it settles.

    Args:
        positions: Rest positions [m], shape (n_nodes, 3).
        fixed: Which sides are held, as in `Scene.fixed`.
        stretch: Fraction of the distance between the sides.

    Raises:
        UsageError: there is a stretch, and no two opposite sides are held.
    """
    if stretch == 0.0:
        return positions
    held = {name.strip().lower() for name in fixed.split(",")}
    pulled = np.array([held.issuperset(pair) for pair in OPPOSITE_SIDES])
    if not pulled.any():
        raise UsageError(
            f"--stretch {stretch} pulls opposite sides apart, and '{fixed}' holds no such pair; "
            "use --fix left,right or --stretch 0"
        )
    centre = (positions.min(axis=0) + positions.max(axis=0)) / 2.0
    return centre + (positions - centre) * np.where(pulled, 1.0 + stretch, 1.0)
