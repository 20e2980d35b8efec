"""Export of the body's surface as STL, OBJ, PLY, GLB or USD files, for use in other programs.

All files are in metres. STL, OBJ, PLY and USD are in the tissue frame, whose z axis points up. GLB
is turned so that y points up, as the format demands.

- STL: one mesh, all pieces together.
- PLY: one mesh; each face has a colour, and the properties `is_cut` and `piece`.
- OBJ: an object for each piece, its faces in the groups `skin` and `cut`.
- GLB and USD: a node for each piece, with a mesh of its skin and a mesh of its cut faces.

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

from scalpel_sim.errors import UsageError, writing
from scalpel_sim.output.usd import USD_ENDINGS, UsdPart, expect_usd, usd_bytes
from scalpel_sim.scene.label_colours import LabelColours
from tissue import CUT_COLOUR, SKIN_COLOUR, BoolArray, FloatArray, IntArray, Surface
from tissue.support import whole_file

if TYPE_CHECKING:  # loading trimesh takes 0.3 s, and most runs export nothing
    from trimesh import Scene, Trimesh

_GAMMA = 2.2
"""Exponent between sRGB, in which colours are given, and the linear light that GLB and USD want."""

_Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, -1.0, 0, 0], [0, 0, 0, 1.0]])
"""Transform from z up to y up, the axis that GLB prescribes."""


class SurfacePiece(NamedTuple):
    """The closed surface of one connected piece of the body."""

    name: str
    """`piece_1` for the largest at rest, and so on."""
    surface: Surface
    """Surface of this piece alone, with vertices of its own."""


class _Part(NamedTuple):
    """The triangles of a piece that have one colour."""

    name: str
    """`skin` or `cut`, and the label of a body that has several."""
    chosen: BoolArray
    """Which triangles of the piece they are."""
    colour: tuple[int, ...]
    """Red, green, blue and opacity, 0 to 255 (sRGB)."""


def export_surface(surface: Surface, path: Path, labels: Sequence[LabelColours] = ()) -> None:
    """Write a body's surface in the format that the file name's ending requests.

    Args:
        surface: The surface.
        path: The file.
        labels: Colours of the labels of the body, if it has several.

    Raises:
        UsageError: the ending is none of `ENDINGS`.
        RunError: the file cannot be written.
    """
    _check_suffix(path, ENDINGS, "--export")
    write = _WRITERS[path.suffix.lower()]
    with writing(path, "another --export"), whole_file(path) as unfinished:
        unfinished.write_bytes(write(surface, labels))


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


def surface_pieces(surface: Surface) -> list[SurfacePiece]:
    """Return the closed surface of each connected piece of the body, the largest at rest first."""
    piece = piece_of_vertices(surface)
    of_triangle = piece[surface.triangles[:, 0]]
    found = []
    for number in range(int(piece.max()) + 1):
        vertices, triangles = np.flatnonzero(piece == number), of_triangle == number
        place = np.empty(len(piece), dtype=np.int64)
        place[vertices] = np.arange(len(vertices))
        part = surface.part(triangles)
        own = part._replace(
            positions=surface.positions[vertices],
            rest_positions=surface.rest_positions[vertices],
            triangles=place[part.triangles],
        )
        found.append(SurfacePiece(f"piece_{number + 1}", own))
    return found


def piece_of_vertices(surface: Surface) -> IntArray:
    """Return the number of the piece of each vertex, from 0, the largest at rest first.

    Triangles that hang together through vertices are one closed shell, and pieces share no vertex.
    A shell that encloses a negative volume is a cavity: it belongs to the piece around it.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    a, b, c = surface.triangles.T
    n = len(surface.positions)
    edges = np.concatenate([a, b]), np.concatenate([b, c])
    n_shells, shell = connected_components(csr_array((np.ones(2 * len(a)), edges), shape=(n, n)))
    corners = surface.rest_positions[surface.triangles]
    volumes = np.bincount(shell[a], np.linalg.det(corners) / 6.0, n_shells)
    outer = np.flatnonzero(volumes > 0.0)
    outer = outer[np.argsort(-volumes[outer], kind="stable")]
    piece = np.empty(n_shells, dtype=np.int64)
    piece[outer] = np.arange(len(outer))
    for cavity in np.flatnonzero(volumes <= 0.0):
        point = surface.rest_positions[shell == cavity][0]
        around = [_winding_number(point, corners[shell[a] == each]) for each in outer]
        piece[cavity] = int(np.argmax(around))
    found: IntArray = piece[shell]
    return found


def _winding_number(point: FloatArray, corners: FloatArray) -> float:
    """Return how often closed triangles, shape (n, 3, 3), surround a point: 1 inside, 0 outside.

    Source: A. Van Oosterom, J. Strackee, "The solid angle of a plane triangle", 1983.
    """
    a, b, c = np.moveaxis(corners - point, 1, 0)
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    ab, bc, ca = (np.einsum("ij,ij->i", *pair) for pair in ((a, b), (b, c), (c, a)))
    angle = np.arctan2(
        np.linalg.det(np.stack([a, b, c], 1)), la * lb * lc + ab * lc + bc * la + ca * lb
    )
    return float(angle.sum() / (2.0 * np.pi))


