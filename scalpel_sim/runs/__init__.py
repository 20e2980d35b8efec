"""A run from start to end, however it is led."""
