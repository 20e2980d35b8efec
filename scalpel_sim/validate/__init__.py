"""`scalpel-sim validate`: the engine's forces against theory and published figures.

`scenes` lists the scenes. `block` holds the body and the strokes that scenes share, `findings` what
a scene returns; `report` writes it down. `speed` is `scalpel-sim bench`.
"""
