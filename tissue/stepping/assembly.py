"""Makes the parts of a tissue from its arguments: each error names the offending value."""

import os
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from tissue.blade.toughness import warn_of_toughness
from tissue.blade_shape import BladeShape
from tissue.body_materials import BodyMaterials
from tissue.body_view import bounds_of_body
from tissue.core.array_types import BoolArray, FloatArray
from tissue.core.vec3 import Vec3
from tissue.cutting.incision import Incision, checked_scheme, scheme_of
from tissue.cutting.snapping import EXPLAINED
from tissue.integrators.global_stepper import GlobalStepper, integrator_of
from tissue.integrators.methods import (
    Global,
    Hierarchical,
    IntegratorOptions,
    Verlet,
    checked_relaxation,
    method_of,
)
from tissue.integrators.model import Numerics, TissueModel
from tissue.material import warn_of_ratio
from tissue.mesh.body import build_body
from tissue.mesh.interfaces import Interfaces
from tissue.solver_settings import ELEMENTS, PRECISIONS, SolverSettings
from tissue.stepping.energy_audit import Audit
from tissue.stepping.stages import StepStages
from tissue.types import TetrahedralMesh


def assembled(
    mesh: TetrahedralMesh,
    fixed: BoolArray | None,
    positions: FloatArray | None,
    gravity: Sequence[float],
    parts: tuple[BodyMaterials, Interfaces],
    blade: BladeShape | None,
    floor: float | None,
    solver: SolverSettings,
) -> StepStages:
    """Return the parts of a tissue.

    Args:
        mesh: A sound mesh. See `tissue.Tissue`, as for all arguments.
        fixed: The supports, shape (n_nodes,).
        positions: Where the nodes are at first [m], shape (n_nodes, 3).
        gravity: Acceleration of free fall [m/s2].
        parts: What the body is made of, and the layers between its labels.
        blade: The body of the blade.
        floor: Height of a floor below the body [m].
        solver: How the body is cut and moved.

    Raises:
        ValueError: an argument does not fit the mesh, or is not finite.
    """
    materials, interfaces = parts
    material = materials.reference
    options = _checked_solver(solver, materials)
    weight = _gravity(gravity)
    body = build_body(
        mesh,
        _positions(positions, mesh.positions),
        _fixed(fixed, len(mesh.positions)),
        materials.table,
        materials.rows,
        interfaces,
    )
    if solver.scheme == "paper":
        _expect_no_layers(interfaces)
        from tissue.cutting.bielser_1998.mesh_records import with_room_to_hang

        body = with_room_to_hang(body)
    method = method_of(options, material.law)
    numerics = Numerics(
        mass_scaling=solver.mass_scaling,
        damps_between_steps=method.damps_between_steps,
        is_single=solver.precision == "single",
        averages_shear=solver.element == "averaged" and not material.law.has_springs,
        moves_together=not isinstance(options, Hierarchical),
    )
    model = TissueModel(body, material, weight, blade, floor, numerics)
    node_size = model.node_size
    different = tuple(dict.fromkeys((material, *materials.by_label.values())))
    for each in different:
        warn_of_toughness(each, node_size)
        warn_of_ratio(each)
    _expect_floor(floor, float(bounds_of_body(body)[0, 2]), options)
    scheme = scheme_of(solver.scheme, solver.cut, body, node_size)
    stepper = GlobalStepper(method, solver.threads)
    return StepStages(
        model,
        different,
        Incision(scheme, node_size),
        stepper,
        integrator_of(options, stepper, len(body.rest)),
        Audit(is_kept=solver.audit),
        EXPLAINED * solver.cut.floor * node_size,
    )


def _expect_no_layers(interfaces: Interfaces) -> None:
    """Refuse layers between labels, of which the scheme of the paper knows nothing.

    Raises:
        ValueError: there is one.
    """
    if len(interfaces.toughness):
        raise ValueError(
            "scheme='paper' cuts along the path of the blade, and follows no layer between two "
            "labels. Use scheme='stellar', or leave the layer out: the labels are then bonded"
        )


def _gravity(gravity: Sequence[float]) -> Vec3:
    """Return gravity as a vector.

    Raises:
        ValueError: it is not three finite numbers.
    """
    array = np.array(gravity, dtype=np.float64)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise ValueError(f"gravity is {gravity}; it is three finite numbers, in m/s2")
    return Vec3(*array.tolist())


def _fixed(fixed: npt.ArrayLike | None, n_nodes: int) -> BoolArray:
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


def _positions(positions: npt.ArrayLike | None, rest: FloatArray) -> FloatArray:
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


def _expect_floor(floor: float | None, lowest: float, options: IntegratorOptions) -> None:
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


def _checked_solver(solver: SolverSettings, materials: BodyMaterials) -> IntegratorOptions:
    """Return the settings of the integrator that was chosen, for a body of these materials.

    Raises:
        ValueError: there is no such scheme, integrator or number of threads, or the integrator does
            not go with the material or an account of the energy.
    """
    checked_scheme(solver.scheme)
    _checked_threads(solver.threads)
    options = checked_relaxation(solver.relaxation, materials.reference)
    if solver.audit and not isinstance(options, Global | Verlet):
        raise ValueError(
            "an audit needs relaxation='global' or 'verlet': in the others nodes are at different "
            "instants, so that the energy of the whole is not known. Omit the audit, or use one of "
            "these"
        )
    if solver.threads > 1 and not isinstance(options, Global | Verlet):
        raise ValueError(
            f"threads is {solver.threads}; a hierarchical relaxation runs on one. Use threads=1, "
            "or relaxation='global' or 'verlet'"
        )
    for name, choices in (("element", ELEMENTS), ("precision", PRECISIONS)):
        if getattr(solver, name) not in choices:
            raise ValueError(
                f"{name} is {getattr(solver, name)!r}; it must be one of {', '.join(choices)}"
            )
    if solver.mass_scaling is not None and not solver.mass_scaling > 0.0:
        raise ValueError(
            f"mass_scaling is {solver.mass_scaling}; it is an angular frequency [1/s] and must be "
            "positive, or None for no added mass"
        )
    return options


def _checked_threads(threads: int) -> int:
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
