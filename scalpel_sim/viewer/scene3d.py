"""A scene in three dimensions, in meshcat's words: the layer that another viewer would replace.

Objects live under paths, as in meshcat, and are sent as meshcat's commands (`set_object`,
`set_transform`). The page that shows them (`page/`) adds what meshcat lacks: textured materials
that many meshes share, several commands that take effect at once, a camera and lights that suit
the size of the scene, and readings beside the picture.

meshcat's viewer and its command format are used, but not its Python package: importing it costs
0.4 s (IPython among others), and its server listens on all interfaces, keeps every property that
was ever set, and waits for a reply to each command.
"""

import base64
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import msgspec
import numpy as np

from scalpel_sim.output.energy_terms import TERMS
from scalpel_sim.output.force_parts import ForceParts
from scalpel_sim.viewer.draping import TriangleMesh
from tissue import Energies, FloatArray, IntArray

# Typed arrays as MessagePack extensions. Source: msgpack-lite, the decoder inside meshcat's viewer.
_EXTENSION = {"int16": 0x13, "uint16": 0x14, "uint32": 0x16, "float32": 0x17}
_JAVASCRIPT_ARRAY = {
    "int16": "Int16Array",
    "uint16": "Uint16Array",
    "uint32": "Uint32Array",
    "float32": "Float32Array",
}

INT16_MAX = 32767


class Look(NamedTuple):
    """What a surface looks like: a three.js material, and the pictures on it."""

    kind: str
    """Class of three.js, for instance `MeshPhongMaterial`."""
    properties: Mapping[str, Any]
    """As three.js names them; colours as 0xRRGGBB in sRGB."""
    maps: Mapping[str, bytes] = {}
    """PNG pictures by the name of the property that holds them, for instance `map`."""


NO_VECTORS = np.zeros((0, 3))


class Readings(NamedTuple):
    """Numbers that are shown beside the picture, and the force that is shown in it."""

    time: float
    """Simulated time [s]."""
    force: FloatArray
    """What the blade feels [N], world frame, shape (3,)."""
    point: FloatArray
    """Where it feels it [m], world frame, shape (3,)."""
    cut_area: float
    """[m2]."""
    n_tetrahedra: int
    contact_points: FloatArray = NO_VECTORS
    """Where the tissue acts on the blade [m], world frame, shape (n_contacts, 3)."""
    contact_forces: FloatArray = NO_VECTORS
    """What it does there [N], world frame, shape (n_contacts, 3)."""
    parts: ForceParts | None = None
    """What the force is made of."""
    energies: Energies | None = None
    """Where the work of the blade went; None without an audit."""


class Scene3D:
    """Collects what is to change in the picture, until `take` hands it over as one packet."""

    def __init__(self) -> None:
        self._commands: list[dict[str, Any]] = []

    def set_look(self, name: str, look: Look) -> None:
        """Define a look that meshes refer to by name."""
        pictures = {
            key: "data:image/png;base64," + base64.b64encode(png).decode("ascii")
            for key, png in look.maps.items()
        }
        self._add("set_look", name=name, kind=look.kind, properties=look.properties, maps=pictures)

    def set_mesh(self, path: str, mesh: TriangleMesh, look: str) -> None:
        """Put a mesh at `path`, in place of the one that is there."""
        attributes = {
            "position": _pack(mesh.positions, "float32"),
            "normal": _pack(mesh.normals * INT16_MAX, "int16", normalized=True),
        }
        if mesh.uv is not None:
            attributes["uv"] = _pack(mesh.uv, "float32")
        if mesh.tints is not None:
            attributes["color"] = _pack(mesh.tints * INT16_MAX, "int16", normalized=True)
        index_type = "uint16" if len(mesh.positions) <= np.iinfo(np.uint16).max else "uint32"
        geometry = {
            "uuid": f"{path} geometry",
            "type": "BufferGeometry",
            "data": {
                "attributes": attributes,
                "index": _pack(mesh.triangles.reshape(-1), index_type),
            },
        }
        plain = {"uuid": f"{path} material", "type": "MeshPhongMaterial", "name": look}
        self._add(
            "set_object",
            path=path,
            object={
                "metadata": {"version": 4.5, "type": "Object"},
                "geometries": [geometry],
                "materials": [plain],
                "object": {
                    "uuid": path,
                    "type": "Mesh",
                    "geometry": geometry["uuid"],
                    "material": plain["uuid"],
                },
            },
        )

    def set_pose(self, path: str, position: FloatArray, rotation: FloatArray) -> None:
        """Place what is under `path`: position [m], shape (3,), and rotation, shape (3, 3)."""
        matrix = np.eye(4)
        matrix[:3, :3] = rotation
        matrix[:3, 3] = position
        self._add("set_transform", path=path, matrix=matrix.T.ravel().tolist())

    def set_camera(self, eye: FloatArray, target: FloatArray, extent: float) -> None:
        """Look from `eye` at `target`, with light for a scene of size `extent` [m]."""
        self._add("set_camera", eye=eye.tolist(), target=target.tolist(), extent=extent)

    def set_wireframe(self, is_on: bool) -> None:
        """Draw the edges of the triangles of the tissue, or do not."""
        self._add("set_wireframe", on=is_on)

    def set_readings(self, readings: Readings, newton_length: float) -> None:
        """Show readings; an arrow at the blade is `newton_length` [m] long for each newton."""
        self._add(
            "set_readings",
            time=readings.time,
            force=np.asarray(readings.force, float).tolist(),
            point=np.asarray(readings.point, float).tolist(),
            cut_area=readings.cut_area,
            tetrahedra=readings.n_tetrahedra,
            newton_length=newton_length,
            contacts=_pack(
                np.hstack([readings.contact_points, readings.contact_forces]), "float32"
            ),
            parts=[] if readings.parts is None else [math.hypot(*part) for part in readings.parts],
            account=_account(readings.energies),
        )

    def take(self) -> bytes:
        """Return all changes since the last call as one packet, which takes effect at once."""
        commands, self._commands = self._commands, []
        return msgspec.msgpack.encode({"type": "batch", "commands": commands})

    def _add(self, command: str, **fields: Any) -> None:
        self._commands.append({"type": command, **fields})


def _account(energies: Energies | None) -> list[dict[str, Any]]:
    """Return the terms of an account with their names and colours, in the table's order."""
    if energies is None:
        return []
    return [
        {"label": term.label, "colour": term.colour, "joules": float(getattr(energies, term.name))}
        for term in TERMS
    ]


def _pack(array: FloatArray | IntArray, kind: str, *, normalized: bool = False) -> dict[str, Any]:
    """Return an array as an attribute of a three.js geometry; rows are items."""
    body = np.ascontiguousarray(array, dtype=kind).tobytes()
    return {
        "itemSize": 1 if array.ndim == 1 else array.shape[1],
        "type": _JAVASCRIPT_ARRAY[kind],
        "array": msgspec.msgpack.Ext(_EXTENSION[kind], body),
        "normalized": normalized,
    }
