"""A layer between two labels: what opens, what it costs, and where the cut leaves it."""

from typing import NamedTuple

import numpy as np
import pytest

from tests.support import strokes
from tests.support.bodies import jittered_grid, sides
from tissue import (
    Energies,
    FloatArray,
    Material,
    Snapshot,
    SolverSettings,
    TetrahedralMesh,
    Tissue,
    block,
    piece_of_tetrahedra,
)
from tissue.mesh.validation import signed_volumes
from tissue.shapes.labelled_stuffing import stuff_labels

SIZE = np.array([0.04, 0.04, 0.02])
CELL, BORDER, SPEED = 0.005, 0.02, 0.1
TOUGHNESS, LAYER = 100.0, 10.0
TISSUE = Material(young_modulus=30e3, toughness=TOUGHNESS)
NO_GRAVITY = (0.0, 0.0, 0.0)
ON_LAYER = 1e-9
"""Distance from the layer up to which a node is on it [m]: rounding."""


class Drawn(NamedTuple):
    """Forces and areas of a stroke along y through a body."""

    before: Snapshot
    after: Snapshot
    energies: Energies
    y: FloatArray
    force: FloatArray

    def steady(self) -> float:
        """Return the force in the middle of the body [N]."""
        return float(self.force[(self.y > 0.012) & (self.y < 0.03)].mean())


def two_halves(labels: tuple[int, int] = (0, 1)) -> TetrahedralMesh:
    """Return a block of two labels that meet in a plane."""
    mesh = block(np.rint(SIZE / CELL).astype(int), SIZE)
    middles = mesh.positions[mesh.tetrahedra].mean(axis=1)
    return mesh._replace(labels=np.where(middles[:, 0] > BORDER, labels[1], labels[0]))


def drawn(beside: float, *, turned: float = 0.0, tip: float = -0.004, layer=LAYER) -> Drawn:
    """Draw an upright edge past the middle of a body of two labels with a layer between them.

    Args:
        beside: How far beside the layer it passes the middle, in elements.
        turned: Angle between the layer and the path [rad].
        tip: Height of its tip [m].
        layer: Toughness of the layer [J/m2]; None: there is none.
    """
    mesh = two_halves()
    layers = {} if layer is None else {(0, 1): layer}
    tissue = Tissue(
        mesh,
        {None: TISSUE} | layers,
        fixed=sides(mesh),
        gravity=NO_GRAVITY,
        solver=SolverSettings(audit=True),
    )
    middle = np.array([BORDER + beside * CELL, 0.5 * SIZE[1], 0.0])
    ahead = np.array([np.sin(turned), np.cos(turned), 0.0])
    poses = [
        strokes.pose((x, y, tip), (x, y, 0.024), ahead)
        for x, y, _ in (middle + s * ahead for s in strokes.along_y(-0.024, 0.028, SPEED))
    ]
    before = tissue.snapshot()
    results = strokes.make(tissue, poses)
    return Drawn(
        before,
        tissue.snapshot(),
        results[-1].energies,
        np.array([pose.tip[1] for pose in poses[1:]]),
        -np.array([result.wrench.force @ ahead for result in results]),
    )


