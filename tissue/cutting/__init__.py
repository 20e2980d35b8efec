"""The topology modifier: it brings the path of the blade into the mesh.

In the order in which they are best read:

    incision               from the first contact of the blade to the last; the scheme
    blade_path             the path of the cutting edge through the material in one step
    collision_detection    CD: the active tetrahedra, and the edges that the blade crossed
    cut_surface            the cut surface that the blade leaves behind, and the two sides of it
    workspace              all that a cut step reads and writes
    snapping               use a node that is there for a crossing, or insert one
    stellar_subdivision    split the tetrahedra around an edge or a face
    crack_front            the edges of the mesh along which the cut ends
    end_depth              what a crack front is beyond the path of its end is made good
    bridging               tetrahedra that still bridge the cut behind the blade
    separation             cut the faces on the cut surface and double their nodes
    stellar_scheme         our scheme, made of the files above
    bielser_1998           the scheme of Bielser, Maiwald and Gross
"""
