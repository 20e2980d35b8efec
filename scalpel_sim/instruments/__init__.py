"""Instruments: how arms hold and drive them, and how they act on the tissue."""
