"""Contact of the body with rigid geoms that move: planes, spheres, boxes, convex meshes.

In the order in which they are best read:

    geom               one geom, as a user gives it
    geom_arrays        all geoms and their contacts, as kernels read them
    geom_motion        where geoms are at an instant, and how fast
    signed_distance    how far a point is from a geom, and in which direction
    deepest_point      the point of a triangle that is deepest in a geom
    near_nodes         which nodes and faces are near one, by boxes
    contact_search     which of them may touch it in a time step
    contact_impulses   impulses of contacts, their sums and their work
    kinematic_contact  what corrects the motion after each substep
    geom_contact       owns the arrays
"""
