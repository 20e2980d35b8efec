"""The arrays that kernels work on, made from a mesh as `Tissue` makes them."""

from typing import NamedTuple

import numpy as np

from tissue import BoolArray, FloatArray, Material, TetrahedralMesh
from tissue.blade.blade_state import BladeState, new_blade_state
from tissue.blade.edge import NOWHERE
from tissue.blade.edge_anchors import Anchors, new_anchors
from tissue.contact.geoms.geom_contact import no_geoms
from tissue.contact.response.contacts import new_penalty_forces
from tissue.core.thread_team import new_team
from tissue.core.vec3 import Vec3
from tissue.cutting.blade_path import new_path
from tissue.cutting.cut_surface import new_cut_surface
from tissue.cutting.workspace import Cut, SnapLimits, new_cut_scratch
from tissue.elasticity.collapse import no_collapse
from tissue.elasticity.finite_elements import no_solid
from tissue.elasticity.internal_forces import Elastic, Surroundings
from tissue.elasticity.mass_scaling import no_mass_scaling
from tissue.elasticity.springs import (
    SPRING_POOL_MARGIN,
    Springs,
    bound_frequencies,
    build_rows,
    no_springs,
)
from tissue.elasticity.stars import room_for_stars
from tissue.elasticity.viscous_stress import no_viscosity
from tissue.forces.attachments import no_attachments
from tissue.forces.step_context import Damping, Stages, StepContext, new_stages, supports_at_rest
from tissue.forces.terms import accelerations
from tissue.integrators.damping import damp
from tissue.integrators.driver import take_steps
from tissue.integrators.runge_kutta import runge_kutta_nystroem
from tissue.laws.energy_density import volume_term
from tissue.mesh.body import Body, build_body, grown_body
from tissue.mesh.changes import SPARE_NODES, new_change
from tissue.mesh.pieces import no_loose_pieces
from tissue.mesh.rigid_cores import no_cores
from tissue.mesh.star import LARGEST_STAR, no_visits

DENSITY, YOUNG_MODULUS = 1000.0, 10e3


def cut_of(mesh: TetrahedralMesh, n_samples: int = 2) -> Cut:
    """Return the arrays of a cut step for an uncut body, with spare capacity."""
    n_nodes, n_tetrahedra = len(mesh.positions) + SPARE_NODES + 512, 8 * len(mesh.tetrahedra) + 4096
    return Cut(
        body=grown_body(build_body(mesh, None, None), n_nodes, n_tetrahedra),
        visits=no_visits(n_nodes, n_tetrahedra),
        surface=new_cut_surface(n_nodes, n_tetrahedra),
        path=new_path(n_samples),
        change=new_change(),
        scratch=new_cut_scratch(n_tetrahedra),
        limits=SnapLimits(snap=0.3, floor=0.0, guard=0.0, crumb=0.0),
    )


def springs_of(body: Body, young_modulus: float = YOUNG_MODULUS) -> Springs:
    """Compute the masses of the body in place; return its springs."""
    n = body.n_nodes
    capacity = len(body.rest)
    body.materials.spring_modulus[:] = young_modulus
    springs = no_springs(capacity, 40 * capacity + SPRING_POOL_MARGIN)
    written = build_rows(
        body,
        no_visits(capacity, len(body.tetrahedra)),
        springs,
        np.arange(n),
        n,
        np.zeros(LARGEST_STAR, dtype=np.int64),
    )
    assert written == n
    bound_frequencies(body, springs, np.arange(n), n)
    return springs


def row(springs: Springs, node: int) -> dict[int, tuple[float, float]]:
    """Return the springs of a node: a dict of neighbour to (stiffness, rest pull)."""
    first = int(springs.first[node])
    slots = range(first, first + int(springs.count[node]))
    return {
        int(springs.neighbour[s]): (float(springs.stiffness[s]), float(springs.rest_pull[s]))
        for s in slots
    }


def dense_modes(body: Body, springs: Springs) -> FloatArray:
    """Return M^-1/2 K M^-1/2 of the free nodes of a body at rest [1/s2]."""
    n = body.n_nodes
    stiffness = np.zeros((n, 3, n, 3))
    for i in range(n):
        for j, (k, _) in row(springs, i).items():
            direction = body.rest[j] - body.rest[i]
            block = k * np.outer(direction, direction) / (direction @ direction)
            stiffness[i, :, i] += block
            stiffness[i, :, j] -= block
    free = np.repeat(~body.fixed[:n], 3)
    weights = 1.0 / np.sqrt(np.repeat(body.masses[:n], 3)[free])
    return weights[:, None] * stiffness.reshape(3 * n, 3 * n)[np.ix_(free, free)] * weights


