"""Tables of TOML files, which cases, scenes and files of materials share.

values    what a key may hold
material  [material] and the measures of [blade]
body      [body]: the geometry
view      [[view]]: where a scene is looked at from
problems  says what is wrong with a value, and where
toml      reads a file
text_file a file as text, no larger than is allowed
"""
