"""Our own engine: springs or neo-Hookean tetrahedra."""

from typing import cast

from benchmarks.engine import EngineLoops
from scalpel_sim.version import version
from tissue import Law, TetrahedralMesh

from .protocol import PeerBody, PeerStepper


def ours(body: PeerBody, case: str) -> PeerStepper:
    """Return the body ready to step.

    Args:
        body: What to simulate.
        case: LAW:METHOD:DAMPING, then :plain where dilatation is not averaged over nodes, and
            :single for forces in single precision.
    """
    law, method, damping, *more = case.split(":")
    loops = EngineLoops(
        TetrahedralMesh(body.positions, body.tetrahedra),
        cast(Law, law),
        is_damped=damping == "damped",
        is_averaged="plain" not in more,
        precision="single" if "single" in more else "double",
    )
    steps = {"runge_kutta": loops.runge_kutta_steps, "euler": loops.euler_steps}[method]
    return PeerStepper(steps, lambda: loops.positions, version("scalpel-sim"))
