"""A force that keeps tetrahedra from turning inside out under law springs, which alone do not.

The springs along the edges of a tetrahedron are at rest in its mirror image, too. One that is
pressed flat may come out on the other side and stays there: in a block that was held at two sides,
after 20 random strokes of a blade, 139 of 945 were inside out. Lips on such tetrahedra meet from
the wrong side, so that a body trembled for ever, and cuts of what is nearly flat set free energy
that no step of the integrator follows. Where J, the volume over that at rest, falls below a limit,

    W = k/2 (J_limit - J)^2,     f_i = k (J_limit - J) dJ/dx_i,     k = E V

is added, as much as Young's modulus E resists elsewhere; above the limit springs are as they were.
W is zero with its slope where it begins, so that nothing jumps.

Teschner et al. (2004), A versatile and robust model for geometrically complex deformable solids,
keep the volume of tetrahedra by such a term; here it acts on one side.
"""

from typing import Final, NamedTuple

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.core.vec3 import Vec3, add, axpy, cross, dot, norm, scale, store, sub, vec3
from tissue.geometry.tetrahedron import tetrahedron_volume
from tissue.mesh.body import Body

J_LISTED: Final = 0.5
"""J below which it is listed, now or by how it moves, as it may come to the limit before the next
increment. Smaller: more is listed so late that it begins to resist where it is, below the limit;
larger: more of what never comes to the limit is listed."""

FASTEST_CHANGE: Final = 6.0
"""Highest rate of change of J, in speeds of the fastest node over the node size: three altitudes,
each between nodes that go opposite ways. What cannot be flat so soon is not looked at."""

INCREMENTS_AHEAD: Final = 2.0
"""For how long J is taken to change as fast as it does [increments]: it may become faster."""

J_LIMIT: Final = 0.3
"""J below which a tetrahedron resists by itself. Larger: tissue that is merely pressed is no more
that of the springs; smaller: the term must be stiffer to turn what moves at the same speed."""

LARGEST_ADDED_SHARE: Final = 2.0
"""Most that a tetrahedron adds to w^2 of its nodes, as a share of the bound of the body at rest.
Larger: slivers, whose altitudes are small, make steps short; smaller: slivers turn over."""

_UNKNOWN: Final = -1.0
"""`slack` before the first search: there must be one."""


class Collapsing(Arrays):
    """The tetrahedra that are pressed flat, and how much they resist."""

    is_needed: IntCell
    """1 where tetrahedra of springs are kept from turning inside out, else 0."""
    n: IntCell
    """Number of tetrahedra that are listed."""
    slack: FloatCell
    """Fall of J of those that are not listed after which one may be listed."""
    highest: FloatCell
    """Bound on w^2 at their nodes, with that of the springs [1/s2]; 0 where none is listed."""
    listed: IntArray = sized("tetrahedra")
    """The tetrahedra, shape (tetrahedron capacity,)."""
    stiffness: FloatArray = sized("tetrahedra")
    """k of each tetrahedron that is listed [J], 0 of others; shape (tetrahedron capacity,)."""
    limit: FloatArray = sized("tetrahedra")
    """J below which each of them resists, shape (tetrahedron capacity,)."""
    per_volume: FloatArray = sized("tetrahedra")
    """1 / (6 V) of each tetrahedron at rest [1/m3], shape (tetrahedron capacity,)."""
    scratch: FloatArray = sized("nodes")
    """For a search and for what they add to w^2 of a node, shape (node capacity,)."""


def no_collapse(n_nodes: int, n_tetrahedra: int, *, is_needed: bool) -> Collapsing:
    """Return that nothing is flat, with room for that many nodes and tetrahedra.

    Args:
        n_nodes: Room for nodes.
        n_tetrahedra: Room for tetrahedra.
        is_needed: Whether tetrahedra need this.
    """
    sizes = {"nodes": n_nodes, "tetrahedra": n_tetrahedra}
    return Collapsing.new(sizes, is_needed=int(is_needed), slack=_UNKNOWN)


