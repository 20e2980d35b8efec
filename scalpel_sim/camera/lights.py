"""Lamps."""

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from scalpel_sim.camera.viewpoints import Viewpoint
from scalpel_sim.scene.schema import ENDOSCOPE
from tissue import FloatArray

Rgb = tuple[float, float, float]

_DARK: Rgb = (0.0, 0.0, 0.0)

WALL_COLOUR = (0.86, 0.89, 0.9)
"""Colour where nothing is, if the model has no sky: that of the page (sRGB)."""

_BESIDE_LENS = 0.15
"""Distance of the lamp of an endoscope from its lens, over that of what it looks at. A lamp in the
lens itself would show no relief."""


class Light(NamedTuple):
    """A lamp: far away, so that its light is parallel; or near, in a cone."""

    towards: Sequence[float] | FloatArray
    """Direction into which it shines, world frame, shape (3,)."""
    colour: Rgb = (0.7, 0.7, 0.7)
    """Light on a surface that faces it: red, green, blue, 1 for all."""
    gloss: Rgb = (0.3, 0.3, 0.3)
    """Light that a surface reflects as in a mirror."""
    ambient: Rgb = _DARK
    """Light that it adds everywhere. Where it casts shadows, this is shadowed too: give it to
    another lamp."""
    place: Sequence[float] | FloatArray | None = None
    """Where it is [m], shape (3,). None: it is far away; only a shadow needs a place then, and has
    one outside of what is drawn."""
    cone_degrees: float | None = None
    """Angle from the axis to the rim of its cone [degree]; None: it is far away."""
    casts_shadow: bool = True
    """Whether it casts shadows where the camera draws them."""


def put_light(light: Light, into: mujoco.MjvLight, *, middle: FloatArray, reach: float) -> None:
    """Write a lamp into a scene of MuJoCo.

    Args:
        light: The lamp.
        into: One of the lights of the scene.
        middle: Middle of what is drawn [m], world frame.
        reach: Distance from there at which a lamp that is far away is put [m].
    """
    towards = np.array(light.towards, np.float64)
    towards /= np.linalg.norm(towards)
    is_far = light.cone_degrees is None
    kinds = mujoco.mjtLightType
    into.type = kinds.mjLIGHT_DIRECTIONAL if is_far else kinds.mjLIGHT_SPOT
    into.pos = middle - reach * towards if light.place is None else np.array(light.place)
    into.dir = towards
    into.diffuse, into.specular, into.ambient = light.colour, light.gloss, light.ambient
    into.castshadow, into.headlight = light.casts_shadow, False
    into.attenuation, into.exponent = (1.0, 0.0, 0.0), 0.0
    into.cutoff = 45.0 if light.cone_degrees is None else light.cone_degrees


def room_lights(place: Viewpoint) -> tuple[Light, ...]:
    """Return the lamps of the page: one above and to the left of the eye, and one from behind."""
    eye, target = place.eye, place.target
    view = np.array([eye[0] - target[0], eye[1] - target[1], 0.0])
    length = float(np.linalg.norm(view))
    view = view / length if length > 0.0 else np.array([0.0, -1.0, 0.0])
    left = np.array([view[1], -view[0], 0.0])
    up = np.array([0.0, 0.0, 1.0])
    lamp = -(0.9 * view + 0.9 * left + 3.6 * up)
    rim = 2.5 * view + 1.5 * left - 1.8 * up
    return (
        Light(lamp, (0.6, 0.58, 0.54), (0.35, 0.35, 0.35)),
        Light(rim, (0.17, 0.19, 0.23), (0.1, 0.1, 0.12), (0.38, 0.4, 0.42), casts_shadow=False),
    )


def endoscope_lights(view: Viewpoint) -> tuple[Light, ...]:
    """Return the lamp of an endoscope, a little above its lens, and what walls throw back of it."""
    forward, up = view.axes
    return (
        Light(forward - _BESIDE_LENS * up, (0.95, 0.92, 0.88), (0.7, 0.7, 0.7)),
        Light(forward, _DARK, _DARK, (0.26, 0.25, 0.24), casts_shadow=False),
    )


def usual_lights(name: str, view: Viewpoint) -> tuple[Light, ...]:
    """Return the lamps of a camera by its name: its own of the endoscope, those of the page else.

    Args:
        name: Name of the camera.
        view: Where it is.
    """
    return endoscope_lights(view) if name == ENDOSCOPE else room_lights(view)
