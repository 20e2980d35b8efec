from .arm.blade import Blade as Blade
from .arm.scalpel import SCALPEL as SCALPEL
from .preparation import prepare as prepare
from .scene_parts.scene import Scene as Scene
from .scenes import SCENES as SCENES
from .scenes import read_scene as read_scene
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
    "read_scene",
]
