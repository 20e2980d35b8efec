"""The columns of a row that a kernel writes, against NumPy."""

from types import SimpleNamespace

import numpy as np
import pytest

from bridge import NamedLabel, TissueFrame
from scalpel_sim.recording.columns import (
    COLUMNS,
    FrameData,
    WallTimes,
    force_parts,
    frame_row,
    label_group,
    label_of_column,
    shared_columns,
)
from scalpel_sim.recording.recording import Recording, read_forces
from scalpel_sim.recording.row_writer import RowWriter
from tissue import AddedMass, BladeSegment, Energies, RigidContacts, Wrench

QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
FRAMES = {
    "parallel": TissueFrame(origin=np.array([0.1, 0.2, 0.3])),
    "turned": TissueFrame(QUARTER, np.array([0.1, 0.2, 0.3])),
}
AXES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def result_of(rng, n, energies=None):
    """Return what a row takes of a step with `n` contacts."""
    normal = rng.normal(size=(n, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    contacts = RigidContacts(
        np.zeros((n, 3)),
        normal,
        rng.normal(size=n),
        rng.normal(size=(n, 3)),
        np.zeros(n),
        np.full(n, -1),
    )
    half = rng.normal(size=(6, 6))
    added = AddedMass(rng.normal(), *rng.normal(size=(4, 3)))
    return SimpleNamespace(
        contacts_of_blade=contacts,
        stiffness=half @ half.T,
        numbers_at_end=np.concatenate(((half @ half.T).ravel(), added.numbers)),
        cut_area=1.0,
        finished_area=2.0,
        n_tetrahedra=3,
        anchored_length=4.0,
        work_of_blade=5.0,
        added_mass=added,
        energies=energies,
        account=None if energies is None else np.array((*energies, energies.residual)),
    )


def row_of(*parts) -> list[float]:
    """Return the numbers of all columns of a frame, without attachments."""
    frame = FrameData(*parts, (), WallTimes(*range(5)), 0.0)
    return frame_row(COLUMNS.values(), frame)


@pytest.mark.kernel
@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("n", [0, 1, 40])
def test_a_row_has_forces_and_stiffness_in_the_world(frame, n):
    rng, there = np.random.default_rng(n), FRAMES[frame]
    result, blade = result_of(rng, n), BladeSegment(*np.linalg.qr(rng.normal(size=(3, 3)))[0])
    felt, raw = (Wrench(*rng.normal(size=(3, 3))) for _ in range(2))
    row = row_of(0.5, blade, felt, raw, result, there)
    assert len(row) == len(shared_columns())
    assert row[:4] == [0.5, *blade.tip]
    assert row[4:16] == [*felt.force, *felt.torque, *raw.force, *raw.torque]
    parts = force_parts(result.contacts_of_blade, there.vectors_to_tissue(blade.forward))
    assert row[16:25] == there.vectors_to_world(np.array(parts)).ravel().tolist()
    stiffness = there.matrix_to_world(result.stiffness[:3, :3])
    assert row[25:31] == [stiffness[at] for at in AXES]
    assert row[31:36] == [1.0, 2.0, 3, 4.0, 5.0]
    assert row[-6:-1] == list(range(5)) and np.isnan(row[36:-19]).all()


@pytest.mark.kernel
@pytest.mark.parametrize("frame", FRAMES)
def test_a_row_has_momenta_of_added_mass_about_the_origin_of_the_world(frame):
    """Against a mass point, in either frame."""
    rng, there = np.random.default_rng(3), FRAMES[frame]
    places, motions = rng.normal(size=(2, 2, 3))
    at, moving = there.points_to_world(places), there.vectors_to_world(motions)
    result = result_of(rng, 0)
    vectors = zip(motions, np.cross(places, motions), strict=True)
    result.added_mass = AddedMass(0.7, *(each for pair in vectors for each in pair))
    still = Wrench(*np.zeros((3, 3)))
    row = row_of(0.5, BladeSegment(*np.eye(3)), still, still, result, there)
    expected = [0.7, *np.hstack((moving, np.cross(at, moving))).ravel()]
    assert row[-19:-6] == pytest.approx(expected, abs=1e-14)
    first = shared_columns().index("added_mass_kg")
    assert first == len(row) - 19


@pytest.mark.kernel
@pytest.mark.parametrize("is_audited", [True, False])
@pytest.mark.parametrize("n", [0, 1, 40])
def test_a_row_that_a_kernel_writes_is_the_same(n, is_audited):
    rng, groups = np.random.default_rng(n), [*COLUMNS.values()]
    blade = BladeSegment(*np.linalg.qr(rng.normal(size=(3, 3)))[0])
    felt, raw = (Wrench(*rng.normal(size=(3, 3))) for _ in range(2))
    energies = Energies(*rng.normal(size=14)) if is_audited else None
    parts = 0.5, blade, felt, raw, result_of(rng, n, energies), FRAMES["parallel"]
    recordings = Recording(), Recording()
    for recording, is_parallel in zip(recordings, (True, False), strict=True):
        writer = RowWriter(groups, recording, is_parallel)
        writer.append(FrameData(*parts, (), WallTimes(*range(5)), 0.0))
    one, other = (recording.rows[:, :-1] for recording in recordings)
    assert one.shape == (1, len(shared_columns()) - 1) and one.tobytes() == other.tobytes()


@pytest.mark.parametrize(
    ("names", "columns"),
    [
        (["", "fat"], ["cutting_0_j", "cutting_1_fat_j", "edge_0_n", "edge_1_fat_n"]),
        (["a x b", "\u00df"], ["cutting_0_a_x_b_j", "cutting_1_j", "edge_0_a_x_b_n", "edge_1_n"]),
        (["alone"], []),
    ],
)
def test_columns_of_labels_are_named_by_number_and_name(names, columns, tmp_path):
    labels = [NamedLabel(i, name) for i, name in enumerate(names)]
    group = label_group(labels)
    assert list(group.columns) == columns
    assert [label_of_column(name) for name in columns] == [0, 1, 0, 1][: len(columns)]
    path = tmp_path / "forces.csv"
    path.write_text(",".join([*shared_columns(), *columns]) + "\n")
    assert read_forces(path).of_label(0) == ((0.0, 0.0) if columns else None)


def test_a_mesh_of_very_many_labels_has_no_columns_of_them():
    assert not label_group([NamedLabel(i, "") for i in range(1000)]).columns
