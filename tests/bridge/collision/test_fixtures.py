import numpy as np
import pytest

from bridge import FixtureBox, FixtureMesh


@pytest.mark.parametrize(
    ("size", "centre", "why"),
    [
        ([1.0, 0.0, 1.0], [0.0, 0.0, 0.0], "all must be positive"),
        ([1.0, 1.0, np.nan], [0.0, 0.0, 0.0], "not finite"),
        ([1.0, 1.0], [0.0, 0.0, 0.0], "wanted"),
        ([1.0, 1.0, 1.0], [0.0, np.inf, 0.0], "centre of fixture 'table' is not finite"),
    ],
)
def test_a_malformed_box_is_refused_by_name(size, centre, why):
    with pytest.raises(ValueError, match=f"fixture 'table'.*{why}|{why}"):
        FixtureBox("table", np.array(size), np.array(centre))


@pytest.mark.parametrize(
    ("triangles", "why"),
    [
        ([[0, 1, 3]], "refer to vertices 0 to 3, but its vertices are 0 to 2"),
        ([[0, 1, -1]], "refer to vertices -1 to 1"),
        (np.zeros((0, 3), int), "wanted"),
        ([[0, 1]], "wanted"),
        ([[0.0, 1.0, 2.0]], "type float64; wanted vertex indices"),
    ],
)
def test_triangles_that_would_end_the_process_are_refused_by_name(triangles, why):
    with pytest.raises(ValueError, match=f"fixture 'clamp'.*{why}"):
        FixtureMesh("clamp", np.eye(3), np.array(triangles))
