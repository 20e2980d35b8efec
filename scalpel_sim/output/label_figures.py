"""The figures of each part of the body, by its label."""

from typing import Any

import numpy as np

from scalpel_sim.output.run_outcome import RunOutcome
from tissue import FloatArray, Snapshot, piece_of_tetrahedra


def label_figures(outcome: RunOutcome) -> list[dict[str, Any]]:
    """Return the figures of each label: none of a body without labels, or that was lost.

    Work of cutting and force are those of the edge: null where there is one label, or very many.
    Of the area of each cut face, half is of the part on either side: so the areas of all parts add
    up to what was cut.
    """
    first, last, faces = outcome.first, outcome.last, outcome.cut_faces
    if last is None or faces is None or not first.labels.any():
        return []
    volumes, piece = _volumes(last), piece_of_tetrahedra(last)
    spared = {row["name"] for row in outcome.settings.get("labels", ()) if row["spare"]}
    found = []
    for label in np.unique(first.labels).tolist():
        name, mine = outcome.label_names.get(label), last.labels == label
        sides = (faces.labels == label).sum(axis=1)
        work, force = outcome.recording.of_label(label) or (None, None)
        found.append(
            {
                "label": label,
                "name": name,
                "spare": name in spared,
                "volume_m3": float(volumes[mine].sum()),
                "cut_area_m2": 0.5 * float(faces.areas @ sides),
                "pieces": len(np.unique(piece[mine])),
                "work_of_cutting_j": work,
                "edge_force_peak_n": force,
            }
        )
    return found


def _volumes(body: Snapshot) -> FloatArray:
    """Return the volume of each tetrahedron at rest [m3]."""
    corners = body.rest_positions[body.tetrahedra]
    return np.asarray(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0)
