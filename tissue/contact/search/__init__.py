"""Which node may come to touch which face, and which edge which edge.

In the order in which they are best read:

    search_state       all that the search reads and writes
    node_motion        how far nodes have moved, and balls around them in which pairs hold
    node_grid          cells of a grid, and nodes by these cells
    near_pairs         the pairs of node and face
    pair_update        faces query the nodes near them, where something moved or changed
    feature_edges      the edges that can touch other edges, and a grid of boxes around them
    edge_pairs         the pairs of edges
    self_proximity     skin that has come near skin of the same piece
"""
