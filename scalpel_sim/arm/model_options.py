"""Options of a MuJoCo model that another one is attached to: they are those of both."""

import mujoco

_OPTIONS = tuple(name for name in dir(mujoco.MjSpec().option) if not name.startswith("_"))


def take_options(spec: mujoco.MjSpec, whole: mujoco.MjSpec) -> None:
    """Give a model the options of the whole that it is to be a part of.

    MuJoCo keeps those of the whole in any case, and warns where the part has others.
    """
    for name in _OPTIONS:
        setattr(spec.option, name, getattr(whole.option, name))
