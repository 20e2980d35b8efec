"""Random lists of contacts."""

import numpy as np

from tissue import block
from tissue.contact.response.contacts import PenaltyForces, new_penalty_forces
from tissue.contact.response.stiffness import new_limits, split_masses
from tissue.mesh.body import Body, build_body

NODE_SIZE = 0.01
ADDED, HIGHEST = 2e7, 4e7
FRICTION = 0.3


def random_contacts(seed: int, n: int = 20) -> tuple[Body, PenaltyForces]:
    """Return a body with random masses and velocities, and contacts at random among its nodes."""
    random = np.random.default_rng(seed)
    body = build_body(block((2, 2, 2), (0.02, 0.02, 0.02)), None, None)
    n_nodes = body.n_nodes
    body.masses[:] = 10.0 ** random.uniform(-7.0, -3.0, n_nodes)
    body.velocities[:] = random.normal(size=(n_nodes, 3))
    forces = new_penalty_forces(n, FRICTION, 1e-4)
    forces.n_contacts = n
    for c in range(n):
        if random.random() < 0.2:
            forces.node[c] = random.integers(n_nodes)
            forces.weight[c] = [1.0, 0.0, 0.0, 0.0]
            forces.normal[c] = [0.0, 0.0, 1.0]
            forces.height[c] = body.positions[forces.node[c, 0], 2] + 1e-4 * random.normal()
            continue
        forces.node[c] = random.choice(n_nodes, 4, replace=False)
        forces.weight[c] = [1.0, *(-random.dirichlet([1.0, 1.0, 1.0]))]
        normal = random.normal(size=3)
        forces.normal[c] = normal / np.linalg.norm(normal)
        # Heights stand for the distance of the random nodes, so that gaps are small.
        gap = forces.normal[c] @ (forces.weight[c] @ body.positions[forces.node[c]])
        forces.height[c] = gap + 1e-4 * random.normal()
    return body, forces


def stiffened(seed: int, n: int = 20) -> tuple[Body, PenaltyForces, np.ndarray]:
    """Return random contacts with their stiffness, and what each node may bear [N/m]."""
    body, forces = random_contacts(seed, n)
    random = np.random.default_rng(seed + 1)
    frequency_squared = random.uniform(0.0, 5e7, body.n_nodes)
    limits = new_limits(NODE_SIZE, ADDED)
    limits.highest = HIGHEST
    split_masses(forces, limits, body, frequency_squared, np.zeros(body.n_nodes))
    room = np.maximum(limits.highest - frequency_squared, 0.0)
    return body, forces, body.masses * (ADDED + 0.5 * room)
