"""The topology container: the body's arrays, and searches in them.

In the order in which they are best read:

    body              nodes, tetrahedra and links; walk from tetrahedron to tetrahedron
    faces             shared faces, the boundary, and the distance of cut faces from the path
    star              the tetrahedra around a node or an edge
    changes           what a cut step changed, and what owners of arrays do then
    cut_faces         faces that cuts have opened
    cut_face_log      the list of them, which grows with each pass of a cut
    node_motion       the nodes that moved since a search
    tetrahedron_grid  a grid of cells that list tetrahedra
    point_location    which tetrahedron holds a point, by that grid
    bounding_boxes    the box around the body, and boxes around its parts
    pieces            the connected pieces, and the loose ones
    parts             parts of a mesh, by their labels
    joined            several bodies as one mesh
    overlaps          whether two bodies lie in each other
    validation        a mesh that the engine can work with, or an error
    nonconforming     faces of two sizes that meet, in the paper's scheme alone
"""
