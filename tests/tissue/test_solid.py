"""Rest shapes and rows of a solid, how they follow a cut, and the bound on its frequencies."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import eigsh

from tests import bodies, incisions, naive, naive_solid
from tests.tissue.kernels_of import cut_of, springs_of
from tests.tissue.solids import LAWS, YOUNG_MODULUS, built, law_of, moved, solid_of
from tests.tissue.test_stellar import split_all
