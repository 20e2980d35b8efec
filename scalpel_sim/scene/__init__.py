"""Scenes: one schema, from which the reader, the writer, options and pages are made.

schema      the tables of a scene file, each key with its unit, bounds and meaning
body        the table of the body, and its mesh
labels      parts of the body, by label
materials   from tables of materials to those of the engine
case        the tables of a case: supports, loads, records and expectations
scene       a scene: all its tables, and the objects of the engine that they describe
checks      what makes no sense together
read        the file, the environment and other layers: one merge, one conversion
write       from a scene to a file that gives the same run
served      a scene around a body in another process
blade       the blade of a scene
shipped/    the scenes that come with the project
"""
