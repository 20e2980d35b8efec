"""Forces inside the body, and the bounds on the frequencies that they cause.

In the order in which they are best read:

    elasticity              owner of the arrays; follows the cuts
    internal_forces         the force on a node: springs, tetrahedra, or both
    springs                 masses, springs along the edges, and their forces
    finite_elements         tetrahedra as elements: what is kept of each, and of each node
    rest_shapes             their shapes at rest
    neo_hookean             forces of tetrahedra; what laws differ in is in `tissue.laws.kernels`
    collapse                what keeps tetrahedra from turning inside out where springs alone act
    viscous_stress          how tetrahedra resist their rate of deformation
    relaxed_stress          the stress that has relaxed, and its part in the forces
    viscoelasticity         how it relaxes
    energy                  energies of the body, and the power of damping
    frequency/              bounds on the frequencies
    mass_scaling            mass for the nodes of slivers
    stiffness_matrix        the body at small strain as a matrix, for calibration and theory
    spring_calibration      springs with the requested stiffness on a given mesh
"""
