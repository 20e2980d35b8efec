"""The second model of a canvas: the assets of the first, and room for meshes that change.

MuJoCo uploads meshes, textures and materials from a compiled model, whose sizes are fixed. The
model of the user is only read: a second one is made from its compiled arrays, with its assets under
the same numbers, and after them what a canvas adds. A scene made from the second model has room for
all that the first one shows; a picture of it by a context of the second shows what the first one
does, to the byte, and those meshes.

Meshes that change are flexes: MuJoCo draws a flex from arrays of the scene, where positions,
normals and texture coordinates of the corners of its triangles are written, with nothing to upload.
"""

from collections.abc import Mapping
from typing import NamedTuple

import mujoco
import numpy as np

from scalpel_sim.camera.finishes import Finish, picture_of
from scalpel_sim.camera.lights import Rgb
from scalpel_sim.viewer.primitives import TriangleMesh
from tissue import FloatArray, IntArray

_SAME = (
    *("mesh_vert", "mesh_normal", "mesh_face", "mesh_facenormal"),
    *("mesh_texcoord", "mesh_facetexcoord", "hfield_data", "tex_data", "flex_edge"),
)
"""Arrays of the assets of the first model, which the second one begins with."""

_VISUAL = {
    "quality": ("numslices", "numstacks", "numquads"),
    "map": ("fogstart", "fogend", "shadowclip", "shadowscale", "znear", "zfar"),
    "rgba": ("fog", "haze"),
    "global_": ("linewidth",),
}
"""Settings of the first model that a context reads."""


class Capacity(NamedTuple):
    """Size of a mesh."""

    n_vertices: int
    n_triangles: int


class RenderModel:
    """The second model of a canvas.

    Args:
        model: The first model, which stays as it is.
        rooms: Most triangles of each mesh that changes, by its name.
        shapes: Meshes that stay as they are, by their names.
        finishes: Look of each of all these meshes.
        shadow_pixels: Side of the map of a shadow [pixels]; 0: there are no shadows.
        samples: Samples of each pixel, against jagged edges; 0: one.
        background: Rgb where nothing is, if the first model has no sky (sRGB).
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        rooms: Mapping[str, int],
        shapes: Mapping[str, TriangleMesh],
        finishes: Mapping[str, Finish],
        *,
        shadow_pixels: int,
        samples: int,
        background: Rgb,
    ) -> None:
        spec = mujoco.MjSpec()
        _add_assets(spec, model)
        if mujoco.mjtTexture.mjTEXTURE_SKYBOX not in model.tex_type:
            _add_sky(spec, background)
        for name, mesh in shapes.items():
            _add_mesh(spec, name, mesh)
        for name, finish in finishes.items():
            _add_material(spec, name, finish)
        for name, room in rooms.items():
            _add_room(spec, name, room)
        spec.visual.quality.shadowsize, spec.visual.quality.offsamples = shadow_pixels, samples
        self.model = spec.compile()
        """MuJoCo's model."""
        _copy(model, self.model)
        self._shapes = {name: self.model.mesh(name).id for name in shapes}
        self._rooms = {name: model.nflex + i for i, name in enumerate(rooms)}
        self._materials = {name: self.model.material(name).id for name in finishes}
        for name, mesh in shapes.items():
            _write_mesh(self.model, self._shapes[name], mesh)

    def shape_number(self, name: str) -> int:
        """Return MuJoCo's number of a mesh that stays as it is."""
        return int(self._shapes[name])

    def room_number(self, name: str) -> int:
        """Return MuJoCo's number of the flex that has room for a mesh."""
        return int(self._rooms[name])

    def material_number(self, name: str) -> int:
        """Return MuJoCo's number of the material of a mesh."""
        return int(self._materials[name])


def _write_mesh(model: mujoco.MjModel, number: int, mesh: TriangleMesh) -> None:
    """Write the arrays of a mesh, which the compiler has put into an order of its own."""
    first, normal = int(model.mesh_vertadr[number]), int(model.mesh_normaladr[number])
    face, n, m = int(model.mesh_faceadr[number]), len(mesh.positions), len(mesh.triangles)
    model.mesh_vert[first : first + n] = mesh.positions
    model.mesh_normal[normal : normal + n] = mesh.normals
    for array in (model.mesh_face, model.mesh_facenormal, model.mesh_facetexcoord):
        array[face : face + m] = mesh.triangles


