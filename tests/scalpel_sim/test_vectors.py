"""Cross products of a few rows."""

import numpy as np

from scalpel_sim.vectors import cross_rows


def test_cross_products_have_the_bits_of_numpy():
    rng = np.random.default_rng(0)
    for shape in ((3,), (1, 3), (50, 3), (4, 5, 3)):
        a, b = rng.normal(size=shape), rng.normal(size=shape)
        np.testing.assert_array_equal(cross_rows(a, b), np.cross(a, b))
