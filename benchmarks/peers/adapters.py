"""The engines: python -m benchmarks.peers.adapters ADAPTER BODY CASE STEP CORE serves one case.

An adapter is a function that takes a body and a case and returns a `PeerStepper`. The Python that
runs this module need not have this project or its dependencies, only NumPy and the engine: so
nothing here imports the project, except `ours`, and each adapter imports its engine itself.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.peers.serving import Adapter, PeerBody, PeerStepper, serve_case

_Array = npt.NDArray[Any]


def ours(body: PeerBody, case: str) -> PeerStepper:
    """Return the body in this engine, without drag: springs or neo-Hookean tetrahedra.

    Args:
        body: The body at rest.
        case: LAW:METHOD:DAMPING, then :plain where dilatation is not averaged over nodes, and
            :single for forces in single precision.
    """
    from benchmarks.engine import EngineLoops
    from scalpel_sim.version import version
    from tissue import TetrahedralMesh

    law, method, damping, *more = case.split(":")
    loops = EngineLoops(
        TetrahedralMesh(body.positions, body.tetrahedra),
        law,
        is_damped=damping == "damped",
        is_averaged="plain" not in more,
        precision="single" if "single" in more else "double",
        has_drag=False,
        dt=body.dt,
    )
    steps = {
        "runge_kutta": loops.runge_kutta_steps,
        "verlet": loops.verlet_steps,
        "euler": loops.euler_steps,
    }[method]
    return PeerStepper(steps, lambda: loops.positions, version("scalpel-sim"))


def mujoco_flex(body: PeerBody, case: str) -> PeerStepper:
    """Return the body as MuJoCo's flex: double precision, no contact.

    Args:
        body: The body at rest.
        case: INTEGRATOR:DAMPING, then :stable for the stable neo-Hookean law instead of St.
            Venant-Kirchhoff's.
    """
    import mujoco

    integrator, damping, *more = case.split(":")
    seconds = body.retardation_time if damping == "damped" else 0.0
    spec = mujoco.MjSpec.from_string(_mjcf(body, integrator, seconds))
    if "stable" in more:
        for flex in spec.flexes:
            flex.elastic3d = 1
    model = spec.compile()
    data = mujoco.MjData(model)
    owner = model.flex_vertbodyid
    model.body_mass[owner[owner > 0]] = body.masses[owner > 0]  # a flexcomp makes all masses equal
    mujoco.mj_setConst(model, data)

    def steps(n: int) -> None:
        mujoco.mj_step(model, data, nstep=n)

    return PeerStepper(steps, lambda: data.flexvert_xpos, mujoco.__version__)


def _mjcf(body: PeerBody, integrator: str, damping: float) -> str:
    """Return the model in MJCF: one flex with pinned vertices, and nothing to collide with."""
    points = " ".join(f"{x:.9g}" for x in body.positions.ravel())
    elements = " ".join(map(str, body.tetrahedra.ravel()))
    held = " ".join(map(str, body.held))
    return f"""
    <mujoco>
      <option timestep="{body.dt}" integrator="{integrator}" solver="CG" tolerance="1e-5"
              gravity="0 0 {-body.gravity}"><flag contact="disable"/></option>
      <worldbody>
        <flexcomp name="block" type="direct" dim="3" mass="{body.masses.sum():.9g}"
                  point="{points}" element="{elements}" radius="1e-4">
          <edge equality="false"/>
          <contact selfcollide="none" contype="0" conaffinity="0"/>
          <elasticity young="{body.young_modulus}" poisson="{body.poisson_ratio}"
                      damping="{damping}"/>
          <pin id="{held}"/>
        </flexcomp>
      </worldbody>
    </mujoco>"""


def newton_particles(body: PeerBody, case: str) -> PeerStepper:
    """Return the body in a solver of Newton on the CPU: single precision, contact off.

    Its step is recorded as a graph, which saves a third of the time in 5,400 tetrahedra.

    Args:
        body: The body at rest.
        case: SOLVER:LAW:DAMPING, the solver `semi_implicit` or `vbd`; then :N for N iterations.
    """
    import newton
    import warp as wp

    solver_name, law, damping, *iterations = case.split(":")
    wp.config.quiet = True
    wp.config.enable_backward = False
    seconds = body.retardation_time if damping == "damped" else 0.0
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, -body.gravity))
    masses = body.masses.copy()
    masses[body.held] = 0.0  # Newton holds particles without mass
    at_rest = [(0.0, 0.0, 0.0)] * len(masses)
    builder.add_particles([tuple(x) for x in body.positions.tolist()], at_rest, masses.tolist())
    is_vbd = solver_name == "vbd"
    _add_elements(builder, body, law, seconds, is_vbd)
    if is_vbd:
        builder.color()
    model = builder.finalize(device="cpu")
    model.particle_grid = None  # no contact between particles
    solver = (
        newton.solvers.SolverVBD(model, iterations=int(iterations[0]))
        if is_vbd
        else newton.solvers.SolverSemiImplicit(model, enable_tri_contact=False)
    )
    state, after = model.state(), model.state()
    control = model.control()

    def one_step() -> None:
        state.clear_forces()
        solver.step(state, after, control, None, body.dt)
        wp.copy(state.particle_q, after.particle_q)
        wp.copy(state.particle_qd, after.particle_qd)

    one_step()  # loads and compiles the kernels
    with wp.ScopedCapture(device="cpu") as capture:
        one_step()
    state.particle_q.assign(body.positions.astype(np.float32))
    state.particle_qd.zero_()

    def steps(n: int) -> None:
        for _ in range(n):
            wp.capture_launch(capture.graph)

    return PeerStepper(steps, lambda: state.particle_q.numpy(), newton.__version__)


def _add_elements(builder: Any, body: PeerBody, law: str, seconds: float, is_vbd: bool) -> None:
    """Add springs or tetrahedra with dampers of this retardation time [s] to Newton's builder."""
    if law == "springs":
        for (i, j), stiffness in zip(body.edges.tolist(), body.stiffness.tolist(), strict=True):
            builder.add_spring(i, j, stiffness, seconds * stiffness, 0.0)
        return
    mu, lam = body.mu, body.lam
    if not is_vbd:  # the other solver takes the law's own constants, and not Lame's
        mu, lam = 4.0 / 3.0 * body.mu, body.lam + 5.0 / 6.0 * body.mu
    for corners in body.tetrahedra.tolist():
        builder.add_tetrahedron(*corners, mu, lam, seconds * body.mu)


