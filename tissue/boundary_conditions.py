"""Displacement boundary conditions: nodes of sides, boxes, spheres, half-spaces, labels, lists.

All functions return masks of shape (n_nodes,).
"""

import difflib
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import BoolArray, FloatArray
from tissue.mesh.faces import boundary_faces
from tissue.mesh.mesh_arrays import mesh_arrays
from tissue.mesh.parts import part_of_mesh
from tissue.types import TetrahedralMesh

SIDES = {
    "left": (0, False),
    "right": (0, True),
    "front": (1, False),
    "back": (1, True),
    "bottom": (2, False),
    "top": (2, True),
}
"""The body's sides: the axis, and whether the side is at its high end."""

FLATNESS = 1e-5
"""Largest departure of a flat side from a plane, as a fraction of the body's extent along the axis.

Files in single precision depart by 1e-6. Larger than 1 / cells, and a grid loses its second layer.
"""

MIN_FLAT_COVER = 0.05
"""A side is flat where its plane holds triangles over this fraction of the bounding box's side.

Less is a chance facet of a round body, too small to hold it by.
"""

_DEPTH = 0.05
"""A round side reaches this deep, as a fraction of the body's extent along the axis.

On an ellipsoid that is a cap of 44 % of its width.
"""

DEPTH_GROWTH = 1.25
"""Factor by which a round side is deepened until it holds three nodes off a line."""

MIN_SPREAD = 1e-3
"""Spread of nodes across a line, over that along it, from which they count as off the line."""

UNDERSIDE = "underside"
"""Name of what a body lies on: all of its surface that faces down."""

FACING_DOWN = 0.3
"""Least downward part of the outward unit normal of a face of the underside: 17 degrees from
upright. Less, and the sides of a round body would be held as well."""

_SPHERE = "sphere:"
"""Beginning of the text of a sphere."""

_LABEL = "label:"
"""Beginning of the text of a label."""

_ROUNDING = 1e-9
"""Distance from a box, a sphere or a plane at which nodes are on it, in the body's extent."""


def fixed_nodes(
    mesh: TetrahedralMesh, specification: str, of: int | str | None = None
) -> BoolArray:
    """Return a mask of the nodes that the text `specification` names.

    Args:
        mesh: The body.
        specification: Sides joined by commas ("left,right"; "underside": all that faces down), or
            the corners of a box in m ("0,0,0:0.01,0.06,0.04"), or centre and radius of a sphere in
            m ("sphere:0.01,0.03,0.04,0.005"), or a label of the mesh by name or number
            ("label:bone", "label:2"), or "none".
        of: A label, by number or name, or one of several bodies (`tissue.joined`), by name: it is
            of that part alone, and its sides; None: all of the mesh.

    Raises:
        MeshError: The arrays of the mesh have another shape or hold no numbers.
        ValueError: The text is none of these, the box or the sphere holds no node, or there is no
            such part.
    """
    if of is not None:
        return _nodes_of_part(mesh, specification, of)
    mesh, text = mesh_arrays(mesh), specification.strip()
    if text.lower() == "none":
        return np.zeros(len(mesh.positions), dtype=bool)
    if text.lower().startswith(_SPHERE):
        return sphere_nodes(mesh, *_centre_and_radius(text))
    if text.lower().startswith(_LABEL):
        return label_nodes(mesh, text[len(_LABEL) :].strip())
    if ":" in text:
        return box_nodes(mesh, *_box_corners(text))
    return side_nodes(mesh, text.split(","))


def _nodes_of_part(mesh: TetrahedralMesh, specification: str, part: int | str) -> BoolArray:
    """Return a mask of the nodes of a part that a text names: see `fixed_nodes`."""
    tetrahedra, labels = part_of_mesh(mesh, part)[1:3]
    nodes, own = np.unique(tetrahedra, return_inverse=True)
    found = np.zeros(len(mesh.positions), dtype=bool)
    of_part = own.reshape(tetrahedra.shape)
    alone = TetrahedralMesh(mesh.positions[nodes], of_part, labels, mesh.label_names)
    try:
        found[nodes] = fixed_nodes(alone, specification)
    except ValueError as error:
        raise ValueError(f"of '{part}': {error}") from error
    return found


