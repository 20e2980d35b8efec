"""The blocks that benchmarks measure on, and the engine's inner loops over them, one at a time."""

from dataclasses import replace

import numpy as np

from scalpel_sim.errors import UsageError
from tissue import (
    BoolArray,
    FloatArray,
    IntArray,
    Material,
    SolverSettings,
    TetrahedralMesh,
    Tissue,
    block,
)
from tissue.blade.edge import NOWHERE
from tissue.contact.response.forces import add_contact_forces, end_contact_substep
from tissue.contact.self_contact import SelfContact
from tissue.core.jit import kernel
from tissue.elasticity.viscous_stress import no_viscosity
from tissue.forces.step_context import Increment
from tissue.forces.terms import accelerations
from tissue.integrators.global_stepper import GlobalStepper
from tissue.integrators.methods import Global, Verlet, method_of
from tissue.laws.energy_density import neo_hookean
from tissue.mesh.body import Body

BlockCells = tuple[int, int, int]
"""Numbers of cells of a block along x, y and z."""

CELL = 0.01
"""Side of a cell [m]."""
JITTER = 0.1
"""Largest displacement of an inner node from the grid, in cells: no two tetrahedra are equal, as in
an organ."""
SEED = 1998
"""Seed of the jitter: every run measures the same blocks."""

BLOCKS: dict[int, BlockCells] = {
    576: (4, 4, 6),
    5_400: (9, 10, 10),
    6_000: (10, 10, 10),
    20_250: (15, 15, 15),
    60_000: (20, 20, 25),
    199_800: (30, 30, 37),
    600_000: (40, 50, 50),
    1_000_188: (49, 54, 63),
}
"""Number of cells along x, y and z, by the number of tetrahedra."""

FRAME_DT = 1e-3
"""Time step of a frame [s]: that of a haptic loop."""

YOUNG_MODULUS = 3e3
"""Young's modulus of the blocks [Pa]: so soft that in cells of 10 mm a step of 1 ms is stable under
every explicit scheme that is measured here, those of other engines too."""
POISSON_RATIO: dict[str, float] = {"springs": 0.25, "neo_hookean": 0.3}
"""Poisson's ratio under each law: that of springs without a volume term, and what other engines get
under their laws for tetrahedra."""
DENSITY = 1e3
"""Density [kg/m3]."""
_TOUGHNESS = 5.0
"""Toughness [J/m2], so low that the engine does not warn of too coarse a mesh; nothing is cut."""

LAW_NAMES: dict[str, str] = {"springs": "springs", "neo_hookean": "neo-Hookean"}
"""The laws that are measured, and their names in the tables."""
PRECISION_OF_LAW: dict[str, str] = {"springs": "double", "neo_hookean": "single"}
"""Precision of the forces under each law, as `run` takes it: springs have no other."""
N_STAGES = 3
"""Stages of a Runge-Kutta-Nystroem step, each with an evaluation of the forces."""


def jittered_block(n_tetrahedra: int) -> TetrahedralMesh:
    """Return the block of that many tetrahedra, one of `BLOCKS`."""
    cells = BLOCKS[n_tetrahedra]
    mesh = block(cells, [CELL * n for n in cells])
    off = np.random.default_rng(SEED).uniform(-JITTER, JITTER, mesh.positions.shape) * CELL
    on_surface = _is_on_sides(mesh.positions, (0, 1, 2))
    positions = mesh.positions + np.where(on_surface[:, None], 0.0, off)
    return TetrahedralMesh(positions, mesh.tetrahedra)


def held_nodes(mesh: TetrahedralMesh) -> BoolArray:
    """Return which nodes are held, shape (n_nodes,): those on the sides across x and y.

    The body sags between them.
    """
    return _is_on_sides(mesh.positions, (0, 1))


def _is_on_sides(positions: FloatArray, axes: tuple[int, ...]) -> BoolArray:
    """Return which nodes lie on the sides of the block across these axes."""
    along = positions[:, axes]
    near = 0.5 * JITTER * CELL
    low, high = along < along.min(axis=0) + near, along > along.max(axis=0) - near
    return np.asarray(np.any(low | high, axis=1))


def sizes_up_to(sizes: tuple[int, ...], largest: int | None) -> tuple[int, ...]:
    """Return the sizes that are not above the largest one wanted; None: all of them.

    Raises:
        UsageError: no size is left.
    """
    if largest is None:
        return sizes
    left = tuple(n for n in sizes if n <= largest)
    if not left:
        raise UsageError(
            f"--largest is {largest}; the smallest body of this benchmark has {min(sizes)} "
            "tetrahedra"
        )
    return left


def block_material(law: str, *, is_damped: bool = True) -> Material:
    """Return the material of the blocks, with the default damping or with none along edges."""
    material = Material(
        young_modulus=YOUNG_MODULUS,
        density=DENSITY,
        toughness=_TOUGHNESS,
        law=law,
        poisson_ratio=POISSON_RATIO[law],
    )
    return material if is_damped else replace(material, retardation_time=0.0)


