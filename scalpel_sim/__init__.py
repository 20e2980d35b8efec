"""A MuJoCo robot arm holds a scalpel, cuts soft tissue for real, and feels it. World frame.

The public names are those that `__init__.pyi` lists. Each is loaded when it is first used, so that
`import scalpel_sim` alone loads no compiler.
"""

import os

import lazy_loader

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    """Load a public name.

    Raises:
        ImportError: what it needs cannot be loaded.
    """
    try:
        found: object = _load(name)
    except AttributeError as error:
        if name not in __all__:
            raise
        # Python would say that there is no such name. MuJoCo raises it where there is not the
        # OpenGL that this variable asks for.
        asked = os.environ.get("MUJOCO_GL")
        hint = "" if asked is None else f"; MUJOCO_GL is {asked}: is it installed?"
        raise ImportError(f"scalpel_sim.{name} cannot be loaded ({error}){hint}") from error
    return found
