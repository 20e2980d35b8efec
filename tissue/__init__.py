"""A tetrahedral body that a blade can cut. Tissue frame, SI units.

The public names are those that `__init__.pyi` lists. Each is loaded when it is first used, so that
`import tissue` alone loads no compiler.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
