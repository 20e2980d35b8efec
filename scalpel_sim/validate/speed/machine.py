"""Facts about this machine that benchmarks depend on: processor, caches, memory, load."""

import os
import platform
from pathlib import Path
from typing import Any, NamedTuple

_CACHE_FOLDER = Path("/sys/devices/system/cpu/cpu0/cache")
"""Where Linux describes the caches."""


class CacheSizes(NamedTuple):
    """Sizes of the caches [bytes]: the core's own two levels, and the level that cores share."""

    l1: int
    l2: int
    l3: int


_USUAL_SIZES = CacheSizes(32 << 10, 1 << 20, 32 << 20)
"""Taken where the system does not describe its caches."""


def describe_machine() -> dict[str, Any]:
    """Return the facts, besides versions, that measurements depend on."""
    return {
        "processor": processor_name(),
        "cores": os.cpu_count(),
        "memory_bytes": memory_bytes("MemTotal"),
        "caches_bytes": cache_sizes()._asdict(),
    }


def processor_name() -> str:
    """Return the name of the processor."""
    named = _values(Path("/proc/cpuinfo"), "model name")
    return named[0] if named else platform.processor() or platform.machine()


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
