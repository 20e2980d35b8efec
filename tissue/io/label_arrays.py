"""Which of the arrays of a file are the labels of its cells.

VTK's formats have cell data of any name. Labels are the first array there is of `LABEL_ARRAYS`,
if it has one number for each cell and all of them are whole and not negative.
"""

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import IntArray
from tissue.mesh.mesh_arrays import LARGEST_LABEL

LABEL_ARRAYS = (
    *("label", "labels", "region", "regions", "region_id", "regionid"),
    *("material", "materials", "material_id", "materialid", "materialids", "mat_id", "matid"),
    *("gmsh:physical", "physical", "medit:ref", "tetgen:ref", "nastran:ref", "cell_tags"),
    *("subdomain", "subdomains", "domain", "part", "part_id", "property", "pid", "tag", "tags"),
    *("attribute", "attributes", "objectid", "elementblockids", "cellentityids"),
    "gmsh:geometrical",
)
"""Names of arrays that are labels, in either case. Where there are several, the first counts."""


NAMES_FIELD = "label_names"
"""Field data with the names of labels: bytes of JSON, {"2": "fat"}."""


def label_array(names: Iterable[str]) -> str | None:
    """Return which of the arrays of cells is that of their labels; None: none is."""
    by_rank = [(LABEL_ARRAYS.index(n.lower()), n) for n in names if n.lower() in LABEL_ARRAYS]
    return min(by_rank)[1] if by_rank else None


def left_out(names: Iterable[str], chosen: str) -> str | None:
    """Return what to say where other arrays could be the labels too; None: nothing."""
    others = [f"'{n}'" for n in names if n.lower() in LABEL_ARRAYS and n != chosen]
    return f"labels are those of '{chosen}', not of {', '.join(others)}" if others else None


def as_labels(values: npt.NDArray[np.generic]) -> IntArray | None:
    """Return numbers as labels; None where one of them is negative, too large or not whole."""
    if values.ndim != 1 or values.dtype.kind not in "iuf":
        return None
    numbers = values.astype(np.float64)
    if not ((numbers >= 0.0) & (numbers <= LARGEST_LABEL) & (np.floor(numbers) == numbers)).all():
        return None
    return numbers.astype(np.int64)
