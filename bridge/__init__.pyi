from .arithmetic import compiled_arithmetic as compiled_arithmetic
from .bridge import Bridge as Bridge
from .collision.collisions import ArmGeom as ArmGeom
from .collision.collisions import Collisions as Collisions
from .collision.collisions import GeomShape as GeomShape
from .collision.fixtures import Fixture as Fixture
from .collision.fixtures import FixtureBox as FixtureBox
from .collision.fixtures import FixtureMesh as FixtureMesh
from .collision.touched_geoms import TouchedGeoms as TouchedGeoms
from .counters import Counters as Counters
from .coupling.coupling import MAX_PLAUSIBLE_FORCE as MAX_PLAUSIBLE_FORCE
from .coupling.coupling import MAX_PLAUSIBLE_TORQUE as MAX_PLAUSIBLE_TORQUE
from .coupling.coupling import CouplingError as CouplingError
from .coupling.driven_bodies import DrivenContact as DrivenContact
from .coupling.driven_bodies import DrivenFrame as DrivenFrame
from .coupling.limits import DeviceLimits as DeviceLimits
from .coupling.local_model import MAX_FRAMES_PER_ANSWER as MAX_FRAMES_PER_ANSWER
from .coupling.virtual_coupling import Proxy as Proxy
from .coupling.virtual_coupling import VirtualCoupling as VirtualCoupling
from .description import NamedLabel as NamedLabel
from .description import SceneView as SceneView
from .description import TissueDescription as TissueDescription
from .device.client import DeviceClient as DeviceClient
from .device.exchange import DeviceCommand as DeviceCommand
from .device.felt_force import BladeReport as BladeReport
from .device.felt_force import motion_between as motion_between
from .device.messages import CartesianPose as CartesianPose
from .device.messages import DeviceDescription as DeviceDescription
from .device.messages import DeviceState as DeviceState
from .device.process import DeviceEnd as DeviceEnd
from .device.process import DeviceProcess as DeviceProcess
from .device.server import DEFAULT_DEVICE_PORT as DEFAULT_DEVICE_PORT
from .device.server import DeviceServer as DeviceServer
from .driven import GeomLoads as GeomLoads
from .driven import GeomPoses as GeomPoses
from .frames import TissueFrame as TissueFrame
from .link import InProcessLink as InProcessLink
from .link import LinkError as LinkError
from .link import TissueLink as TissueLink
from .tcp.address import DEFAULT_HOST as DEFAULT_HOST
from .tcp.address import DEFAULT_PORT as DEFAULT_PORT
from .tcp.address import parse_address as parse_address
from .tcp.client import TcpLink as TcpLink
from .tcp.keys import chosen_key as chosen_key
from .tcp.keys import write_new_key as write_new_key
from .tcp.messages.text import sent_scene_name as sent_scene_name
from .tcp.server import serve as serve

__all__ = [
    "ArmGeom",
    "BladeReport",
    "Bridge",
    "CartesianPose",
    "Collisions",
    "Counters",
    "CouplingError",
    "DEFAULT_DEVICE_PORT",
    "DEFAULT_HOST",
    "DEFAULT_PORT",
    "DeviceClient",
    "DeviceCommand",
    "DeviceDescription",
    "DeviceEnd",
    "DeviceLimits",
    "DeviceProcess",
    "DeviceServer",
    "DeviceState",
    "Fixture",
    "FixtureBox",
    "FixtureMesh",
    "GeomLoads",
    "GeomPoses",
    "GeomShape",
    "InProcessLink",
    "DrivenContact",
    "DrivenFrame",
    "LinkError",
    "MAX_FRAMES_PER_ANSWER",
    "MAX_PLAUSIBLE_FORCE",
    "MAX_PLAUSIBLE_TORQUE",
    "NamedLabel",
    "Proxy",
    "SceneView",
    "TcpLink",
    "TissueDescription",
    "TissueFrame",
    "TissueLink",
    "TouchedGeoms",
    "VirtualCoupling",
    "chosen_key",
    "compiled_arithmetic",
    "motion_between",
    "parse_address",
    "sent_scene_name",
    "serve",
    "write_new_key",
]
