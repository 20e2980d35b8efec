"""Runs one case of one engine in a process of its own: python FILE ADAPTER BODY CASE CORE.

An adapter is a function that takes a body and a case and returns a `PeerStepper`. The Python that
runs this file need not have this project or its dependencies, only NumPy and the engine: so nothing
here imports the project, except `ours`, and each adapter imports its engine itself.

Each case runs on one core and one thread. The parent process has them step in turn for a number
of seconds, one line of text each; the answer is a line of JSON with the CPU time that the steps
took, of the whole process with its own threads. A process that waits uses no CPU time. Standard
output belongs to these answers.
"""

import json
import os
import sys
import time
from collections.abc import Callable
from typing import Any, NamedTuple, TextIO

import numpy as np
import numpy.typing as npt

_SHORTEST_SAMPLE = 2e-4
"""Least duration of a sample [s]: as many steps as this needs are timed together."""
_LEAST_SAMPLES = 3
"""Fewest samples in a turn."""
N_WARM_UP = 5
"""Steps before the first turn: they compile and allocate, and are not timed."""

_Array = npt.NDArray[Any]


class PeerBody(NamedTuple):
    """The body and material to simulate, the same for every engine."""

    positions: _Array
    """Positions of the nodes at rest [m], shape (n_nodes, 3)."""
    tetrahedra: _Array
    """Nodes of each tetrahedron, shape (n_tetrahedra, 4)."""
    edges: _Array
    """Nodes of each edge, shape (n_edges, 2)."""
    stiffness: _Array
    """Stiffness of the spring along each edge [N/m], by van Gelder's formula, shape (n_edges,)."""
    masses: _Array
    """Masses of the nodes [kg], shape (n_nodes,)."""
    held: _Array
    """Indices of the nodes that do not move, shape (n_held,)."""
    young_modulus: float
    """Young's modulus [Pa]."""
    poisson_ratio: float
    """Poisson's ratio, for laws that have a choice; springs have 1/4."""
    retardation_time: float
    """Viscosity over stiffness [s]."""
    dt: float
    """Time step [s]."""

    @property
    def mu(self) -> float:
        """Lame's second constant [Pa]."""
        return self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def lam(self) -> float:
        """Lame's first constant [Pa]."""
        nu = self.poisson_ratio
        return self.young_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))


class PeerStepper(NamedTuple):
    """A body that an engine made, ready to step."""

    steps: Callable[[int], None]
    """Takes the given number of steps of `dt`."""
    positions: Callable[[], _Array]
    """Returns the positions of the nodes [m], shape (n_nodes, 3)."""
    version: str
    """Version of the engine."""


def serve_case() -> None:
    """Load the adapter and serve the case."""
    adapter, file, case, core = sys.argv[1:5]
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {int(core)})
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # what a library prints must not get among the answers
    try:
        body = read_body(file)
        stepper = ADAPTERS[adapter](body, case)
        stepper.steps(N_WARM_UP)
    except ImportError:
        raise  # the engine is not installed
    except Exception as error:
        answers.write(json.dumps({"failed": f"{type(error).__name__}: {error}"}) + "\n")
        return
    answer_requests(body, stepper, sys.stdin, answers)


def write_body(file: str, body: PeerBody) -> None:
    """Write a body to a .npz file."""
    arrays: dict[str, Any] = body._asdict()
    np.savez(file, **arrays)


def read_body(file: str) -> PeerBody:
    """Read a body from a .npz file."""
    with np.load(file) as arrays:
        entries = {name: arrays[name] for name in PeerBody._fields}
    values: dict[str, Any] = {name: v if v.ndim else float(v) for name, v in entries.items()}
    return PeerBody(**values)


def answer_requests(
    body: PeerBody, stepper: PeerStepper, requests: TextIO, answers: TextIO
) -> None:
    """Write the version; then answer each request with the times of its steps, until they end.

    Args:
        body: The body at rest.
        stepper: The same body, ready to step.
        requests: Lines with the seconds to step for.
        answers: Where the answers go: `seconds`, a list of seconds per step, and `moved`, the
            largest displacement of a node from rest [m], or null where positions are not finite.
    """
    n_steps = _steps_per_sample(stepper.steps)
    answers.write(json.dumps({"version": stepper.version}) + "\n")
    for line in requests:
        samples = _time_turn(stepper.steps, n_steps, float(line))
        moved = float(np.abs(stepper.positions() - body.positions).max())
        answers.write(
            json.dumps({"seconds": samples, "moved": moved if np.isfinite(moved) else None}) + "\n"
        )


def _steps_per_sample(steps: Callable[[int], None]) -> int:
    """Return how many steps make up a sample."""
    n_steps = 1
    while True:
        start = time.process_time()
        steps(n_steps)
        if time.process_time() - start >= _SHORTEST_SAMPLE:
            return n_steps
        n_steps *= 2


def _time_turn(steps: Callable[[int], None], n_steps: int, seconds: float) -> list[float]:
    """Run one turn; return the seconds per step of each sample. The first step is not timed."""
    steps(1)
    samples: list[float] = []
    begin = time.process_time()
    while True:
        start = time.process_time()
        steps(n_steps)
        end = time.process_time()
        samples.append((end - start) / n_steps)
        if end - begin >= seconds and len(samples) >= _LEAST_SAMPLES:
            return samples


def ours(body: PeerBody, case: str) -> PeerStepper:
    """Return the body in this engine: springs or neo-Hookean tetrahedra.

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
    )
    steps = {"runge_kutta": loops.runge_kutta_steps, "euler": loops.euler_steps}[method]
    return PeerStepper(steps, lambda: loops.positions, version("scalpel-sim"))


def mujoco_flex(body: PeerBody, case: str) -> PeerStepper:
    """Return the body as MuJoCo's flex: St. Venant-Kirchhoff law, double precision, no contact.

    Args:
        body: The body at rest.
        case: INTEGRATOR:DAMPING.
    """
    import mujoco

    integrator, damping = case.split(":")
    seconds = body.retardation_time if damping == "damped" else 0.0
    model = mujoco.MjModel.from_xml_string(_mjcf(body, integrator, seconds))
    data = mujoco.MjData(model)

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
      <option timestep="{body.dt}" integrator="{integrator}"><flag contact="disable"/></option>
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


def newton_semi_implicit(body: PeerBody, case: str) -> PeerStepper:
    """Return the body in Newton's semi-implicit solver on the CPU: single precision, contact off.

    Args:
        body: The body at rest.
        case: LAW:DAMPING.
    """
    import newton
    import warp as wp

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


def rapier_soft(body: PeerBody, case: str) -> PeerStepper:
    """Return the body in Rapier: single precision, collision off.

    Args:
        body: The body at rest.
        case: `springs`, `constraints`, or `fem`.
    """
    import rapier3d as rapier

    solver, cell_model = {
        "springs": (rapier.SoftBodySolver.CONSTRAINTS, None),
        "constraints": (rapier.SoftBodySolver.CONSTRAINTS, rapier.SoftBodyCellModel.NEO_HOOKEAN),
        "fem": (rapier.SoftBodySolver.FEM, rapier.SoftBodyCellModel.NEO_HOOKEAN),
    }[case]
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


ADAPTERS = {each.__name__: each for each in (ours, mujoco_flex, newton_semi_implicit, rapier_soft)}
"""The adapters by name."""

if __name__ == "__main__":
    serve_case()