def elastic_of(springs: Springs, n_nodes: int = 0) -> Elastic:
    """Return the elastic arrays of a body with springs and no tetrahedra.

    `n_nodes`: nodes that there is room for beside the springs.
    """
    solid = no_solid(volume_term(0.0), n_nodes, 0, room_for_stars(n_nodes, 0))
    frequencies, n_nodes = np.zeros(len(springs.first)), len(springs.first)
    return Elastic(
        springs=springs,
        solid=solid,
        viscosity=no_viscosity(solid, is_viscous=False),
        collapsing=no_collapse(0, 0, is_needed=False),
        has_springs=1,
        has_tetrahedra=0,
        highest=0.0,
        highest_of_tetrahedra=0.0,
        highest_of_dampers=0.0,
        scaling=no_mass_scaling(),
        frequency_squared=frequencies,
        n_touching=0,
        highest_touching=0.0,
        allowed_touching=0.0,
        touching=np.zeros(n_nodes, np.int64),
        of_contact=np.zeros(n_nodes),
    )


def line_blade(anchors: Anchors, material: Material = Material()) -> BladeState:
    """Return the state of a blade without thickness, with these anchors."""
    return new_blade_state(anchors, None, material, 1.0, 0)


class Network(NamedTuple):
    """A body of springs that moves without being touched by a blade."""

    body: Body
    springs: Springs
    blade: BladeState
    stages: Stages
    surroundings: Surroundings

    @property
    def context(self) -> StepContext:
        """Return the context of an integration step."""
        n_nodes, n_tetrahedra = len(self.body.rest), len(self.body.tetrahedra)
        return StepContext(
            body=self.body,
            elastic=elastic_of(self.springs),
            blade=self.blade,
            contacts=new_penalty_forces(0, 0.0, 0.0),
            geoms=no_geoms(self.body, 1.0).arrays,
            surroundings=self.surroundings,
            damping=Damping(
                interval=1,
                owed=0.0,
                dissipated=0.0,
                is_counted=0,
                rate_uncut=0.0,
                retardation_time=0.0,
                drag=0.0,
            ),
            supports=supports_at_rest(),
            attachments=no_attachments(),
            loose=no_loose_pieces(),
            cores=no_cores(),
            stages=self.stages,
            visits=no_visits(n_nodes, n_tetrahedra),
            team=new_team(),
        )

    def forces(self) -> FloatArray:
        """Return the forces on the nodes at their current positions and velocities [N]."""
        out = np.zeros_like(self.body.positions)
        accelerations(self.context, out)
        return out * self.body.masses[:, None]

    def damped_between_steps(
        self,
        method: int,
        h: float,
        n: int = 1,
        *,
        interval: int = 1,
        is_running: bool = False,
    ) -> Damping:
        """Take `n` steps of `h` [s] with damping between steps; return the damping.

        Args:
            method: Number of the method (`tissue.integrators.methods`).
            h: Length of a step [s].
            n: Number of steps.
            interval: Steps from one time that damping acts to the next.
            is_running: Whether there are steps before and after: then half of the damping of the
                one before is owed at the begin, and half of that of the last at the end. If not,
                no damping is owed at the end.
        """
        around, context = self.surroundings, self.context
        damping = Damping(
            interval=interval,
            owed=0.5 * interval * h if is_running else 0.0,
            dissipated=0.0,
            is_counted=0,
            rate_uncut=0.0,
            retardation_time=around.retardation_time,
            drag=around.drag,
        )
        undamped = around.replaced(drag=0.0, retardation_time=0.0)
        context = context.replaced(surroundings=undamped, damping=damping)
        take_steps(context, method, NOWHERE, n * h, 0.0, 1.0, n)
        if not is_running:
            damp(context, 0.0, n * h, False)
        return damping

    def advance(self, h: float, n: int = 1) -> None:
        """Take `n` Runge-Kutta steps of `h` [s], with damping in every stage."""
        context = self.context
        for _ in range(n):
            runge_kutta_nystroem(context, NOWHERE, h, 0.0, 1.0)


def network_of(
    mesh: TetrahedralMesh,
    fixed: BoolArray | None = None,
    retardation_time: float = 0.0,
    viscous_damping: float = 0.0,
) -> Network:
    """Return the network of springs of a mesh, at rest."""
    body = build_body(mesh, None, fixed)
    springs = springs_of(body)
    stages = new_stages(len(mesh.positions))
    blade = line_blade(new_anchors(2, 1.0, 4.0 * YOUNG_MODULUS))
    surroundings = Surroundings(
        gravity=Vec3(0.0, 0.0, 0.0), drag=viscous_damping, retardation_time=retardation_time
    )
    return Network(body, springs, blade, stages, surroundings)


def oscillator(
    frequency: float, retardation_time: float = 0.0, viscous_damping: float = 0.0
) -> Network:
    """Return one mass of 1 kg on a spring along x, 1 m from the fixed node at its other end.

    While it moves along x the spring is linear: x'' = -w^2 (x - 1) - 2 zeta w x'.
    """
    mesh = TetrahedralMesh(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 1, 2, 3]]))
    network = network_of(
        mesh, np.array([True, False, True, True]), retardation_time, viscous_damping
    )
    springs = network.springs
    springs.count[:] = 0
    springs.count[1] = 1
    springs.neighbour[:] = 1
    springs.stiffness[:] = springs.rest_pull[:] = 0.0
    springs.neighbour[springs.first[1]] = 0
    springs.stiffness[springs.first[1]] = springs.rest_pull[springs.first[1]] = frequency**2
    network.body.masses[:] = 1.0
    return network
