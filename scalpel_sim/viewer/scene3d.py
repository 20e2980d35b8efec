"""Commands that change a three-dimensional scene, in the format of meshcat.

Objects have paths, as in meshcat, and are sent as meshcat's commands (`set_object`,
`set_transform`). The page that shows them (`page/`) adds commands that meshcat lacks: textured
materials that many meshes share, several commands that take effect together, a camera and lights
that suit the size of the scene, and readings next to the picture.

meshcat's viewer and its command format are used, but not its Python package: importing it takes
0.4 s (it imports IPython), and its server listens on all interfaces, keeps every property that was
ever set, and waits for a reply to each command.
"""

import base64
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import msgspec
import numpy as np

from bridge import TissueFrame
from scalpel_sim.hands.run_results import RunResults
from scalpel_sim.recording.columns import ForceParts
from scalpel_sim.recording.recording import TERMS
from scalpel_sim.scene.label_colours import LabelColours
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.viewer.primitives import TriangleMesh
from tissue import BoolArray, Energies, FloatArray, IntArray

_EXTENSION = {"uint8": 0x12, "int16": 0x13, "uint16": 0x14, "uint32": 0x16, "float32": 0x17}
"""MessagePack extension type of each kind of typed array. Source: msgpack-lite, the decoder inside
meshcat's viewer."""

INT16_MAX = 32767
"""Largest 16-bit integer, which stands for 1 in normals and tints."""


class Appearance(NamedTuple):
    """Appearance of a surface: a three.js material and its textures."""

    kind: str
    """Name of the three.js class, for instance `MeshPhongMaterial`."""
    properties: Mapping[str, Any]
    """Properties of the material by their three.js names; colours are 0xRRGGBB in sRGB."""
    maps: Mapping[str, bytes] = {}
    """Textures (PNG) by the name of the property that holds them, for instance `map`."""
    part: str | None = None
    """`link` of an arm, which is drawn faint before tissue, or `end`, its blade or a pad, which is
    not to be hidden; None: neither."""


NO_VECTORS = np.zeros((0, 3))
"""An array of no vectors."""


class Readings(NamedTuple):
    """Numbers that are shown next to the picture, and forces that are drawn in it."""

    time: float
    """Simulated time [s]."""
    force: FloatArray
    """Force of the tissue on the blade [N], world frame, shape (3,)."""
    point: FloatArray
    """Point at which the force acts [m], world frame, shape (3,)."""
    cut_area: float
    """Area cut since the start [m2]."""
    n_tetrahedra: int
    """Number of tetrahedra of the body."""
    contact_points: FloatArray = NO_VECTORS
    """Points at which the tissue acts on the blade [m], world frame, shape (n_contacts, 3)."""
    contact_forces: FloatArray = NO_VECTORS
    """Force on the blade at each of these points [N], world frame, shape (n_contacts, 3)."""
    parts: ForceParts | None = None
    """The force in parts: of the edge, of the faces, and of friction."""
    hands: Sequence[tuple[str, float]] = ()
    """Name of each grasper, and the force of the tissue on it [N]."""
    energies: Energies | None = None
    """Energy balance: where the work of the blade went. None without an audit."""


class JudgedState(NamedTuple):
    """The plan of a task as a line on the skin, what of it is open, and the score so far."""

    places: FloatArray
    """Places of the line in order [m], tissue frame, shape (n, 3)."""
    is_open: BoolArray
    """Whether the cut is open there, shape (n,)."""
    rows: Sequence[tuple[str, str, bool | None]]
    """Terms of the score: name, figure with its unit, and whether it is as was asked for; None:
    nothing was."""


