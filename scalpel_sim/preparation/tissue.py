"""The tissue of a scene: held, stretched, and settled."""

import logging
import math
from collections.abc import Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from scalpel_sim.arm.standing import Tabletop
from scalpel_sim.errors import UsageError
from scalpel_sim.scene.labels import unused_labels
from scalpel_sim.scene.materials import naming_table
from scalpel_sim.scene.scene import Scene
from scalpel_sim.scene.schema import AttachmentTable, CoreTable, LedSupportTable
from scalpel_sim.strokes.stroke import from_csv
from tissue import (
    Attachment,
    BoolArray,
    FloatArray,
    FramePath,
    Geom,
    Material,
    SolverSettings,
    SupportPath,
    TetrahedralMesh,
    Tissue,
    expect_toughness_in_range,
    fixed_nodes,
    toughness_law_of,
)

_log = logging.getLogger("scalpel_sim")

LONG_DRAG = 0.1
"""Distance to which a blade may drag the tissue without a warning, as a share of the body's median
extent."""

MOST_INVERTED = 0.0
"""Share of tetrahedra that may be inside out after settling without a warning."""

LEAST_VOLUME = 0.9
"""Volume after settling over that at rest below which there is a warning. Soft tissue barely
changes its volume; held at its sides the softest scene keeps 0.99."""

_HARDLY_COMPRESSIBLE = 0.45
"""Poisson's ratio that most presets have [1]."""

TABLE_MARGIN = 0.08
"""Width of a table beyond the body [m]: as far as pieces are put down next to it."""

TABLE_HALF_THICKNESS = 0.005
"""Half the thickness of a table [m]: what is pressed on it is never nearer to the other side."""

OPPOSITE_SIDES = (("left", "right"), ("front", "back"), ("bottom", "top"))
"""Pairs of sides that can be pulled apart, one pair per axis."""


def make_tissue(scene: Scene) -> Tissue:
    """Return the tissue of a scene, at rest under gravity between the sides that are held.

    Raises:
        MeshError: the mesh cannot be cut.
        ValueError: the material or the fixed nodes make no sense for this mesh, or the blade would
            fold its springs.
        TissueError: the body cannot come to rest.
    """
    mesh, solver = scene.mesh(), scene.solver
    fixed = scene.held_nodes()
    tissue = Tissue(
        mesh,
        scene.materials_and_layers,
        fixed=fixed,
        positions=_start_of(scene, mesh),
        gravity=scene.world.free_fall,
        floor=scene.world.floor,
        blade=scene.blade,
        solver=SolverSettings(
            cut=scene.cut,
            scheme=solver.scheme,
            relaxation=solver.relaxation,
            threads=solver.threads,
            audit=solver.audit,
            mass_scaling=solver.mass_scaling or None,
            element=solver.element,
            precision=solver.precision,
        ),
    )
    for material in scene.all_materials:  # a blade will come
        expect_toughness_in_range(material, tissue.node_size)
    table = tabletop_of(scene, tissue.bounds)
    if table is not None:
        tissue.collide_with([table.geom], [table.centre])
    for i, core in enumerate(scene.cores):
        naming_table(
            f"[[core]] number {i + 1}",
            partial(_make_rigid, tissue, mesh, core),
        )
    attachments = _attached(tissue, mesh, scene.attachments)
    if fixed.any() or table is not None or attachments:
        tissue.settle()
        _warn_of_collapse(tissue, scene)
    for attachment, row in zip(attachments, scene.attachments, strict=True):
        ends = math.inf if row.release_at is None else row.release_at
        attachment.follow(FramePath(times_of(row), row.displacements or (), release_at=ends))
    for i, support in enumerate(scene.supports):
        naming_table(f"[[support]] number {i + 1}", partial(_lead, tissue, mesh, support))
    return tissue


def tabletop_of(scene: Scene, bounds: FloatArray) -> Tabletop | None:
    """Return the table of a scene; None where it has none.

    Args:
        scene: The scene.
        bounds: Lowest and highest corner of the body [m], shape (2, 3).
    """
    world = scene.world
    if world.table is None:
        return None
    of_tissue = {material.friction for material in scene.all_materials}
    # None: that of the label that touches.
    friction = of_tissue.pop() if len(of_tissue) == 1 else None
    if world.table_friction is not None:
        friction = world.table_friction
    middle, half = 0.5 * (bounds[0] + bounds[1]), 0.5 * (bounds[1] - bounds[0])
    # Whole millimetres: the same table, whatever a body has sagged by before it is made.
    size = np.ceil(1e3 * (half[:2] + TABLE_MARGIN)) * 1e-3
    centre = np.array([*np.round(middle[:2], 3), world.table - TABLE_HALF_THICKNESS])
    geom = Geom("tabletop", "box", (*size.tolist(), TABLE_HALF_THICKNESS), friction)
    return Tabletop(geom, centre)


