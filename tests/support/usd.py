"""Stages of Universal Scene Description, read by OpenUSD's own library."""

from pathlib import Path

import numpy as np
import trimesh


def usd_scene(path: Path) -> trimesh.Scene:
    """Read a stage: a mesh for each part, with its colour of linear light."""
    from pxr import Usd, UsdGeom, UsdShade

    stage, scene = Usd.Stage.Open(str(path)), trimesh.Scene()
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0 and UsdGeom.GetStageUpAxis(stage) == "Z"
    assert stage.GetDefaultPrim().GetPath() == "/world"
    for prim in stage.Traverse():
        if not prim.IsA(UsdGeom.Mesh):
            continue
        mesh, material = (
            UsdGeom.Mesh(prim),
            UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(),
        )
        assert mesh.GetSubdivisionSchemeAttr().Get() == "none"
        points = np.array(mesh.GetPointsAttr().Get())
        extent = [points.min(axis=0), points.max(axis=0)]
        np.testing.assert_allclose(np.array(mesh.GetExtentAttr().Get()), extent, rtol=1e-6)
        assert set(mesh.GetFaceVertexCountsAttr().Get()) == {3}
        faces = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
        shader, _, _ = material[0].ComputeSurfaceSource()
        colour = np.array(shader.GetInput("diffuseColor").Get())
        roughness = shader.GetInput("roughness").Get()
        assert np.array_equal(mesh.GetDisplayColorAttr().Get()[0], colour)
        paint = {"colour": colour, "roughness": roughness}
        part = trimesh.Trimesh(points, faces, process=False, metadata=paint)
        name = f"{prim.GetParent().GetName()}_{prim.GetName()}"
        transform = np.array(UsdGeom.Imageable(prim).ComputeLocalToWorldTransform(0.0)).T
        scene.add_geometry(part, geom_name=name, node_name=name, transform=transform)
    return scene
