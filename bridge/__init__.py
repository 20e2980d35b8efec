"""Carries blade poses to a tissue and wrenches back, for any arm; independent of MuJoCo.

The public names are those that `__init__.pyi` lists. Each is loaded when it is first used, so that
`import bridge` alone loads no compiler.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