def times_of(table: AttachmentTable) -> list[float]:
    """Return when the frame of an attachment is at each of its displacements [s]."""
    if table.displacements is None:
        return []
    if table.speed is None:
        assert table.times is not None
        return table.times
    found, seconds = [], 0.0
    for here, there in pairwise([(0.0, 0.0, 0.0), *table.displacements]):
        seconds += math.dist(here, there) / table.speed
        found.append(seconds)
    return found


def _make_rigid(tissue: Tissue, mesh: TetrahedralMesh, table: CoreTable) -> int:
    """Make one rigid core; return its number."""
    return tissue.make_rigid(_region(mesh, table), density=table.density)


def _region(
    mesh: TetrahedralMesh, table: AttachmentTable | CoreTable | LedSupportTable
) -> str | BoolArray:
    """Return the region of a table: as text; or its nodes, of a body or a label with a name."""
    is_text = table.body is None and not table.where.strip().lower().startswith("label:")
    return table.where if is_text else fixed_nodes(mesh, table.where, table.body)


def _attached(
    tissue: Tissue, mesh: TetrahedralMesh, tables: Sequence[AttachmentTable]
) -> list[Attachment]:
    """Attach what holds the tissue, before it settles.

    Raises:
        UsageError: one cannot be attached; the message names its table.
    """
    return [
        naming_table(f"[[attachment]] number {i + 1}", partial(_attach, tissue, mesh, table))
        for i, table in enumerate(tables)
    ]


def _attach(tissue: Tissue, mesh: TetrahedralMesh, table: AttachmentTable) -> Attachment:
    """Make one attachment, or ligament."""
    where = _region(mesh, table)
    breaks_at = math.inf if table.breaks_at is None else table.breaks_at
    if table.to_body is not None:
        return _tie_bodies(tissue, table, where, breaks_at)
    if table.to is None:
        return tissue.attach(
            where,
            stiffness=table.stiffness,
            damping=table.damping,
            rest_length=table.rest_length or 0.0,
            breaks_at=breaks_at,
        )
    assert table.area is not None and table.toughness is not None
    return tissue.tie(
        where,
        table.to,
        stiffness=table.stiffness,
        damping=table.damping,
        rest_length=table.rest_length,
        breaks_at=breaks_at,
        area=table.area,
        toughness=table.toughness,
    )


def _tie_bodies(
    tissue: Tissue, table: AttachmentTable, where: str | BoolArray, breaks_at: float
) -> Attachment:
    """Tie the skin of a region to that of another body, which faces it."""
    assert table.to_body is not None and table.toughness is not None
    assert not isinstance(where, str)  # it is of one body
    facing = tissue.facing(where, table.to_body, within=table.within)
    return tissue.tie(
        facing.points,
        facing.others,
        stiffness=table.stiffness,
        damping=table.damping,
        rest_length=table.rest_length,
        breaks_at=breaks_at,
        area=facing.area if table.area is None else table.area,
        toughness=table.toughness,
    )


def _lead(tissue: Tissue, mesh: TetrahedralMesh, table: LedSupportTable) -> None:
    """Lead held nodes along their path, from the first frame on."""
    about = table.about
    if about is None:
        nodes = fixed_nodes(mesh, table.where, table.body)
        places = tissue.snapshot().positions[nodes]
        about = tuple((0.5 * (places.min(axis=0) + places.max(axis=0))).tolist())
    turns = None if table.rotations_degrees is None else np.radians(table.rotations_degrees)
    path = SupportPath(table.times, table.displacements, turns, table.stretches, about=about)
    tissue.lead_supports(_region(mesh, table), path)