def side_nodes(mesh: TetrahedralMesh, names: Sequence[str]) -> BoolArray:
    """Return a mask of the boundary nodes of all sides in `names`.

    left and right are the low and the high end of x, front and back of y, bottom and top of z. A
    flat side is the nodes in its plane, exactly. A round side is the nodes less than `_DEPTH` of
    the body's extent deep, and deeper ones where these would not hold the body: three nodes off a
    line. The underside is the nodes of all faces that face down, whatever their height.

    Raises:
        ValueError: A name is not a side.
    """
    mesh = mesh_arrays(mesh)
    given = [name.strip().lower() for name in ([names] if isinstance(names, str) else names)]
    axes = [_side(name) for name in given if name != UNDERSIDE]
    triangles = boundary_faces(mesh.tetrahedra)
    mask = np.zeros(len(mesh.positions), dtype=bool)
    if UNDERSIDE in given:
        mask[triangles[_faces_down(mesh.positions, triangles)]] = True
    for axis, is_high in axes:
        mask |= _one_side(mesh.positions, triangles, axis, is_high)
    return mask


def box_nodes(mesh: TetrahedralMesh, low: npt.ArrayLike, high: npt.ArrayLike) -> BoolArray:
    """Return a mask of the nodes between the corners `low` and `high` [m], faces included.

    Raises:
        ValueError: The corners are not finite or not in order, or no node is between them.
    """
    mesh = mesh_arrays(mesh)
    low, high = _point(low, "the low corner"), _point(high, "the high corner")
    if not np.all(low <= high):
        raise ValueError(
            f"the box goes from {_text(low)} to {_text(high)} m; "
            "each coordinate of the first corner must be the smaller"
        )
    slack = _ROUNDING * np.ptp(mesh.positions, axis=0).max()
    mask = np.all((mesh.positions >= low - slack) & (mesh.positions <= high + slack), axis=1)
    return _with_nodes(mask, mesh, f"in the box from {_text(low)} to {_text(high)} m")


def sphere_nodes(mesh: TetrahedralMesh, centre: npt.ArrayLike, radius: float) -> BoolArray:
    """Return a mask of the nodes in the sphere around `centre` [m] of a radius [m], and on it.

    Raises:
        ValueError: A number is not finite, the radius is not positive, or no node is there.
    """
    mesh = mesh_arrays(mesh)
    middle = _point(centre, "the centre of the sphere")
    if not (math.isfinite(radius) and radius > 0.0):
        raise ValueError(f"the radius of the sphere is {radius} m; it must be positive and finite")
    slack = _ROUNDING * np.ptp(mesh.positions, axis=0).max()
    mask = np.linalg.norm(mesh.positions - middle, axis=1) <= radius + slack
    return _with_nodes(mask, mesh, f"in the sphere of {radius:.4g} m around {_text(middle)} m")


def label_nodes(mesh: TetrahedralMesh, label: int | str) -> BoolArray:
    """Return a mask of the nodes of the tetrahedra of a label, those on its borders too.

    Args:
        mesh: The body.
        label: Number or name, or the name of one of several bodies; digits alone are a number,
            unless a label has that name.

    Raises:
        ValueError: No tetrahedron has it.
    """
    if isinstance(label, str) and label.isdecimal() and label not in mesh.label_names.values():
        label = int(label)
    mask = np.zeros(len(mesh.positions), dtype=bool)
    mask[part_of_mesh(mesh, label).tetrahedra] = True
    return mask


def plane_nodes(mesh: TetrahedralMesh, point: npt.ArrayLike, normal: npt.ArrayLike) -> BoolArray:
    """Return a mask of the nodes on the plane through `point` [m] and beyond it along `normal`.

    If the plane touches the body and the normal points outwards, these are the nodes on the plane.

    Raises:
        ValueError: A value is not finite, the normal is zero, or no node is there.
    """
    mesh = mesh_arrays(mesh)
    point, normal = _point(point, "the point"), _point(normal, "the normal")
    length = np.linalg.norm(normal)
    if length == 0.0:
        raise ValueError("the normal of the plane is zero; it must point to the nodes to hold")
    slack = _ROUNDING * np.ptp(mesh.positions, axis=0).max()
    mask = (mesh.positions - point) @ (normal / length) >= -slack
    place = f"beyond the plane through {_text(point)} m with normal {_text(normal)}"
    return _with_nodes(mask, mesh, place)


def listed_nodes(mesh: TetrahedralMesh, nodes: npt.ArrayLike) -> BoolArray:
    """Return a mask of the nodes in the list `nodes`, counted from 0.

    Raises:
        ValueError: An entry is not a whole number, or not a node.
    """
    listed = np.asarray(nodes)
    if listed.size and listed.dtype.kind not in "iu":
        raise ValueError(f"the list of nodes holds {listed.dtype} values; give whole numbers")
    listed = listed.astype(np.int64).ravel()
    wrong = listed[(listed < 0) | (listed >= len(mesh.positions))]
    if wrong.size:
        raise ValueError(
            f"there is no node {wrong[0]}; the body has the nodes 0 to {len(mesh.positions) - 1}"
        )
    mask = np.zeros(len(mesh.positions), dtype=bool)
    mask[listed] = True
    return mask


