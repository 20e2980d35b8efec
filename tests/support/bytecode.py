"""Bytecode for the processes of the tests."""

import os
import sys
import tempfile

import pytest


def keep_bytecode(config: pytest.Config) -> None:
    """Keep bytecode until the tests end, also where the environment says that none is written.

    Else each of several hundred processes compiles some 500 modules anew, 0.5 s of processor time,
    and each that collects the tests takes 8 s more. It is kept outside the clone.
    """
    if os.environ.pop("PYTHONDONTWRITEBYTECODE", "") and "PYTHONPYCACHEPREFIX" not in os.environ:
        folder = tempfile.TemporaryDirectory(prefix="bytecode-")
        config.add_cleanup(folder.cleanup)
        os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix = folder.name
        sys.dont_write_bytecode = False
