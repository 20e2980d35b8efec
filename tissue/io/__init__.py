"""Tetrahedral meshes from files, and bodies to files.

In the order in which they are best read:

    mesh_io          read a mesh by the suffix of its file, check it
    byte_reader      the bytes of a file, taken piece by piece, with errors that name the line
    cell_types       types of cells, and a clear error where there are no tetrahedra
    gmsh             Gmsh 1, 2 and 4.1, with gmsh_elements
    vtk_legacy       VTK legacy
    vtu              VTK XML
    vtu_writer       write the state of a body as VTK XML
    whole_file       files that appear only when they are whole
"""