class _Shape(NamedTuple):
    """A tetrahedron as it is deformed."""

    j: float
    """Its volume over that at rest."""
    a: Vec3
    """dJ/dx of its first node [1/m]."""
    b: Vec3
    """That of its second."""
    c: Vec3
    """That of its third."""
    d: Vec3
    """That of its fourth."""


@kernel
def _shape(collapsing: Collapsing, body: Body, positions: FloatArray, t: int) -> _Shape:
    """Return J of tetrahedron `t` at `positions` [m], and its derivatives."""
    nodes, per_volume = body.tetrahedra, collapsing.per_volume[t]
    origin = vec3(positions, nodes[t, 0])
    ab = sub(vec3(positions, nodes[t, 1]), origin)
    ac = sub(vec3(positions, nodes[t, 2]), origin)
    ad = sub(vec3(positions, nodes[t, 3]), origin)
    b = scale(per_volume, cross(ac, ad))
    c = scale(per_volume, cross(ad, ab))
    d = scale(per_volume, cross(ab, ac))
    return _Shape(dot(ab, b), scale(-1.0, add(add(b, c), d)), b, c, d)


@kernel
def renew_collapsing(
    collapsing: Collapsing, body: Body, tetrahedra: IntArray, n: int, highest: float
) -> None:
    """Measure tetrahedra whose shape at rest has changed, and list those of them that are flat.

    Args:
        collapsing: Written, if tetrahedra need this.
        body: The body.
        tetrahedra: Tetrahedra, of which the first `n` are new or another.
        n: How many these are.
        highest: Bound on w^2 of the body at rest [1/s2].
    """
    if collapsing.is_needed == 0:
        return
    for i in range(n):
        t = tetrahedra[i]
        was_listed = collapsing.stiffness[t] > 0.0
        collapsing.per_volume[t] = 1.0 / (6.0 * tetrahedron_volume(body.rest, body.tetrahedra, t))
        collapsing.stiffness[t] = 0.0
        shape = _shape(collapsing, body, body.positions, t)
        if was_listed or shape.j < J_LISTED:
            collapsing.stiffness[t] = _stiffness(collapsing, body, shape, t, highest)
            collapsing.limit[t] = J_LIMIT
            if not was_listed:
                collapsing.listed[collapsing.n] = t
                collapsing.n += 1
        else:
            collapsing.slack = min(collapsing.slack, shape.j - J_LISTED)


@kernel
def find_collapsing(
    collapsing: Collapsing,
    body: Body,
    frequency_squared: FloatArray,
    highest: float,
    fastest: float,
    node_size: float,
    seconds: float,
) -> None:
    """List the tetrahedra that are flat, and bound the frequencies at their nodes.

    All are looked at only where nodes have moved so far that one may have become flat. One keeps
    its stiffness as long as it is listed. What was flat before it was listed begins to resist where
    it is, and its limit goes back with it, so that nothing gets energy from nowhere.

    Args:
        collapsing: Written, if tetrahedra need this.
        body: The body.
        frequency_squared: Bound on w^2 of each node by the springs [1/s2].
        highest: Bound on w^2 of the body at rest [1/s2].
        fastest: Speed of the fastest node [m/s].
        node_size: Of the smallest node [m].
        seconds: Length of the increment [s].
    """
    if collapsing.is_needed == 0:
        return
    seconds *= INCREMENTS_AHEAD
    fall = FASTEST_CHANGE / node_size * seconds
    collapsing.slack -= fall * fastest
    if collapsing.slack < 0.0:
        _search(collapsing, body, highest, fall, seconds)
        collapsing.slack -= fall * fastest
    else:
        for i in range(collapsing.n):
            t = collapsing.listed[i]
            _raise_limit(collapsing, t, _j(collapsing, body, t))
    _bound_frequencies(collapsing, body, frequency_squared)


