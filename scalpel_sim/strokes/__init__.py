"""Strokes: paths of a blade over time, given or planned through a body.

scene_stroke  the strokes of a scene, checked and in turn
kinds/        the kinds of strokes; kind: the table of a stroke, and what each of them is
planning      strokes along a sheet across the body; drawn: strokes along points
stroke        the path of a blade, and its file
"""
