"""Meshes as a stage of Universal Scene Description, by OpenUSD's own library."""

import importlib.util
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scalpel_sim.arm.free_names import free_name
from scalpel_sim.errors import UsageError
from scalpel_sim.output.rigid_bodies import ROUGHNESS
from tissue import FloatArray, IntArray

USD_ENDINGS = (".usd", ".usda", ".usdc")
"""Endings of names: USD's usual form, which is binary; text; binary."""


class UsdMesh(NamedTuple):
    """Triangles of one colour."""

    positions: FloatArray
    """Vertices [m], shape (n_vertices, 3)."""
    triangles: IntArray
    """Vertex numbers, shape (n_triangles, 3)."""
    colour: FloatArray
    """Red, green and blue of linear light, and opacity, from 0 to 1; shape (4,)."""
    normals: FloatArray | None = None
    """Unit normals of the vertices, shape (n_vertices, 3); None: those of the triangles."""
    roughness: float = ROUGHNESS
    """From 0, a mirror, to 1."""


class UsdNode:
    """A transform, or a mesh, and the nodes below it.

    Args:
        name: Its name, of letters, digits and underscores.
        pose: Transform to the frame of the node above [m], shape (4, 4); None: the same frame.
        mesh: What it shows; None: nothing.
    """

    def __init__(
        self, name: str, pose: FloatArray | None = None, mesh: UsdMesh | None = None
    ) -> None:
        self.name, self.pose, self.mesh = name, pose, mesh
        self.below: list[UsdNode] = []

    def child(
        self, wanted: str, pose: FloatArray | None = None, *, mesh: UsdMesh | None = None
    ) -> "UsdNode":
        """Add a node below, and return it; its name is the wanted one, as far as USD takes it.

        Args:
            wanted: The name.
            pose: See `UsdNode`.
            mesh: See `UsdNode`.
        """
        from pxr import Tf

        name = free_name(str(Tf.MakeValidIdentifier(wanted)), (node.name for node in self.below))
        self.below.append(UsdNode(name, pose, mesh))
        return self.below[-1]


def expect_usd(path: Path) -> None:
    """Refuse a file of USD where what writes it is not installed.

    Raises:
        UsageError: it is not.
    """
    if importlib.util.find_spec("pxr") is None:
        raise UsageError(
            f"{path}: a file of USD is written by usd-core, which is not installed: pip install "
            "'scalpel-sim[usd]'"
        )


def usd_bytes(root: UsdNode, ending: str) -> bytes:
    """Return a stage in metres, whose z axis points up.

    Args:
        root: The node that stands for all when the stage is used in another.
        ending: One of `USD_ENDINGS`.
    """
    from pxr import Usd, UsdGeom

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"body{ending}"
        stage: Any = Usd.Stage.CreateNew(str(path))
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
        _add(stage, "", root)
        stage.SetDefaultPrim(stage.GetPrimAtPath(f"/{root.name}"))
        stage.GetRootLayer().Save()
        return path.read_bytes()


def _add(stage: Any, above: str, node: UsdNode) -> None:
    """Add a node and those below it."""
    from pxr import Gf, UsdGeom

    path = f"{above}/{node.name}"
    if node.mesh is not None:
        _add_mesh(stage, path, node.mesh)
    else:
        transform = UsdGeom.Xform.Define(stage, path)
        if node.pose is not None:  # USD multiplies rows
            transform.AddTransformOp().Set(Gf.Matrix4d(node.pose.T.tolist()))
    for each in node.below:
        _add(stage, path, each)


def _add_mesh(stage: Any, path: str, given: UsdMesh) -> None:
    """Add triangles and a material."""
    from pxr import Gf, Sdf, UsdGeom, UsdShade, Vt

    points, corners = given.positions.astype(np.float32), given.triangles.astype(np.int32)
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(corners), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(corners.ravel()))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)  # or it would be drawn round
    if given.normals is not None:
        mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(given.normals.astype(np.float32)))
        mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    mesh.CreateExtentAttr(
        [Gf.Vec3f(*points.min(axis=0).tolist()), Gf.Vec3f(*points.max(axis=0).tolist())]
    )
    red, green, blue, opacity = given.colour.tolist()
    colour = Gf.Vec3f(red, green, blue)
    mesh.CreateDisplayColorAttr([colour])
    material = UsdShade.Material.Define(stage, f"{path}_material")
    shader = UsdShade.Shader.Define(stage, f"{path}_material/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(colour)
    for name, value in (
        ("roughness", given.roughness),
        ("opacity", opacity),
    ):
        shader.CreateInput(name, Sdf.ValueTypeNames.Float).Set(value)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