class HandState(
    msgspec.Struct,
    frozen=True,
    tag_field="type",
    tag="set_hand",
    rename={"is_engaged": "engaged", "has_ended": "ended", "is_closed": "closed"},
):
    """State of the hand that the page leads: a command, with the names that the page reads."""

    tip: FloatArray
    """Where the tip of the chosen instrument is led [m], world frame, shape (3,)."""
    back: FloatArray
    """Direction from there back along the instrument, world frame, shape (3,)."""
    length: float
    """Length of its edge, or of its pads [m]."""
    normal: FloatArray
    """Unit normal of the plane in which it works, world frame, shape (3,)."""
    is_engaged: bool
    """Whether it leads that."""
    has_ended: bool
    """Whether the run will not follow it any more."""
    stamp: float | None
    """Stamp of the newest command that the picture shows; None: there was none yet."""
    instruments: Sequence[str]
    """Names of the instruments that it may choose."""
    chosen: int
    """Which of them it leads."""
    is_closed: bool | None
    """Whether the jaws of the chosen one are closed, or on their way there; None: it has none."""


class RunState(
    msgspec.Struct,
    frozen=True,
    tag_field="type",
    tag="set_run",
    rename={"is_paused": "paused", "n_strokes": "strokes", "has_ended": "ended"},
):
    """State of the run that the page controls: a command, with the names that the page reads."""

    is_paused: bool
    """Whether its time stands still."""
    rate: float
    """Simulated time over wall time, at most: below 1 it is slow motion."""
    real_time: float
    """Simulated time over wall time, lately."""
    can_go_back: bool
    """Whether it can go back to its start."""
    n_strokes: int
    """Number of strokes that can be undone."""
    has_ended: bool = False
    """Whether the page has ended it."""
    notice: str = ""
    """The message to the person."""
    results: RunResults | None = None
    """Results of it; None: it goes on."""
    stylus_distance: float = 0.0
    """Distance of the stylus of a device from the blade [m]."""


class LiveState(NamedTuple):
    """State of a run for the page that controls it."""

    run: RunState
    hand: HandState | None = None
    """The hand that it leads; None: a script leads it."""


