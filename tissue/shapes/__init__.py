"""Bodies made from numbers: blocks, and a lobe of a liver."""
