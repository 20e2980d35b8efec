"""A solid flex of a MuJoCo model as a body to be cut: its mesh in its place, and its pins."""

import warnings
from typing import NamedTuple

import mujoco
import numpy as np

from scalpel_sim.arm.blade import no_such
from tissue import BoolArray, Material, TetrahedralMesh, mesh_from_arrays

_SOLID = 3
"""Dimension of a flex of tetrahedra."""


class FlexError(ValueError):
    """The model has no such flex, or it cannot become a tissue."""


class FlexBody(NamedTuple):
    """The body that a flex of a model was."""

    mesh: TetrahedralMesh
    """Its vertices in the world as the model begins [m], and its tetrahedra."""
    fixed: BoolArray
    """Whether each vertex is pinned to what does not move, shape (n_nodes,)."""
    material: Material
    """Young's modulus and Poisson's ratio of its `<elasticity>`, where it has one, and its density;
    the rest is as in `Material`."""


def take_flex(spec: mujoco.MjSpec, name: str | None = None) -> FlexBody:
    """Take a solid flex, which has a name, out of a model; return the body that it was.

    `<flexcomp>` and `<flex>` with `dim="3"` are taken. The flex, the bodies of its vertices and
    what constrains it are deleted, so that MuJoCo does not move it too: the spec compiles to the
    model without it. Vertices are fixed that belong to the world, or to a body that has no joint
    between it and the world.

    Args:
        spec: The model, yet to be compiled.
        name: The flex; None: the only solid one.

    Raises:
        FlexError: there is no such flex, or it is no solid; its vertices have no bodies of their
            own (`dof="trilinear"` or `"quadratic"`); or some are pinned to a body that moves.
        MeshError: its tetrahedra cannot be cut.
    """
    flex = _chosen(spec, name)
    with warnings.catch_warnings(category=UserWarning, action="ignore"):  # on what holds the flex
        model = spec.copy().compile()
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_FLEX, flex.name)
    if model.flex_interp[number]:
        raise FlexError(
            f"the vertices of flex '{flex.name}' have no bodies of their own: give it dof=\"full\""
        )
    first, n_vertices = model.flex_vertadr[number], model.flex_vertnum[number]
    bodies = model.flex_vertbodyid[first : first + n_vertices]
    fixed = model.body_weldid[bodies] == 0
    own = _own_bodies(model, bodies)
    carried = np.flatnonzero(~fixed & ~np.isin(bodies, own))
    if carried.size:
        raise FlexError(
            f"{carried.size} vertices of flex '{flex.name}' are pinned to a body that moves, "
            f"'{model.body(bodies[carried[0]]).name}': pin them to one that does not, and hold "
            "them by Tissue.attach"
        )
    body = _body(model, number, fixed, flex, float(model.body_mass[own].sum()))
    _delete(spec, flex, [model.body(each).name for each in own])
    return body


def _chosen(spec: mujoco.MjSpec, name: str | None) -> mujoco.MjsFlex:
    """Return the flex of that name, or the only solid one."""
    solids = [each for each in spec.flexes if each.dim == _SOLID and each.name]
    names = [each.name for each in solids]
    if name is None and len(solids) == 1:
        return solids[0]
    if name is None:
        listed = f": {', '.join(names)}. Name one of them" if names else ""
        raise FlexError(f'the model has {len(solids)} flexes with dim="3" and a name{listed}')
    if name not in names:
        raise FlexError(no_such("flex with dim=3", name, names))
    return solids[names.index(name)]


def _own_bodies(model: mujoco.MjModel, bodies: np.ndarray) -> np.ndarray:
    """Return the bodies that are one vertex each: they slide, and carry no geom."""
    found, counts = np.unique(bodies, return_counts=True)
    alone = found[(counts == 1) & (model.body_weldid[found] != 0)]
    joints = [model.jnt_type[model.jnt_bodyid == each] for each in alone]
    slides = [(each == mujoco.mjtJoint.mjJNT_SLIDE).all() and len(each) > 0 for each in joints]
    is_bare = model.body_geomnum[alone] == 0
    return np.asarray(alone[np.array(slides, dtype=bool) & is_bare])


def _body(
    model: mujoco.MjModel, number: int, fixed: BoolArray, flex: mujoco.MjsFlex, mass: float
) -> FlexBody:
    """Return mesh, pins and material of a flex."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_flex(model, data)
    first, n_vertices = model.flex_vertadr[number], model.flex_vertnum[number]
    start, n_elements = model.flex_elemdataadr[number], model.flex_elemnum[number]
    elements = model.flex_elem[start : start + (_SOLID + 1) * n_elements].reshape(-1, _SOLID + 1)
    elements = elements[:, [0, 1, 3, 2]]  # MuJoCo's wind the other way
    mesh = mesh_from_arrays(data.flexvert_xpos[first : first + n_vertices], elements)
    if len(mesh.positions) != n_vertices:
        raise FlexError(f"flex '{flex.name}' has vertices that no tetrahedron uses, or shares")
    a, b, c, d = (mesh.positions[mesh.tetrahedra[:, k]] for k in range(4))
    volume = float(np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a).sum() / 6.0)
    given = {"density": mass / volume * n_vertices / (~fixed).sum()} if mass > 0.0 else {}
    if flex.young > 0.0:
        given |= {"young_modulus": float(flex.young), "poisson_ratio": float(flex.poisson)}
    return FlexBody(mesh, fixed, Material(**given))


def _delete(spec: mujoco.MjSpec, flex: mujoco.MjsFlex, bodies: list[str]) -> None:
    """Delete a flex, its constraints, and the bodies of its vertices."""
    for each in list(spec.equalities):
        if each.type == mujoco.mjtEq.mjEQ_FLEX and each.name1 == flex.name:
            spec.delete(each)
    spec.delete(flex)
    for name in bodies:
        spec.delete(spec.body(name))
