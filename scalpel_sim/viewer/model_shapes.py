"""The shapes of a MuJoCo model as triangles: what the arm looks like."""

from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np

from scalpel_sim.viewer.draping import TriangleMesh
from tissue import FloatArray

_N_AROUND = 32
"""Segments around a round shape: at this count its outline looks round on a screen."""

BEVEL = 0.12
"""Rounded rim of a cylinder, as a fraction of its radius, or of its half length if that is less.
A perfectly sharp rim catches no light and looks like paper."""

LAST_VISIBLE_GROUP = 2
"""MuJoCo's viewer shows the geom groups 0, 1 and 2; in the others are collision shapes, say."""

PLANE_EXTENT = 0.5
"""Half width [m] drawn of a plane that the model leaves infinite."""


class Shape(NamedTuple):
    """One visible geom."""

    name: str
    """The geom's name, or its number."""
    body: int
    kind: int
    """A value of `mujoco.mjtGeom`."""
    mesh: TriangleMesh
    """In the geom's own frame."""
    pose: FloatArray
    """Position [m] and quaternion (w, x, y, z) in the body's frame, shape (7,)."""
    colour: FloatArray
    """Red, green, blue and opacity between 0 and 1, shape (4,)."""
    is_blade: bool
    """Whether it is the blade: a box that holds the sites `heel` and `tip` of its body."""
    is_target: bool
    """Whether it only marks where somebody's hand is (a mocap body)."""


def shapes_of(model: mujoco.MjModel) -> Iterator[Shape]:
    """Yield the geoms that MuJoCo's own viewer would show, except deformable ones (flex)."""
    for geom in range(model.ngeom):
        colour = _colour(model, geom)
        if model.geom_group[geom] > LAST_VISIBLE_GROUP or colour[3] == 0.0:
            continue
        body = int(model.geom_bodyid[geom])
        kind = int(model.geom_type[geom])
        edge = _edge_in_geom(model, geom) if kind == mujoco.mjtGeom.mjGEOM_BOX else None
        mesh = _triangles(model, geom) if edge is None else _blade(model.geom_size[geom], *edge)
        if mesh is not None:
            yield Shape(
                name=model.geom(geom).name or str(geom),
                body=body,
                kind=kind,
                mesh=mesh,
                pose=np.concatenate([model.geom_pos[geom], model.geom_quat[geom]]),
                colour=colour,
                is_blade=edge is not None,
                is_target=bool(model.body_mocapid[body] >= 0),
            )


def body_poses(data: mujoco.MjData) -> FloatArray:
    """Return where all bodies are now: position [m] and quaternion (w, x, y, z), (n_bodies, 7)."""
    return np.hstack([data.xpos, data.xquat])


def _colour(model: mujoco.MjModel, geom: int) -> FloatArray:
    """Return the colour of a geom: of its material where it has one, as MuJoCo does."""
    material = int(model.geom_matid[geom])
    colour = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
    return np.array(colour, dtype=float)


def _triangles(model: mujoco.MjModel, geom: int) -> TriangleMesh | None:
    """Return a geom's shape in its own frame; None if it is of a kind that has no surface."""
    size = np.array(model.geom_size[geom], dtype=float)
    kinds = mujoco.mjtGeom
    match int(model.geom_type[geom]):
        case kinds.mjGEOM_PLANE:
            return _plane(np.where(size[:2] > 0.0, size[:2], PLANE_EXTENT))
        case kinds.mjGEOM_SPHERE:
            return _ellipsoid(np.full(3, size[0]))
        case kinds.mjGEOM_ELLIPSOID:
            return _ellipsoid(size)
        case kinds.mjGEOM_CAPSULE:
            return _capsule(size[0], size[1])
        case kinds.mjGEOM_CYLINDER:
            return _cylinder(size[0], size[1])
        case kinds.mjGEOM_BOX:
            return _box(size)
        case kinds.mjGEOM_MESH | kinds.mjGEOM_SDF:
            return _mesh(model, int(model.geom_dataid[geom]))
        case kinds.mjGEOM_HFIELD:
            return _height_field(model, int(model.geom_dataid[geom]))
        case _:
            return None


