"""The kinds of strokes: each module adds its own to `STROKES`. A new module is found."""

import pkgutil
from importlib import import_module

from scalpel_sim.strokes.kind import STROKES

__all__ = ["STROKES"]

for _module in pkgutil.iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
