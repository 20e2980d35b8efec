"""Our own engine: springs or neo-Hookean tetrahedra, double precision."""

from typing import cast

from scalpel_sim.bench.engine import EngineLoops
from scalpel_sim.version import version
from tissue import Law, TetrahedralMesh

from .protocol import PeerBody, PeerStepper


def ours(body: PeerBody, case: str) -> PeerStepper:
    """Return the body ready to step.

    Args:
        body: What to simulate.
        case: LAW:METHOD:DAMPING, and :plain where dilatation is not averaged over nodes.
    """
    law, method, damping, *plain = case.split(":")
    mesh = TetrahedralMesh(body.positions, body.tetrahedra)
    loops = EngineLoops(mesh, cast(Law, law), is_damped=damping == "damped", is_averaged=not plain)
    steps = {"runge_kutta": loops.runge_kutta_steps, "euler": loops.euler_steps}[method]
    return PeerStepper(steps, lambda: loops.positions, version("scalpel-sim"))
