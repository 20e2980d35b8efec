"""Rows of a run: one a frame, in memory and in a file that grows."""
