"""Hands that somebody leads, in place of a planned stroke: by the page, or by a device."""
