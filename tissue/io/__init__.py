"""Tetrahedral meshes from files, and bodies to files.

In the order in which they are best read:

    mesh_io          read a mesh by the suffix of its file, check it
    byte_reader      the bytes of a file, taken piece by piece, with errors that name the line
    cell_types       types of cells, and a clear error where there are no tetrahedra
    gmsh             Gmsh: the header; then gmsh_1_and_2 or gmsh_4, with gmsh_elements
    vtk_legacy       VTK legacy, with vtk_cells
    vtu              VTK XML, with vtu_data and vtk_cells
    vtu_writer       write the state of a body as VTK XML
    whole_file       files that appear only when they are whole
"""
