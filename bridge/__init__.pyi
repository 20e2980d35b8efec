from .bridge import Bridge as Bridge
from .collision.fixtures import Fixture as Fixture
from .collision.fixtures import FixtureBox as FixtureBox
from .collision.fixtures import FixtureMesh as FixtureMesh
from .coupling.coupling import CouplingError as CouplingError
from .coupling.limits import DeviceLimits as DeviceLimits
from .coupling.virtual_coupling import VirtualCoupling as VirtualCoupling
from .frames import TissueFrame as TissueFrame
from .link import InProcessLink as InProcessLink
from .link import LinkError as LinkError
from .link import TissueLink as TissueLink
from .tcp.client import TcpLink as TcpLink
from .tcp.server import serve as serve

__all__ = [
    "Bridge",
    "CouplingError",
    "DeviceLimits",
    "Fixture",
    "FixtureBox",
    "FixtureMesh",
    "InProcessLink",
    "LinkError",
    "TcpLink",
    "TissueFrame",
    "TissueLink",
    "VirtualCoupling",
    "serve",
]