def _add_assets(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Add as many textures, materials, fields, meshes, skins, flexes and planes as a model has."""
    for i in range(model.ntex):
        width, height = int(model.tex_width[i]), int(model.tex_height[i])
        channels, first = int(model.tex_nchannel[i]), int(model.tex_adr[i])
        texture = spec.add_texture(
            name=f"texture {i}",
            type=mujoco.mjtTexture(int(model.tex_type[i])),
            width=width,
            height=height,
            nchannel=channels,
        )
        texture.colorspace = mujoco.mjtColorSpace(int(model.tex_colorspace[i]))
        texture.data = model.tex_data[first : first + width * height * channels].tobytes()
    for i in range(model.nmat):
        repeats, is_even = model.mat_texrepeat[i], bool(model.mat_texuniform[i])
        material = spec.add_material(name=f"material {i}", texrepeat=repeats, texuniform=is_even)
        for role, texture in enumerate(model.mat_texid[i].tolist()):
            if texture >= 0:
                material.textures[role] = f"texture {texture}"
    for i in range(model.nhfield):
        rows, columns = int(model.hfield_nrow[i]), int(model.hfield_ncol[i])
        spec.add_hfield(
            name=f"field {i}",
            nrow=rows,
            ncol=columns,
            size=model.hfield_size[i],
            userdata=np.zeros(rows * columns),
        )
    for i in range(model.nmesh):
        face, n = int(model.mesh_faceadr[i]), int(model.mesh_facenum[i])
        faces = slice(face, face + n)
        n_places = int(model.mesh_texcoordnum[i])
        _add_shape(
            spec,
            f"mesh {i}",
            Capacity(int(model.mesh_vertnum[i]), n),
            (int(model.mesh_normalnum[i]), model.mesh_facenormal[faces]),
            (n_places, model.mesh_facetexcoord[faces]) if n_places else None,
        )
    for i in range(model.nskin):
        _add_skin(spec, model, i)
    for i in range(model.nflex):
        first, dimension = int(model.flex_elemdataadr[i]), int(model.flex_dim[i])
        n_corners = int(model.flex_elemnum[i]) * (dimension + 1)
        elements = model.flex_elem[first : first + n_corners].reshape(-1, dimension + 1)
        _add_flex(spec, f"flex {i}", dimension, int(model.flex_vertnum[i]), elements)
    for i in range(model.ngeom):  # a plane is drawn by the number of its geom
        if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_PLANE:
            material_number = int(model.geom_matid[i])
            painted = {} if material_number < 0 else {"material": f"material {material_number}"}
            kind, size = mujoco.mjtGeom.mjGEOM_PLANE, model.geom_size[i]
            spec.worldbody.add_geom(type=kind, size=size, **painted)
        else:
            spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[1.0, 0.0, 0.0])


def _add_skin(spec: mujoco.MjSpec, model: mujoco.MjModel, number: int) -> None:
    """Add a skin of the right sizes: where it is comes with each scene of the first model."""
    first, n = int(model.skin_vertadr[number]), int(model.skin_vertnum[number])
    face, m = int(model.skin_faceadr[number]), int(model.skin_facenum[number])
    skin = spec.add_skin(name=f"skin {number}")
    skin.vert = model.skin_vert[first : first + n].ravel()
    skin.face = model.skin_face[face : face + m].ravel()
    place = int(model.skin_texcoordadr[number])
    if place >= 0:
        skin.texcoord = model.skin_texcoord[place : place + n].ravel()
    skin.bodyname, skin.bindpos, skin.bindquat = ["world"], [0.0] * 3, [1.0, 0.0, 0.0, 0.0]
    skin.vertid, skin.vertweight = [list(range(n))], [[1.0] * n]


def _add_sky(spec: mujoco.MjSpec, colour: Rgb) -> None:
    """Add a sky of one colour."""
    kind, flat = mujoco.mjtTexture.mjTEXTURE_SKYBOX, mujoco.mjtBuiltin.mjBUILTIN_FLAT
    spec.add_texture(
        name="sky", type=kind, builtin=flat, width=2, height=12, rgb1=colour, rgb2=colour
    )


def _add_mesh(spec: mujoco.MjSpec, name: str, mesh: TriangleMesh) -> None:
    """Add a mesh that stays as it is.

    With texture coordinates, though it has none, MuJoCo takes its normals as they are.
    """
    size = Capacity(len(mesh.positions), len(mesh.triangles))
    attribute = (size.n_vertices, mesh.triangles)
    _add_shape(spec, name, size, attribute, attribute)
    # A mesh without a geom would be left out. It collides with nothing.
    kind = mujoco.mjtGeom.mjGEOM_MESH
    spec.worldbody.add_geom(type=kind, meshname=name, contype=0, conaffinity=0)


def _add_room(spec: mujoco.MjSpec, name: str, n_triangles: int) -> None:
    """Add a flex that has room for so many triangles: MuJoCo draws two for each of its own."""
    elements = _faces(Capacity(n_triangles + 2, -(-n_triangles // 2)))
    _add_flex(spec, name, 2, n_triangles + 2, elements)


def _add_flex(
    spec: mujoco.MjSpec, name: str, dimension: int, n_vertices: int, elements: IntArray
) -> None:
    """Add a flex of the right sizes: where it is comes with each scene.

    Args:
        spec: The model.
        name: Name of the flex.
        dimension: Whether its elements are lines (1), triangles (2) or tetrahedra (3).
        n_vertices: Number of its vertices.
        elements: Vertices of each element, shape (n, dimension + 1).
    """
    flex = spec.add_flex(name=name, dim=dimension)
    flex.vertbody, flex.elem = ["world"], elements.ravel()
    # Places that the compiler takes: no element is flat.
    turns = np.arange(n_vertices)
    flex.vert = np.stack([np.cos(turns), np.sin(turns), turns**2], axis=1).ravel()
    flex.contype = flex.conaffinity = 0


def _add_shape(
    spec: mujoco.MjSpec,
    name: str,
    room: Capacity,
    normals: tuple[int, IntArray],
    places: tuple[int, IntArray] | None,
) -> None:
    """Add a mesh of the right sizes; its arrays are written later.

    Args:
        spec: The model.
        name: Name of the mesh.
        room: Number of its vertices and triangles.
        normals: Number of its normals, and those of the corners of each triangle.
        places: The same of its texture coordinates; None: it has none.
    """
    turns = np.linspace(0.0, 2.0 * np.pi, room.n_vertices, endpoint=False)
    mesh = spec.add_mesh(name=name)
    # Any solid that the compiler takes.
    heights = np.sin(7.0 * turns) + 0.1 * np.cos(3.0 * turns)
    mesh.uservert = np.stack([np.cos(turns), np.sin(turns), heights], axis=1).ravel()
    mesh.userface = _faces(room).ravel()
    mesh.usernormal = np.tile([0.0, 0.0, 1.0], normals[0])
    mesh.userfacenormal = normals[1].ravel()
    if places is not None:
        mesh.usertexcoord = np.zeros(2 * places[0])
        mesh.userfacetexcoord = places[1].ravel()
    mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL


def _faces(room: Capacity) -> IntArray:
    """Return triangles that differ, and use all vertices; shape (n_triangles, 3)."""
    n, each = room.n_vertices, np.arange(room.n_triangles)
    around, step = each % n, each // n
    return np.stack([around, (around + 1 + step) % n, (around + 2 + 3 * step) % n], axis=1)


def _add_material(spec: mujoco.MjSpec, name: str, finish: Finish) -> None:
    """Add the material of a mesh."""
    material = spec.add_material(name=name)
    if finish.picture is None:
        return
    picture = picture_of(finish.picture)
    texture = spec.add_texture(
        name=name,
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        width=picture.width,
        height=picture.height,
        nchannel=3,
    )
    texture.data = picture.pixels
    material.textures[int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] = name


def _copy(model: mujoco.MjModel, into: mujoco.MjModel) -> None:
    """Copy the assets of a model, and what a context reads of its settings."""
    for name in _SAME:
        array: FloatArray = getattr(model, name)
        getattr(into, name)[: len(array)] = array
    for group, names in _VISUAL.items():
        for name in names:
            setattr(getattr(into.vis, group), name, getattr(getattr(model.vis, group), name))
    into.stat.extent, into.stat.center = model.stat.extent, model.stat.center
