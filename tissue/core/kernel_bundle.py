"""Compiled kernels in one file, for every machine whose processor reaches a level.

A bundle is a zip file of programs, each restored from machine code alone, and of a key that says
where they run. `$SCALPEL_SIM_BUNDLE` names one; else those in this package count, which a wheel can
carry. What a bundle does not hold is compiled.
"""

import functools
import json
import logging
import os
import platform
import sys
import zipfile
from pathlib import Path
from typing import NamedTuple

import llvmlite
import llvmlite.binding as llvm
import numba as nb

from tissue.core.kernel_folder import DIGEST, cache_directory

_VARIABLE = "SCALPEL_SIM_BUNDLE"
_PACKAGED = Path(__file__).parents[1] / "bundles"
_KEY = "key.json"

_log = logging.getLogger(__name__)


class Level(NamedTuple):
    """Processors that run the same machine code."""

    machines: tuple[str, ...]
    """Names of their architecture, as systems give them."""
    processor: str
    """LLVM's name of the level."""
    features: tuple[str, ...]
    """Extensions that a processor needs, by LLVM's names."""

    def missing(self) -> str:
        """Return what this machine lacks, for a message; an empty string where it has all."""
        if platform.machine() not in self.machines:
            return f"processor {self.machines[0]}"
        has = llvm.get_host_cpu_features()
        return ", ".join(name for name in self.features if not has.get(name))

    @property
    def environment(self) -> dict[str, str]:
        """Variables with which a process compiles for the level, and takes nothing from a bundle.

        Without Intel's library of vector functions, which other machines of the level may not have.
        """
        return {
            "NUMBA_CPU_NAME": self.processor,
            "NUMBA_CPU_FEATURES": "",
            "NUMBA_DISABLE_INTEL_SVML": "1",
            _VARIABLE: "",
        }

    @property
    def folder(self) -> Path:
        """Where such a process keeps kernels."""
        return cache_directory(self.processor, "")


_V3 = (
    *("cx16", "sahf", "popcnt", "sse4.2"),
    *("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "xsave"),
)
_V4 = (*_V3, "avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl")
_X86, _ARM = ("x86_64", "AMD64"), ("aarch64", "arm64")
_NEOVERSE = ("neon", "crc", "lse", "rdm", "dotprod", "fullfp16")
LEVELS = {
    "x86-64-v4": Level(_X86, "x86-64-v4", _V4),
    "x86-64-v3": Level(_X86, "x86-64-v3", _V3),
    "neoverse": Level(_ARM, "neoverse-n1", _NEOVERSE),
}
"""Levels for which bundles are made, by name; of two that run on a machine the better one first."""


def bundle_name(level: str) -> str:
    """Return the usual name of the file for a level."""
    return f"kernels-{level}.zip"


def write_bundle(level: str, folder: Path, file: Path) -> int:
    """Pack the programs of a folder that were compiled for a level; return how many there are.

    Raises:
        OSError: the file cannot be written.
    """
    programs = sorted(folder.glob("*/*-program.*.nbc"))
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr(_KEY, json.dumps(_key_of(level), indent=2))
        for path in (*programs, *sorted(folder.glob("*.complete"))):
            packed.write(path, path.relative_to(folder).as_posix())
    return len(programs)


def bundled(name: str) -> bytes | None:
    """Return a file of the bundle by its name in the folder of kernels; None without such one."""
    bundle = _bundle()
    try:
        return bundle.read(name) if bundle else None
    except KeyError:
        return None


@functools.cache
def _bundle() -> zipfile.ZipFile | None:
    """Return the bundle that this process uses, opened; None without one that fits."""
    named = os.environ.get(_VARIABLE)
    if named is not None:
        files = [Path(named)] if named else []
    else:
        files = [file for level in LEVELS if (file := _PACKAGED / bundle_name(level)).exists()]
    refusals = []
    for file in files:
        try:
            return _opened(file)
        except ValueError as reason:
            refusals.append(f"bundle of kernels {file} is not used: {reason}")
    if refusals:
        _log.warning(
            "%s; kernels are compiled instead (for a bundle that fits, run "
            "`scalpel-sim warm-up --target` with this installation)",
            "; ".join(refusals),
        )
    return None


def _opened(file: Path) -> zipfile.ZipFile:
    """Return a bundle.

    Raises:
        ValueError: it cannot be read, or does not fit.
    """
    try:
        packed = zipfile.ZipFile(file)
        key = dict(json.loads(packed.read(_KEY)))
    except (OSError, zipfile.BadZipFile, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"it cannot be read ({error})") from error
    level = LEVELS.get(str(key.get("level")))
    if level is None:
        raise ValueError(f"its level is {key.get('level')}, which this version does not know")
    if missing := level.missing():
        raise ValueError(f"it is for {key['level']}, and this machine lacks {missing}")
    for name, here in _key_of(key["level"]).items():
        if key.get(name) != here:
            raise ValueError(f"its {name} is {key.get(name)}, and here it is {here}")
    return packed


def _key_of(level: str) -> dict[str, str]:
    """Return what has to agree where a bundle is used."""
    return {
        "level": level,
        "system": sys.platform,
        "Python": str(sys.implementation.cache_tag),
        "numba": nb.__version__,
        "llvmlite": llvmlite.__version__,
        "engine": DIGEST,
    }