def opened(body: Snapshot) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the faces that are open inside the block, and half of each area."""
    faces = body.tetrahedra[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3)
    _, place, counts = np.unique(
        np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    corners = body.rest_positions[faces[counts[place.reshape(-1)] == 1]]
    on_side = [
        (np.abs(corners[:, :, axis] - at) < ON_LAYER).all(axis=1)
        for axis in range(3)
        for at in (0.0, SIZE[axis])
    ]
    inside = corners[~np.any(on_side, axis=0)]
    normals = np.cross(inside[:, 1] - inside[:, 0], inside[:, 2] - inside[:, 0])
    return inside, 0.25 * np.linalg.norm(normals, axis=1)


def share_on_layer(body: Snapshot) -> float:
    """Return how much of the opened area is in the layer."""
    corners, area = opened(body)
    is_on = (np.abs(corners[:, :, 0] - BORDER) < ON_LAYER).all(axis=1)
    return float(area[is_on].sum() / area.sum())


@pytest.mark.parametrize("beside", [0.0, 0.25, -0.25, 0.45, -0.45])
def test_a_blade_led_within_half_an_element_of_a_weak_layer_dissects_along_it(beside):
    cut = drawn(beside)
    assert share_on_layer(cut.after) == 1.0
    assert len(np.unique(piece_of_tetrahedra(cut.after))) == 2
    assert cut.steady() == pytest.approx(LAYER * SIZE[2], rel=0.05)
    assert abs(cut.energies.residual) < 0.01 * cut.energies.work_of_blade
    volumes = [
        np.bincount(each.labels, weights=signed_volumes(each.rest_positions, each.tetrahedra))
        for each in (cut.before, cut.after)
    ]
    np.testing.assert_allclose(*volumes, rtol=1e-9)


def shared_area(body: Snapshot) -> float:
    """Return the area of the faces that the two labels share [m2]."""
    faces = np.sort(body.tetrahedra[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3))
    each, place, counts = np.unique(faces, axis=0, return_inverse=True, return_counts=True)
    labels = np.bincount(place.reshape(-1), weights=np.repeat(body.labels, 4))
    x = body.rest_positions[each[(counts == 2) & (labels == 1)]]
    return 0.5 * float(np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1).sum())


@pytest.mark.parametrize("beside", [0.25, -0.45, 0.45])
def test_a_bumpy_layer_is_dissected_whole(beside):
    """Its nodes are shifted by up to 0.15 cells, those beside it too."""
    mesh = jittered_grid(6, seed=1)
    middles = mesh.positions[mesh.tetrahedra].mean(axis=1)
    mesh = mesh._replace(labels=(middles[:, 0] > BORDER).astype(np.int64))
    tissue = Tissue(mesh, {None: TISSUE, (0, 1): LAYER}, fixed=sides(mesh), gravity=NO_GRAVITY)
    before = shared_area(tissue.snapshot())
    x = BORDER + beside * 0.04 / 6
    results = strokes.make(tissue, strokes.upright(x, -0.004, 0.05, -0.004, 0.044, SPEED))
    assert shared_area(tissue.snapshot()) == 0.0
    assert results[-1].cut_area == pytest.approx(before, rel=1e-9)
    steady = np.mean([-result.wrench.force[1] for result in results[200:340]])
    assert steady == pytest.approx(LAYER * 0.04, rel=0.05)


@pytest.mark.parametrize("beside", [0.25, -0.25])
def test_a_curved_layer_is_followed(beside):
    """A cylinder of 60 mm, in a mesh of the mesher. Where it meets the skin, a part stays whole."""
    radius, half = 0.06, np.array([0.02, 0.02, 0.01])

    def depth(points, label):
        inside = (half - np.abs(points)).min(axis=1)
        beyond = np.hypot(points[:, 0] + radius, points[:, 1]) - radius
        return np.where(
            label == 0, -inside, np.minimum(inside, np.where(label == 1, -1, 1) * beyond)
        )

    mesh = stuff_labels(depth, 2, [-half - 0.01, half + 0.01], 0.005)
    mesh = mesh._replace(labels=mesh.labels - 1)
    tissue = Tissue(
        mesh, {None: TISSUE, (0, 1): LAYER}, fixed=sides(mesh, share=0.05), gravity=NO_GRAVITY
    )
    before = shared_area(tissue.snapshot())
    poses = [
        strokes.pose(
            (r * np.cos(a) - radius, r * np.sin(a), -0.014),
            (r * np.cos(a) - radius, r * np.sin(a), 0.014),
            (-np.sin(a), np.cos(a), 0.0),
        )
        for r in [radius + beside * 0.0038]  # mean edge of the layer
        for a in np.linspace(-0.024, 0.028, 521) / radius
    ]
    results = strokes.make(tissue, poses)
    dissected = before - shared_area(tissue.snapshot())
    assert dissected > 0.9 * before
    assert dissected > 0.9 * results[-1].cut_area


def test_a_cut_that_ends_in_the_layer_pays_for_its_depth():
    cut = drawn(0.45, tip=0.007)
    assert share_on_layer(cut.after) == 1.0
    assert cut.steady() == pytest.approx(LAYER * (SIZE[2] - 0.007), rel=0.05)


@pytest.mark.parametrize(("beside", "layer"), [(0.7, LAYER), (0.45, 110.0), (0.45, None)])
def test_the_tissue_is_cut_where_the_layer_is_far_or_no_weaker(beside, layer):
    cut = drawn(beside, layer=layer)
    assert share_on_layer(cut.after) < 0.02
    assert cut.steady() == pytest.approx(TOUGHNESS * SIZE[2], rel=0.08)


@pytest.mark.parametrize("degrees", [50.0, 70.0, 90.0])
def test_a_steep_cut_crosses_the_layer(degrees):
    cut, without = (drawn(0.1, turned=np.radians(degrees), layer=each) for each in (LAYER, None))
    assert share_on_layer(cut.after) == 0.0
    assert len(np.unique(piece_of_tetrahedra(cut.after))) == 2
    assert cut.energies.cutting == pytest.approx(without.energies.cutting, rel=0.05)


def test_the_toughness_of_a_layer_can_be_changed_and_a_state_carries_it():
    mesh = two_halves()
    tissue = Tissue(mesh, {None: TISSUE, (0, 1): LAYER}, fixed=sides(mesh), gravity=NO_GRAVITY)
    poses = strokes.upright(BORDER + 0.4 * CELL, -0.004, 0.02, -0.004, 0.024, SPEED)
    before = tissue.save_state()
    tissue.set_material((1, 0), toughness=2.0)
    changed = tissue.save_state()
    force = [-strokes.make(tissue, poses)[-1].wrench.force[1]]
    for state in (before, changed):
        tissue.load_state(state)
        force.append(-strokes.make(tissue, poses)[-1].wrench.force[1])
    assert force[0] == force[2]
    np.testing.assert_allclose(force[:2], np.array([2.0, 1.0]) * LAYER * SIZE[2], rtol=0.05)


@pytest.mark.parametrize(
    ("layers", "message"),
    [
        ({(0, 3): 1.0}, "no tetrahedron has label 3"),
        ({(1, "fat"): 1.0}, "between 1 and 'fat' is between a part and itself"),
        ({(0, 1): 1.0, ("fat", 0): 2.0}, "between 'fat' and 0 is given twice"),
        ({(0, 2): 1.0}, "no tetrahedra of the two share a face"),
        ({(0, 1): -1.0}, r"has toughness -1\.0"),
    ],
)
def test_a_layer_that_cannot_be_is_refused(layers, message):
    mesh = two_halves()
    middles = mesh.positions[mesh.tetrahedra].mean(axis=1)
    labels = np.where(middles[:, 0] > 0.03, 2, mesh.labels)
    mesh = mesh._replace(labels=labels, label_names={1: "fat"})
    with pytest.raises(ValueError, match=message):
        Tissue(mesh, {None: TISSUE} | layers)


def test_the_papers_scheme_has_no_layers():
    with pytest.raises(ValueError, match="follows no layer"):
        Tissue(two_halves(), {None: TISSUE, (0, 1): 1.0}, solver=SolverSettings(scheme="paper"))
