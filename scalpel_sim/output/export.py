"""Export of the body's surface as STL, OBJ, PLY, GLB or USD files, for use in other programs.

All files are in metres. STL, OBJ, PLY and USD are in the tissue frame, whose z axis points up. GLB
is turned so that y points up, as the format demands.

- STL: one mesh, all pieces together.
- PLY: one mesh; each face has a colour, and the properties `is_cut` and `piece`.
- OBJ: an object for each piece, its faces in the groups `skin` and `cut`.
- GLB and USD: a node for each piece, with a mesh of its skin and a mesh of its cut faces; and one
  for each body of the arm at its pose, with a mesh for each of its shapes.

Pieces are numbered from 1, the largest at rest first, as in `summary.json`. Of a body with several
labels each face of a PLY has the colour of its label, and the property `label`; groups of an OBJ
and meshes of a GLB or USD are one for each label, as `skin_2_fat` and `cut_2_fat`.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from scalpel_sim.arm.free_names import free_name
from scalpel_sim.errors import UsageError, writing
from scalpel_sim.output.rigid_bodies import (
    ROUGHNESS,
    RigidBody,
    RigidPart,
    group_of,
)
from scalpel_sim.output.surface_pieces import piece_of_vertices, surface_pieces
from scalpel_sim.output.usd import (
    USD_ENDINGS,
    UsdMesh,
    UsdNode,
    expect_usd,
    usd_bytes,
)
from scalpel_sim.scene.label_colours import TissueColours
from tissue import BoolArray, FloatArray, Surface
from tissue.support import whole_file

if TYPE_CHECKING:  # loading trimesh takes 0.3 s, and most runs export nothing
    from trimesh import Scene, Trimesh

_GAMMA = 2.2
"""Exponent between sRGB, in which colours are given, and the linear light that GLB and USD want."""

_Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, -1.0, 0, 0], [0, 0, 0, 1.0]])
"""Transform from z up to y up, the axis that GLB prescribes."""


class _Exported(NamedTuple):
    """Contents of a file."""

    surface: Surface
    """Surface of the body."""
    colours: TissueColours
    """Its colours."""
    beside: Sequence[RigidBody]
    """Arm and surroundings."""


class _Part(NamedTuple):
    """The triangles of a piece that have one colour."""

    name: str
    """`skin` or `cut`, and the label of a body that has several."""
    chosen: BoolArray
    """Which triangles of the piece they are."""
    colour: tuple[int, ...]
    """Red, green, blue and opacity, 0 to 255 (sRGB)."""


def export_surface(
    surface: Surface,
    path: Path,
    colours: TissueColours = TissueColours(),
    *,
    beside: Sequence[RigidBody] = (),
    option: str = "--export",
) -> None:
    """Write a body's surface in the format that the file name's ending requests.

    Args:
        surface: The surface.
        path: The file.
        colours: Colours of the body.
        beside: Arm and surroundings, which GLB and USD have.
        option: The option that chose the file, for messages.

    Raises:
        UsageError: the ending is none of `ENDINGS`.
        RunError: the file cannot be written.
    """
    _check_suffix(path, ENDINGS, option)
    write = _WRITERS[path.suffix.lower()]
    with writing(path, f"another {option}"), whole_file(path) as unfinished:
        unfinished.write_bytes(write(_Exported(surface, colours, beside)))


def check_exports(
    paths: Iterable[Path], option: str = "--export", endings: Sequence[str] | None = None
) -> None:
    """Make sure before the work that a surface can be exported to these files.

    Args:
        paths: The files.
        option: The option that chose them, for messages.
        endings: Endings of names that are known; None: `ENDINGS`.

    Raises:
        UsageError: an ending is none of these, what writes such a file is not installed, or there
            is no such folder.
        RunError: the system refuses to write there.
    """
    for path in paths:
        _check_suffix(path, ENDINGS if endings is None else endings, option)
        if path.suffix.lower() in USD_ENDINGS:
            expect_usd(path)
        check_file(path, path.suffix.lower(), option)


def check_file(path: Path, suffix: str, option: str) -> None:
    """Make sure that a file can be written, before the work whose result it is for.

    Args:
        path: The file; one that is there will be overwritten.
        suffix: What its name must end in.
        option: The option that chose it, for the message.

    Raises:
        UsageError: another suffix, a folder, or a file in a folder that does not exist.
        RunError: the system refuses.
    """
    _check_suffix(path, [suffix], option)
    if path.is_dir() or not path.parent.is_dir():
        reason = "it is a folder" if path.is_dir() else f"there is no folder {path.parent}"
        raise UsageError(f"{option} is {path}, and {reason}; choose another file")
    is_new = not path.exists()
    with writing(path, f"another {option}"):
        path.open("ab").close()
        if is_new:
            path.unlink()


def _stl(given: _Exported) -> bytes:
    """Return the surface as binary STL: triangles, and nothing else."""
    return _exported(given.surface.to_trimesh(), "stl")


def _ply(given: _Exported) -> bytes:
    """Return the surface as binary PLY with a colour, `is_cut` and `piece` for each face."""
    surface, colours, _ = given
    mesh = surface.to_trimesh()
    piece = piece_of_vertices(surface)[surface.triangles[:, 0]] + 1
    mesh.face_attributes["piece"] = piece.astype(np.int32)
    if colours.labels and surface.labels is not None:
        mesh.face_attributes["label"] = surface.labels.astype(np.int32)
    of_faces = np.zeros((len(surface.triangles), 4), np.uint8)
    for part in _parts(surface, colours):
        of_faces[part.chosen] = part.colour
    visual: Any = mesh.visual
    visual.face_colors = of_faces
    return _exported(mesh, "ply")


def _obj(given: _Exported) -> bytes:
    """Return the surface as OBJ text.

    Written here, because trimesh has no groups: skin and cut faces would not share their vertices.
    """
    lines: list[str] = []
    n_before = 1
    for name, piece in surface_pieces(given.surface):
        lines.append(f"o {name}")
        lines += (f"v {x!r} {y!r} {z!r}" for x, y, z in piece.positions.tolist())
        for part in _parts(piece, given.colours):
            lines.append(f"g {name}_{part.name}")
            corners = (piece.triangles[part.chosen] + n_before).tolist()
            lines += (f"f {a} {b} {c}" for a, b, c in corners)
        n_before += len(piece.positions)
    return ("\n".join(lines) + "\n").encode("ascii")


def _glb(given: _Exported) -> bytes:
    """Return a GLB: a node for each piece, above its skin and its cut faces, and for each body."""
    from trimesh import Scene

    scene = Scene(base_frame="world")
    graph: Any = scene.graph
    graph.update("body", "world", matrix=_Y_UP)
    for name, piece in surface_pieces(given.surface):
        graph.update(name, "body")
        for part in _parts(piece, given.colours):
            scene.add_geometry(
                _part_mesh(piece, part),
                node_name=f"{name}_{part.name}",
                geom_name=f"{name}_{part.name}",
                parent_node_name=name,
            )
    taken = set(graph.nodes)

    def node(wanted: str) -> str:
        name = free_name(wanted, taken)
        taken.add(name)
        return name

    groups = {group: node(group) for group in sorted({group_of(body) for body in given.beside})}
    for name in groups.values():
        graph.update(name, "world", matrix=_Y_UP)
    for body in given.beside:
        above = node(body.name)
        graph.update(above, groups[group_of(body)], matrix=body.pose)
        for rigid in body.parts:
            name = node(f"{body.name}_{rigid.name}")
            scene.add_geometry(
                _rigid_mesh(rigid), node_name=name, geom_name=name, parent_node_name=above
            )
    return _exported(scene, "glb")


def _usd(ending: str, given: _Exported) -> bytes:
    """Return a USD stage: a transform for each piece, above its parts, and for each body."""
    root = UsdNode("world")
    tissue = root.child("body")
    for name, piece in surface_pieces(given.surface):
        above = tissue.child(name)
        for part in _parts(piece, given.colours):
            own = piece.part(part.chosen)
            used, corners = np.unique(own.triangles, return_inverse=True)
            above.child(
                part.name,
                mesh=UsdMesh(own.positions[used], corners.reshape(-1, 3), _linear(part.colour)),
            )
    groups: dict[str, UsdNode] = {}
    for body in given.beside:
        group = group_of(body)
        if group not in groups:
            groups[group] = root.child(group)
        above = groups[group].child(body.name, body.pose)
        for rigid in body.parts:
            above.child(
                rigid.name,
                mesh=UsdMesh(
                    rigid.positions,
                    rigid.triangles,
                    _linear(rigid.colour),
                    rigid.normals,
                    rigid.roughness,
                ),
            )
    return usd_bytes(root, ending)


def _linear(colour: tuple[int, ...]) -> FloatArray:
    """Return a colour of sRGB, 0 to 255, as linear light from 0 to 1; opacity stays what it is."""
    linear = np.array(colour) / 255.0
    linear[:3] **= _GAMMA
    return linear


def _parts(piece: Surface, colours: TissueColours) -> Iterator[_Part]:
    """Yield the parts that a piece has: skin and cut faces, those of each label by themselves."""
    for name, chosen, colour in (
        ("skin", ~piece.is_cut, colours.skin),
        ("cut", piece.is_cut, colours.inside),
    ):
        if piece.labels is None or not colours.labels:
            parts = [_Part(name, chosen, _opaque(colour))]
        else:
            parts = [
                _Part(
                    f"{name}_{each.label}_{re.sub(r'[^A-Za-z0-9]+', '_', each.title)}",
                    chosen & (piece.labels == each.label),
                    _opaque(each.inside if name == "cut" else each.skin),
                )
                for each in colours.labels
            ]
        yield from (part for part in parts if part.chosen.any())


def _opaque(colour: str) -> tuple[int, ...]:
    """Return red, green, blue and opacity, 0 to 255, of six hexadecimal digits."""
    return (*bytes.fromhex(colour), 255)


def _part_mesh(piece: Surface, part: _Part) -> "Trimesh":
    """Return the triangles of a part, all of one colour, as a mesh with a material."""
    mesh = piece.part(part.chosen).to_trimesh()
    mesh.remove_unreferenced_vertices()
    return _painted(mesh, part.colour)


def _rigid_mesh(part: RigidPart) -> "Trimesh":
    """Return a part of a body as a mesh with a material."""
    from trimesh import Trimesh

    mesh = Trimesh(part.positions, part.triangles, vertex_normals=part.normals, process=False)
    return _painted(mesh, part.colour, part.roughness)


def _painted(mesh: "Trimesh", colour: tuple[int, ...], roughness: float = ROUGHNESS) -> "Trimesh":
    """Return a mesh with a material of its own."""
    from trimesh.visual import material, texture

    pbr: Any = material.PBRMaterial
    visuals: Any = texture.TextureVisuals
    mesh.visual = visuals(
        material=pbr(
            baseColorFactor=_linear(colour),
            roughnessFactor=roughness,
            metallicFactor=0.0,
        )
    )
    return mesh


def _exported(mesh: "Trimesh | Scene", kind: str) -> bytes:
    """Return a file's bytes in one of trimesh's formats."""
    exported = mesh.export(file_type=kind)
    assert isinstance(exported, bytes)
    return exported


def _check_suffix(path: Path, suffixes: Sequence[str], option: str) -> None:
    """Refuse a file whose name ends in another suffix."""
    if path.suffix.lower() not in suffixes:
        *others, last = suffixes
        known = f"{', '.join(others)} or {last}" if others else last
        raise UsageError(f"{option} is {path}; its name must end in {known}")


_WRITERS: dict[str, Callable[[_Exported], bytes]] = {
    ".stl": _stl,
    ".obj": _obj,
    ".ply": _ply,
    ".glb": _glb,
    **{ending: partial(_usd, ending) for ending in USD_ENDINGS},
}
"""Functions that return the bytes of a file, by the ending of its name."""

ENDINGS = tuple(_WRITERS)
"""Endings of the file names that can be exported."""
