"""A scalpel for the flange of a robot: a handle, and a blade with the sites `heel` and `tip`."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from scalpel_sim.arm.free_names import free_prefix, names_in
from scalpel_sim.arm.grasper import take_options
from scalpel_sim.arm.mounting import Place, attach_at
from tissue import BladeShape, FloatArray

_SCALPEL = "scalpel_"
"""Prefix of the names of its parts, where those are free."""

HEEL, TIP = "heel", "tip"
"""Sites at the ends of its edge, after that prefix."""

HANDLE_SIZE = (0.003, 0.125, 0.008)
"""Thickness, length and height of its handle [m], about those of a no. 3 handle: 23 g of steel."""

USUAL_LENGTH = 0.04
"""Length of its edge [m]: that of a no. 11 blade."""

_STEEL = 7800.0
"""Density of steel [kg/m3]."""

_LEAST_SIZE = 1e-4
"""Shortest edge, and shortest part of `forward` across +z, that make sense [m, 1]."""


class ScalpelError(ValueError):
    """The model has no such place for a scalpel, or there can be no such scalpel."""


def add_scalpel(
    spec: mujoco.MjSpec,
    at: Place,
    blade: BladeShape = BladeShape(),
    *,
    length: float = USUAL_LENGTH,
    forward: Sequence[float] = (0.0, 1.0, 0.0),
) -> str:
    """Attach a scalpel to a site, a body or a frame of a model, with its handle along the +z there.

    That is how the flanges of robots point. Afterwards `Blade(model, data, prefix + "heel",
    prefix + "tip")` is its edge. Where the model has one of the names of its parts, all of them get
    another prefix.

    Args:
        spec: A model that is yet to be compiled.
        at: The site, body or frame, or its name; the handle begins at its origin.
        blade: Cross-section of the blade, as the tissue has it.
        length: Length of the cutting edge [m].
        forward: Direction in which the edge cuts, in the frame of the place; what of it is across
            +z counts.

    Returns:
        The prefix of the names of its parts: `scalpel_` where all are free.

    Raises:
        ScalpelError: the model has no such place; an edge of no length; a `forward` along +z.
    """
    if not (math.isfinite(length) and length >= _LEAST_SIZE):
        raise ScalpelError(f"the edge is {length} m long; it must be at least {_LEAST_SIZE} m")
    scalpel = _scalpel(blade, length)
    take_options(scalpel, spec)
    scalpel.body("handle").quat = _turned_towards(forward)
    prefix = free_prefix(spec, names_in(scalpel), _SCALPEL)
    attach_at(spec, scalpel, at, prefix, ScalpelError)
    return prefix


def _scalpel(blade: BladeShape, length: float) -> mujoco.MjSpec:
    """Return a scalpel whose handle and edge point along +y, and that cuts towards -z.

    Its mass does not depend on how the model computes masses.
    """
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body(name="handle", gravcomp=1.0)
    sheet = np.array([blade.thickness, length, blade.height])
    ends = np.array([HANDLE_SIZE[1], HANDLE_SIZE[1] + length])
    sizes = np.array([HANDLE_SIZE, sheet])
    middles = np.array([[0.0, 0.5 * HANDLE_SIZE[1], 0.0], [0.0, ends.mean(), 0.0]])
    _make_solid(body, sizes, middles)
    colours = (0.75, 0.77, 0.8, 1.0), (0.9, 0.9, 0.95, 1.0)
    for name, size, middle, colour in zip(
        ("handle", "blade"), sizes, middles, colours, strict=True
    ):
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=0.5 * size,
            pos=middle,
            rgba=colour,
            contype=2,
            conaffinity=1,
            group=2,
        )
    for name, end in zip((HEEL, TIP), ends, strict=True):
        body.add_site(name=name, pos=[0.0, end, -0.5 * blade.height], size=[8e-4] * 3, group=3)
    return spec


def _make_solid(body: mujoco.MjsBody, sizes: FloatArray, middles: FloatArray) -> None:
    """Give a body the mass of boxes of steel.

    Args:
        body: The body.
        sizes: Their sizes [m], shape (n, 3).
        middles: Their middles, on its y axis [m], shape (n, 3).
    """
    masses = _STEEL * sizes.prod(axis=1)
    centre = masses @ middles / masses.sum()
    squares = sizes**2 / 12.0 + (middles - centre) ** 2
    moments = masses @ (squares.sum(axis=1)[:, None] - squares)
    body.explicitinertial = True
    body.mass, body.ipos, body.inertia = masses.sum(), centre, moments


def _turned_towards(forward: Sequence[float]) -> FloatArray:
    """Return the rotation (w, x, y, z) that has +y point along +z, and -z along `forward`."""
    across = np.array(forward, np.float64)
    if across.shape != (3,) or not np.isfinite(across).all():
        raise ScalpelError(f"forward is {across.tolist()}; wanted three finite numbers")
    across[2] = 0.0
    size = float(np.linalg.norm(across))
    if size < _LEAST_SIZE:
        raise ScalpelError(
            f"forward is {list(forward)}, along the handle, which points to +z; the edge cuts "
            "across it, such as towards [0, 1, 0]"
        )
    back, along = -across / size, np.array([0.0, 0.0, 1.0])
    axes, quaternion = np.stack([np.cross(along, back), along, back], axis=1), np.empty(4)
    mujoco.mju_mat2Quat(quaternion, axes.ravel())
    return quaternion
