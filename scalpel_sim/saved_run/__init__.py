"""The recording of a run: one HDF5 file that grows with it, and what is made from that."""
