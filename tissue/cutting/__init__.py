"""The topology modifier: it brings the path of the blade into the mesh."""
