"""The visible shapes of a MuJoCo model as triangle meshes."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from scalpel_sim.arm.free_names import free_name
from scalpel_sim.arm.standing import TABLETOP
from scalpel_sim.viewer import primitives
from scalpel_sim.viewer.primitives import TriangleMesh, blade, edge_in_geom
from tissue import FloatArray, IntArray

LAST_VISIBLE_GROUP = 2
"""Last geom group that is drawn. MuJoCo's viewer shows the groups 0, 1 and 2 too; the others hold,
for instance, collision shapes."""

PADS = ("pad_low", "pad_high")
"""Ends of the names of the pads of graspers; see `arm/assets/grasper.xml`."""

PLANE_EXTENT = 0.5
"""Half width [m] at which a plane is drawn that is infinite in the model."""


class Shape(NamedTuple):
    """One visible geom."""

    name: str
    """The geom's name; its number if it has none."""
    geom: int
    """Number of the geom."""
    body: int
    """Number of the body that the geom belongs to."""
    root: int
    """Number of the body of the world that carries that body: one for each arm."""
    kind: int
    """Type of the geom: a value of `mujoco.mjtGeom`."""
    mesh: TriangleMesh
    """Triangles in the geom's own frame."""
    pose: FloatArray
    """Position [m] and quaternion (w, x, y, z) of the geom in the body's frame, shape (7,)."""
    colour: FloatArray
    """Red, green, blue and opacity between 0 and 1, shape (4,)."""
    edge: tuple[FloatArray, FloatArray] | None
    """Heel and tip [m] in the geom's frame, if the geom is the blade: a box that holds the sites
    `heel` and `tip` of its body."""
    is_target: bool
    """Whether the geom only marks the target pose of the hand (a mocap body)."""

    @property
    def is_blade(self) -> bool:
        """Whether the geom is the blade."""
        return self.edge is not None

    @property
    def is_end(self) -> bool:
        """Whether the geom is what an arm works with: the blade, or a pad of a grasper."""
        return self.is_blade or self.name.endswith(PADS)

    @property
    def is_table(self) -> bool:
        """Whether the geom is the board of a scene's table."""
        return self.body == 0 and self.name.endswith(TABLETOP)

    @property
    def is_link(self) -> bool:
        """Whether the geom is another part of an arm, which may stand before the tissue."""
        return self.body > 0 and not (self.is_end or self.is_target)


def shapes_of(model: mujoco.MjModel) -> Iterator[Shape]:
    """Yield the geoms that MuJoCo's own viewer would show, except deformable ones (flex)."""
    names = [model.geom(geom).name for geom in range(model.ngeom)]
    for geom in range(model.ngeom):
        colour = _colour(model, geom)
        if model.geom_group[geom] > LAST_VISIBLE_GROUP or colour[3] == 0.0:
            continue
        body = int(model.geom_bodyid[geom])
        kind = int(model.geom_type[geom])
        edge = edge_in_geom(model, geom) if kind == mujoco.mjtGeom.mjGEOM_BOX else None
        mesh = _triangles(model, geom) if edge is None else blade(model.geom_size[geom], *edge)
        if mesh is not None:
            yield Shape(
                name=names[geom] or free_name(str(geom), names),
                geom=geom,
                body=body,
                root=int(model.body_rootid[body]),
                kind=kind,
                mesh=mesh,
                pose=np.concatenate([model.geom_pos[geom], model.geom_quat[geom]]),
                colour=colour,
                edge=edge,
                is_target=bool(model.body_mocapid[body] >= 0),
            )


def arm_bodies(model: mujoco.MjModel) -> IntArray:
    """Return the numbers of the bodies of arms: of all that hang on the world by a joint."""
    roots = model.body_rootid
    return np.flatnonzero(np.isin(roots, roots[model.dof_bodyid]))


def body_poses(data: mujoco.MjData) -> FloatArray:
    """Return position [m] and quaternion (w, x, y, z) of all bodies, shape (n_bodies, 7)."""
    return np.hstack([data.xpos, data.xquat])


