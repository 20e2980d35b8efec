"""Contact as forces, found once in a time step: the choice `penalty`.

In the order in which they are best read:

    penalty_contact    owns the arrays
    search             the stages of a search
    contact_forces     contacts as springs with friction, evaluated with all other forces
    contact_work       what slides slides on after a substep, and work is counted
    eight_contacts     vectors of eight contacts
    line_of_action     where a force acts, so that it and its reaction turn nothing
    couples            what takes their torque where there is no such place
    stiffness          stiffness by mass splitting, and offsets by which their forces go on
    contact_list       one contact for each direction in which a node is pushed
    ridge_contacts     one contact for each pair of ridges that cross
    contact_rows       how a contact begins, and goes on with the force of another
    touch              whether a node touches a face, and in which direction it is pushed
    ridge_touch        whether two ridges touch, and in which direction they are pushed
    lost_nodes         nodes inside another part of the body, which no contact pushes out
    search_state       all that the search reads and writes
    pair_update        faces ask for nodes near them, where something moved or changed
    near_pairs         the pairs of node and face
    ridge_pairs        the pairs of ridges
    ridges             the edges that can touch other edges
    node_grid          nodes by the cells of a grid
    ridge_grid         ridges by the cells of two grids
    cells              the cells of a grid
    folds              skin that has come near skin of the same piece
    node_ways          how far nodes have moved
"""
