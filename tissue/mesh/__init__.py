"""The topology container: the body's arrays, and what is looked up in them.

In the order in which they are best read:

    body              nodes, tetrahedra and links; walk from tetrahedron to tetrahedron
    faces             the faces that tetrahedra share, and the table of their outward nodes
    star              the tetrahedra around a node or an edge
    workspace         room for the nodes and tetrahedra that a cut adds
    changes           what a cut step changed, and what owners of arrays do then
    moved_nodes       the nodes that moved since a search asked last
    tetrahedron_grid  a grid of cells that list tetrahedra
    point_location    which tetrahedron holds a point, by that grid
    bounding_boxes    the box around the body, and boxes around its parts
    surface           the boundary triangles
    pieces            the connected pieces
    cut_error         how far cut faces lie from the blade's path
    validation        a mesh that the engine can work with, or an error
    node_order        nodes in an order that the caches like
    nonconforming     faces of two sizes that meet, in the paper's scheme alone
"""
