"""Contact of the body with rigid geoms that move: planes, spheres, boxes, convex meshes.

In the order in which they are best read:

    geom               one geom, as a user gives it
    geom_arrays        all geoms and their contacts, as kernels read them, and how geoms move
    signed_distance    distance of a point, and of the deepest point of a triangle, from a geom
    contact_search     which nodes and faces may touch a geom in a time step
    kinematic_contact  what corrects the motion after each substep: impulses and their work
    geom_contact       owns the arrays
"""
