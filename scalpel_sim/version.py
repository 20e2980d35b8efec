"""The version of an installed package."""

import importlib.metadata


def version(package: str = "scalpel-sim") -> str:
    """Return the version of an installed package; "source" where it is not installed."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "source"
