"""Geometry without a mesh.

In the order in which they are best read:

    tetrahedron             volumes, altitudes, barycentric weights, 3 x 3 matrices
    aabb                    boxes whose sides are parallel to the axes
    exact_predicates        decisions on integer coordinates, without rounding
    tetrahedron_overlap     how deep two tetrahedra lie in each other
    rotations               whether matrices are rotations; the rotation in a deformation
"""
