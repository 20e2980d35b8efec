"""Which pairs touch, and the list of contacts.

In the order in which they are best read:

    contact_list       one contact for each direction in which a node is pushed
    node_face          which nodes touch faces, where, and in which direction they are pushed
    edge_contacts      one contact for each pair of edges that cross
    edge_edge          which edges touch, and in which direction they are pushed
    penetrating_nodes  nodes inside another part of the body, which no contact pushes out
"""