class ModelCamera(NamedTuple):
    """A camera of a model."""

    name: str
    """Its name."""
    number: int
    """Its number."""
    fov_degrees: float
    """Angle from the lower to the upper side of its picture [degree]."""


def perspective_cameras(model: mujoco.MjModel) -> list[ModelCamera]:
    """Return the cameras of a model that have a name, and a lens that an angle describes.

    Those that have a sensor and a focal length, or no perspective, are left out.
    """
    perspective = int(mujoco.mjtProjection.mjPROJ_PERSPECTIVE)
    is_plain = (model.cam_projection == perspective) & ~model.cam_sensorsize.any(axis=1)
    cameras = (model.camera(i) for i in np.flatnonzero(is_plain))
    return [ModelCamera(c.name, c.id, float(c.fovy[0])) for c in cameras if c.name]


def camera_poses(data: mujoco.MjData, cameras: Sequence[ModelCamera]) -> FloatArray:
    """Return position [m] and quaternion (w, x, y, z) of cameras, shape (n_cameras, 7)."""
    poses = np.empty((len(cameras), 7))
    for pose, camera in zip(poses, cameras, strict=True):
        pose[:3] = data.cam_xpos[camera.number]
        mujoco.mju_mat2Quat(pose[3:], data.cam_xmat[camera.number])
    return poses


def position_and_rotation(pose: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position, shape (3,), and rotation, shape (3, 3), of a pose of shape (7,)."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, np.ascontiguousarray(pose[3:]))
    return pose[:3], matrix.reshape(3, 3)


def in_world(shape: Shape, body_poses: FloatArray, points: FloatArray) -> FloatArray:
    """Return points of a shape's own frame in the world [m], shape (n, 3)."""
    for pose in (shape.pose, body_poses[shape.body]):
        position, rotation = position_and_rotation(pose)
        points = points @ rotation.T + position
    return points


def _colour(model: mujoco.MjModel, geom: int) -> FloatArray:
    """Return the colour of a geom, or of its material where it has one, as MuJoCo does."""
    material = int(model.geom_matid[geom])
    colour = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
    return np.array(colour, dtype=float)


def _triangles(model: mujoco.MjModel, geom: int) -> TriangleMesh | None:
    """Return the triangles of a geom in its own frame; None if its type has no surface."""
    size = np.array(model.geom_size[geom], dtype=float)
    kinds = mujoco.mjtGeom
    match int(model.geom_type[geom]):
        case kinds.mjGEOM_PLANE:
            return primitives.rectangle(np.where(size[:2] > 0.0, size[:2], PLANE_EXTENT))
        case kinds.mjGEOM_SPHERE:
            return primitives.ellipsoid(np.full(3, size[0]))
        case kinds.mjGEOM_ELLIPSOID:
            return primitives.ellipsoid(size)
        case kinds.mjGEOM_CAPSULE:
            return primitives.capsule(size[0], size[1])
        case kinds.mjGEOM_CYLINDER:
            return primitives.rounded_cylinder(size[0], size[1])
        case kinds.mjGEOM_BOX:
            return primitives.box(size)
        case kinds.mjGEOM_MESH | kinds.mjGEOM_SDF:
            return _asset_mesh(model, int(model.geom_dataid[geom]))
        case kinds.mjGEOM_HFIELD:
            return _height_field(model, int(model.geom_dataid[geom]))
        case _:
            return None


def _asset_mesh(model: mujoco.MjModel, mesh: int) -> TriangleMesh | None:
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
    """Return the upper side of a height field; its base is out of sight."""
    rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    half_x, half_y, top, _ = model.hfield_size[field]
    first = int(model.hfield_adr[field])
    heights = model.hfield_data[first : first + rows * columns].reshape(rows, columns)
    y, x = np.meshgrid(
        np.linspace(-half_y, half_y, rows), np.linspace(-half_x, half_x, columns), indexing="ij"
    )
    positions = np.stack([x, y, top * heights], axis=2).reshape(-1, 3)
    return primitives.faceted(positions, primitives.grid_triangles(rows, columns))