def _warn_of_collapse(tissue: Tissue, scene: Scene) -> None:
    """Warn where a body that has settled has folded over, or has lost volume."""
    material = scene.material
    inverted = tissue.cut_report().now.inverted
    pieces = tissue.pieces()
    volume = sum(piece.volume for piece in pieces) / sum(piece.rest_volume for piece in pieces)
    if inverted <= MOST_INVERTED and volume >= LEAST_VOLUME:
        return
    remedies = ["--law neo_hookean"] if material.law.has_springs else []
    if material.poisson_ratio < _HARDLY_COMPRESSIBLE:
        remedies.append(f"--poisson-ratio {_HARDLY_COMPRESSIBLE}")
    remedies.append("a larger --young")
    remedies += ["less --stretch"] * (scene.stretched_by != 0.0)
    remedies += ["less --gravity"] * any(scene.world.free_fall)
    _log.warning(
        "settled, %.2g %% of the tetrahedra are inside out, and the body has %.3g %% of its "
        "volume: forces on a blade there mean little. What may help: %s, or a mesh without flat "
        "tetrahedra",
        1e2 * inverted,
        1e2 * volume,
        ", ".join(remedies),
    )


def check_scene(scene: Scene) -> None:
    """Check a scene as far as possible before its tissue is made.

    Raises:
        MeshError: the mesh cannot be cut.
        StrokeError: the file of a stroke cannot be used.
        ValueError: no nodes are where they are to be held.
    """
    for stroke in scene.strokes:
        if stroke.file is not None:
            from_csv(stroke.file)
    mesh = scene.mesh()
    unused = None if scene.bodies else unused_labels(mesh, scene.labels)
    if unused is not None:
        _log.warning("%s", unused)
    scene.held_nodes()
    _start_of(scene, mesh)
    for i, attachment in enumerate(scene.attachments):
        region = partial(fixed_nodes, mesh, attachment.where, attachment.body)
        naming_table(f"[[attachment]] number {i + 1}", region)
    drag = max(_toughness_in(scene, each) / each.young_modulus for each in scene.all_materials)
    extent = float(np.median(np.ptp(mesh.positions, axis=0)))
    if drag > LONG_DRAG * extent and not scene.material.stiffens:
        _log.warning(
            "the blade will drag the tissue along by some %.2g mm (toughness / Young's modulus) "
            "before the tissue parts, and the body measures %.3g mm: the cut may stay unfinished. "
            "A larger --young or a smaller --toughness cuts cleanly",
            1e3 * drag,
            1e3 * extent,
        )


def highest_toughness(scene: Scene) -> float:
    """Return the highest toughness in a scene [J/m2]: of the skin, or at the stroke's speed."""
    return max(_toughness_in(scene, material) for material in scene.all_materials)


def _toughness_in(scene: Scene, material: Material) -> float:
    """Return the highest toughness of a material in a scene [J/m2]."""
    resistance = toughness_law_of(material, scene.blade)
    at_speed = resistance.toughness
    if material.toughness_exponent > 0.0:
        ratio = scene.speed / material.toughness_speed
        at_speed *= 1.0 + ratio**material.toughness_exponent
    return max(resistance.skin_toughness, at_speed)


def _start_of(scene: Scene, mesh: TetrahedralMesh) -> FloatArray:
    """Return where the nodes are before they settle [m]: at rest, or pulled apart."""
    if isinstance(scene.body, tuple):
        return mesh.positions
    return pulled_apart(mesh.positions, scene.body.fixed, scene.stretched_by)


def pulled_apart(positions: FloatArray, fixed: str, stretch: float) -> FloatArray:
    """Return the positions with opposite held sides moved apart by the fraction `stretch`.

    The body between them is stretched evenly: a start from which it settles.

    Args:
        positions: Rest positions [m], shape (n_nodes, 3).
        fixed: Which sides are held, as in `HeldBodyTable.fixed`.
        stretch: Fraction of the distance between the sides.

    Raises:
        UsageError: there is a stretch, and no two opposite sides are held.
    """
    if stretch == 0.0:
        return positions
    held = {name.strip().lower() for name in fixed.split(",")}
    pulled = np.array([held.issuperset(pair) for pair in OPPOSITE_SIDES])
    if not pulled.any():
        raise UsageError(
            f"--stretch {stretch} pulls opposite sides apart, and '{fixed}' holds no such pair; "
            "use --fix left,right or --stretch 0"
        )
    centre = (positions.min(axis=0) + positions.max(axis=0)) / 2.0
    return np.asarray(centre + (positions - centre) * np.where(pulled, 1.0 + stretch, 1.0))
