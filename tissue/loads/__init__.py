"""What drives a body from outside: loads on material points, and supports that move.

material_points    points of the material, which survive cuts
attachment         springs to a frame that is moved from outside
load               a force on such points, and all loads of a body
driven_body        `DrivenBody`: the methods of `Tissue` that push and move it
"""
