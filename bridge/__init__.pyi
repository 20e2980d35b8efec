from .arithmetic import compiled_arithmetic as compiled_arithmetic
from .bridge import Bridge as Bridge
from .collision.arm_geoms import SIZES_PER_SHAPE as SIZES_PER_SHAPE
from .collision.arm_geoms import ArmGeom as ArmGeom
from .collision.arm_geoms import GeomShape as GeomShape
from .collision.collisions import Collisions as Collisions
from .collision.fixtures import Fixture as Fixture
from .collision.fixtures import FixtureBox as FixtureBox
from .collision.fixtures import FixtureMesh as FixtureMesh
from .collision.touched_geoms import TouchedGeoms as TouchedGeoms
from .counters import Counters as Counters
from .coupling.coupling import MAX_PLAUSIBLE_FORCE as MAX_PLAUSIBLE_FORCE
from .coupling.coupling import MAX_PLAUSIBLE_TORQUE as MAX_PLAUSIBLE_TORQUE
from .coupling.coupling import CouplingError as CouplingError
from .coupling.led_contact import LedContact as LedContact
from .coupling.led_grip import LedGrip as LedGrip
from .coupling.limits import DeviceLimits as DeviceLimits
from .coupling.local_model import MAX_FRAMES_PER_ANSWER as MAX_FRAMES_PER_ANSWER
from .coupling.passivity import PassivityCounters as PassivityCounters
from .coupling.virtual_coupling import Proxy as Proxy
from .coupling.virtual_coupling import VirtualCoupling as VirtualCoupling
from .device.client import DeviceClient as DeviceClient
from .device.server import DEFAULT_DEVICE_PORT as DEFAULT_DEVICE_PORT
from .device.server import DeviceServer as DeviceServer
from .device.values import CartesianPose as CartesianPose
from .device.values import DeviceDescription as DeviceDescription
from .device.values import DeviceState as DeviceState
from .frames import TissueFrame as TissueFrame
from .led_frames import FrameHold as FrameHold
from .led_frames import FrameLoad as FrameLoad
from .led_frames import FramePose as FramePose
from .led_frames import FrameTie as FrameTie
from .led_geoms import GeomLoads as GeomLoads
from .led_geoms import GeomPoses as GeomPoses
from .link import InProcessLink as InProcessLink
from .link import LinkError as LinkError
from .link import SceneView as SceneView
from .link import TissueDescription as TissueDescription
from .link import TissueLink as TissueLink
from .scene_names import sent_scene_name as sent_scene_name
from .tcp.address import DEFAULT_HOST as DEFAULT_HOST
from .tcp.address import DEFAULT_PORT as DEFAULT_PORT
from .tcp.address import parse_address as parse_address
from .tcp.client import TcpLink as TcpLink
from .tcp.keys import chosen_key as chosen_key
from .tcp.keys import write_new_key as write_new_key
from .tcp.server import serve as serve

__all__ = [
    "ArmGeom",
    "Bridge",
    "CartesianPose",
    "Collisions",
    "Counters",
    "CouplingError",
    "DEFAULT_DEVICE_PORT",
    "DEFAULT_HOST",
    "DEFAULT_PORT",
    "DeviceClient",
    "DeviceDescription",
    "DeviceLimits",
    "DeviceServer",
    "DeviceState",
    "Fixture",
    "FixtureBox",
    "FixtureMesh",
    "FrameLoad",
    "FramePose",
    "GeomLoads",
    "GeomPoses",
    "GeomShape",
    "FrameHold",
    "FrameTie",
    "InProcessLink",
    "LedContact",
    "LedGrip",
    "LinkError",
    "MAX_FRAMES_PER_ANSWER",
    "MAX_PLAUSIBLE_FORCE",
    "MAX_PLAUSIBLE_TORQUE",
    "PassivityCounters",
    "Proxy",
    "SIZES_PER_SHAPE",
    "SceneView",
    "TcpLink",
    "TissueDescription",
    "TissueFrame",
    "TissueLink",
    "TouchedGeoms",
    "VirtualCoupling",
    "chosen_key",
    "compiled_arithmetic",
    "parse_address",
    "sent_scene_name",
    "serve",
    "write_new_key",
]
