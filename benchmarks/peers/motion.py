"""Sinking of a body in its first swing under gravity: converged motion, and the error of it.

The converged motion of each law is computed here in NumPy, apart from all engines: so an engine is
compared with its own law, and what is left is the error of its time step and its solver.
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from benchmarks.peers.serving import SWING_INSTANTS, SWING_INTERVAL, PeerBody

_Array = npt.NDArray[np.float64]
_Forces = Callable[[_Array], _Array]

_FINE_DT = 2.5e-4
"""Time step of the converged motion [s]: with a half of it the sag changes by less than 0.01 %."""
_POLAR_ITERATIONS = 4
"""Newton's iterations for the rotation in a deformation; their error squares in each, from the
some 0.1 of the block's strain."""


def converged_sag(body: PeerBody, law: str) -> _Array:
    """Return the sag of a law's converged motion from rest [m], shape (SWING_INSTANTS,).

    The motion is that of lumped masses without damping, by velocity Verlet in fine steps.

    Args:
        body: The body at rest.
        law: `springs`, `neo_hookean`, `st_venant_kirchhoff` or `corotational`.
    """
    forces = _spring_forces(body) if law == "springs" else _solid_forces(body, law)
    steps = round(SWING_INTERVAL / _FINE_DT)
    x, v = body.positions.copy(), np.zeros_like(body.positions)
    a = _accelerations(body, forces(x))
    sag = np.empty(SWING_INSTANTS)
    for instant in range(SWING_INSTANTS):
        for _ in range(steps):
            v += 0.5 * _FINE_DT * a
            x += _FINE_DT * v
            a = _accelerations(body, forces(x))
            v += 0.5 * _FINE_DT * a
        sag[instant] = np.mean(body.positions[:, 2] - x[:, 2])
    return sag


def error_of(sag: npt.ArrayLike, converged: _Array) -> float:
    """Return the largest error of a sag at any instant, over the largest converged sag."""
    return float(np.abs(np.asarray(sag, dtype=float) - converged).max() / converged.max())


def _accelerations(body: PeerBody, forces: _Array) -> _Array:
    """Return accelerations with gravity [m/s2]; held nodes have none."""
    a = forces / body.masses[:, None]
    a[:, 2] -= body.gravity
    a[body.held] = 0.0
    return a


def _spring_forces(body: PeerBody) -> _Forces:
    """Return the function that computes the forces of springs [N] from positions [m]."""
    i, j = body.edges.T
    rest = np.linalg.norm(body.positions[j] - body.positions[i], axis=1)

    def forces(x: _Array) -> _Array:
        along = x[j] - x[i]
        length = np.linalg.norm(along, axis=1)
        pull = (body.stiffness * (1.0 - rest / length))[:, None] * along
        return _summed(np.r_[i, j], np.r_[pull, -pull], len(x))

    return forces


def _solid_forces(body: PeerBody, law: str) -> _Forces:
    """Return the function that computes the forces of linear tetrahedra [N] from positions [m]."""
    stress = _STRESS[law]
    corners = body.tetrahedra
    inverse = np.linalg.inv(_edges_from_first(body.positions, corners))
    volume = np.abs(1.0 / np.linalg.det(inverse)) / 6.0
    nodes = corners.T.ravel()

    def forces(x: _Array) -> _Array:
        deformation = _edges_from_first(x, corners) @ inverse
        p = stress(deformation, body.mu, body.lam)
        of_edges = -volume[:, None, None] * (p @ np.swapaxes(inverse, 1, 2))
        rows = np.concatenate([-of_edges.sum(axis=2), *np.moveaxis(of_edges, 2, 0)])
        return _summed(nodes, rows, len(x))

    return forces


def _edges_from_first(x: _Array, corners: npt.NDArray[np.int32]) -> _Array:
    """Return the edges from the first corner of each tetrahedron as columns [m]."""
    return np.stack([x[corners[:, k]] - x[corners[:, 0]] for k in (1, 2, 3)], axis=2)


def _summed(nodes: npt.NDArray[np.int32], rows: _Array, n_nodes: int) -> _Array:
    """Return the sum of the rows of each node, shape (n_nodes, 3)."""
    return np.stack([np.bincount(nodes, rows[:, c], n_nodes) for c in range(3)], axis=1)


def _neo_hookean(f: _Array, mu: float, lam: float) -> _Array:
    """Return the first Piola-Kirchhoff stress of stable neo-Hookean tissue [Pa].

    Smith, de Goes and Kim 2018, without the term that resists collapse.
    """
    j = np.linalg.det(f)
    cofactor = j[:, None, None] * _inverse_transpose(f)
    stress: _Array = mu * f + ((lam + mu) * (j - 1.0) - mu)[:, None, None] * cofactor
    return stress


def _st_venant_kirchhoff(f: _Array, mu: float, lam: float) -> _Array:
    """Return the first Piola-Kirchhoff stress [Pa] that is linear in Green's strain."""
    return f @ _isotropic(0.5 * (np.swapaxes(f, 1, 2) @ f - np.eye(3)), mu, lam)


def _corotational(f: _Array, mu: float, lam: float) -> _Array:
    """Return the first Piola-Kirchhoff stress [Pa] that is linear but for the rotation."""
    rotation = f
    for _ in range(_POLAR_ITERATIONS):
        rotation = 0.5 * (rotation + _inverse_transpose(rotation))
    stretch = np.swapaxes(rotation, 1, 2) @ f
    return rotation @ _isotropic(0.5 * (stretch + np.swapaxes(stretch, 1, 2)) - np.eye(3), mu, lam)


def _isotropic(strain: _Array, mu: float, lam: float) -> _Array:
    """Return Hooke's stress of a strain [Pa]."""
    trace = np.trace(strain, axis1=1, axis2=2)
    stress: _Array = 2.0 * mu * strain + lam * trace[:, None, None] * np.eye(3)
    return stress


def _inverse_transpose(f: _Array) -> _Array:
    return np.swapaxes(np.linalg.inv(f), 1, 2)


_STRESS: dict[str, Callable[[_Array, float, float], _Array]] = {
    "neo_hookean": _neo_hookean,
    "st_venant_kirchhoff": _st_venant_kirchhoff,
    "corotational": _corotational,
}
"""Stress of each law for tetrahedra, by its name."""