def _stl(surface: Surface, _: Sequence[LabelColours]) -> bytes:
    """Return the surface as binary STL: triangles, and nothing else."""
    return _exported(surface.to_trimesh(), "stl")


def _ply(surface: Surface, labels: Sequence[LabelColours]) -> bytes:
    """Return the surface as binary PLY with a colour, `is_cut` and `piece` for each face."""
    mesh = surface.to_trimesh()
    piece = piece_of_vertices(surface)[surface.triangles[:, 0]] + 1
    mesh.face_attributes["piece"] = piece.astype(np.int32)
    if labels and surface.labels is not None:
        mesh.face_attributes["label"] = surface.labels.astype(np.int32)
        colours = np.zeros((len(surface.triangles), 4), np.uint8)
        for part in _parts(surface, labels):
            colours[part.chosen] = part.colour
        visual: Any = mesh.visual
        visual.face_colors = colours
    return _exported(mesh, "ply")


def _obj(surface: Surface, labels: Sequence[LabelColours]) -> bytes:
    """Return the surface as OBJ text.

    Written here, because trimesh has no groups: skin and cut faces would not share their vertices.
    """
    lines: list[str] = []
    n_before = 1
    for name, piece in surface_pieces(surface):
        lines.append(f"o {name}")
        lines += (f"v {x!r} {y!r} {z!r}" for x, y, z in piece.positions.tolist())
        for part in _parts(piece, labels):
            lines.append(f"g {name}_{part.name}")
            corners = (piece.triangles[part.chosen] + n_before).tolist()
            lines += (f"f {a} {b} {c}" for a, b, c in corners)
        n_before += len(piece.positions)
    return ("\n".join(lines) + "\n").encode("ascii")


def _glb(surface: Surface, labels: Sequence[LabelColours]) -> bytes:
    """Return the surface as GLB: a node for each piece, above its skin and its cut faces."""
    from trimesh import Scene

    scene = Scene(base_frame="world")
    graph: Any = scene.graph
    graph.update("body", "world", matrix=_Y_UP)
    for name, piece in surface_pieces(surface):
        graph.update(name, "body")
        for part in _parts(piece, labels):
            scene.add_geometry(
                _part_mesh(piece, part),
                node_name=f"{name}_{part.name}",
                geom_name=f"{name}_{part.name}",
                parent_node_name=name,
            )
    return _exported(scene, "glb")


def _usd(ending: str, surface: Surface, labels: Sequence[LabelColours]) -> bytes:
    """Return the surface as a USD stage: a transform for each piece, above its parts."""
    pieces = {
        name: [
            UsdPart(part.name, piece.part(part.chosen), _linear(part.colour))
            for part in _parts(piece, labels)
        ]
        for name, piece in surface_pieces(surface)
    }
    return usd_bytes(pieces, ending)


def _linear(colour: tuple[int, ...]) -> FloatArray:
    """Return a colour of sRGB, 0 to 255, as linear light from 0 to 1; opacity stays what it is."""
    linear = np.array(colour) / 255.0
    linear[:3] **= _GAMMA
    return linear


def _parts(piece: Surface, labels: Sequence[LabelColours]) -> Iterator[_Part]:
    """Yield the parts that a piece has: skin and cut faces, those of each label by themselves."""
    for name, chosen, colour in (
        ("skin", ~piece.is_cut, SKIN_COLOUR),
        ("cut", piece.is_cut, CUT_COLOUR),
    ):
        if piece.labels is None or not labels:
            parts = [_Part(name, chosen, colour)]
        else:
            parts = [
                _Part(
                    f"{name}_{each.label}_{re.sub(r'[^A-Za-z0-9]+', '_', each.title)}",
                    chosen & (piece.labels == each.label),
                    (*bytes.fromhex(each.inside if name == "cut" else each.skin), colour[3]),
                )
                for each in labels
            ]
        yield from (part for part in parts if part.chosen.any())


def _part_mesh(piece: Surface, part: _Part) -> "Trimesh":
    """Return the triangles of a part, all of one colour, as a mesh with a material."""
    from trimesh.visual import material, texture

    mesh = piece.part(part.chosen).to_trimesh()
    mesh.remove_unreferenced_vertices()
    colour = _linear(part.colour)
    pbr: Any = material.PBRMaterial
    visuals: Any = texture.TextureVisuals
    mesh.visual = visuals(
        material=pbr(baseColorFactor=colour, roughnessFactor=0.5, metallicFactor=0.0)
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


_WRITERS: dict[str, Callable[[Surface, Sequence[LabelColours]], bytes]] = {
    ".stl": _stl,
    ".obj": _obj,
    ".ply": _ply,
    ".glb": _glb,
    **{ending: partial(_usd, ending) for ending in USD_ENDINGS},
}
"""Functions that return the bytes of a file, by the ending of its name."""

ENDINGS = tuple(_WRITERS)
"""Endings of the file names that can be exported."""
