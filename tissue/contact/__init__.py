"""Contact of the body with itself and with the floor: lips, pieces, and what lies on the table.

In the order in which they are best read:

    contact            what contact does for a system, whichever way it acts
    self_contact       owns the arrays, and knows when there is anything to search
    state              all that contact reads and writes, beside the body
    resolve            the stages of contact after a Runge-Kutta step
    faces              the boundary faces that may touch something
    piece_boxes        boxes around the pieces: skin far from all others touches nothing
    feature_edges      which edges are ridges, and so may touch other edges
    candidates         active faces and the pairs that may come to touch
    candidate_update   what moved or changed is paired again
    pairing            look-ups in the grids
    spatial_hash       boxes by the cells of a grid
    pairs              pairs, near and far
    motion_bounds      how far nodes have moved, and which pairs can touch for it
    node_normals       normals of nodes, and which tetrahedra are inverted
    narrow_phase       which pairs went through each other
    simd_prefilter     the same for eight pairs at once, by signs alone
    point_triangle     whether a node went through a triangle
    edge_edge          whether an edge went through an edge
    distance           distances of the two
    hits               pairs that went through each other
    constraints        one contact: manifold, slop, warm start
    contact_table      contacts by their nodes
    solver             Gauss-Seidel on positions and velocities
    penalty            the other way: springs, found once in a time step
"""
