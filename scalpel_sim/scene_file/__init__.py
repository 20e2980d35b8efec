"""Scenes as TOML files: read, changed, made into a scene, and written.

reading  reads a scene file, and finds those that come with the project
layers   what the environment and the command line change in it
build    from its tables to a scene
writing  from a scene to a file
shipped/ the scenes that come with the project
"""
