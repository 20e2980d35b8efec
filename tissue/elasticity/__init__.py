"""Forces inside the body, by law, and the bounds on the frequencies that they cause.

In the order in which they are best read:

    elasticity              owner of the arrays; follows the cuts
    internal_forces         the force on a node: springs, tetrahedra, or both
    springs                 masses, and springs along the edges
    spring_forces           forces of springs and dampers
    finite_elements         tetrahedra as elements: rest shapes, and the star of each node
    energy_density          the laws of tetrahedra, and their constants
    neo_hookean             forces of tetrahedra under these laws
    stiffening              exponential and polynomial laws of tissue that stiffens
    energy                  energies of the body, and the power of damping
    frequency_bound         a bound on the frequencies of tetrahedra at rest
    frequency_refinement    the same bound brought near the truth
    changed_frequencies     both, and the mass that nodes get, after a cut
    mass_scaling            mass for the nodes of slivers
    limited_frequency       mass for nodes that are made fast between cuts
    strained_frequency      a bound for tetrahedra as they are deformed now
    stiffness_matrix        the body at small strain as a matrix, for calibration and theory
    spring_calibration      springs that are as stiff as asked for on a given mesh
"""
