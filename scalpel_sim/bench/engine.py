"""The engine's inner loops, one at a time: the only file here that knows how they are called."""

from dataclasses import replace

import numpy as np

from scalpel_sim.bench.blocks import block_mesh, held
from scalpel_sim.bench.traffic import Traffic, traffic
from tissue import FloatArray, Law, Material, SolverSettings, TetrahedralMesh, Tissue
from tissue.contact.resolve import note_all_positions, resolve
from tissue.contact.state import REBUILD
from tissue.core.jit import kernel
from tissue.elasticity.finite_elements import neo_hookean
from tissue.integrators.global_stepper import GlobalStepper
from tissue.integrators.runge_kutta import accelerations
from tissue.integrators.step_context import Increment
from tissue.mesh.body import Body
from tissue.tissue import NOWHERE

DT = 1e-3
"""Time step [s]: that of a haptic loop."""

STIFFNESS = 3e3
"""Young's modulus of the blocks [Pa]: so soft that in cells of 10 mm a step of 1 ms is stable under
every explicit scheme that is measured here, those of the peers too."""
POISSON_RATIO: dict[Law, float] = {"springs": 0.25, "neo_hookean": 0.3}
"""What springs have without a volume term; what peers are given under their law of tetrahedra."""
DENSITY = 1e3
"""[kg/m3]."""
_TOUGHNESS = 5.0
"""[J/m2]: for an engine that warns of tissue too tough for its mesh. Nothing is cut here."""
LAWS: tuple[Law, ...] = ("springs", "neo_hookean")
"""Each is measured."""


def material(law: Law, *, is_damped: bool = True) -> Material:
    """Return what the blocks are made of, damped as by default or not along edges."""
    made = Material(
        young_modulus=STIFFNESS,
        density=DENSITY,
        toughness=_TOUGHNESS,
        law=law,
        poisson_ratio=POISSON_RATIO[law],
    )
    return made if is_damped else replace(made, retardation_time=0.0)


class Loops:
    """A block of so many tetrahedra, and the loops that make it move.

    Each method does its loop `n` times, as `timing.Case` wants it.

    Args:
        n_tetrahedra: How many.
        law: Of what.
        is_damped: Whether there are dampers along the edges.
        is_averaged: Whether volumes are averaged around nodes, as the engine has it, or kept in
            each tetrahedron, as peers have it.
    """

    def __init__(
        self,
        n_tetrahedra: int,
        law: Law = "springs",
        *,
        is_damped: bool = True,
        is_averaged: bool = True,
    ) -> None:
        mesh = block_mesh(n_tetrahedra)
        self._is_damped = is_damped
        self._stepper = GlobalStepper()
        self._tissue = Tissue(
            mesh,
            material(law, is_damped=is_damped),
            fixed=held(mesh),
            solver=SolverSettings(relaxation="global"),
        )
        if not is_averaged:
            made, elasticity = material(law), self._tissue._system.elasticity
            plain = neo_hookean(made.mu, made.lam, averaged=False)
            arrays = elasticity.arrays
            elasticity.arrays = arrays.replaced(solid=arrays.solid.replaced(law=plain))

    def forces(self, n: int) -> None:
        """Evaluate the forces on all nodes, and what they accelerate them by."""
        system = self._tissue._system
        for _ in range(n):
            accelerations(system.context, system.stages.a1)

    def euler_steps(self, n: int) -> None:
        """Take steps of the symplectic Euler method: one evaluation of the forces each.

        The engine has better; this is what peers do, for a comparison of like with like.
        """
        body = self._tissue._body
        for _ in range(n):
            self.forces(1)
            _kick_and_drift(body, self._tissue._system.stages.a1, DT)

    def runge_kutta_steps(self, n: int) -> None:
        """Take steps of the Runge-Kutta-Nystroem method: three evaluations of the forces each."""
        increment = Increment(NOWHERE, n * DT, 0.0, 1.0)
        self._stepper.take_steps(self._tissue._system, increment, n)

    def frames(self, n: int) -> None:
        """Let the body live through time steps, all included but a blade."""
        for _ in range(n):
            self._tissue.step(None, DT)

    @property
    def n_substeps(self) -> int:
        """Runge-Kutta steps that stability needs in one time step."""
        return self._tissue.step(None, DT).n_substeps

    @property
    def traffic(self) -> Traffic:
        """What a Runge-Kutta step of the springs must move and compute."""
        lengths = self._tissue._system.elasticity.arrays.springs.count[: self._tissue.n_nodes]
        return traffic(lengths.tolist(), is_damped=self._is_damped)

    @property
    def positions(self) -> FloatArray:
        """Where the nodes are [m], shape (n_nodes, 3)."""
        return self._tissue.snapshot().positions


class Touching:
    """Two blocks of which one lies on the other, and the search for what touches."""

    FALL = 100
    """Time steps that the upper one has to come to rest."""

    def __init__(self, n_tetrahedra: int) -> None:
        lower = block_mesh(n_tetrahedra)
        height = float(np.ptp(lower.positions[:, 2]))
        upper = lower.positions + np.array([0.0, 0.0, height])
        mesh = TetrahedralMesh(
            np.vstack([lower.positions, upper]),
            np.vstack([lower.tetrahedra, lower.tetrahedra + len(upper)]),
        )
        fixed = np.zeros(len(mesh.positions), dtype=bool)
        fixed[: len(upper)] = held(lower)
        self._tissue = Tissue(mesh, material("springs"), fixed=fixed)
        for _ in range(self.FALL):
            self._tissue.step(None, DT)

    @property
    def n_contacts(self) -> int:
        """Contacts that press."""
        return self._tissue._system.contact.arrays.n_pressing

    def searches(self, n: int) -> None:
        """Look for all pairs that may touch, as where faces have moved by the margin."""
        for _ in range(n):
            self._tissue._system.contact.arrays.stale = REBUILD
            self.checks(1)

    def checks(self, n: int) -> None:
        """Look at the pairs that were found, and keep them apart, as in every Runge-Kutta step."""
        contact, body = self._tissue._system.contact.arrays, self._tissue._body
        for _ in range(n):
            note_all_positions(contact, body)
            resolve(contact, body, DT)


@kernel
def _kick_and_drift(body: Body, accelerations: FloatArray, dt: float) -> None:
    for i in range(body.n_nodes):
        for c in range(3):
            body.velocities[i, c] += dt * accelerations[i, c]
            body.positions[i, c] += dt * body.velocities[i, c]
