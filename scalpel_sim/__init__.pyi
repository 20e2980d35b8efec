from .arm.blade import Blade as Blade
from .arm.flex import FlexBody as FlexBody
from .arm.flex import FlexError as FlexError
from .arm.flex import take_flex as take_flex
from .arm.grasper import Grasper as Grasper
from .arm.grasper import add_grasper as add_grasper
from .arm.scalpel import add_scalpel as add_scalpel
from .camera.camera import Camera as Camera
from .camera.lights import Light as Light
from .camera.pixel_places import pixels_to_points as pixels_to_points
from .camera.theatre import Theatre as Theatre
from .instruments.driven_grasper import between_pads as between_pads
from .instruments.geom_coupling import GeomCoupling as GeomCoupling
from .instruments.grip import Grip as Grip
from .instruments.instrument import Instrument as Instrument
from .preparation.prepare import prepare as prepare
from .recording.columns import COLUMNS as COLUMNS
from .recording.columns import ColumnGroup as ColumnGroup
from .recording.columns import FrameData as FrameData
from .recording.observations import OBSERVATIONS as OBSERVATIONS
from .saved_run.recorder import RunRecorder as RunRecorder
from .saved_run.saved_run import SavedRun as SavedRun
from .saved_run.saved_step import SavedStep as SavedStep
from .scene.arm_tables import GrasperTable as GrasperTable
from .scene.arm_tables import WaypointTable as WaypointTable
from .scene.blade import SCALPEL as SCALPEL
from .scene.read import SCENES as SCENES
from .scene.read import read_scene as read_scene
from .scene.read import scene_called as scene_called
from .scene.scene import Scene as Scene
from .scene.scene import changed as changed
from .simulation import Simulation as Simulation
from .state import SimulationState as SimulationState
from .strokes.kind import LyingBody as LyingBody
from .strokes.kind import StrokeTable as StrokeTable
from .strokes.kind import stroke_kind as stroke_kind
from .strokes.kinds import STROKES as STROKES
from .viewer.viewer import Viewer as Viewer

__all__ = [
    "Blade",
    "COLUMNS",
    "Camera",
    "ColumnGroup",
    "FrameData",
    "GeomCoupling",
    "Grasper",
    "GrasperTable",
    "Grip",
    "Instrument",
    "OBSERVATIONS",
    "LyingBody",
    "RunRecorder",
    "Light",
    "SCALPEL",
    "FlexBody",
    "FlexError",
    "SCENES",
    "STROKES",
    "SavedRun",
    "SavedStep",
    "Scene",
    "Simulation",
    "SimulationState",
    "StrokeTable",
    "Theatre",
    "Viewer",
    "WaypointTable",
    "add_grasper",
    "add_scalpel",
    "between_pads",
    "changed",
    "pixels_to_points",
    "prepare",
    "read_scene",
    "scene_called",
    "stroke_kind",
    "take_flex",
]
