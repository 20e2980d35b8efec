"""Tasks as environments for policies that learn: see `docs/learning.md`.

`import scalpel_sim.learning` registers `scalpel_sim/Scene-v0`, for scenes of one's own, and the
tasks, such as `scalpel_sim/Incise-v0`, with Gymnasium where the extra `learn` has installed that.
"""

from importlib.util import find_spec

import lazy_loader

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

_HAS_GYMNASIUM = find_spec("gymnasium") is not None


def __getattr__(name: str) -> object:
    """Load a public name.

    Raises:
        ImportError: it needs Gymnasium or PettingZoo, which is not installed.
    """
    try:
        found: object = _load(name)
    except ModuleNotFoundError as error:
        package = {"gymnasium": "Gymnasium", "pettingzoo": "PettingZoo"}.get(error.name or "")
        if package is None:
            raise
        raise ImportError(
            f"scalpel_sim.learning.{name} needs {package}: pip install 'scalpel-sim[learn]'"
        ) from error
    return found


if _HAS_GYMNASIUM:
    from scalpel_sim.learning.registration import register_tasks

    register_tasks()
