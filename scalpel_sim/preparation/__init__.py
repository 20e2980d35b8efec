"""From a scene to a simulation.

prepare  the tissue, a stroke through it, and an arm that reaches
tissue   the tissue of a scene: held, stretched, and settled
"""
