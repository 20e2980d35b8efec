"""Slow reference versions of kernels, written in the obvious form in plain Python and NumPy."""

import itertools
from fractions import Fraction

import numpy as np

from tissue import FloatArray, IntArray
from tissue.mesh.body import OUTER


def determinant(a, b, c, d) -> int:
    """Return six times the signed volume of four lattice points, in Python's exact integers."""
    u, v, w = ([int(q) - int(p) for p, q in zip(a, x, strict=True)] for x in (b, c, d))
    return (
        w[0] * (u[1] * v[2] - u[2] * v[1])
        + w[1] * (u[2] * v[0] - u[0] * v[2])
        + w[2] * (u[0] * v[1] - u[1] * v[0])
    )


def pierced_at(a, b, p, q, r) -> list[Fraction] | None:
    """Return the weights of the point where line ab meets plane pqr; None if they are parallel."""
    weights = [determinant(a, b, *edge) for edge in ((q, r), (r, p), (p, q))]
    total = sum(weights)
    return None if total == 0 else [Fraction(w, total) for w in weights]


def links(tetrahedra: IntArray) -> IntArray:
    """Return the link of each face: the other tetrahedron with a face of the same three nodes."""
    out = np.full(tetrahedra.shape, OUTER)
    faces = [[frozenset(t) - {node} for node in t] for t in tetrahedra.tolist()]
    for (t, of_t), (u, of_u) in itertools.permutations(enumerate(faces), 2):
        for face in set(of_t) & set(of_u):
            out[t, of_t.index(face)] = 4 * u + of_u.index(face)
    return out


def star(tetrahedra: IntArray, node: int) -> set[int]:
    """Return the tetrahedra that have `node` as a corner."""
    return set(np.flatnonzero((tetrahedra == node).any(axis=1)).tolist())


def volume(corners: FloatArray) -> float:
    """Return the signed volume of a tetrahedron with these corners [m3]."""
    return float(np.linalg.det(corners[1:] - corners[0])) / 6.0


def node_size(rest: FloatArray, tetrahedra: IntArray, node: int) -> float:
    """Return the least altitude from `node`: three times volume over area of the face opposite."""
    altitudes = []
    for t in star(tetrahedra, node):
        face = rest[[n for n in tetrahedra[t] if n != node]]
        area = 0.5 * np.linalg.norm(np.cross(face[1] - face[0], face[2] - face[0]))
        altitudes.append(3.0 * volume(rest[tetrahedra[t]]) / area)
    return float(min(altitudes))


def masses(rest: FloatArray, tetrahedra: IntArray, density: float) -> FloatArray:
    """Return the mass of each node: a quarter of each tetrahedron around it [kg]."""
    out = np.zeros(len(rest))
    for nodes in tetrahedra:
        out[nodes] += 0.25 * density * volume(rest[nodes])
    return out


def stiffnesses(
    rest: FloatArray, tetrahedra: IntArray, young_modulus: float
) -> dict[tuple[int, int], float]:
    """Return the spring of each edge: k = E * (volume around it) / (rest length)^2 [N/m]."""
    around: dict[tuple[int, int], float] = {}
    for nodes in tetrahedra:
        for a, b in itertools.combinations(sorted(nodes.tolist()), 2):
            around[a, b] = around.get((a, b), 0.0) + volume(rest[nodes])
    return {
        (a, b): young_modulus * v / float(np.sum((rest[b] - rest[a]) ** 2))
        for (a, b), v in around.items()
    }


def elastic_energy(
    springs: dict[tuple[int, int], float], rest: FloatArray, positions: FloatArray
) -> float:
    """Return the elastic energy: the sum of k (l - l0)^2 / 2 over the springs [J]."""
    energy = 0.0
    for (a, b), k in springs.items():
        stretch = np.linalg.norm(positions[b] - positions[a]) - np.linalg.norm(rest[b] - rest[a])
        energy += 0.5 * k * float(stretch) ** 2
    return energy


def forces(
    springs: dict[tuple[int, int], float],
    rest: FloatArray,
    positions: FloatArray,
    velocities: FloatArray,
    retardation_time: float = 0.0,
) -> FloatArray:
    """Return the force on each node: the pull of every spring and its damper on both ends [N]."""
    out = np.zeros_like(positions)
    for (a, b), k in springs.items():
        d = positions[b] - positions[a]
        length = np.linalg.norm(d)
        direction = d / length
        pull = k * (length - np.linalg.norm(rest[b] - rest[a]))
        pull += retardation_time * k * float((velocities[b] - velocities[a]) @ direction)
        out[a] += pull * direction
        out[b] -= pull * direction
    return out
