from .arm.blade import Blade as Blade
from .arm.geom_coupling import GeomCoupling as GeomCoupling
from .arm.grip import Grip as Grip
from .arm.scalpel import SCALPEL as SCALPEL
from .preparation import prepare as prepare
from .scene_parts.scene import Scene as Scene
from .scenes import SCENES as SCENES
from .scenes import read_scene as read_scene
from .simulation import Simulation as Simulation
from .tables.stroke import StrokeTable as StrokeTable
from .viewer.viewer import Viewer as Viewer

__all__ = [
    "Blade",
    "GeomCoupling",
    "Grip",
    "SCALPEL",
    "SCENES",
    "Scene",
    "Simulation",
    "StrokeTable",
    "Viewer",
    "prepare",
    "read_scene",
]
