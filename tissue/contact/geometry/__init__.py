"""Geometry of the skin and of cuts.

faces              the boundary faces that may touch, boxes around pieces, normals of nodes
edges              which edges are feature edges; distance and crossing of two edges
eight_contacts     vectors of eight contacts, and of eight pairs of edges
"""
