"""Contact of the body with itself, with the floor and with rigid geoms.

In the order in which they are best read:

    self_contact       owns the arrays of contact of the body with itself and the floor
    search_stages      the stages of a search for contacts, once in a time step
    geometry           faces, edges, and vectors of eight contacts
    search             which node may come to touch which face, and which edge which edge
    narrow             which of these touch, and the list of contacts
    response           contacts as springs with friction: stiffness, forces, work
    geoms              contact with rigid geoms
"""
