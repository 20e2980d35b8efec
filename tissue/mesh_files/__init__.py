"""Files that hold tetrahedra, one format a module."""
