"""Facts about this machine that benchmarks depend on: processor, clock, caches, memory, load."""

import os
import platform
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from scalpel_sim.runs.warm_up import KernelSet
from tissue import block
from tissue.support import is_compiling, kernel

_CPU_TABLE = Path("/proc/cpuinfo")
"""Where Linux describes the cores."""
_CACHE_FOLDER = Path("/sys/devices/system/cpu/cpu0/cache")
"""Where Linux describes the caches."""


class CacheSizes(NamedTuple):
    """Sizes of the caches [bytes]: the core's own two levels, and the level that cores share."""

    l1: int
    l2: int
    l3: int


_USUAL_SIZES = CacheSizes(32 << 10, 1 << 20, 32 << 20)
"""Taken where the system does not describe its caches."""

_V3 = {"avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe"}
_V4 = _V3 | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}
_NEOVERSE = {"asimd", "crc32", "atomics", "asimdrdm", "asimddp", "asimdhp"}
SIMD_LEVELS = {"x86-64-v4": _V4, "x86-64-v3": _V3, "neoverse": _NEOVERSE}
"""Extensions that processors of a level have, by the names that Linux gives them; of two levels of
one processor the better one first."""

_CPU_LIMIT = Path("/sys/fs/cgroup/cpu.max")
"""Where Linux says how much of the processor a container gets: `LIMIT PERIOD`, or `max PERIOD`."""

_CHAIN = 100_000
"""Rounds of the chain that measures the clock: 50 µs at 4 GHz, short compared with a time slice."""
_CYCLES_PER_ROUND = 2
_CLOCK_SECONDS = 0.2
"""Time for which the clock is measured [s]. In the first half of it the processor wakes up."""


def describe_machine() -> dict[str, Any]:
    """Return the facts, besides versions, that measurements depend on."""
    return {
        "processor": processor_name(),
        "simd": simd_level(),
        "cores": os.cpu_count(),
        "memory_bytes": memory_bytes("MemTotal"),
        "caches_bytes": cache_sizes()._asdict(),
    }


def processor_name() -> str:
    """Return the name of the processor."""
    named = _values(_CPU_TABLE, "model name")
    return named[0] if named else platform.processor() or platform.machine()


def simd_level(flags: str | None = None) -> str | None:
    """Return the level of the processor's vector instructions; None where it is not known.

    Args:
        flags: Names of its extensions, with blanks between [default: those that Linux gives].
    """
    if flags is None:
        flags = " ".join(_values(_CPU_TABLE, "flags")[:1] + _values(_CPU_TABLE, "Features")[:1])
    has = set(flags.split())
    return next((level for level, needs in SIMD_LEVELS.items() if needs <= has), None)


def usable_cores() -> float:
    """Return how many cores this process may use; a container may get a part of one."""
    affinity = getattr(os, "sched_getaffinity", None)
    cores = float(len(affinity(0)) if affinity else os.cpu_count() or 1)
    try:
        limit, period = _CPU_LIMIT.read_text(encoding="ascii").split()
    except (OSError, ValueError):
        return cores
    return cores if limit == "max" else min(cores, int(limit) / int(period))


def measured_clock(load: Callable[[], object] = lambda: None) -> float | None:
    """Return the clock of the core on which this runs [Hz]; None where kernels are not compiled.

    Additions of which each waits for the one before take a cycle each, on every processor of the
    levels above.

    Args:
        load: What the core does between two samples.
    """
    if not is_compiling():
        return None
    _chain(1, 1)
    samples: list[float] = []
    end = perf_counter() + _CLOCK_SECONDS
    while (start := perf_counter()) < end:
        _chain(_CHAIN, len(samples))
        samples.append(perf_counter() - start)
        load()
    return _CYCLES_PER_ROUND * _CHAIN / float(np.median(samples[len(samples) // 2 :]))


def clock_under_load() -> float | None:
    """Return the clock of the core while it steps a small body, as scenes do [Hz].

    Where long vectors lower the clock, it is that lower one. None where kernels are not compiled.
    """
    body = KernelSet().body(block((4, 4, 6), (0.02, 0.02, 0.03)))
    return measured_clock(partial(body.step, None, 1e-3))


def machine_line(machine: Mapping[str, Any]) -> str:
    """Return the processor in one line: its name, vector instructions, clock and cores.

    Args:
        machine: As `describe_machine` has it, with `clock_hz` where that was measured.
    """
    clock = machine.get("clock_hz")
    parts = (
        machine["processor"],
        machine.get("simd"),
        clock and f"{1e-9 * clock:.1f} GHz under load",
        f"{machine['cores']} cores",
    )
    return ", ".join(filter(None, parts))


@kernel
def _chain(n: int, start: int) -> int:
    """Add two numbers to each other in turn, by operations that no compiler joins."""
    a, b = start, 1
    for _ in range(n):
        a += b
        b ^= a
    return a


def memory_bytes(entry: str = "MemAvailable") -> int | None:
    """Return an entry of the system's memory table [bytes], or None where there is no table."""
    found = _values(Path("/proc/meminfo"), entry)
    return 1024 * int(found[0].split()[0]) if found else None


def cache_sizes() -> CacheSizes:
    """Return the sizes of the caches; usual sizes where the system does not say."""
    sizes: dict[int, int] = {}
    for folder in sorted(_CACHE_FOLDER.glob("index*")):
        try:
            content, level, size = (
                (folder / name).read_text(encoding="ascii").strip()
                for name in ("type", "level", "size")
            )
        except OSError:
            continue
        if content != "Instruction" and size.endswith("K"):
            sizes[int(level)] = 1024 * int(size[:-1])
    return CacheSizes(
        *(sizes.get(level, usual) for level, usual in zip((1, 2, 3), _USUAL_SIZES, strict=True))
    )


def load_average() -> float:
    """Return the mean number of running programs in the last minute; 0 where it is unknown."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0


def _values(file: Path, name: str) -> list[str]:
    """Return the values of the lines `name: value` of one of the system's tables."""
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except OSError:
        return []
    pairs = (line.partition(":") for line in lines)
    return [value.strip() for key, _, value in pairs if key.strip() == name]
