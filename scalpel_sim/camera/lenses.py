"""The lenses of a scene of MuJoCo: where they are, and from where to where they see."""

from collections.abc import Sequence

import mujoco
import numpy as np

from scalpel_sim.camera.viewpoints import Viewpoint
from tissue import FloatArray

NEAREST = 1e-3
"""Distance from the eye below which nothing is drawn [m]. MuJoCo's own is a share of the extent of
the model, a centimetre or more for an arm, and would cut off what an endoscope sees."""

_SKY = 2.0
"""Distance of the sky over that beyond which nothing else is. It is a cube with half a diagonal
of it, so that it begins at 2 / sqrt(3): beyond all else in the depth of an image."""


def aim(scene: mujoco.MjvScene, view: Viewpoint, far: float) -> None:
    """Aim both eyes of a scene, which see from `NEAREST` to the sky behind all else.

    Args:
        scene: The scene.
        view: Where from.
        far: Distance beyond which nothing but the sky is drawn [m].
    """
    forward, up = view.axes
    half = NEAREST * float(np.tan(np.radians(0.5 * view.fov_degrees)))
    for lens in scene.camera:
        lens.pos, lens.forward, lens.up = view.eye, forward, up
        lens.frustum_near, lens.frustum_far = NEAREST, _SKY * far
        lens.frustum_bottom, lens.frustum_top = -half, half
        lens.frustum_center = lens.frustum_width = 0.0
        lens.orthographic = False


def widen_range(scene: mujoco.MjvScene) -> None:
    """Make the eyes of a camera of a model see from `NEAREST` to the sky behind all else."""
    for lens in scene.camera:
        lens.frustum_far *= _SKY
        share = NEAREST / lens.frustum_near
        if lens.orthographic or share >= 1.0:
            continue
        for side in ("near", "bottom", "top", "width", "center"):
            name = f"frustum_{side}"
            setattr(lens, name, share * getattr(lens, name))


def sight_through(
    lenses: Sequence[mujoco.MjvGLCamera], width: int, height: int, pixels: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the eye [m], and unit vectors along the lines of sight through places of a picture.

    Args:
        lenses: Both eyes of a scene, which are one in a picture.
        width: Width of the picture [pixels].
        height: Its height.
        pixels: Places as columns and rows, from the upper left corner, shape (n, 2).

    Returns:
        The eye, shape (3,), and the vectors, shape (n, 3); world frame.
    """
    eye, axes, (left, top, wide, high) = _picture(lenses, width / height)
    across = left + pixels[:, 0] / width * wide
    upward = top - pixels[:, 1] / height * high
    ways = np.column_stack([across, upward, np.ones(len(pixels))]) @ axes
    return eye, ways / np.linalg.norm(ways, axis=1)[:, None]


def pixels_through(
    lenses: Sequence[mujoco.MjvGLCamera], width: int, height: int, points: FloatArray
) -> FloatArray:
    """Return where points are in a picture, as columns and rows, shape (n, 2).

    Args:
        lenses: Both eyes of a scene.
        width: Width of the picture [pixels].
        height: Its height.
        points: Before the eyes [m], world frame, shape (n, 3).
    """
    eye, axes, (left, top, wide, high) = _picture(lenses, width / height)
    across, upward, deep = axes @ (points - eye).T
    columns = (across / deep - left) / wide * width
    return np.column_stack([columns, (top - upward / deep) / high * height])


def _picture(
    lenses: Sequence[mujoco.MjvGLCamera], aspect: float
) -> tuple[FloatArray, FloatArray, tuple[float, float, float, float]]:
    """Return the eye [m], the axes right, up and forward, and the picture at a depth of 1.

    The picture is its left side, its upper side, its width and its height.
    """
    names = ("pos", "forward", "up")
    eye, forward, up = (np.mean([getattr(each, name) for each in lenses], axis=0) for name in names)
    lens, near = lenses[0], lenses[0].frustum_near
    high = (lens.frustum_top - lens.frustum_bottom) / near
    wide = 2.0 * lens.frustum_width / near or high * aspect
    left = lens.frustum_center / near - 0.5 * wide
    axes = np.stack([np.cross(forward, up), up, forward])
    return eye, axes, (left, lens.frustum_top / near, wide, high)
