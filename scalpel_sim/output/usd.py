"""A surface as a stage of Universal Scene Description, by OpenUSD's own library."""

import importlib.util
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scalpel_sim.errors import UsageError
from tissue import FloatArray, Surface

USD_ENDINGS = (".usd", ".usda", ".usdc")
"""Endings of names: USD's usual form, which is binary; text; binary."""

ROUGHNESS = 0.5
"""Roughness of all surfaces, from 0, a mirror, to 1."""


class UsdPart(NamedTuple):
    """Triangles of one colour."""

    name: str
    """Name of the mesh."""
    surface: Surface
    """They, and the vertices of the piece."""
    colour: FloatArray
    """Red, green and blue of linear light, and opacity, from 0 to 1; shape (4,)."""


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


def usd_bytes(pieces: Mapping[str, Sequence[UsdPart]], ending: str) -> bytes:
    """Return a stage in metres, whose z axis points up: `/body/piece_1/skin` and so on.

    Args:
        pieces: The parts of each piece, by the name of that.
        ending: One of `USD_ENDINGS`.
    """
    from pxr import Usd, UsdGeom

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"body{ending}"
        stage: Any = Usd.Stage.CreateNew(str(path))
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
        stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/body").GetPrim())
        for name, parts in pieces.items():
            UsdGeom.Xform.Define(stage, f"/body/{name}")
            for part in parts:
                _add_mesh(stage, f"/body/{name}/{part.name}", part)
        stage.GetRootLayer().Save()
        return path.read_bytes()


def _add_mesh(stage: Any, path: str, part: UsdPart) -> None:
    """Add the triangles of a part, with the vertices that they have, and a material."""
    from pxr import Gf, Sdf, UsdGeom, UsdShade, Vt

    used, corners = np.unique(part.surface.triangles, return_inverse=True)
    points = part.surface.positions[used].astype(np.float32)
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexCountsAttr(
        Vt.IntArray.FromNumpy(np.full(len(part.surface.triangles), 3, np.int32))
    )
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(corners.ravel().astype(np.int32)))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)  # or it would be drawn round
    mesh.CreateExtentAttr(
        [Gf.Vec3f(*points.min(axis=0).tolist()), Gf.Vec3f(*points.max(axis=0).tolist())]
    )
    red, green, blue, opacity = part.colour.tolist()
    colour = Gf.Vec3f(red, green, blue)
    mesh.CreateDisplayColorAttr([colour])
    material = UsdShade.Material.Define(stage, f"{path}_material")
    shader = UsdShade.Shader.Define(stage, f"{path}_material/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(colour)
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(ROUGHNESS)
    shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(opacity)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
