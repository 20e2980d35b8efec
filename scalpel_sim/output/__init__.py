"""What a run records and writes: tables, plots, and the files of its folder."""