class EngineLoops:
    """A block of tissue, and the loops that advance it.

    Each method runs its loop `n` times, as `timing.Case` requests.

    Args:
        mesh: The block.
        law: Name of the law of elasticity.
        is_damped: Whether the tissue is viscous.
        is_averaged: Whether dilatation is averaged over nodes, as the engine does, or taken in
            each tetrahedron, as other engines do.
        precision: Of the forces of tetrahedra, `double` or `single`.
        has_drag: Whether the default drag slows the motion within the tissue.
        dt: Time step [s].
    """

    def __init__(
        self,
        mesh: TetrahedralMesh,
        law: str = "springs",
        *,
        is_damped: bool = True,
        is_averaged: bool = True,
        precision: str = "double",
        has_drag: bool = True,
        dt: float = FRAME_DT,
    ) -> None:
        material = block_material(law, is_damped=is_damped)
        if not has_drag:
            material = replace(material, viscous_damping=0.0)
        self._dt = dt
        self._stepper = GlobalStepper(method_of(Global(damping="step"), material.law))
        self._verlet = GlobalStepper(method_of(Verlet(), material.law))
        solver = SolverSettings(relaxation=Global(damping="step"), precision=precision)
        self._tissue = Tissue(mesh, material, fixed=held_nodes(mesh), solver=solver)
        if not is_averaged:
            elasticity = self._tissue._model.elasticity
            plain = neo_hookean(material.mu, material.lam, averaged=False)
            solid = elasticity.arrays.solid.replaced(law=plain)
            viscosity = no_viscosity(solid, is_viscous=is_damped and law != "springs")
            elasticity.arrays = elasticity.arrays.replaced(solid=solid, viscosity=viscosity)

    def forces(self, n: int) -> None:
        """Evaluate the forces on all nodes, and the accelerations that follow."""
        system = self._tissue._model
        # With viscosity among the forces; the engine's own steps let it act in between.
        damped = system.context.replaced(surroundings=system.surroundings)
        for _ in range(n):
            accelerations(damped, system.stages.a1)

    def euler_steps(self, n: int) -> None:
        """Take steps of the symplectic Euler method: one evaluation of the forces each.

        The engine itself steps otherwise; other engines step like this, so like is compared with
        like.
        """
        body = self._tissue._body
        for _ in range(n):
            self.forces(1)
            _kick_and_drift(body, self._tissue._model.stages.a1, self._dt)

    def runge_kutta_steps(self, n: int) -> None:
        """Take steps of the Runge-Kutta-Nystroem method: three evaluations of the forces each."""
        self._take(self._stepper, n)

    def verlet_steps(self, n: int) -> None:
        """Take steps of position Verlet: one evaluation of the forces each."""
        self._take(self._verlet, n)

    def _take(self, stepper: GlobalStepper, n: int) -> None:
        increment = Increment(NOWHERE, n * self._dt, 0.0, 1.0)
        stepper.take_steps(self._tissue._model, increment, n)

    def frames(self, n: int) -> None:
        """Advance the body by whole frames, without a blade."""
        for _ in range(n):
            self._tissue.step(None, self._dt)

    @property
    def springs(self) -> tuple[IntArray, FloatArray]:
        """Nodes of each spring, shape (n_springs, 2), and stiffness [N/m], shape (n_springs,)."""
        rows = self._tissue._model.elasticity.arrays.springs
        counts = rows.count[: self._tissue.n_nodes]
        node = np.repeat(np.arange(len(counts)), counts)
        within = np.concatenate([np.arange(n) for n in counts])
        slots = rows.first[node] + within
        is_first = node < rows.neighbour[slots]  # each spring stands in the rows of both nodes
        ends = np.stack([node, rows.neighbour[slots]], axis=1)[is_first]
        return ends, rows.stiffness[slots][is_first]

    @property
    def masses(self) -> FloatArray:
        """Masses of the nodes [kg], shape (n_nodes,)."""
        return self._tissue.snapshot().masses

    @property
    def positions(self) -> FloatArray:
        """Positions of the nodes [m], shape (n_nodes, 3)."""
        return self._tissue.snapshot().positions


class TouchingBlocks:
    """Two blocks, one of which lies on the other: search for contacts, and their forces."""

    N_SETTLING = 100
    """Frames in which the upper block comes to rest."""

    def __init__(self, n_tetrahedra: int) -> None:
        lower = jittered_block(n_tetrahedra)
        height = float(np.ptp(lower.positions[:, 2]))
        upper = lower.positions + np.array([0.0, 0.0, height])
        mesh = TetrahedralMesh(
            np.vstack([lower.positions, upper]),
            np.vstack([lower.tetrahedra, lower.tetrahedra + len(upper)]),
        )
        fixed = np.zeros(len(mesh.positions), dtype=bool)
        fixed[: len(upper)] = held_nodes(lower)
        self._tissue = Tissue(mesh, block_material("springs"), fixed=fixed)
        for _ in range(self.N_SETTLING):
            self._tissue.step(None, FRAME_DT)

    @property
    def _contact(self) -> SelfContact:
        contact = self._tissue._model.contact
        assert isinstance(contact, SelfContact)
        return contact

    @property
    def n_contacts(self) -> int:
        """Number of contacts that press."""
        return int(self._contact.forces.n_pressing)

    def new_searches(self, n: int) -> None:
        """Find the pairs that may touch as after all nodes have moved far, and the contacts.

        The searches of `searches` are part of it.
        """
        search = self._contact.search
        for _ in range(n):
            search.pairs.n_updates += 1  # all nodes count as new
            search.is_pairing_due = 1
            self.searches(1)

    def searches(self, n: int) -> None:
        """Find the contacts, as in every time step."""
        system = self._tissue._model
        for _ in range(n):
            system.contact.begin()
            system.find_contacts(FRAME_DT)

    def forces(self, n: int) -> None:
        """Evaluate the forces of the contacts, with sliding, as in every Verlet step."""
        system, body, contacts = self._tissue._model, self._tissue._body, self._contact.forces
        x, v, external = body.positions, body.velocities, system.stages.external
        for _ in range(n):
            add_contact_forces(contacts, x, v, FRAME_DT, external)
            end_contact_substep(contacts, x, v, external)


@kernel
def _kick_and_drift(body: Body, accelerations: FloatArray, dt: float) -> None:
    for i in range(body.n_nodes):
        for c in range(3):
            body.velocities[i, c] += dt * accelerations[i, c]
            body.positions[i, c] += dt * body.velocities[i, c]
