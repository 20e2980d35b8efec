"""What a benchmark has to know of the machine: processor, caches, free memory."""

import os
import platform
from pathlib import Path
from typing import Any, NamedTuple

CACHES = Path("/sys/devices/system/cpu/cpu0/cache")
"""Where Linux describes them."""


class Caches(NamedTuple):
    """Sizes in bytes: of the core's own two levels, and of the level that cores share."""

    l1: int
    l2: int
    l3: int


USUAL = Caches(32 << 10, 1 << 20, 32 << 20)
"""Where the system does not say."""


def description() -> dict[str, Any]:
    """Return what figures depend on besides versions."""
    return {
        "processor": processor(),
        "cores": os.cpu_count(),
        "memory_bytes": memory("MemTotal"),
        "caches_bytes": caches()._asdict(),
    }


def processor() -> str:
    """Return what the processor calls itself."""
    named = _values(Path("/proc/cpuinfo"), "model name")
    return named[0] if named else platform.processor() or platform.machine()


def memory(what: str = "MemAvailable") -> int | None:
    """Return so many bytes of memory, or None where the system does not say."""
    found = _values(Path("/proc/meminfo"), what)
    return 1024 * int(found[0].split()[0]) if found else None


def caches() -> Caches:
    """Return the sizes of the caches; usual ones where the system does not say."""
    sizes: dict[int, int] = {}
    for folder in sorted(CACHES.glob("index*")):
        try:
            kind, level, size = (
                (folder / name).read_text(encoding="ascii").strip()
                for name in ("type", "level", "size")
            )
        except OSError:
            continue
        if kind != "Instruction" and size.endswith("K"):
            sizes[int(level)] = 1024 * int(size[:-1])
    return Caches(*(sizes.get(level, usual) for level, usual in zip((1, 2, 3), USUAL, strict=True)))


def load() -> float:
    """Return how many programs ran in the last minute on average; 0 where nobody knows."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0


def _values(file: Path, name: str) -> list[str]:
    """Return the values of the lines `name: value` of one of the system's tables."""
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except OSError:
        return []
    pairs = (line.partition(":") for line in lines)
    return [value.strip() for key, _, value in pairs if key.strip() == name]
