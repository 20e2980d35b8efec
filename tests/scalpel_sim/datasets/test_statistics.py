import numpy as np
import pytest

from scalpel_sim.datasets.statistics import (
    QUANTILES,
    ImageCounts,
    statistics_of,
    statistics_together,
)

ROUNDING = 1e-12
"""Relative: sums of a few hundred numbers in double precision."""


def test_statistics_are_those_of_the_values():
    values = np.random.default_rng(0).normal(size=(101, 3))
    found = statistics_of(values)
    assert found.n_steps == 101
    assert np.array_equal(found.least, values.min(axis=0))
    assert np.array_equal(found.most, values.max(axis=0))
    assert found.mean == pytest.approx(values.mean(axis=0), rel=ROUNDING)
    assert found.deviation == pytest.approx(values.std(axis=0), rel=ROUNDING)
    assert np.array_equal(found.quantiles["q50"], np.sort(values, axis=0)[50])


def test_an_array_a_step_has_statistics_of_its_last_dimension():
    values = np.random.default_rng(1).normal(size=(7, 4, 3))
    found = statistics_of(values)
    assert found.n_steps == 7
    assert np.array_equal(found.least, values.min(axis=(0, 1)))


def test_images_have_the_statistics_of_their_colours_from_0_to_1():
    images = np.random.default_rng(2).integers(0, 256, (5, 8, 6, 3), np.uint8)
    images[..., 2] = 40
    counts = ImageCounts()
    for image in images:
        counts.add(image)
    found, colours = counts.statistics(), images / 255.0
    axes = (0, 1, 2)
    assert found.n_steps == 5
    assert found.mean.shape == (3, 1, 1)
    assert found.least.ravel() == pytest.approx(colours.min(axis=axes), rel=ROUNDING)
    assert found.most.ravel() == pytest.approx(colours.max(axis=axes), rel=ROUNDING)
    assert found.mean.ravel() == pytest.approx(colours.mean(axis=axes), rel=ROUNDING)
    assert found.deviation.ravel() == pytest.approx(colours.std(axis=axes), abs=1e-7)
    for name, share in QUANTILES.items():
        expected = np.quantile(colours, share, axis=axes, method="inverted_cdf")
        assert found.quantiles[name].ravel() == pytest.approx(expected, rel=ROUNDING)


def test_episodes_together_have_the_statistics_of_all_their_values():
    rng = np.random.default_rng(3)
    parts = [rng.normal(i, 1.0 + i, size=(n, 2)) for i, n in enumerate((5, 40, 17))]
    found, whole = (
        statistics_together([statistics_of(part) for part in parts]),
        np.concatenate(parts),
    )
    assert found.n_steps == len(whole)
    assert np.array_equal(found.least, whole.min(axis=0))
    assert np.array_equal(found.most, whole.max(axis=0))
    assert found.mean == pytest.approx(whole.mean(axis=0), rel=ROUNDING)
    assert found.deviation == pytest.approx(whole.std(axis=0), rel=ROUNDING)
