"""A person's hand, which leads the blade in place of a planned stroke."""
