"""Forces that act on nodes, in one list (`terms`), and what they act on.

In the order in which they are best read:

    step_context        everything that the kernels of a step read and write
    terms               the list of all forces on nodes: one function for each verb
    acceleration        the acceleration of one node, from the forces on it and inside the body
    attachments         springs and dampers to points that are moved from outside
    fibre_shape, fibres, fibre_crossing    fibres that the blade catches, bends and cuts
    tearing             fibres between two bodies, which tear as those are pulled apart
    supports            the forces that hold fixed nodes, and their work
    rigid_motion        the motion of loose pieces, on which drag does not act
    geom_reactions      reactions of rigid geoms
"""
