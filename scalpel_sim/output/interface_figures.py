"""The figures of each layer between two parts of the body."""

from typing import Any

import numpy as np

from scalpel_sim.output.run_outcome import RunOutcome
from tissue import Snapshot


def interface_figures(outcome: RunOutcome) -> list[dict[str, Any]]:
    """Return the area of each layer at rest, and how much was cut; none where faces are unknown.

    These are the faces between its parts: what is cut beside it, in one of them, is not of it.
    """
    rows, faces = outcome.settings.get("interfaces", ()), outcome.cut_faces
    if faces is None:
        return []
    found = []
    for row in rows:
        one, other = parts = [_labels_of(outcome, name) for name in row["between"]]
        is_of_one, is_of_other = (np.isin(faces.labels, part) for part in (one, other))
        is_between = is_of_one.any(axis=1) & is_of_other.any(axis=1)
        found.append(
            {
                "between": list(row["between"]),
                "toughness_j_m2": row["toughness"],
                "area_m2": _shared_area(outcome.first, parts),
                "cut_area_m2": float(faces.areas[is_between].sum()),
            }
        )
    return found


def _labels_of(outcome: RunOutcome, name: str) -> list[int]:
    """Return the labels of a part or a body."""
    names = outcome.label_names.items()
    return [label for label, each in names if each == name or each.startswith(f"{name}/")]


def _shared_area(body: Snapshot, parts: list[list[int]]) -> float:
    """Return the area at rest of the faces that the tetrahedra of two parts share [m2]."""
    tetrahedra = np.flatnonzero(np.isin(body.labels, parts[0] + parts[1]))
    corners = body.tetrahedra[tetrahedra]
    faces = np.sort(corners[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3))
    is_of_second = np.repeat(np.isin(body.labels[tetrahedra], parts[1]), 4)
    each, place, counts = np.unique(faces, axis=0, return_inverse=True, return_counts=True)
    of_second = np.bincount(place.reshape(-1), weights=is_of_second)
    x = body.rest_positions[each[(counts == 2) & (of_second == 1)]]
    areas = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)
    return float(0.5 * areas.sum())
