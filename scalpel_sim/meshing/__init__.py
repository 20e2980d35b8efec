"""Tetrahedra from the files that people have: surfaces, label volumes, meshes to be repaired."""