@kernel
def _search(
    collapsing: Collapsing, body: Body, highest: float, fall: float, seconds: float
) -> None:
    """List all tetrahedra that are flat.

    Args:
        collapsing: Written.
        body: The body.
        highest: Bound on w^2 of the body at rest [1/s2].
        fall: How far J falls at most, over the speed of its fastest node [s/m].
        seconds: For how long it is taken to change as fast as it does [s].
    """
    n, least, speeds_squared = 0, 1.0, collapsing.scratch
    for i in range(body.n_nodes):
        v = vec3(body.velocities, i)
        speeds_squared[i] = dot(v, v)
    for t in range(body.n_tetrahedra):
        j = _j(collapsing, body, t)
        flat = j < J_LISTED
        if not flat and fall * fall * _fastest(body, speeds_squared, t) > (j - J_LISTED) ** 2:
            flat = _will_be_flat(collapsing, body, t, seconds)
        if not flat:
            collapsing.stiffness[t] = 0.0
            least = min(least, j)
            continue
        if collapsing.stiffness[t] == 0.0:
            shape = _shape(collapsing, body, body.positions, t)
            collapsing.stiffness[t] = _stiffness(collapsing, body, shape, t, highest)
            collapsing.limit[t] = min(j, J_LIMIT)
        _raise_limit(collapsing, t, j)
        collapsing.listed[n] = t
        n += 1
    collapsing.n = n
    collapsing.slack = least - J_LISTED


@kernel
def _fastest(body: Body, speeds_squared: FloatArray, t: int) -> float:
    """Return the square of the speed of the fastest node of tetrahedron `t` [m2/s2]."""
    nodes, fastest = body.tetrahedra, 0.0
    for q in range(4):
        fastest = max(fastest, speeds_squared[nodes[t, q]])
    return fastest


@kernel
def _j(collapsing: Collapsing, body: Body, t: int) -> float:
    """Return J of tetrahedron `t`."""
    volume = tetrahedron_volume(body.positions, body.tetrahedra, t)
    j: float = 6.0 * volume * collapsing.per_volume[t]
    return j


@kernel
def _raise_limit(collapsing: Collapsing, t: int, j: float) -> None:
    """Move the limit of a tetrahedron, of which J is `j`, back to `J_LIMIT` as it goes there."""
    collapsing.limit[t] = min(max(j, collapsing.limit[t]), J_LIMIT)


@kernel
def _will_be_flat(collapsing: Collapsing, body: Body, t: int, seconds: float) -> bool:
    """Whether J of tetrahedron `t` falls to `J_LISTED` in that time [s], as fast as it does now."""
    shape, nodes, v = _shape(collapsing, body, body.positions, t), body.tetrahedra, body.velocities
    rate = dot(shape.a, vec3(v, nodes[t, 0])) + dot(shape.b, vec3(v, nodes[t, 1]))
    rate += dot(shape.c, vec3(v, nodes[t, 2])) + dot(shape.d, vec3(v, nodes[t, 3]))
    return bool(shape.j + seconds * rate < J_LISTED)


@kernel
def _stiffness(collapsing: Collapsing, body: Body, shape: _Shape, t: int, highest: float) -> float:
    """Return k of tetrahedron `t` [J]: E V, or what its nodes bear."""
    most = 0.0
    for q in range(4):
        most = max(most, _frequency_at(collapsing, body, shape, t, q))
    modulus = body.materials.young_modulus[body.material[t]]
    k = modulus / (6.0 * abs(collapsing.per_volume[t]))
    if k * most > LARGEST_ADDED_SHARE * highest:  # not where all of its nodes are fixed
        k = LARGEST_ADDED_SHARE * highest / most
    stiffness: float = k
    return stiffness


