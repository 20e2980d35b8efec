"""The kernels that many tests need are compiled once, by all cores, before the first test.

Else each process of the tests compiles them for itself, as they need them at the same time.
"""

import pytest

from scalpel_sim.runs.console import compiling
from scalpel_sim.runs.options import PrintOptions
from scalpel_sim.runs.warm_up import USUAL_SETS, KernelSet, compile_ahead

DOUBLE = KernelSet(precision="double", audit=False)
SPRINGS = KernelSet(law="springs", audit=False)
SETS = (
    *USUAL_SETS,
    DOUBLE,
    DOUBLE._replace(relaxation="verlet"),
    DOUBLE._replace(law="springs"),
    SPRINGS,
    SPRINGS._replace(relaxation="hierarchical"),
    DOUBLE._replace(law="springs", relaxation="hierarchical"),
    SPRINGS._replace(relaxation="hierarchical", scheme="paper", has_sides=False),
    KernelSet(is_held=True),
)
"""Kernels of most tests of bodies and runs. What one file alone calls, it compiles."""
N_KERNELS = 1340
"""How many kernels these sets have, about."""


def compile_for_all_tests(config: pytest.Config) -> None:
    """Compile, and show the progress."""
    capture = config.pluginmanager.getplugin("capturemanager")
    with capture.global_and_fixture_disabled(), compiling(PrintOptions()) as on_progress:
        compile_ahead(SETS, lambda n, n_all: on_progress(n, max(n_all, N_KERNELS)))
