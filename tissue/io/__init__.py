"""Tetrahedral meshes from files, and bodies to files.

In the order in which they are best read:

    mesh_io          read a mesh by the content of its file, check it
    mesh_report      what is in the file of a mesh
    byte_reader      the bytes of a file, taken piece by piece, with errors that name the line
    cell_types       types of cells, and a clear error where none fill a volume
    cell_division    hexahedra, wedges and pyramids divided into tetrahedra
    label_arrays     which arrays are labels
    mesh_file        the cells of a file made into labelled tetrahedra
    gmsh             Gmsh 1 and 2, with gmsh_elements and gmsh_names
    gmsh_4           Gmsh 4.1
    vtk_legacy       VTK legacy, with vtk_cells
    vtu              VTK XML
    medit            Medit, text and binary
    tetgen           TetGen
    abaqus           Abaqus
    nastran          Nastran
    vtu_writer       write the state of a body as VTK XML
    whole_file       files that appear only when they are whole
"""
