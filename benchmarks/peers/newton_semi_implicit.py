"""Newton on the CPU: its semi-implicit solver, single precision, all contact off."""

import newton
import warp as wp

from .protocol import PeerBody, PeerStepper


def newton_semi_implicit(body: PeerBody, case: str) -> PeerStepper:
    """Return the body as springs or as neo-Hookean tetrahedra, ready to step.

    Args:
        body: What to simulate.
        case: LAW:DAMPING.
    """
    law, damping = case.split(":")
    seconds = body.retardation_time if damping == "damped" else 0.0
    wp.config.quiet = True
    builder = newton.ModelBuilder()
    masses = body.masses.copy()
    masses[body.held] = 0.0  # Newton holds particles without mass
    at_rest = [(0.0, 0.0, 0.0)] * len(masses)
    builder.add_particles([tuple(x) for x in body.positions.tolist()], at_rest, masses.tolist())
    if law == "springs":
        for (i, j), stiffness in zip(body.edges.tolist(), body.stiffness.tolist(), strict=True):
            builder.add_spring(i, j, stiffness, seconds * stiffness, 0.0)
    else:
        for corners in body.tetrahedra.tolist():
            builder.add_tetrahedron(*corners, body.mu, body.lam, seconds * body.mu)
    model = builder.finalize(device="cpu")
    model.particle_grid = None  # no contact between particles
    solver = newton.solvers.SolverSemiImplicit(model, enable_tri_contact=False)
    states = [model.state(), model.state()]
    control = model.control()

    def steps(n: int) -> None:
        for _ in range(n):
            states[0].clear_forces()
            solver.step(states[0], states[1], control, None, body.dt)
            states.reverse()

    return PeerStepper(steps, lambda: states[0].particle_q.numpy(), newton.__version__)
