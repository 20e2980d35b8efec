"""`scalpel-sim validate`: the engine's forces against theory and published figures.

Each scene has a file of its own; `scenes` lists them. `block` holds the body and the strokes that
scenes share, `findings` what a scene returns; `report`, `results` and `pictures` write it down.
"""
