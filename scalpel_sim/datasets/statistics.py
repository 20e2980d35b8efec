"""Statistics of the columns of a dataset, with which policies scale what they see."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from tissue import FloatArray

QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
"""Shares of the values that are below a quantile, by its name."""

_BYTES = np.arange(256)
"""Values of a colour."""

_BRIGHTEST = 255.0
"""Value of a colour that counts as 1."""


class Statistics(NamedTuple):
    """Statistics of a column; each is an array of one shape."""

    n_steps: int
    """Number of control steps."""
    least: FloatArray
    """Smallest values."""
    most: FloatArray
    """Largest values."""
    mean: FloatArray
    """Means."""
    deviation: FloatArray
    """Standard deviations, over the number of values."""
    quantiles: dict[str, FloatArray]
    """Quantiles by name: see `QUANTILES`."""

    def as_lists(self) -> dict[str, Any]:
        """Return them as lists, by the names that LeRobot gives them."""
        arrays = {
            "min": self.least,
            "max": self.most,
            "mean": self.mean,
            "std": self.deviation,
            "count": np.array([self.n_steps]),
        }
        return {name: array.tolist() for name, array in (arrays | self.quantiles).items()}


def statistics_of(values: np.ndarray) -> Statistics:
    """Return the statistics of a column of numbers.

    Args:
        values: A row for each control step. Of arrays with several dimensions the last one stays.
    """
    count = len(values)
    flat = values.reshape(-1, values.shape[-1] if values.ndim > 1 else 1).astype(np.float64)
    quantiles = np.quantile(flat, list(QUANTILES.values()), axis=0)
    return Statistics(
        count,
        flat.min(axis=0),
        flat.max(axis=0),
        flat.mean(axis=0),
        flat.std(axis=0),
        dict(zip(QUANTILES, quantiles, strict=True)),
    )


class ImageCounts:
    """Counts of the colours of images, from which their statistics follow.

    Colours go from 0 to 1 in the statistics, which have shape (3, 1, 1).
    """

    def __init__(self) -> None:
        self._count = 0
        self._of_values = np.zeros((3, len(_BYTES)), np.int64)

    def add(self, image: np.ndarray) -> None:
        """Count an image: bytes, shape (height, width, 3)."""
        self._count += 1
        for channel, counts in enumerate(self._of_values):
            counts += np.bincount(image[..., channel].ravel(), minlength=len(_BYTES))

    def statistics(self) -> Statistics:
        """Return the statistics of what was counted: of one image or more."""
        counts = self._of_values
        n = counts.sum(axis=1)
        mean = counts @ _BYTES / n
        square = counts @ _BYTES**2 / n
        below = np.cumsum(counts, axis=1)
        found = counts > 0

        def shaped(values: np.ndarray) -> FloatArray:
            return (np.asarray(values, np.float64) / _BRIGHTEST).reshape(-1, 1, 1)

        return Statistics(
            self._count,
            shaped(found.argmax(axis=1)),
            shaped(len(_BYTES) - 1 - found[:, ::-1].argmax(axis=1)),
            shaped(mean),
            shaped(np.sqrt(np.maximum(square - mean**2, 0.0))),
            {
                name: shaped((below >= share * n[:, None]).argmax(axis=1))
                for name, share in QUANTILES.items()
            },
        )


def statistics_together(parts: Sequence[Statistics]) -> Statistics:
    """Return the statistics of several episodes together.

    Quantiles are means of theirs, weighted by the number of control steps, as LeRobot has them; all
    else is what the values of all episodes give.
    """
    counts = np.array([part.n_steps for part in parts], np.float64)
    share = counts / counts.sum()

    def weighted(arrays: Sequence[FloatArray]) -> FloatArray:
        return np.asarray(np.tensordot(share, np.stack(arrays), axes=1))

    mean = weighted([part.mean for part in parts])
    square = weighted([part.deviation**2 + (part.mean - mean) ** 2 for part in parts])
    return Statistics(
        sum(part.n_steps for part in parts),
        np.min([part.least for part in parts], axis=0),
        np.max([part.most for part in parts], axis=0),
        mean,
        np.sqrt(square),
        {name: weighted([part.quantiles[name] for part in parts]) for name in QUANTILES},
    )
