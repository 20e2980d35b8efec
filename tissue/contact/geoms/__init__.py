"""Contact of the body with rigid geoms that move: planes, spheres, boxes, convex meshes.

In the order in which they are best read:

    geom               one geom, as a user gives it
    geom_arrays        all geoms and their contacts, as kernels read them
    geom_motion        where geoms are at an instant, and how fast
    signed_distance    how far a point is from a geom, and in which direction
    deepest_point      the point of a triangle that is deepest in a geom
    contact_search     which nodes and faces may touch a geom in a time step
    held_forces        the forces of contacts in the stages of a substep
    kinematic_contact  what makes them just large enough, after it
    geom_contact       owns the arrays
"""
