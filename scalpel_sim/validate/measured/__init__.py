"""Materials by name against measured curves that their figures were not fitted to.

curves.toml   the measured points, with their spread, apparatus and source
curves        reads them, and compares the materials with them
homogeneous   the stress of a block that is deformed evenly
silicone_bar  a bar of silicone that is let go, with and without a weight at its tip
"""