def rapier_soft(body: PeerBody, case: str) -> PeerStepper:
    """Return the body in Rapier: single precision, collision off, no damping.

    Args:
        body: The body at rest.
        case: springs:F, with their natural frequency F [Hz], or SOLVER:LAW, the solver
            `constraints` or `fem` and the law `NEO_HOOKEAN` or `COROTATIONAL`.
    """
    import rapier3d as rapier

    solver, _, law = case.partition(":")
    world = rapier.PhysicsWorld(gravity=(0.0, 0.0, -body.gravity))
    world.set_num_threads(1)
    world.integration_parameters.dt = body.dt
    world.integration_parameters.num_solver_iterations = 1  # the fewest that it allows; default 4
    builder = rapier.SoftBodyBuilder(body.positions)
    if solver == "springs":
        # Its springs have no stiffness of their own: all have one frequency, as if alone.
        softness = rapier.SpringCoefficients(float(law), 0.0)
        material = rapier.SoftBodyMaterial(edge_softness=softness)
        builder = builder.edges(body.edges)
    else:
        material = rapier.SoftBodyMaterial(
            young_modulus=body.young_modulus,
            poisson_ratio=body.poisson_ratio,
            elastic_damping_ratio=0.0,
        )
        model = getattr(rapier.SoftBodyCellModel, law)
        builder = builder.cells(body.tetrahedra).cell_model(model)
    kind = rapier.SoftBodySolver.FEM if solver == "fem" else rapier.SoftBodySolver.CONSTRAINTS
    builder = builder.material(material).solver(kind).additional_pgs_iterations(0)
    builder = builder.masses(body.masses).pinned_particles(body.held.tolist())
    soft = world.soft_bodies[world.add_soft_body(builder.no_surface_collider().can_sleep(False))]

    def steps(n: int) -> None:
        for _ in range(n):
            world.step()

    return PeerStepper(steps, lambda: soft.particle_positions, rapier.__version__)


def genesis_fem(body: PeerBody, case: str) -> PeerStepper:
    """Return the body in Genesis' finite elements on the CPU: single precision, contact off.

    Args:
        body: The body at rest.
        case: SOLVER:LAW:N, the solver `implicit` or `explicit`, the law as Genesis names it, and N
            iterations of its conjugate gradients.
    """
    import genesis as gs
    from genesis.utils import element

    solver, law, iterations = case.split(":")
    gs.init(backend=gs.cpu, precision="32", logging_level="error")
    scene = gs.Scene(
        sim_options=gs.options.SimOptions(dt=body.dt, gravity=(0.0, 0.0, -body.gravity)),
        fem_options=gs.options.FEMOptions(
            use_implicit_solver=solver == "implicit",
            n_pcg_iterations=int(iterations),
            pcg_threshold=1e-12,  # in squared newtons: the default ends before the first iteration
            damping_alpha=0.0,
            damping_beta=0.0,
            enable_vertex_constraints=True,
            floor_height=-1.0,  # the body sags below zero
        ),
        show_viewer=False,
    )
    # A morph is filled by TetGen, and there is no other: this body has its tetrahedra already.
    element.mesh_to_elements = lambda *_, **__: (body.positions, body.tetrahedra)
    element.split_all_surface_tets = lambda nodes, corners: (nodes, corners)
    material = gs.materials.FEM.Elastic(
        E=body.young_modulus, nu=body.poisson_ratio, rho=body.density, model=law
    )
    block = scene.add_entity(morph=gs.morphs.Box(size=(1.0, 1.0, 1.0)), material=material)
    scene.build()
    block.set_vertex_constraints(body.held)

    def steps(n: int) -> None:
        for _ in range(n):
            scene.step(update_visualizer=False, refresh_visualizer=False)

    def positions() -> _Array:
        found: _Array = block.get_state().pos[0].detach().cpu().numpy()
        return found

    return PeerStepper(steps, positions, gs.__version__)


ADAPTERS: dict[str, Adapter] = {
    each.__name__: each for each in (ours, mujoco_flex, newton_particles, rapier_soft, genesis_fem)
}
"""The adapters by name."""

if __name__ == "__main__":
    serve_case(ADAPTERS)
