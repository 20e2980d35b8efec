"""Checks of arguments: each error names the offending value, each warning what to do."""

import logging
import math
import os
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from tissue.blade.edge import LEAST_SINE, Edge
from tissue.core.array_types import BoolArray, FloatArray
from tissue.core.three_vectors import BladeSweep
from tissue.core.vec3 import Vec3
from tissue.cutting.scheme import checked_scheme
from tissue.integrators.options import (
    Global,
    Hierarchical,
    IntegratorOptions,
    Verlet,
    checked_relaxation,
)
from tissue.material import NEARLY_INCOMPRESSIBLE, Material
from tissue.solver_settings import PRECISIONS, SolverSettings

TOUGHEST = {"springs": 0.6, "neo_hookean": 2.0}
"""Toughness over Young's modulus, in mean node sizes, up to which steady forces are within 5 % of
toughness times depth. Springs were 2 to 9 % high at 0.8 and 57 % at 1.5, where the blade paid for
60 % of what it opened. Tetrahedra were within 3 % at 2.3, but there the force of the first
centimetres dropped to 58 %. Laws that stiffen have no such limit."""


_log = logging.getLogger("tissue")


def checked_gravity(gravity: Sequence[float]) -> Vec3:
    """Return gravity as a vector.

    Raises:
        ValueError: it is not three finite numbers.
    """
    array = np.array(gravity, dtype=np.float64)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise ValueError(f"gravity is {gravity}; it is three finite numbers, in m/s2")
    return Vec3(*array.tolist())


def checked_fixed(fixed: npt.ArrayLike | None, n_nodes: int) -> BoolArray:
    """Return the mask of nodes that do not move; None holds nothing.

    Raises:
        ValueError: it is not one truth value a node.
    """
    if fixed is None:
        return np.zeros(n_nodes, dtype=np.bool_)
    array = np.array(fixed)
    if array.shape != (n_nodes,) or array.dtype != np.bool_:
        raise ValueError(
            f"fixed has shape {array.shape} and type {array.dtype}; it is one truth value for each "
            f"of the {n_nodes} nodes"
        )
    return array


def checked_positions(positions: npt.ArrayLike | None, rest: FloatArray) -> FloatArray:
    """Return where the nodes are at first [m]; None is at rest.

    Raises:
        ValueError: it is not three finite numbers a node.
    """
    if positions is None:
        return rest.copy()
    array = np.array(positions, dtype=np.float64)
    if array.shape != rest.shape:
        raise ValueError(f"positions have shape {array.shape}; the mesh's nodes have {rest.shape}")
    if not np.isfinite(array).all():
        first = np.flatnonzero(~np.isfinite(array).all(axis=1))[:5].tolist()
        raise ValueError(f"positions of nodes {first} are not finite")
    return array


def edge_of(sweep: BladeSweep) -> Edge:
    """Return the cutting edge over a step; `begin_blade_step` checks what it is.

    Raises:
        ValueError: tip, heel or forward are not three numbers each.
    """
    try:
        return Edge.of_numbers(sweep.t0.numbers + sweep.t1.numbers)
    except (AttributeError, TypeError, ValueError):
        return edge_or_error(sweep)


def edge_or_error(sweep: BladeSweep) -> Edge:
    """Return the cutting edge over a step, where a blade can move so.

    Raises:
        ValueError: a number is not finite, the blade has no length, it would cut along itself, or
            it turns by more than a right angle.
    """
    points, ways = [], []
    for when, segment in (("start", sweep.t0), ("end", sweep.t1)):
        tip, heel, forward = map(_three_numbers, segment)
        if tip is None or heel is None or forward is None:
            rows = [np.asarray(part, dtype=np.float64).tolist() for part in segment]
            raise ValueError(
                f"the blade at the {when} of the step is {rows}; tip, heel and forward are three "
                "finite numbers each"
            )
        x, y, z = heel.x - tip.x, heel.y - tip.y, heel.z - tip.z
        u, v, w = forward
        length = math.hypot(x, y, z)
        if not length > 0.0:
            raise ValueError(
                f"the blade at the {when} of the step has no length: {[[*tip], [*heel]]}"
            )
        across = math.hypot(y * w - z * v, z * u - x * w, x * v - y * u)
        if not across > LEAST_SINE * length * math.hypot(u, v, w):
            raise ValueError(
                f"the blade at the {when} of the step cuts along its own edge: forward is "
                f"{[*forward]}, from tip to heel is {[x, y, z]}"
            )
        points += [tip, heel, forward]
        ways.append((x, y, z))
    edge = Edge(*points)
    (x, y, z), (u, v, w) = ways
    (a, b, c), (f, g, h) = edge.forward_t0, edge.forward_t1
    if not (x * u + y * v + z * w > 0.0 and a * f + b * g + c * h > 0.0):
        expect_small_turn(np.array(ways), np.array([edge.forward_t0, edge.forward_t1]))
    return edge


