from .arm.blade import Blade as Blade
from .arm.scalpel import SCALPEL as SCALPEL
from .preparation import prepare as prepare
from .scenes import SCENES as SCENES
from .scenes import Scene as Scene
from .simulation import Simulation as Simulation
from .viewer.viewer import Viewer as Viewer

__all__ = [
    "Blade",
    "SCALPEL",
    "SCENES",
    "Scene",
    "Simulation",
    "Viewer",
    "prepare",
]
