"""Places of a model that hold an instrument along their +z, as flanges of robots point."""

from typing import TypeAlias

import mujoco

from scalpel_sim.arm.blade import no_such

Place: TypeAlias = str | mujoco.MjsSite | mujoco.MjsBody | mujoco.MjsFrame
"""A site, a body or a frame of a model, or the name of one."""


def attach_at(
    spec: mujoco.MjSpec,
    instrument: mujoco.MjSpec,
    at: Place,
    prefix: str,
    error: type[ValueError],
) -> None:
    """Attach an instrument to a place of a model.

    Args:
        spec: The model, yet to be compiled.
        instrument: What is attached, at the origin of the place.
        at: The place. A name that several kinds have is that of the site, else of the body.
        prefix: What the names of its parts will begin with.
        error: What to raise where the model has no such place.

    Raises:
        ValueError: `error`, with the nearest name, and all that there are.
    """
    place = place_called(spec, at, error) if isinstance(at, str) else at
    if isinstance(place, mujoco.MjsSite):
        spec.attach(instrument, prefix=prefix, site=place)
    elif isinstance(place, mujoco.MjsFrame):
        spec.attach(instrument, prefix=prefix, frame=place)
    else:
        spec.attach(instrument, prefix=prefix, frame=place.add_frame())


def place_called(
    spec: mujoco.MjSpec, name: str, error: type[ValueError]
) -> mujoco.MjsSite | mujoco.MjsBody | mujoco.MjsFrame:
    """Return the site, body or frame of that name.

    Args:
        spec: The model.
        name: Its name.
        error: What to raise where there is none.

    Raises:
        ValueError: `error`.
    """
    found = spec.site(name) or spec.body(name) or spec.frame(name)
    if found is None:
        there = [each.name for each in (*spec.sites, *spec.bodies[1:], *spec.frames)]
        raise error(no_such("site, body or frame", name, there))
    return found