@kernel
def _frequency_at(collapsing: Collapsing, body: Body, shape: _Shape, t: int, q: int) -> float:
    """Return what tetrahedron `t` adds to w^2 of its node `q`, per k [1/(J s2)]; 0 if it is fixed.

    The second derivatives of W are k g g^T, g those of J, of which the only frequency is
    k sum(g_i^2 / m_i), and k (J - J_limit) times the second derivatives of J: for two nodes the
    edge between the other two, over 6 V.
    """
    nodes, x, masses = body.tetrahedra, body.positions, body.masses
    if body.fixed[nodes[t, q]]:
        return 0.0
    alone, edges = 0.0, 0.0
    for i in range(4):
        node = nodes[t, i]
        if body.fixed[node]:
            continue
        g = shape.a if i == 0 else shape.b if i == 1 else shape.c if i == 2 else shape.d
        alone += dot(g, g) / masses[node]
        if i != q:
            j, k = _others(i, q)
            edges += norm(sub(vec3(x, nodes[t, j]), vec3(x, nodes[t, k])))
    depth = max(J_LIMIT - shape.j, J_LIMIT)
    bent = depth * edges * abs(collapsing.per_volume[t]) / masses[nodes[t, q]]
    frequency_squared: float = alone + bent
    return frequency_squared


@kernel
def _others(i: int, q: int) -> tuple[int, int]:
    """Return the two corners of a tetrahedron next to two."""
    first = 0
    while first in (i, q):
        first += 1
    return first, 6 - i - q - first


@kernel
def _bound_frequencies(collapsing: Collapsing, body: Body, frequency_squared: FloatArray) -> None:
    """Write the bound on w^2 at the nodes of what is listed, springs and all."""
    x, nodes, added = body.positions, body.tetrahedra, collapsing.scratch
    for i in range(collapsing.n):
        for q in range(4):
            added[nodes[collapsing.listed[i], q]] = 0.0
    highest = 0.0
    for i in range(collapsing.n):
        t = collapsing.listed[i]
        shape = _shape(collapsing, body, x, t)
        for q in range(4):
            node = nodes[t, q]
            added[node] += collapsing.stiffness[t] * _frequency_at(collapsing, body, shape, t, q)
            highest = max(highest, frequency_squared[node] + added[node])
    collapsing.highest = highest


@kernel
def clear_collapse_forces(collapsing: Collapsing, body: Body, external: FloatArray) -> None:
    """Set the forces on the nodes of what is listed to zero."""
    for i in range(collapsing.n):
        for q in range(4):
            store(external, body.tetrahedra[collapsing.listed[i], q], Vec3(0.0, 0.0, 0.0))


@kernel
def add_collapse_forces(
    collapsing: Collapsing, body: Body, positions: FloatArray, external: FloatArray
) -> None:
    """Add the forces of what is flat at `positions` [m] to those on the nodes [N]."""
    nodes = body.tetrahedra
    for i in range(collapsing.n):
        t = collapsing.listed[i]
        shape = _shape(collapsing, body, positions, t)
        if shape.j < collapsing.limit[t]:
            push = collapsing.stiffness[t] * (collapsing.limit[t] - shape.j)
            _push(external, nodes[t, 0], push, shape.a)
            _push(external, nodes[t, 1], push, shape.b)
            _push(external, nodes[t, 2], push, shape.c)
            _push(external, nodes[t, 3], push, shape.d)


@kernel
def _push(external: FloatArray, node: int, push: float, gradient: Vec3) -> None:
    store(external, node, axpy(push, gradient, vec3(external, node)))


@kernel
def collapse_energy(collapsing: Collapsing, body: Body) -> float:
    """Return the energy in what is flat [J]."""
    energy = 0.0
    for i in range(collapsing.n):
        t = collapsing.listed[i]
        depth = collapsing.limit[t] - _shape(collapsing, body, body.positions, t).j
        if depth > 0.0:
            energy += 0.5 * collapsing.stiffness[t] * depth * depth
    return energy
