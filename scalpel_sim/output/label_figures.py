"""The figures of each part of the body, by its label."""

from typing import Any

import numpy as np

from scalpel_sim.output.run_outcome import RunOutcome
from tissue import FloatArray, Snapshot, piece_of_tetrahedra


def label_figures(outcome: RunOutcome) -> list[dict[str, Any]]:
    """Return the figures of each label: none of a body without labels, or that was lost.

    Work of cutting and force are those of the edge: null where there is one label, or very many.
    The area cut is that by which its outside at rest has grown, one side of each cut. A cut along
    the border of two parts is half of each.
    """
    first, last = outcome.first, outcome.last
    if last is None or not first.labels.any():
        return []
    before, after = (_outside(each) for each in (first, last))
    volumes, piece = _volumes(last), piece_of_tetrahedra(last)
    spared = {row["name"] for row in outcome.settings.get("labels", ()) if row["spare"]}
    found = []
    for label in np.unique(first.labels).tolist():
        name, mine = outcome.label_names.get(label), last.labels == label
        cut = 0.5 * (after[label] - before[label])
        work, force = outcome.recording.of_label(label) or (None, None)
        found.append(
            {
                "label": label,
                "name": name,
                "spare": name in spared,
                "volume_m3": float(volumes[mine].sum()),
                "cut_area_m2": max(cut, 0.0) if cut > _ROUNDING * after[label] else 0.0,
                "pieces": len(np.unique(piece[mine])),
                "work_of_cutting_j": work,
                "edge_force_peak_n": force,
            }
        )
    return found


_ROUNDING = 1e-9
"""Share of the outside of a label below which what it has grown by is rounding."""


def _volumes(body: Snapshot) -> FloatArray:
    """Return the volume of each tetrahedron at rest [m3]."""
    corners = body.rest_positions[body.tetrahedra]
    return np.asarray(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0)


def _outside(body: Snapshot) -> FloatArray:
    """Return the area of the outside at rest of the tetrahedra of each label [m2]."""
    n = len(body.tetrahedra)
    faces = body.tetrahedra[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3)
    in_order = np.sort(faces, axis=1)
    _, place, counts = np.unique(in_order, axis=0, return_inverse=True, return_counts=True)
    alone = counts[place.reshape(-1)] == 1
    corners = body.rest_positions[faces[alone]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = 0.5 * np.linalg.norm(normals, axis=1)
    labels = np.repeat(body.labels, 4).reshape(4 * n)[alone]
    total = np.bincount(labels, weights=areas, minlength=int(body.labels.max()) + 1)
    return np.asarray(total, dtype=np.float64)
