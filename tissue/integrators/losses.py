"""What contact takes from the energy of a body."""

from tissue.core.structs import Arrays, FloatCell, IntCell


class ContactLoss(Arrays):
    """Energy lost in contact."""

    is_counted: IntCell
    """1 if it is counted, which takes two sums over the body where something touches; else 0."""
    dissipated: FloatCell
    """Energy lost so far [J]."""
