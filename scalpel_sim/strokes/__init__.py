"""Strokes: paths of a blade over time, given or planned through a body."""