def _revolve(radii: FloatArray, heights: FloatArray, normals: FloatArray) -> TriangleMesh:
    """Return a profile turned about z: rings of vertices from the bottom to the top.

    Args:
        radii: Distance from the axis of each ring [m].
        heights: Height of each ring [m].
        normals: Outward and upward component of each ring's normal, shape (n_rings, 2).
    """
    angle = np.linspace(0.0, 2.0 * np.pi, _N_AROUND + 1)
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    up = np.array([0.0, 0.0, 1.0])
    positions = radii[:, None, None] * around + heights[:, None, None] * up
    directions = normals[:, :1, None] * around + normals[:, 1:, None] * up
    return TriangleMesh(
        positions.reshape(-1, 3), _grid(len(radii), _N_AROUND + 1), directions.reshape(-1, 3)
    )


def _grid(n_rows: int, n_columns: int) -> np.ndarray:
    """Return the triangles of a grid of vertices, rows after each other."""
    corner = (np.arange(n_rows - 1)[:, None] * n_columns + np.arange(n_columns - 1)).ravel()
    right, above = corner + 1, corner + n_columns
    first = np.stack([corner, right, above], axis=1)
    second = np.stack([right, above + 1, above], axis=1)
    return np.concatenate([first, second])


def _half_circle(steps: int, start: float, end: float) -> FloatArray:
    """Return cosine and sine of angles between two latitudes, shape (steps, 2)."""
    latitude = np.linspace(start, end, steps)
    return np.stack([np.cos(latitude), np.sin(latitude)], axis=1)


def _ellipsoid(radii: FloatArray) -> TriangleMesh:
    circle = _half_circle(_N_AROUND // 2 + 1, -np.pi / 2.0, np.pi / 2.0)
    ball = _revolve(circle[:, 0], circle[:, 1], circle)
    normals = ball.normals / radii
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return ball._replace(positions=ball.positions * radii, normals=normals)


def _capsule(radius: float, half_length: float) -> TriangleMesh:
    lower = _half_circle(_N_AROUND // 4 + 1, -np.pi / 2.0, 0.0)
    upper = _half_circle(_N_AROUND // 4 + 1, 0.0, np.pi / 2.0)
    normals = np.concatenate([lower, upper])
    shift = np.repeat([-half_length, half_length], len(lower))
    return _revolve(radius * normals[:, 0], radius * normals[:, 1] + shift, normals)


def _cylinder(radius: float, half_length: float) -> TriangleMesh:
    bevel = BEVEL * min(radius, half_length)
    lower = _half_circle(5, -np.pi / 2.0, 0.0)
    upper = _half_circle(5, 0.0, np.pi / 2.0)
    normals = np.concatenate([[[0.0, -1.0]], lower, upper, [[0.0, 1.0]]])
    rim = np.concatenate([lower, upper])
    radii = np.concatenate([[0.0], radius - bevel + bevel * rim[:, 0], [0.0]])
    shift = np.repeat([bevel - half_length, half_length - bevel], len(lower))
    heights = np.concatenate([[-half_length], bevel * rim[:, 1] + shift, [half_length]])
    return _revolve(radii, heights, normals)


def _faceted(positions: FloatArray, triangles: np.ndarray) -> TriangleMesh:
    """Return a mesh whose triangles are flat, each with vertices of its own."""
    corners = positions[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals /= np.where(length > 0.0, length, 1.0)
    return TriangleMesh(
        corners.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3), normals.repeat(3, 0)
    )


BOX_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
BOX_SIDES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)
BOX_TRIANGLES = np.concatenate([BOX_SIDES[:, [0, 1, 2]], BOX_SIDES[:, [0, 2, 3]]])


def _box(size: FloatArray) -> TriangleMesh:
    return _faceted(BOX_CORNERS * size, BOX_TRIANGLES)


def _plane(size: FloatArray) -> TriangleMesh:
    corners = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
    mesh = TriangleMesh(
        corners * [*size, 1.0],
        _grid(2, 2),
        np.tile([0.0, 0.0, 1.0], (4, 1)),
        corners[:, :2] / 2 + 0.5,
    )
    return mesh


def _mesh(model: mujoco.MjModel, mesh: int) -> TriangleMesh | None:
    """Return a mesh asset with the normals that MuJoCo computed for it."""
    if mesh < 0:
        return None
    faces = slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh])
    corners = model.mesh_face[faces].ravel() + model.mesh_vertadr[mesh]
    directions = model.mesh_facenormal[faces].ravel() + model.mesh_normaladr[mesh]
    return TriangleMesh(
        model.mesh_vert[corners].astype(float),
        np.arange(len(corners)).reshape(-1, 3),
        model.mesh_normal[directions].astype(float),
    )


