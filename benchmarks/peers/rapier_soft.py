"""Rapier's soft bodies: constraints or finite elements, single precision, collision off."""

import rapier3d as rapier

from .protocol import PeerBody, PeerStepper

_SOLVERS = {
    "springs": (rapier.SoftBodySolver.CONSTRAINTS, None),
    "constraints": (rapier.SoftBodySolver.CONSTRAINTS, rapier.SoftBodyCellModel.NEO_HOOKEAN),
    "fem": (rapier.SoftBodySolver.FEM, rapier.SoftBodyCellModel.NEO_HOOKEAN),
}


def rapier_soft(body: PeerBody, case: str) -> PeerStepper:
    """Return the body ready to step.

    Args:
        body: What to simulate.
        case: `springs`, `constraints`, or `fem`.
    """
    solver, cell_model = _SOLVERS[case]
    world = rapier.PhysicsWorld(gravity=(0.0, 0.0, -9.81))
    world.set_num_threads(1)
    world.integration_parameters.dt = body.dt
    world.integration_parameters.num_solver_iterations = 1  # the fewest that it allows; default 4
    builder = rapier.SoftBodyBuilder(body.positions)
    if cell_model is None:
        builder = builder.edges(body.edges)
    else:
        material = rapier.SoftBodyMaterial(
            young_modulus=body.young_modulus, poisson_ratio=body.poisson_ratio
        )
        builder = builder.cells(body.tetrahedra).cell_model(cell_model).material(material)
    builder = builder.solver(solver).masses(body.masses).pinned_particles(body.held.tolist())
    soft = world.soft_bodies[world.add_soft_body(builder.no_surface_collider().can_sleep(False))]

    def steps(n: int) -> None:
        for _ in range(n):
            world.step()

    return PeerStepper(steps, lambda: soft.particle_positions, rapier.__version__)
