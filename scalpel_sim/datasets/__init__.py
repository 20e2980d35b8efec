"""Datasets of demonstrations: runs that are done again, and written as policies are trained."""