def _height_field(model: mujoco.MjModel, field: int) -> TriangleMesh:
    """Return the top of a height field; its base is out of sight."""
    rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    half_x, half_y, top, _ = model.hfield_size[field]
    first = int(model.hfield_adr[field])
    heights = model.hfield_data[first : first + rows * columns].reshape(rows, columns)
    y, x = np.meshgrid(
        np.linspace(-half_y, half_y, rows), np.linspace(-half_x, half_x, columns), indexing="ij"
    )
    positions = np.stack([x, y, top * heights], axis=2).reshape(-1, 3)
    return _faceted(positions, _grid(rows, columns))


_BLADE_MARGIN = 0.1
"""How far heel and tip may lie outside the box that stands for the blade, as a fraction of its
length. Boxes that they do not fit are other parts of the same body."""


def _edge_in_geom(model: mujoco.MjModel, geom: int) -> tuple[FloatArray, FloatArray] | None:
    """Return heel and tip in a box's frame, if the box is the sheet that carries them."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, model.geom_quat[geom])
    ends = []
    for name in ("heel", "tip"):
        site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name)
        if site < 0 or model.site_bodyid[site] != model.geom_bodyid[geom]:
            return None
        ends.append((model.site_pos[site] - model.geom_pos[geom]) @ matrix.reshape(3, 3))
    heel, tip = ends
    size = model.geom_size[geom]
    fits = (np.abs([heel, tip]) <= size + _BLADE_MARGIN * size.max()).all()
    is_in_sheet = np.abs(tip - heel).argmax() != size.argmin() and not np.array_equal(heel, tip)
    return (heel, tip) if fits and is_in_sheet else None


#      spine_start ____________ spine_end
#                 |            \___
#                 |                \___
#            heel |____________________\ tip        sharp along heel-tip, no. 11 blade
#
SPINE_LENGTH = 0.45
"""How far the blunt back of a no. 11 blade runs along the edge before it slopes to the tip."""


def _blade(size: FloatArray, heel: FloatArray, tip: FloatArray) -> TriangleMesh:
    """Return a thin sheet ground to an edge from heel to tip, as wide as the box it stands for.

    Args:
        size: Half sizes of the box [m]; the least is half the thickness of the sheet.
        heel: End of the edge nearest the handle [m], in the box's frame.
        tip: Sharp end [m], in the box's frame.
    """
    along = tip - heel
    across = np.cross(np.eye(3)[np.argmin(size)], along)
    across /= np.linalg.norm(across)
    towards_spine = -across if np.dot(across, heel + tip) > 0.0 else across
    width = 2.0 * float(np.abs(towards_spine) @ size)
    half = np.cross(along, towards_spine)
    half *= size.min() / np.linalg.norm(half)
    spine_start = heel + width * towards_spine
    spine_end = spine_start + SPINE_LENGTH * along
    corners = np.array(
        [heel, tip, spine_start + half, spine_end + half, spine_start - half, spine_end - half]
    )
    heel_, tip_, start, end, start_, end_ = range(6)
    front = [[heel_, tip_, end], [heel_, end, start]]
    back = [[tip_, heel_, start_], [tip_, start_, end_]]
    rim = [[start, end, end_], [start, end_, start_], [end, tip_, end_], [heel_, start, start_]]
    return _faceted(corners, np.array(front + back + rim))
