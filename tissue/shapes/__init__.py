"""Bodies made from numbers.

In the order in which they are best read:

    block                  a rectangular block of cells; with a node in each cell, for bending
    cylinder               a circular cylinder of rings and layers
    liver_lobe             a lobe of a liver, whose mesh comes with the package
    isosurface_stuffing    fill an implicit shape with tetrahedra
"""
