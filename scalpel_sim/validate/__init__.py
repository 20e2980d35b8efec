"""`scalpel-sim validate`: the engine's forces against theory and published figures, a scene a file.

`findings` holds what a scene finds, `block` what scenes cut and how, `scenes` their list;
`report`, `markdown` and `pictures` show what was found.
"""
