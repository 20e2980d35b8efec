"""The scheme of Bielser, Maiwald and Gross (1998), sections 3 and 4, as it was printed.

In the order in which they are best read:

    scheme              detect, wait until the blade has left a tetrahedron, split it by the table
    active_tetrahedra   the search along the blade's line, and the edges that it sweeps over
    template_1_to_17    the cut-edge code, and the generic split of a tetrahedron in seventeen
    case_table          the lookup table: what each code opens
    mesh_records        cut edges and nodes of the initial mesh
    node_placement      where the nodes of a split tetrahedron are
    subdivision         split one tetrahedron and open it along its cut: splitEdge, splitFace
"""
