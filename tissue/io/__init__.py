"""Tetrahedral meshes from files, and bodies to files: one format a module."""