class Scene3D:
    """Collects changes of the scene, until `take` returns them as one packet."""

    def __init__(self) -> None:
        self._commands: list[dict[str, Any] | RunState | HandState] = []

    def set_appearance(self, name: str, appearance: Appearance) -> None:
        """Define an appearance that meshes refer to by name."""
        pictures = {
            key: "data:image/png;base64," + base64.b64encode(png).decode("ascii")
            for key, png in appearance.maps.items()
        }
        self._add(
            "set_appearance",
            name=name,
            kind=appearance.kind,
            properties=appearance.properties,
            maps=pictures,
            part=appearance.part,
        )

    def set_mesh(self, path: str, mesh: TriangleMesh, appearance: str) -> None:
        """Put a mesh at `path`; it replaces the mesh that is there."""
        attributes = {
            "position": _pack(mesh.positions, "float32"),
            "normal": _pack(mesh.normals * INT16_MAX, "int16", normalized=True),
        }
        if mesh.uv is not None:
            attributes["uv"] = _pack(mesh.uv, "float32")
        if mesh.tints is not None:
            attributes["color"] = _pack(mesh.tints * INT16_MAX, "int16", normalized=True)
        if mesh.rest is not None:
            attributes["rest"] = _pack(mesh.rest, "float32")
        for name, levels in mesh.levels.items():
            attributes[name] = _pack(levels, "uint8", normalized=True)
        index_type = "uint16" if len(mesh.positions) <= np.iinfo(np.uint16).max else "uint32"
        geometry = {
            "uuid": f"{path} geometry",
            "type": "BufferGeometry",
            "data": {
                "attributes": attributes,
                "index": _pack(mesh.triangles.reshape(-1), index_type),
            },
        }
        plain = {"uuid": f"{path} material", "type": "MeshPhongMaterial", "name": appearance}
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
        """Set position [m], shape (3,), and rotation, shape (3, 3), of the objects below `path`."""
        matrix = np.eye(4)
        matrix[:3, :3] = rotation
        matrix[:3, 3] = position
        self._add("set_transform", path=path, matrix=matrix.T.ravel().tolist())

    def set_cameras(self, views: Sequence[ViewTable], extent: float) -> None:
        """Set the cameras that the page offers; it uses the first, and lights that suit it.

        Args:
            views: One or more, in the frame of the world.
            extent: Size of the scene [m], which the lights suit.
        """
        cameras = [
            {"name": v.name, "eye": v.eye, "target": v.target, "up": v.up, "fov": v.fov_degrees}
            for v in views
        ]
        self._add("set_cameras", cameras=cameras, extent=extent)

    def set_legend(self, labels: Sequence[LabelColours]) -> None:
        """Show which label has which colours; no labels: the body has one material."""
        entries = [
            {"title": each.title, "skin": f"#{each.skin}", "inside": f"#{each.inside}"}
            for each in labels
        ]
        self._add("set_legend", entries=entries)

    def set_wireframe(self, is_on: bool) -> None:
        """Switch the wireframe on or off: the edges of the tissue's triangles."""
        self._add("set_wireframe", on=is_on)

    def set_readings(self, readings: Readings, newton_length: float) -> None:
        """Show readings; the force arrow is `newton_length` [m] long for each newton."""
        self._add(
            "set_readings",
            time=readings.time,
            force=np.asarray(readings.force, float),
            point=np.asarray(readings.point, float),
            cut_area=readings.cut_area,
            tetrahedra=readings.n_tetrahedra,
            newton_length=newton_length,
            contacts=_pack(
                np.hstack([readings.contact_points, readings.contact_forces]), "float32"
            ),
            parts=[] if readings.parts is None else [math.hypot(*part) for part in readings.parts],
            hands=[{"name": name, "newtons": force} for name, force in readings.hands],
            energies=_energy_terms(readings.energies),
        )

    def set_scales(self, tops: Mapping[str, float]) -> None:
        """Set the value of each quantity that level 255 of the meshes before stands for, SI."""
        self._add("set_scales", tops=dict(tops))

    def set_judged(self, judged: JudgedState, frame: TissueFrame) -> None:
        """Draw the line of a plan on the skin, and show the terms of the score.

        Args:
            judged: Plan and score.
            frame: Pose of the tissue frame in the world.
        """
        places, is_open = frame.points_to_world(judged.places), judged.is_open.astype(np.int64)
        self._add("set_plan", places=_pack(places, "float32"), open=_pack(is_open, "uint8"))
        self._add("set_score", rows=judged.rows)

    def set_live(self, live: LiveState) -> None:
        """Show how the run is that the page controls, and its hand."""
        self._commands += [live.run] if live.hand is None else [live.run, live.hand]

    def take(self) -> bytes:
        """Return all changes since the last call as one packet; they take effect together."""
        commands, self._commands = self._commands, []
        batch = {"type": "batch", "commands": commands}
        return msgspec.msgpack.encode(batch, enc_hook=np.ndarray.tolist)

    def _add(self, command: str, **fields: Any) -> None:
        self._commands.append({"type": command, **fields})


def _energy_terms(energies: Energies | None) -> list[dict[str, Any]]:
    """Return the terms of the energy balance with names and colours, in the order of the table."""
    if energies is None:
        return []
    return [
        {"label": term.label, "colour": term.colour, "joules": float(getattr(energies, term.name))}
        for term in TERMS
    ]


def _pack(array: FloatArray | IntArray, kind: str, *, normalized: bool = False) -> dict[str, Any]:
    """Return an array as an attribute of a three.js geometry; each row is one item."""
    body = np.ascontiguousarray(array, dtype=kind).tobytes()
    return {
        "itemSize": 1 if array.ndim == 1 else array.shape[1],
        "type": f"{kind.capitalize()}Array",
        "array": msgspec.msgpack.Ext(_EXTENSION[kind], body),
        "normalized": normalized,
    }
