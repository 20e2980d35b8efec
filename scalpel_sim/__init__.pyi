from .arm.blade import Blade as Blade
from .arm.grasper import Grasper as Grasper
from .arm.grasper import add_grasper as add_grasper
from .instruments.driven_grasper import between_pads as between_pads
from .instruments.geom_coupling import GeomCoupling as GeomCoupling
from .instruments.grip import Grip as Grip
from .preparation import prepare as prepare
from .scene.blade import SCALPEL as SCALPEL
from .scene_parts.scene import Scene as Scene
from .scenes import SCENES as SCENES
from .scenes import read_scene as read_scene
from .simulation import Simulation as Simulation
from .state import SimulationState as SimulationState
from .tables.grasper import GrasperTable as GrasperTable
from .tables.grasper import WaypointTable as WaypointTable
from .tables.stroke import StrokeTable as StrokeTable
from .viewer.viewer import Viewer as Viewer

__all__ = [
    "Blade",
    "GeomCoupling",
    "Grasper",
    "GrasperTable",
    "Grip",
    "SCALPEL",
    "SCENES",
    "Scene",
    "Simulation",
    "SimulationState",
    "StrokeTable",
    "Viewer",
    "WaypointTable",
    "add_grasper",
    "between_pads",
    "prepare",
    "read_scene",
]
