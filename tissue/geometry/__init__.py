"""Geometry of points, boxes and tetrahedra, without a mesh."""
