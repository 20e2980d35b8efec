"""The scheme of Bielser, Maiwald and Gross (1998), sections 3 and 4, as it was printed.

In the order in which they are best read:

    scheme              detect, wait until the blade has left a tetrahedron, split it by the table
    cut_edge_code       which edges of a tetrahedron are cut, as a number of six bits
    template_1_to_17    the generic split of a tetrahedron in seventeen
    case_table          the lookup table: what each code opens
    mesh_records        cut edges and nodes of the initial mesh
    crossings           record what the blade crossed, and which tetrahedra it has left
    workspace           all that a split reads and writes
    node_placement      where the nodes of a split tetrahedron are
    split_operators     splitEdge and splitFace
    subdivision         split one tetrahedron and open it along its cut
    statistics          what was done, and what was left behind
"""
