"""The laws of materials: how stress follows from deformation."""
