"""Loads on material points, and supports that move: the drives of a body from outside.

material_points    points of the material, which survive cuts
attachment         springs to a frame that is moved from outside, and fibres that the blade cuts
load               a force on such points, and all loads of a body
facing             skin of one body that faces that of another
support_path       fields along which supports are led
handles            loads, attachments, geoms and supports of one body, step by step
"""
