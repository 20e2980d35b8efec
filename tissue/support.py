"""Internal names of the engine for the packages around it; what users need is in `tissue` itself.

The names are those that `support.pyi` lists. Each is loaded when it is first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub("tissue", __file__)
