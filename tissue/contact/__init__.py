"""Contact of the body with itself, with the floor and with rigid geoms, as forces.

In the order in which they are best read:

    faces              the boundary faces that may touch something
    piece_boxes        boxes around the pieces: skin far from all others touches nothing
    feature_edges      which edges are ridges, and so may touch other edges
    edge_edge          distance and crossing of two edges
    node_normals       normals of nodes, and which tetrahedra are inverted
    penalty            contact of the body with itself and the floor: springs, found once in a step
    geoms              contact with rigid geoms
"""
