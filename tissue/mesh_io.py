"""Meshes from files and bodies to files."""

from tissue.mesh_files.vtu_writer import write_vtu

__all__ = ["write_vtu"]