def _side(name: str) -> tuple[int, bool]:
    """Return the axis of a side, and whether it is the high end."""
    key = name.strip().lower()
    if key not in SIDES:
        close = difflib.get_close_matches(key, [*SIDES, UNDERSIDE, "none"], n=1)
        hint = f" Did you mean '{close[0]}'?" if close else ""
        raise ValueError(
            f"'{name.strip()}' is not a side of the body.{hint} Sides: {', '.join(SIDES)}, "
            f"{UNDERSIDE}; or a box x0,y0,z0:x1,y1,z1 or {_SPHERE}x,y,z,radius in m; or "
            f"{_LABEL}NAME; or none"
        )
    return SIDES[key]


def _faces_down(positions: FloatArray, triangles: npt.NDArray[np.int64]) -> BoolArray:
    """Return which triangles, counter-clockwise seen from outside, face down."""
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    return np.asarray(normals[:, 2] < -FACING_DOWN * np.linalg.norm(normals, axis=1))


def _one_side(
    positions: FloatArray, triangles: npt.NDArray[np.int64], axis: int, is_high: bool
) -> BoolArray:
    """Return the boundary nodes of one side."""
    on_boundary = np.zeros(len(positions), dtype=bool)
    on_boundary[triangles] = True
    low, high = positions[on_boundary].min(axis=0), positions[on_boundary].max(axis=0)
    extent = high - low
    below = (high - positions)[:, axis] if is_high else (positions - low)[:, axis]

    in_plane: BoolArray = on_boundary & (below <= FLATNESS * extent[axis])
    if _covered(positions, triangles[in_plane[triangles].all(axis=1)], axis) >= (
        MIN_FLAT_COVER * np.prod(np.delete(extent, axis))
    ):
        return in_plane
    depth = _DEPTH
    while True:  # ends: at depth 1 a body holds three nodes off a line, else it has no volume
        side: BoolArray = on_boundary & (below <= depth * extent[axis])
        if _holds(positions[side]) or depth >= 1.0:
            return side
        depth *= DEPTH_GROWTH


def _covered(positions: FloatArray, triangles: npt.NDArray[np.int64], axis: int) -> float:
    """Return the area of `triangles` seen along `axis` [m2]."""
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    return float(np.abs(0.5 * np.cross(b - a, c - a)[:, axis]).sum())


def _holds(points: FloatArray) -> bool:
    """Return whether three points are off a line, so that holding them stops every rotation."""
    if len(points) < 3:
        return False
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[1] > MIN_SPREAD * spread[0])


def _box_corners(text: str) -> tuple[FloatArray, FloatArray]:
    """Parse "x0,y0,z0:x1,y1,z1"."""
    try:
        low, high = (np.array([float(n) for n in c.split(",")]) for c in text.split(":"))
    except ValueError:
        low = high = np.empty(0)
    if low.shape != (3,) or high.shape != (3,):
        raise ValueError(f"'{text}' is not a box; write its corners in m as x0,y0,z0:x1,y1,z1")
    return low, high


def _centre_and_radius(text: str) -> tuple[FloatArray, float]:
    """Parse "sphere:x,y,z,r"."""
    try:
        x, y, z, radius = (float(n) for n in text[len(_SPHERE) :].split(","))
    except ValueError:
        raise ValueError(
            f"'{text}' is not a sphere; write its centre and its radius in m as {_SPHERE}x,y,z,r"
        ) from None
    return np.array([x, y, z]), radius


def _point(values: npt.ArrayLike, name: str) -> FloatArray:
    """Return three finite numbers, or raise an error that names them."""
    point = np.asarray(values, dtype=np.float64)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise ValueError(f"{name} is {values!r}; it must be three finite numbers")
    return point


def _with_nodes(mask: BoolArray, mesh: TetrahedralMesh, place: str) -> BoolArray:
    """Return a mask, or raise an error where it holds no node: that none is at the place."""
    if not mask.any():
        low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
        raise ValueError(f"no node is {place}; the body goes from {_text(low)} to {_text(high)} m")
    return mask


def _text(point: FloatArray) -> str:
    """Return a point as text for messages."""
    return "(" + ", ".join(f"{value:.4g}" for value in point) + ")"