def _three_numbers(part: npt.ArrayLike) -> Vec3 | None:
    """Return three finite numbers as plain floats; None where they are not that."""
    array = np.asarray(part, dtype=np.float64)
    if array.shape != (3,):
        return None
    x, y, z = array.tolist()
    # A sum is finite only where all are, and is faster to ask.
    is_finite = math.isfinite(x + y + z) or all(map(math.isfinite, (x, y, z)))
    return Vec3(x, y, z) if is_finite else None


def expect_small_turn(along: FloatArray, forward: FloatArray) -> None:
    """Check that the blade turns by less than a right angle from each place to the next.

    Between two places it is interpolated; halfway round it would have no direction.

    Args:
        along: From tip to heel, shape (n_places, 3).
        forward: Where it faces, shape (n_places, 3).

    Raises:
        ValueError: it turns further.
    """
    for what, way in (("edge", along), ("forward", forward)):
        wrong = np.flatnonzero(~((way[1:] * way[:-1]).sum(axis=1) > 0.0))
        if len(wrong):
            i = int(wrong[0])
            raise ValueError(
                f"the blade's {what} turns by a right angle or more in one step, from "
                f"{way[i].tolist()} to {way[i + 1].tolist()}; turn it in smaller steps"
            )


def checked_edges(edges: npt.ArrayLike, forward: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the places of a cutting edge, and where it faces in each.

    Raises:
        ValueError: an array has another shape, is not finite, or an edge faces along itself.
    """
    rows = np.array(edges, dtype=np.float64)
    if rows.ndim != 3 or rows.shape[2] != 3 or min(rows.shape[:2]) < 2:
        raise ValueError(
            f"edges have shape {rows.shape}; they are two or more places of two or more points: "
            "(n_places, n_points, 3)"
        )
    ways = np.array(forward, dtype=np.float64)
    if ways.shape not in ((3,), (len(rows), 3)):
        raise ValueError(f"forward has shape {ways.shape}; it is (3,) or ({len(rows)}, 3)")
    if not (np.isfinite(rows).all() and np.isfinite(ways).all()):
        raise ValueError("edges and forward hold a number that is not finite")
    ways = np.broadcast_to(ways, (len(rows), 3)).copy()
    along = rows[:, -1] - rows[:, 0]
    across = np.linalg.norm(np.cross(along, ways), axis=1)
    limit = LEAST_SINE * np.linalg.norm(along, axis=1) * np.linalg.norm(ways, axis=1)
    wrong = np.flatnonzero(~(across > limit))
    if len(wrong):
        i = int(wrong[0])
        raise ValueError(
            f"the edge in place {i} has no length or cuts along itself: forward is "
            f"{ways[i].tolist()}, from tip to heel is {along[i].tolist()}"
        )
    expect_small_turn(along, ways)
    return rows, ways / np.linalg.norm(ways, axis=1)[:, None]


def checked_floor(floor: float | None, lowest: float, options: IntegratorOptions) -> None:
    """Refuse a floor that is no height, that the body is below, or that nothing can touch.

    Args:
        floor: Height of the floor [m]; None for no floor.
        lowest: Height of the lowest node of the body [m].
        options: The integrator.

    Raises:
        ValueError: it is not finite, or not below the body, or the relaxation is `hierarchical`,
            which has no contact.
    """
    if floor is None:
        return
    if isinstance(options, Hierarchical):
        raise ValueError(
            "relaxation='hierarchical' is the paper's, without contact: the body would fall "
            "through the floor. Use 'global' or 'verlet', or omit the floor"
        )
    if not np.isfinite(floor):
        raise ValueError(f"floor is {floor} m; it must be a finite height, or None for no floor")
    if floor > lowest:
        raise ValueError(
            f"the floor is at {floor:g} m and the body reaches down to {lowest:g} m: put the floor "
            "at that height or below, or lift the body's positions"
        )


def checked_threads(threads: int) -> int:
    """Return the number of threads.

    Raises:
        ValueError: it is not from 1 to the number of cores.
    """
    cores = os.cpu_count() or 1
    if isinstance(threads, bool) or not isinstance(threads, int) or not 1 <= threads <= cores:
        raise ValueError(
            f"threads is {threads!r}; it is a whole number from 1 to {cores}, the cores"
        )
    return threads


def checked_time_step(dt: float) -> float:
    """Return a time step [s] as a float: kernels that are called with one take no other number.

    Raises:
        ValueError: it is not finite, or negative.
    """
    if not (math.isfinite(dt) and dt >= 0.0):
        raise ValueError(f"dt is {dt} s; it must be finite and not negative")
    return float(dt)


def checked_solver(solver: SolverSettings, material: Material) -> IntegratorOptions:
    """Return the settings of the integrator that was chosen, for a body of that material.

    Raises:
        ValueError: there is no such scheme, integrator or number of threads, or the integrator does
            not go with the material or an account of the energy.
    """
    checked_scheme(solver.scheme)
    checked_threads(solver.threads)
    options = checked_relaxation(solver.relaxation, material)
    if solver.audit and not isinstance(options, Global | Verlet):
        raise ValueError(
            "an audit needs relaxation='global' or 'verlet': in the others nodes are at different "
            "instants, so that the energy of the whole is not known. Omit the audit, or use one of "
            "these"
        )
    if solver.threads > 1 and not isinstance(options, Global | Verlet):
        raise ValueError(
            f"threads is {solver.threads}; relaxation='hierarchical' runs on one. Use threads=1, "
            "or relaxation='global' or 'verlet'"
        )
    if solver.precision not in PRECISIONS:
        raise ValueError(
            f"precision is {solver.precision!r}; it must be one of {', '.join(PRECISIONS)}"
        )
    if solver.mass_scaling is not None and not solver.mass_scaling > 0.0:
        raise ValueError(
            f"mass_scaling is {solver.mass_scaling}; it is an angular frequency [1/s] and must be "
            "positive, or None for no added mass"
        )
    return options


def expect_toughness_in_range(material: Material, node_size: float) -> None:
    """Check that a blade would not fold the springs of a body.

    Args:
        material: What the body is made of.
        node_size: Mean node size of its mesh [m].

    Raises:
        ValueError: it would, and the force would be that of the fold.
    """
    if material.law == "springs" and _is_too_tough(material, node_size):
        raise ValueError(
            f"{_toughness_in_nodes(material, node_size)}: springs fold ahead of the blade above "
            f"{TOUGHEST['springs']:g}, and the force would be that of the fold. Use law "
            "neo_hookean, a lower toughness, a stiffer material or a coarser mesh"
        )


def warn_of_toughness(material: Material, node_size: float) -> None:
    """Log a warning if the blade will strain tetrahedra beyond the range of their law.

    Args:
        material: What the body is made of.
        node_size: Mean node size of its mesh [m].
    """
    if material.law != "springs" and _is_too_tough(material, node_size):
        _log.warning(
            "%s: tetrahedra ahead of the blade are strained beyond the range of law %s, and the "
            "force of the first centimetres drops to some 60 %% where elements open. Use a lower "
            "toughness, a stiffer material, or a law that stiffens, exponential",
            _toughness_in_nodes(material, node_size),
            material.law,
        )


def _is_too_tough(material: Material, node_size: float) -> bool:
    """Return whether toughness over Young's modulus is beyond the range of the law."""
    length = material.toughness / material.young_modulus
    return length > TOUGHEST.get(material.law, math.inf) * node_size


def _toughness_in_nodes(material: Material, node_size: float) -> str:
    """Return toughness over Young's modulus, in words."""
    length = material.toughness / material.young_modulus
    return (
        f"toughness / young_modulus is {length * 1e3:.3g} mm, {length / node_size:.3g} times the "
        f"mean node size of {node_size * 1e3:.3g} mm"
    )


def warn_of_ratio(material: Material) -> None:
    """Log a warning if the resistance to compression makes time steps very short."""
    ratio = material.poisson_ratio
    if ratio > NEARLY_INCOMPRESSIBLE:
        _log.warning(
            "poisson_ratio is %g: time steps are %.3g times shorter than at 0.45, because waves of "
            "compression are that much faster. 0.45 to 0.49 is as incompressible as a soft body "
            "looks",
            ratio,
            material.wave_speed / replace(material, poisson_ratio=0.45).wave_speed,
        )
